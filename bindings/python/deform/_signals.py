"""Ctrl-C during a step. Python only notes a signal while C runs; a thread that hears of it asks the worlds
whose step the main thread is in to stop, and the exception of the signal's handler is raised there at once.
"""
from __future__ import annotations

import contextlib
import os
import signal
import threading
import weakref
from typing import Any

from ._library import at_fork, quick

_worlds: weakref.WeakSet[Any] = weakref.WeakSet()
_writer = -1


def _all() -> list[Any]:
    while True:
        try:
            return list(_worlds)
        except RuntimeError:  # another thread has made a world meanwhile
            continue


def interrupt() -> None:
    """Ends the step that the main thread is in."""
    main = threading.main_thread().ident
    for world in _all():
        if world._busy == main:
            world._stop = True
            quick.dfm_world_interrupt(world.handle)


def _listen(reader: int, previous: int) -> None:
    """Reads the numbers of signals; previous: the former wakeup descriptor (asyncio), -1: none."""
    while True:
        with contextlib.suppress(OSError):
            heard = os.read(reader, 64)
            if signal.SIGINT in heard:
                interrupt()
            if previous >= 0:
                os.write(previous, heard)


def _forget() -> None:
    """In a forked process: the thread is the parent's, and so is who reads."""
    global _writer
    if _writer >= 0:
        signal.set_wakeup_fd(-1)
        _writer = -1


at_fork(after_in_child=_forget)


def watch(world: Any) -> None:
    """Lets Ctrl-C end steps of this world, from the first world on that the main thread makes."""
    global _writer
    _worlds.add(world)
    if threading.current_thread() is not threading.main_thread():
        return
    previous = signal.set_wakeup_fd(-1)
    if previous != _writer or _writer < 0:
        reader, _writer = os.pipe()
        with contextlib.suppress(AttributeError):  # Windows has it from Python 3.12 on
            os.set_blocking(_writer, False)
        threading.Thread(target=_listen, args=(reader, previous), daemon=True, name="deform signals").start()
    signal.set_wakeup_fd(_writer, warn_on_full_buffer=False)

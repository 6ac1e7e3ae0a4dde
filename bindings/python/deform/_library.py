"""The shared library: found, loaded, and called with its errors as exceptions.

What takes time (`lib`) releases the interpreter's lock. What only reads (`quick`) keeps it: such a call is
shorter than a switch of threads, and no step can begin beneath it.
"""
from __future__ import annotations

import contextlib
import ctypes
import os
import pathlib
from typing import Any, Mapping, Sequence

from . import _abi

ROOT = pathlib.Path(__file__).resolve().parent
NATIVE = ROOT / "native"  # what the wheel carries: lib/, bin/, share/
_LIBRARY, _COMMAND = (("bin/libdeform.dll", "bin/deform.exe") if os.name == "nt" else
                      ("lib/libdeform.so.0", "bin/deform"))
# Calls after_in_child in forked processes, where the system has them.
at_fork = getattr(os, "register_at_fork", lambda after_in_child: None)


class Error(Exception):
    """What the library refuses, with its own sentence: what was wrong, where, and what to do.

    `status` is the name of the C status, as "DFM_E_ARG".
    """

    status = "DFM_E_FATAL"

    def __init__(self, sentence: str, status: str | None = None):
        super().__init__(sentence)
        if status:
            self.status = status


class ArgumentError(Error, ValueError):
    """A value, name or shape that is not allowed."""


class OutOfMemory(Error, MemoryError):
    """No memory; nothing has changed."""


class UnsupportedError(Error, NotImplementedError):
    """What this model, law or scene cannot do, or a plugin that is not there."""


class StateError(Error):
    """Not now: the name is taken, or what it works on is in use."""


class HandleError(Error, ReferenceError):
    """The world, body or mesh is gone."""


class FileError(Error, OSError):
    """A file that cannot be read or written."""


class FormatError(Error, ValueError):
    """A file that is not what it should be; names line, byte or key."""


class Diverged(Error, ArithmeticError):
    """A step that could not be taken: the world is back at its last good sub-step."""


class BusyError(Error, RuntimeError):
    """Called while a step of the same world runs."""


class Discarded(Error):
    """A step that was given up and changed nothing: too many sub-steps, its budget, or an interruption.

    `trouble` tells which.
    """

    trouble: int = 0


_CLASSES = {_abi.DFM_DISCARD: Discarded, _abi.DFM_E_ARG: ArgumentError, _abi.DFM_E_NOMEM: OutOfMemory,
            _abi.DFM_E_UNSUPPORTED: UnsupportedError, _abi.DFM_E_STATE: StateError,
            _abi.DFM_E_FATAL: Error, _abi.DFM_E_HANDLE: HandleError, _abi.DFM_E_IO: FileError,
            _abi.DFM_E_FORMAT: FormatError, _abi.DFM_E_DIVERGED: Diverged, _abi.DFM_E_BUSY: BusyError}


class OfThisProcess:
    """What lives in the library and cannot be pickled or copied. `_instead`: what a user can do."""

    __slots__ = ()
    _instead = ""

    def __reduce__(self) -> Any:
        raise TypeError(f"{self!r} belongs to this process, and is not pickled or copied; {self._instead}")


def _path() -> pathlib.Path:
    given = os.environ.get("DEFORM_LIBRARY")
    path = pathlib.Path(given) if given else NATIVE / _LIBRARY
    if not path.exists():
        raise ImportError(f"{path} is not there: install the package (pip install .), or name a {_LIBRARY} "
                          f"in the environment variable DEFORM_LIBRARY")
    return path


def _declare(library: ctypes.CDLL) -> ctypes.CDLL:
    for name, (result, arguments) in _abi.FUNCTIONS.items():
        function = getattr(library, name)
        function.restype = result
        function.argtypes = arguments
    return library


PATH = _path()
lib = _declare(ctypes.CDLL(str(PATH)))
quick = _declare(ctypes.PyDLL(str(PATH)))


def command_path() -> pathlib.Path:
    """The `deform` command that belongs to the library: the wheel's own, or the one beside a build's
    library."""
    given = os.environ.get("DEFORM_COMMAND")
    for path in ([pathlib.Path(given)] if given else [NATIVE / _COMMAND,
                                                      PATH.resolve().parent.parent / _COMMAND]):
        if path.exists():
            return path
    raise FileError(f"no deform command beside {PATH}; name one in the environment variable DEFORM_COMMAND",
                    "DFM_E_IO")


def _shipped(inside: str, of_tree: str) -> pathlib.Path:
    for path in (NATIVE / inside, ROOT.parents[2] / of_tree):
        if path.is_dir():
            return path
    raise FileError(f"{NATIVE / inside} is not there", "DFM_E_IO")


def include_dir() -> pathlib.Path:
    """Where the C headers are: `cc -I` takes it, for plugins and programs in C."""
    return _shipped("include", "libdeform/include")


def demo_scene() -> pathlib.Path:
    """The scene of `python -m deform demo`."""
    return _shipped("share/deform/scenes", "examples/scenes") / "two_cylinders.json"


def template_dir(kind: str = "friction") -> pathlib.Path:
    """A plugin in C to copy and edit: "friction" or "model"."""
    return _shipped(f"share/deform/template_{kind}", f"plugins/template_{kind}")


def error(status: int, sentence: str | None = None) -> Error:
    """The exception that belongs to a status, with the library's last sentence."""
    if sentence is None:
        sentence = (quick.dfm_last_error() or b"").decode("utf-8", "replace")
    name = quick.dfm_status_name(status).decode()
    return _CLASSES.get(status, Error)(sentence or name, name)


def check(status: int) -> int:
    """Raises what a negative status means."""
    if status < 0:
        raise error(status)
    return status


def default(kind: type) -> Any:
    """A def with the library's defaults."""
    out = kind()
    out.size = ctypes.sizeof(kind)
    getattr(quick, f"{kind.__name__}_default_sized")(out.size, ctypes.byref(out))
    return out


def sized(kind: type) -> Any:
    """A struct for the library to fill in."""
    out = kind()
    out.size = ctypes.sizeof(kind)
    return out


def encoded(text: Any) -> bytes | None:
    if text is None or isinstance(text, bytes):
        return text
    return os.fspath(text).encode(errors="surrogateescape")  # names of files need not be UTF-8


def _marked(path: pathlib.Path, mark: str) -> bool | None:
    """Whether a file has the mark, at its beginning or at its end. None: there is none, or only zeros in it,
    of a loss of power in the first write."""
    try:
        with open(path, "rb") as file:
            size = os.fstat(file.fileno()).st_size
            found = file.read(1 << 20)
            file.seek(max(file.tell(), size - (1 << 20)))
            found += file.read()
    except (FileNotFoundError, NotADirectoryError):
        return None
    return mark.encode() in found if len(found) < size or found.strip(b"\0") else None


def refuse_foreign(path: pathlib.Path, mark: str) -> None:
    """Refuses to change a file that lacks the mark of what is to be written there."""
    if _marked(path, mark) is False:
        raise FileError(f"{path}: another program wrote this file, or an earlier deform, and it stays as it "
                        f"is; give another folder (--out), or move the file", "DFM_E_IO")


def write_whole(path: pathlib.Path, data: bytes, mark: str = "") -> None:
    """The file is there as a whole, or as it was before. mark: of those that may be replaced."""
    if mark:
        refuse_foreign(path, mark)
    part = path.with_name(f"{path.name}.part{os.getpid()}")
    try:
        part.write_bytes(data)
        part.replace(path)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror}", "DFM_E_IO") from None
    finally:
        with contextlib.suppress(OSError):
            part.unlink()


def clear_own(folder: pathlib.Path, marks: Mapping[str, str], written: Sequence[pathlib.Path]) -> None:
    """Takes away what an earlier call has left, which would look like results of this one. marks: of its
    files, by their names; a file of another program stays."""
    for name, mark in marks.items():
        if folder / name not in written:
            with contextlib.suppress(OSError):  # a folder, or not to be read: not its own
                if _marked(folder / name, mark):
                    (folder / name).unlink()


def read_text(function: Any, *arguments: Any) -> str:
    """The two-call convention of texts: asks for the size, then for the text."""
    size = ctypes.c_size_t(0)
    check(function(*arguments, None, ctypes.byref(size)))
    buffer = ctypes.create_string_buffer(size.value + 1)
    size.value += 1
    check(function(*arguments, buffer, ctypes.byref(size)))
    return buffer.value.decode("utf-8")

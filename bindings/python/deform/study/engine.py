"""One run: an input with its values, to the numbers that a study reads of it.

A scene runs in a worker of the command (`deform worker`, bindings/cli/cmd_worker.cpp), which is started once
and keeps the library and its plugins loaded; a rig is a program of its own.
"""
from __future__ import annotations

import json
import math
import os
import pathlib
import select
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from typing import Any, Mapping, Sequence

from .._library import FileError, command_path
from .._values import read_json
from .store import hold
from .tables import finite, read_csv

FOLDER = "deform-study-"
ROOM = 2 ** 30  # bytes, free in memory for tables and states of runs; else they are written to disk
ATTEMPTS = 3  # of a run whose worker dies: what kills so many is the run
INTERRUPTED = 130  # exit code of a run that SIGTERM has ended before its time (bindings/cli/messages.h)


class Died(Exception):
    """The process of a run ended without an answer."""


class Failed(Exception):
    """A run that gives no result, with its sentence."""


def _key(of: Any, word: str) -> Any:
    word = word.replace("~1", "/").replace("~0", "~")
    if not isinstance(of, list):
        return word
    if not word.isdecimal():  # int() takes -1, too
        raise IndexError(word)
    return int(word)


def _resolve(value: Any, pointer: str) -> Any:
    for word in pointer.split("/")[1:]:
        value = value[_key(value, word)]
    return value


def _set(value: Any, pointer: str, new: Any) -> None:
    above, _, word = pointer.rpartition("/")
    at = _resolve(value, above) if above else value
    at[_key(at, word)] = new


# ---- what is read of a run --------------------------------------------------------------------------------


class Results:
    """summary.json and the tables of a run."""

    def __init__(self, folder: pathlib.Path, summary: Any):
        self.folder, self.summary = folder, summary
        self.tables: dict[str, list[dict[str, str]]] = {}

    def table(self, name: str) -> list[dict[str, str]]:
        if name not in self.tables:
            path = self.folder / f"{name}.csv"
            if not path.exists():
                raise Failed(f"the run wrote no {name}.csv")
            self.tables[name] = read_csv(path)
        return self.tables[name]

    def column(self, read: Mapping[str, Any], name: str) -> list[float]:
        rows = self.table(read["table"])
        for key in (*read["where"], name):
            if rows and key not in rows[0]:
                raise Failed(f'{read["table"]}.csv has no column "{key}"; it has {", ".join(rows[0])}')
        kept = [row for row in rows if all(row[key] == value for key, value in read["where"].items())]
        if not kept:
            held = {key: sorted({row[key] for row in rows})[:8] for key in read["where"]}
            raise Failed(f'no row of {read["table"]}.csv is as {json.dumps(read["where"])}; it holds '
                         f"{json.dumps(held)}")
        try:
            return finite(kept, name)
        except ValueError as error:
            raise Failed(f'column "{name}" of {read["table"]}.csv holds {error}, no number') from None

    def read(self, what: Mapping[str, Any]) -> Any:
        """A number; of a curve its two columns."""
        if "summary" in what:
            try:
                value = _resolve(self.summary, what["summary"])
            except (KeyError, IndexError, ValueError, TypeError):
                raise Failed(f'the summary has no value {what["summary"]}') from None
            if value is None or isinstance(value, (dict, list, str)):
                raise Failed(f'{what["summary"]} of the summary is no number: {json.dumps(value)[:80]}')
            return float(value)
        column = self.column(what, what["column"])
        if "against" in what:
            return [self.column(what, what["against"]), column]
        value = take(column, what["take"], self.column(what, "t") if what["take"] == "period" else [])
        if math.isnan(value):
            raise Failed(f'"{what["take"]}" of {what["table"]}.csv, column "{what["column"]}", is no number')
        return value


def take(column: list[float], how: str, t: list[float]) -> float:
    """A column as one number. period: s, the mean time between crossings of the mean value upward."""
    if how in ("last", "first"):
        return column[-1 if how == "last" else 0]
    if how in ("min", "max"):
        return min(column) if how == "min" else max(column)
    if how == "mean":
        return math.fsum(column) / len(column)
    if how == "change":
        return column[-1] - column[0]
    if how == "peak_to_peak":
        return max(column) - min(column)
    middle = math.fsum(column) / len(column)
    ups = [t[i] + (t[i + 1] - t[i]) * (middle - a) / (b - a)
           for i, (a, b) in enumerate(zip(column, column[1:])) if a < middle <= b]
    return (ups[-1] - ups[0]) / (len(ups) - 1) if len(ups) > 1 else math.nan


# ---- runs -------------------------------------------------------------------------------------------------


class Engine:
    """Runs what it is given, one after the other; one for each thread that wants to run something."""

    def __init__(self) -> None:
        self.process: subprocess.Popen[str] | None = None  # the worker, which stays, or the rig that runs
        self.ended = False
        self.lock = threading.Lock()  # of both
        self.folder, self.mark = _own_folder(_memory())

    def end(self) -> None:
        """From any thread: ends what runs, and nothing new begins. The thread whose run it is sees that as
        the death of its process."""
        with self.lock:
            self.ended = True
            if self.process is not None:
                self.process.kill()

    def close(self) -> None:
        """When no thread runs anything here."""
        self.end()
        self._stop()
        shutil.rmtree(self.folder, ignore_errors=True)
        os.close(self.mark)

    def _start(self, words: Sequence[str], **pipes: Any) -> subprocess.Popen[str]:
        with self.lock:
            if self.ended:
                raise Died("the sweep has ended")
            try:
                # in a session of its own: Ctrl-C is for the sweep, which ends its processes
                self.process = subprocess.Popen([str(command_path()), *words], stdout=subprocess.PIPE,
                                                text=True, start_new_session=True, **pipes)
            except OSError as error:
                raise FileError(f"{command_path()}: cannot be started: {error.strerror}",
                                "DFM_E_IO") from None
            return self.process

    def _stop(self) -> None:
        with self.lock:
            process, self.process = self.process, None
            if process is None:
                return
            process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout, process.stderr):
            try:
                if pipe is not None:
                    pipe.close()
            except OSError:  # what was not sent cannot be
                pass

    def run(self, task: Mapping[str, Any]) -> dict[str, Any]:
        """{"state": "done", "read": [..]} or {"state": "failed", "said": sentence}; both with "seconds".

        task: kind ("scene", "rig"), runs [[file, {pointer: value}, [what to read]]], limit (s, 0: none)."""
        begun = time.perf_counter()
        out: dict[str, Any] = {"state": "done", "read": []}
        died = 0
        try:
            while True:
                try:
                    out["read"] = [[results.read(what) for what in reads]
                                   for file, values, reads in task["runs"]
                                   for results in [self._results(task["kind"], file, values, task["limit"])]]
                    break
                except Died as error:
                    self._stop()
                    died += 1
                    if self.ended:
                        raise Failed("the sweep has ended") from None
                    if died == ATTEMPTS:
                        raise Failed(f"{error}, {ATTEMPTS} times in {ATTEMPTS}") from None
        except Failed as error:
            out = {"state": "failed", "said": str(error)}
        if died:
            out["died"] = died
        return {**out, "seconds": time.perf_counter() - begun}

    def _results(self, kind: str, file: str, values: Mapping[str, Any], limit: float) -> Results:
        folder = self.folder / "run"
        shutil.rmtree(folder, ignore_errors=True)
        return self._rig(folder, file, values, limit) if kind == "rig" else self._scene(folder, file, values,
                                                                                      limit)

    def _rig(self, folder: pathlib.Path, file: str, values: Mapping[str, Any], limit: float) -> Results:
        folder.mkdir()
        case = read_json(file)
        for pointer, value in values.items():
            try:
                _set(case, pointer, value)
            except (KeyError, IndexError, ValueError, TypeError):
                raise Failed(f"{file}: there is nothing at {pointer} to set") from None
        (folder / "case.json").write_text(json.dumps(case))
        rig = self._start(["friction", str(folder / "case.json"), "--json",
                           "--csv", str(folder / "rows.csv")],
                          stdin=subprocess.DEVNULL, stderr=subprocess.PIPE)
        try:
            summary, said = rig.communicate(timeout=limit or None)
        except subprocess.TimeoutExpired:
            raise Failed(_over(limit)) from None
        finally:
            self._stop()
        if rig.returncode < 0 or rig.returncode == INTERRUPTED:
            raise Died(f"the rig was ended by {_signal(-rig.returncode)}")
        if rig.returncode:
            raise Failed(_last(said).replace(str(folder / "case.json"), file))
        return Results(folder, json.loads(summary))

    def _scene(self, folder: pathlib.Path, file: str, values: Mapping[str, Any], limit: float) -> Results:
        request = {"scene": file, "out": str(folder),
                   "set": [f"{pointer}={json.dumps(value)}" for pointer, value in values.items()]}
        answer = self._call(request, limit)
        if answer["signal"] or answer["code"] == INTERRUPTED:
            raise Died(f"the run was ended by {_signal(answer['signal'])}")
        if answer["code"]:
            # its files do not stay
            clauses = [part for part in _last(answer["said"]).split("; ") if f" is in {folder}" not in part]
            said = "; ".join(clauses).replace(f"{folder}/", "")
            raise Failed(said or f"the run ended with exit code {answer['code']}")
        return Results(folder, json.loads((folder / "summary.json").read_text()))

    def _call(self, request: Mapping[str, Any], limit: float) -> Any:
        worker = self.process or self._start(["worker"], stdin=subprocess.PIPE)
        to, replies = worker.stdin, worker.stdout
        assert to is not None and replies is not None
        try:
            to.write(json.dumps(request) + "\n")
            to.flush()
            if limit and not _answers(replies, limit):
                self._stop()
                raise Failed(_over(limit))
            line = replies.readline()
        except (BrokenPipeError, ConnectionResetError):
            line = ""
        if not line.endswith("\n"):
            raise Died("the worker died")
        return json.loads(line)


def _answers(pipe: Any, limit: float) -> bool:
    """Whether there is something to read within so many seconds. select() knows 1,024 descriptors alone."""
    waiting = select.poll()
    waiting.register(pipe, select.POLLIN)
    return bool(waiting.poll(1000 * limit))


def _over(limit: float) -> str:
    return f"the run took longer than limit_s ({limit:g} s) and was ended"


def _last(said: str) -> str:
    return said.strip().rsplit("\n", 1)[-1].removeprefix("deform: ")


def _signal(number: int) -> str:
    return f"signal {number} ({signal.strsignal(number)})" if number > 0 else "a signal to end"


def _memory() -> str:
    """A folder in memory, where there is one with room: tables of a run are read once. TMPDIR names
    another."""
    there = "/dev/shm"
    if not os.environ.get("TMPDIR") and os.access(there, os.W_OK):
        room = os.statvfs(there)
        if room.f_bavail * room.f_frsize > ROOM:
            return there
    return tempfile.gettempdir()


def _own_folder(there: str) -> tuple[pathlib.Path, int]:
    """A new folder and its lock, which ends with this process. Removes the folders that nobody locks: their
    processes were killed."""
    for old in pathlib.Path(there).glob(FOLDER + "*"):
        try:
            mark = os.open(old, os.O_RDONLY)
        except OSError:
            continue
        try:
            hold(mark)
            shutil.rmtree(old, ignore_errors=True)
        except OSError:
            pass
        os.close(mark)
    new = pathlib.Path(tempfile.mkdtemp(prefix="." + FOLDER, dir=there))
    mark = os.open(new, os.O_RDONLY)
    hold(mark)
    return new.rename(new.with_name(new.name[1:])), mark  # seen by others from here on, locked


_of_thread = threading.local()


def run_here(task: Mapping[str, Any]) -> dict[str, Any]:
    """Runs a task by an engine of the calling thread, which lasts as long as its process."""
    if not hasattr(_of_thread, "engine"):
        _of_thread.engine = Engine()
        import atexit
        atexit.register(_of_thread.engine.close)
    return _of_thread.engine.run(task)

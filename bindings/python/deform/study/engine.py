"""One run: an input with its values, to the numbers that a study reads of it.

A scene runs in a worker of the command (`deform worker`, bindings/cli/cmd_worker.cpp), which is started once
and keeps the library and its plugins loaded; a rig is a program of its own.
"""
from __future__ import annotations

import csv
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
from typing import Any, Mapping

from .._library import FileError, command_path

FOLDER = "deform-study-"  # and the process whose it is
ATTEMPTS = 3  # of a run whose worker dies: what kills so many is the run


class Died(Exception):
    """The process of a run ended without an answer."""


class Failed(Exception):
    """A run that gives no result, with its sentence."""


def _resolve(value: Any, pointer: str) -> Any:
    for key in pointer.split("/")[1:]:
        key = key.replace("~1", "/").replace("~0", "~")
        value = value[int(key)] if isinstance(value, list) else value[key]
    return value


def _set(value: Any, pointer: str, new: Any) -> None:
    above, _, key = pointer.rpartition("/")
    key = key.replace("~1", "/").replace("~0", "~")
    at = _resolve(value, above) if above else value
    if isinstance(at, list):
        at[int(key)] = new
    else:
        at[key] = new


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
            with open(path, newline="") as file:
                self.tables[name] = list(csv.DictReader(file))
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
            return [float(row[name]) for row in kept]
        except ValueError:
            raise Failed(f'column "{name}" of {read["table"]}.csv holds texts') from None

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
        self.worker: subprocess.Popen[str] | None = None
        self.closed = False
        memory = _memory()
        _clear(pathlib.Path(memory or tempfile.gettempdir()))
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix=f"{FOLDER}{os.getpid()}-", dir=memory))

    def close(self) -> None:
        """Ends the run that another thread has begun, too."""
        self.closed = True
        self._stop()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _stop(self) -> None:
        if self.worker is None:
            return
        self.worker.kill()
        self.worker.wait()
        for pipe in (self.worker.stdin, self.worker.stdout):
            try:
                pipe.close()  # type: ignore[union-attr]
            except OSError:
                pass
        self.worker = None

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
                    if self.closed:
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
        case = json.loads(pathlib.Path(file).read_text())
        for pointer, value in values.items():
            try:
                _set(case, pointer, value)
            except (KeyError, IndexError, ValueError, TypeError):
                raise Failed(f"{file}: there is nothing at {pointer} to set") from None
        (folder / "case.json").write_text(json.dumps(case))
        try:
            done = subprocess.run([str(command_path()), "friction", str(folder / "case.json"), "--json",
                                   "--csv", str(folder / "rows.csv")], capture_output=True, text=True,
                                  timeout=limit or None)
        except subprocess.TimeoutExpired:
            raise Failed(_over(limit)) from None
        if done.returncode < 0:
            raise Died(f"the rig was ended by signal {-done.returncode}")
        if done.returncode:
            raise Failed(_last(done.stderr).replace(str(folder / "case.json"), file))
        return Results(folder, json.loads(done.stdout))

    def _scene(self, folder: pathlib.Path, file: str, values: Mapping[str, Any], limit: float) -> Results:
        request = {"scene": file, "out": str(folder),
                   "set": [f"{pointer}={json.dumps(value)}" for pointer, value in values.items()]}
        answer = self._ask(request, limit)
        if answer["signal"]:
            raise Died(f"the run was ended by signal {answer['signal']} "
                       f"({signal.strsignal(answer['signal']) or 'unknown'})")
        if answer["code"]:
            raise Failed(_last(answer["said"]) or f"the run ended with exit code {answer['code']}")
        return Results(folder, json.loads((folder / "summary.json").read_text()))

    def _ask(self, request: Mapping[str, Any], limit: float) -> Any:
        if self.worker is None:
            program = str(command_path())
            try:
                # in a session of its own: Ctrl-C is for the sweep, which ends its workers
                self.worker = subprocess.Popen([program, "worker"], stdin=subprocess.PIPE,
                                               stdout=subprocess.PIPE, text=True, start_new_session=True)
            except OSError as error:
                raise FileError(f"{program}: cannot be started: {error.strerror}", "DFM_E_IO") from None
        to, answers = self.worker.stdin, self.worker.stdout
        assert to is not None and answers is not None
        try:
            to.write(json.dumps(request) + "\n")
            to.flush()
            if limit and not select.select([answers], [], [], limit)[0]:
                self._stop()
                raise Failed(_over(limit))
            line = answers.readline()
        except (BrokenPipeError, ConnectionResetError):
            line = ""
        if not line.endswith("\n"):
            raise Died("the worker died")
        return json.loads(line)


def _over(limit: float) -> str:
    return f"the run took longer than limit_s ({limit:g} s) and was ended"


def _last(said: str) -> str:
    return said.strip().rsplit("\n", 1)[-1].removeprefix("deform: ")


def _memory() -> str | None:
    """A folder in memory, where there is one: tables of a run are read once."""
    return "/dev/shm" if os.access("/dev/shm", os.W_OK) else None


def _clear(there: pathlib.Path) -> None:
    """Removes the folders of processes that were killed."""
    for folder in there.glob(FOLDER + "*"):
        owner = folder.name.removeprefix(FOLDER).partition("-")[0]
        if owner.isdigit() and not os.path.exists(f"/proc/{owner}"):
            shutil.rmtree(folder, ignore_errors=True)


_of_thread = threading.local()


def run_here(task: Mapping[str, Any]) -> dict[str, Any]:
    """Runs a task by an engine of the calling thread, which lasts as long as its process."""
    if not hasattr(_of_thread, "engine"):
        _of_thread.engine = Engine()
        import atexit
        atexit.register(_of_thread.engine.close)
    return _of_thread.engine.run(task)

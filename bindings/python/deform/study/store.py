"""Results of a sweep, one line of JSON for each run, in a file that only grows: whatever ends the sweep, what
is done stays, and the next call goes on."""
from __future__ import annotations

import json
import os
import pathlib
import time
from typing import Any

from .._library import FileError, StateError, UnsupportedError, refuse_foreign

MARK = '", "point": {'  # in each line
SYNC_EVERY = 1.0  # s: what a loss of power may cost; the end of a process costs nothing


def require_posix() -> None:
    if os.name == "nt":
        raise UnsupportedError("sweep and fit need POSIX: run them on Linux, or in WSL", "DFM_E_UNSUPPORTED")


def hold(file: Any) -> None:
    """A lock that ends with this process; OSError: another one has it."""
    import fcntl
    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _results(folder: pathlib.Path) -> list[pathlib.Path]:
    return [folder / "runs.jsonl", *sorted((folder / "runs").glob("*.jsonl"))]


class Store:
    """The file runs.jsonl of a folder, and runs/*.jsonl, which parts of an export write."""

    def __init__(self, folder: pathlib.Path, name: str = "runs.jsonl"):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        for file in {path, *_results(folder)}:
            refuse_foreign(file, MARK)
        self.file = open(path, "ab")
        try:
            hold(self.file)
        except BlockingIOError:
            self.file.close()
            raise StateError(f"{path}: another sweep writes here; wait for its end, or give another folder "
                             f"(--out)", "DFM_E_STATE") from None
        except OSError as error:
            self.file.close()
            raise FileError(f"{path}: cannot be locked: {error.strerror}; give a folder of another file "
                            f"system (--out)", "DFM_E_IO") from None
        self.rows: dict[str, dict[str, Any]] = {}
        for other in _results(folder):
            if other != path and other.exists():
                self._load(other.read_bytes())
        text = path.read_bytes()
        whole = text.rfind(b"\n") + 1
        if whole < len(text):  # a line that was being written when the process ended
            self.file.truncate(whole)
        self._load(text[:whole])
        self.synced = time.monotonic()

    def _load(self, text: bytes) -> None:
        for line in text.splitlines():
            try:
                row = json.loads(line)
            except ValueError:  # another process is writing it
                continue
            if row["state"] == "done" or self.rows.get(row["key"], row)["state"] == "failed":
                self.rows[row["key"]] = row

    def add(self, row: dict[str, Any]) -> None:
        self.rows[row["key"]] = row
        self.file.write(json.dumps(row).encode() + b"\n")
        self.file.flush()
        if time.monotonic() - self.synced > SYNC_EVERY:
            self.sync()

    def sync(self) -> None:
        os.fsync(self.file.fileno())
        self.synced = time.monotonic()

    def close(self) -> None:
        self.sync()
        self.file.close()

"""The `deform` command that the package carries: run it, and read what it says."""
from __future__ import annotations

import json
import os
import pathlib
import subprocess
import sys
import tempfile
from typing import Any, Sequence

from ._library import ArgumentError, Diverged, Error, command_path


def main() -> None:
    """Becomes the command: `deform run SCENE`, `deform cost SCENE`, ... (the console script)."""
    path = str(command_path())
    os.execv(path, [path, *sys.argv[1:]])


def command(*arguments: Any) -> str:
    """Runs `deform ARGUMENTS...` and returns what it prints; raises its sentence where it fails."""
    done = subprocess.run([str(command_path()), *map(str, arguments)], capture_output=True, text=True)
    if done.returncode == 0:
        return done.stdout
    said = done.stderr.strip() or f"deform {arguments[0]} ended with {done.returncode}"
    raise {2: ArgumentError, 3: Diverged}.get(done.returncode, Error)(said.removeprefix("deform: "))


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3g}"
    return "" if value is None else str(value)


class Table(list):
    """Rows as dicts; prints as a table, and a notebook shows it as one."""

    def __init__(self, rows: Sequence[dict[str, Any]], columns: Sequence[str]):
        super().__init__(rows)
        self.columns = list(columns)

    def column(self, name: str) -> list[Any]:
        """One column, a value for each row."""
        return [row.get(name) for row in self]

    def __str__(self) -> str:
        cells = [self.columns] + [[_shown(row.get(c)) for c in self.columns] for row in self]
        widths = [max(len(line[i]) for line in cells) for i in range(len(self.columns))]
        return "\n".join("  ".join(c.ljust(w) for c, w in zip(line, widths)).rstrip() for line in cells)

    def _repr_html_(self) -> str:
        from html import escape
        head = "".join(f"<th>{escape(c)}</th>" for c in self.columns)
        cells = [[f"<td>{escape(_shown(row.get(c)))}</td>" for c in self.columns] for row in self]
        rows = "".join(f"<tr>{''.join(line)}</tr>" for line in cells)
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"

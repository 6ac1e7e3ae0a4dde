"""The `deform` command that the package carries: run it, and read what it says."""
from __future__ import annotations

import json
import logging
import math
import os
import signal
import subprocess
import sys
import tempfile
from html import escape
from typing import Any, Mapping, Sequence

from ._library import ArgumentError, Diverged, Error, command_path

_LOG = logging.getLogger("deform")


def main() -> None:
    """Becomes the command: `deform run SCENE`, `deform cost SCENE`, ... (the console script)."""
    path = str(command_path())
    # `deform sweep` and `deform fit` come back to this interpreter
    environment = {"DEFORM_PYTHON": sys.executable, **os.environ}
    if os.name == "nt":  # there who has started this process would not wait for the other one
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the command
        sys.exit(subprocess.call([path, *sys.argv[1:]], env=environment))
    os.execve(path, [path, *sys.argv[1:]], environment)


def command(*arguments: Any, environment: Mapping[str, str] | None = None) -> str:
    """Runs `deform ARGUMENTS...` and returns what it prints; raises its sentence where it fails."""
    done = subprocess.run([str(command_path()), *map(str, arguments)], capture_output=True,
                          encoding="utf-8", env={**os.environ, **(environment or {})})
    if done.returncode == 0:
        for line in done.stderr.splitlines():
            _LOG.warning("%s", line.removeprefix("deform: ").removeprefix("warning: "))
        return done.stdout
    said = done.stderr.strip() or f"deform {arguments[0]} ended with {done.returncode}"
    raise {2: ArgumentError, 3: Diverged}.get(done.returncode, Error)(said.removeprefix("deform: "))


def _shown(value: Any, digits: int) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.{digits}g}"
    return "" if value is None else str(value)


class Table(list):
    """Rows as dicts; prints as a table below its notes, and a notebook shows it as one."""

    digits = 3

    def __init__(self, rows: Sequence[dict[str, Any]], columns: Sequence[str], notes: Sequence[str] = ()):
        super().__init__(rows)
        self.columns = list(columns)
        self.notes = list(notes)

    def column(self, name: str) -> list[Any]:
        """One column, a value for each row."""
        return [row.get(name) for row in self]

    def __str__(self) -> str:
        cells = [self.columns] + [[_shown(row.get(c), self.digits) for c in self.columns] for row in self]
        widths = [max(len(line[i]) for line in cells) for i in range(len(self.columns))]
        return "\n".join([*self.notes] + ["  ".join(c.ljust(w) for c, w in zip(line, widths)).rstrip()
                                          for line in cells])

    def table_html(self, titles: Sequence[str]) -> str:
        """The rows, below titles of the columns; its classes are those of a study's page."""
        head = "".join(f"<th>{escape(title)}</th>" for title in titles)
        rows = ""
        for row in self:
            rows += f'<tr{" class=failed" if row.get("state") == "failed" else ""}>'
            for c in self.columns:
                text = escape(_shown(row.get(c), self.digits))
                rows += f'<td{" class=said" if c == "said" else ""}>{text}</td>'
            rows += "</tr>"
        return f"<table><thead><tr>{head}</tr></thead>{rows}</table>"

    def _repr_html_(self) -> str:
        return "".join(f"<p>{escape(note)}</p>" for note in self.notes) + self.table_html(self.columns)


class Cost(Table):
    """What cost() found: a row for each choice (label, model, integrator, step s, cells, law, error,
    cpu_s_per_s, state), below what the errors are of and the reference that they are against.

    front: the choices of which none is both faster and closer; pick: the cheapest one within the target, or
    None; says: the sentences on errors, reference and choice; report: all that cost.json holds."""

    def __init__(self, report: dict[str, Any]):
        columns = ["label", "model", "integrator", "step", "cells", "law", "error", "cpu_s_per_s", "state"]
        self.says = [text.rstrip() for text in report["says"]]
        super().__init__([{**row, "error": row["headline"]} for row in report["choices"]], columns, self.says)
        self.report = report
        self.front = Table([self[i] for i in report["front"]], columns, self.says[1:2])
        self.pick = None if report["pick"] is None else self[report["pick"]["index"]]


def cost(scene: Any, *, budget: float = 120, target: float | None = None, axes: Sequence[str] | None = None,
         quantities: Sequence[str] = (), out: Any = None, apply: Any = None) -> Cost:
    """What accuracy costs on a scene: `deform cost SCENE` as a table. Takes minutes.

    budget: s for all runs; target: relative error for which the cheapest choice is sought; axes: what varies
    (model, time, mesh, cells, volume, contact, law, self, guard, precision; all); quantities: what is
    compared (all probes); out: a folder that keeps the runs, so that a larger budget goes on; apply: a file
    for the scene with the cheapest choice."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = ["cost", scene, "--json", "--budget", budget, "--out", out or folder]
        axes = [axes] if isinstance(axes, str) else axes
        for option, value in (("--target", target), ("--axes", ",".join(axes) if axes else None),
                              ("--apply", apply)):
            if value is not None:
                arguments += [option, value]
        for quantity in quantities:
            arguments += ["--quantity", quantity]
        return Cost(json.loads(command(*arguments)))


def explain(scene: Any) -> str:
    """What `deform explain SCENE` prints: the stages of a step, those left out and why, what bounds the
    step."""
    return command("explain", scene)

"""deform.sweep(): a scene over ranges of its values."""
from __future__ import annotations

import pathlib
from contextlib import ExitStack, closing
from typing import Any, Sequence

from .._command import Table
from .._library import ArgumentError, UnsupportedError, clear_own, write_whole
from . import plots, tables
from .design import points
from .executors import executor as named_executor
from .page import page
from .progress import Progress
from .spec import Study, read_study
from .store import Store, require_posix

# What write() makes, and what tells that it was made by it.
MARKS = {"sweep.csv": ",state,said,seconds", "sweep.html": "<title>Sweep ", "sweep.parquet": "deform sweep",
         **dict.fromkeys(("curves.png", "map.png", "parallel.png"), plots.MARK)}


class Sweep(Table):
    """The runs of a sweep as rows: parameters and quantities by name, state ("done", "failed", "open"), said
    (the sentence of a run that failed) and seconds. units: {name: unit}; folder: where its files are."""

    digits = 5

    def __init__(self, study: Study, rows: Sequence[dict[str, Any]], folder: pathlib.Path):
        names = [p.name for p in study.parameters] + list(study.quantities)
        super().__init__(rows, [*names, "state", "said", "seconds"], [_count(rows)])
        self.study, self.folder = study, folder
        self.units = {**study.units, "seconds": "s"}

    @property
    def done(self) -> list[dict[str, Any]]:
        return [row for row in self if row["state"] == "done"]

    @property
    def failed(self) -> list[dict[str, Any]]:
        return [row for row in self if row["state"] == "failed"]

    def figures(self) -> dict[str, Any]:
        """Matplotlib figures by name: "curves", and of two or more parameters "map" and "parallel"."""
        return plots.sweep_figures(plots.Columns(self, self.study.parameters, list(self.study.quantities),
                                                 self.units))

    def write(self, parquet: bool = False) -> list[pathlib.Path]:
        """sweep.csv, sweep.html and the figures; parquet: sweep.parquet, too. Without matplotlib the page has
        no figures."""
        written = [self.folder / "sweep.csv"]
        tables.write_csv(written[0], self, self.columns, self.units, MARKS["sweep.csv"])
        sentences, figures = list(self.notes), {}
        try:
            figures = {name: plots.png(drawn) for name, drawn in self.figures().items()}
        except UnsupportedError as missing:
            sentences.append(str(missing))
        for name, data in figures.items():
            written.append(self.folder / f"{name}.png")
            write_whole(written[-1], data, plots.MARK)
        written.append(self.folder / "sweep.html")
        write_whole(written[-1], page(f"Sweep {self.study.name}", sentences, figures, self, self.units),
                    MARKS["sweep.html"])
        clear_own(self.folder, MARKS, written)
        if parquet:
            written.append(self.folder / "sweep.parquet")
            tables.write_parquet(written[-1], self, self.columns, self.units, MARKS["sweep.parquet"])
        return written


def _count(rows: Sequence[dict[str, Any]]) -> str:
    states = [row["state"] for row in rows]
    opened = f", {states.count('open')} open" if "open" in states else ""
    return f"{len(rows)} runs: {states.count('done')} done, {states.count('failed')} failed{opened}"


def out_folder(study: Study, out: Any) -> pathlib.Path:
    return pathlib.Path(out) if out is not None else pathlib.Path("out") / study.name


def task_of(study: Study, point: dict[str, Any]) -> dict[str, Any]:
    file, fixed = study.runs[0]
    return {"kind": study.kind, "limit": study.limit,
            "runs": [[file, {**fixed, **study.values(point)}, list(study.quantities.values())]]}


def sweep(study: Any, *, out: Any = None, executor: str = "local", workers: int | None = None,
          address: str = "", retry: bool = False, only: tuple[int, int] | None = None,
          progress: bool = False) -> Sweep:
    """Runs a study (the path of STUDY.json, or a dict of the same form) and returns its rows.

    out: folder of results (out/STUDY); runs that are there are not made again. executor: "local" or "dask";
    workers: how many (one for each processor); address: of a Dask scheduler. retry: makes failed runs again.
    only: (first, last) index of the runs to make, for a part of an array. progress: tells it on standard
    error."""
    require_posix()
    read = study if isinstance(study, Study) else read_study(study)
    if not read.quantities:
        raise ArgumentError(f'{read.file}: /: a sweep needs "quantities", what is read of each run',
                            "DFM_E_ARG")
    folder, all_points = out_folder(read, out), points(read)
    keys = read.keys(all_points)
    first, last = only if only is not None else (0, len(keys) - 1)
    if not 0 <= first <= last < len(keys):
        raise ArgumentError(f"runs {first} to {last} are not among the {len(keys)} of this study, which are "
                            f"counted from 0", "DFM_E_ARG")
    with ExitStack() as stack:
        store = Store(folder, f"runs/{first}-{last}.jsonl" if only is not None else "runs.jsonl")
        stack.callback(store.close)
        open_runs = {}
        for i in range(first, last + 1):
            row = store.rows.get(keys[i])
            if row is None or retry and row["state"] == "failed":
                open_runs.setdefault(keys[i], i)
        todo = list(open_runs.values())
        shown = Progress(len(todo), progress)
        if todo:
            pool = stack.enter_context(named_executor(executor, workers, address))
            ended = stack.enter_context(closing(pool.map([task_of(read, all_points[i]) for i in todo])))
            for which, outcome in ended:
                i = todo[which]
                store.add({"key": keys[i], "point": all_points[i], **outcome})
                shown.add(outcome["state"] == "failed")
        rows = [_row(read, point, store.rows.get(key)) for point, key in zip(all_points, keys)]
    return Sweep(read, rows, folder)


def _row(study: Study, point: dict[str, Any], kept: dict[str, Any] | None) -> dict[str, Any]:
    row: dict[str, Any] = {**point, **dict.fromkeys(study.quantities), "state": "open", "said": None,
                           "seconds": None}
    if kept is not None:
        row.update(state=kept["state"], said=kept.get("said"), seconds=kept["seconds"])
        if kept["state"] == "done":
            row.update(zip(study.quantities, kept["read"][0]))
    return row

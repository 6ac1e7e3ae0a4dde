"""deform.fit(): values of a scene from measured curves."""
from __future__ import annotations

import json
import math
import pathlib
from contextlib import ExitStack, closing
from typing import Any, Callable, Mapping, Sequence

import numpy as np

from .._command import Table
from .._library import ArgumentError, Error, UnsupportedError, clear_own, refuse_foreign, write_whole
from .._values import finite_or_none
from . import plots
from .engine import Failed
from .executors import Dask, Local, executor as named_executor
from .page import page
from .spec import Residual, Study, read_study
from .statistics import Spread
from .store import require_posix
from .sweep import out_folder
from .tables import titled

# What write() makes, and what tells that it was made by it: "parameters" of a study are an object.
MARKS = {"fit.json": '{\n "parameters": [', "fit.html": "<title>Fit ", "fit.png": plots.MARK}
ROUGH = 0.2  # relative change of a derivative with its step from which the residuals are no smooth function
LEFT = 0.1   # of an interval's half width: what a search that has converged may leave of the way


class Fit(Table):
    """What fit() found: a row for each parameter (parameter, value, low, high, unit, start), and sentences in
    notes. values: {name: value}; intervals: {name: (low, high)}, which hold all at once with the stated
    confidence; curves: measured and fitted; scatter: of the residuals over sigma; evaluations: points."""

    digits = 5

    def __init__(self, study: Study, rows: Sequence[dict[str, Any]], notes: Sequence[str], curves: Any,
                 spread: Spread, evaluations: int, folder: pathlib.Path):
        super().__init__(rows, ["parameter", "value", "low", "high", "unit", "start"], notes)
        self.study, self.curves, self.spread, self.folder = study, curves, spread, folder
        self.values = {row["parameter"]: row["value"] for row in rows}
        self.intervals = {row["parameter"]: (row["low"], row["high"]) for row in rows}
        self.scatter, self.evaluations = spread.scatter, evaluations

    def figure(self) -> Any:
        """A matplotlib figure of the measured and fitted curves."""
        return plots.fit_figure(self.curves)

    def write(self) -> list[pathlib.Path]:
        """fit.json, fit.html, and fit.png where there is matplotlib."""
        self.folder.mkdir(parents=True, exist_ok=True)
        report = {"parameters": list(self), "says": self.notes, "scatter": self.scatter,
                  "confidence": self.study.confidence, "evaluations": self.evaluations,
                  "correlation": self.spread.correlation.tolist(),
                  "curves": [{key: value.tolist() if isinstance(value, np.ndarray) else value
                              for key, value in curve.items()} for curve in self.curves]}
        written = [self.folder / "fit.json", self.folder / "fit.html"]
        text = json.dumps(finite_or_none(report), indent=1) + "\n"
        write_whole(written[0], text.encode(), MARKS["fit.json"])
        sentences, figures = list(self.notes), {}
        try:
            figures["fit"] = plots.png(self.figure())
            written.append(self.folder / "fit.png")
            write_whole(written[-1], figures["fit"], plots.MARK)
        except UnsupportedError as missing:
            sentences.append(str(missing))
        write_whole(written[1], page(f"Fit {self.study.name}", sentences, figures, self, {}),
                    MARKS["fit.html"])
        clear_own(self.folder, MARKS, written)
        return written


class Spent(Exception):
    """A search has used its evaluations."""


class Problem:
    """Residuals of points in shares of the ranges; each is found once. evaluations: points whose runs were
    made; most: of them, 0: as many as asked for."""

    def __init__(self, study: Study, pool: Local | Dask, tell: Callable[[str], None]):
        self.study, self.pool, self.tell = study, pool, tell
        self.known: dict[tuple[float, ...], list[np.ndarray] | Failed] = {}
        self.evaluations = self.most = 0
        self.best, self.best_at = math.inf, np.array([])

    def point(self, shares: Sequence[float]) -> dict[str, Any]:
        return {p.name: p.place(float(s)) for p, s in zip(self.study.parameters, shares)}

    def find(self, many: Sequence[Sequence[float]]) -> list[list[np.ndarray] | Failed]:
        """What the runs of each point give, in the form of the measurements."""
        keys = [tuple(float(s) for s in shares) for shares in many]
        new = list(dict.fromkeys(key for key in keys if key not in self.known))
        if self.most and self.evaluations + len(new) > self.most:
            raise Spent
        with closing(self.pool.map([self._task(key) for key in new])) as ended:
            for which, outcome in ended:
                self.evaluations += 1
                try:
                    if outcome["state"] == "failed":
                        raise Failed(outcome["said"])
                    self.known[new[which]] = self._in_measured_form(outcome["read"])
                except Failed as failed:
                    self.known[new[which]] = failed
        return [self.known[key] for key in keys]

    def curves(self, shares: Sequence[float]) -> list[np.ndarray]:
        found = self.find([shares])[0]
        if isinstance(found, Failed):
            point = ", ".join(f"{name} = {value:.6g}" for name, value in self.point(shares).items())
            raise Error(f"the run at {point} failed: {found}; a fit needs it: give ranges, and a start, in "
                        f"which the scene runs")
        return found

    def _task(self, shares: Sequence[float]) -> dict[str, Any]:
        values = self.study.values(self.point(shares))
        return {"kind": self.study.kind, "limit": self.study.limit,
                "runs": [[file, {**fixed, **values}, [r.read for r in self.study.residuals if r.run == i]]
                         for i, (file, fixed) in enumerate(self.study.runs)
                         if any(r.run == i for r in self.study.residuals)]}

    def _in_measured_form(self, read: Sequence[Any]) -> list[np.ndarray]:
        used = sorted({r.run for r in self.study.residuals})
        columns = {run: iter(values) for run, values in zip(used, read)}
        return [_at_measured(r, next(columns[r.run])) for r in self.study.residuals]

    def residuals(self, many: Sequence[Sequence[float]]) -> list[np.ndarray]:
        """Infinite where a run failed: no search goes there."""
        n = sum(len(r.measured) for r in self.study.residuals)
        out = [np.full(n, math.inf) if isinstance(found, Failed) else np.concatenate(self.of_curves(found))
               for found in self.find(many)]
        for shares, values in zip(many, out):
            cost = float(values @ values)
            if cost < self.best:
                self.best, self.best_at = cost, np.array(shares, dtype=float)
                self.tell(f"{self.evaluations} points: residuals are {math.sqrt(cost / n):.4g} sigma")
        return out

    def of_curves(self, curves: Sequence[np.ndarray]) -> list[np.ndarray]:
        return [(c - r.measured) / r.sigma for r, c in zip(self.study.residuals, curves)]

    def jacobian(self, shares: np.ndarray, step: float) -> np.ndarray:
        """By central differences, one-sided where a bound is nearer than the step or a run fails."""
        ends = []
        for i in range(len(shares)):
            for sign in (-1, 1):
                end = np.array(shares, dtype=float)
                end[i] = min(max(end[i] + sign * step, 0.0), 1.0)
                ends.append(end)
        values = self.residuals([shares, *ends])
        here = values.pop(0)
        columns = []
        for i in range(len(shares)):
            (low, a), (high, b) = ((end, value) if np.isfinite(value).all() else (shares, here)
                                   for end, value in zip(ends[2 * i:2 * i + 2], values[2 * i:2 * i + 2]))
            if high[i] - low[i] < step / 2:  # a difference of rounding
                for end in ends[2 * i:2 * i + 2]:
                    self.curves(end)  # raises what the run there said
            columns.append((b - a) / (high[i] - low[i]))
        return np.array(columns).T


def _at_measured(residual: Residual, read: Any) -> np.ndarray:
    if residual.against is None:
        return np.array([read])
    x, y = map(np.array, read)
    if not np.all(np.diff(x) > 0):
        if residual.read["against"] == "t":
            raise Failed(f'residual "{residual.name}": several rows of the run have one time; choose those '
                         f'of one thing by "where"')
        raise Failed(f'residual "{residual.name}": the column "{residual.read["against"]}" of the run does '
                     f'not increase from row to row, so nothing can be read off between rows; use "against": '
                     f'"t"')
    slack = 1e-9 * (x[-1] - x[0])
    if residual.against[0] < x[0] - slack or residual.against[-1] > x[-1] + slack:
        raise Failed(f'residual "{residual.name}": measured from {residual.against[0]:g} to '
                     f'{residual.against[-1]:g}, and the run gives {x[0]:g} to {x[-1]:g}; make the run '
                     f"longer or leave out what it does not reach")
    return np.interp(residual.against, x, y)


def _least_squares(problem: Problem, start: np.ndarray, step: float, _seed: int) -> np.ndarray:
    from scipy.optimize import least_squares
    found = least_squares(lambda u: problem.residuals([u])[0], start, jac=lambda u: problem.jacobian(u, step),
                          bounds=(0.0, 1.0), xtol=1e-6, ftol=1e-9, gtol=1e-12)
    return np.array(found.x)


def _cost(problem: Problem, many: Sequence[Any]) -> list[float]:
    return [float(r @ r) for r in problem.residuals(many)]


def _differential_evolution(problem: Problem, start: np.ndarray, _step: float, seed: int) -> np.ndarray:
    from scipy.optimize import differential_evolution
    found = differential_evolution(lambda u: u, [(0.0, 1.0)] * len(start), x0=start, seed=seed, polish=False,
                                   updating="deferred", workers=lambda _, many: _cost(problem, list(many)),
                                   tol=1e-3)
    return np.array(found.x)


def _cma(problem: Problem, start: np.ndarray, _step: float, seed: int) -> np.ndarray:
    try:
        import cma
    except ImportError:
        raise UnsupportedError('the optimizer cma needs the package cma for this Python (pip install cma); '
                               '"differential_evolution" does without', "DFM_E_UNSUPPORTED") from None
    search = cma.CMAEvolutionStrategy(start, 0.25, {"bounds": [0, 1], "seed": seed + 1, "verbose": -9,
                                                    "tolx": 1e-4})
    while not search.stop():
        many = search.ask()
        search.tell(many, _cost(problem, many))
    return np.array(search.result.xbest)


# And how many points for each parameter, unless the study says it.
OPTIMIZERS: dict[str, tuple[Callable[[Problem, np.ndarray, float, int], np.ndarray], int]] = {
    "least_squares": (_least_squares, 100), "differential_evolution": (_differential_evolution, 600),
    "cma": (_cma, 400)}


def _search(problem: Problem, start: np.ndarray, method: str, optimizer: Mapping[str, Any],
            most: int) -> tuple[np.ndarray, bool]:
    """The best point, and whether the search ended by itself."""
    search, of_each = OPTIMIZERS[method]
    problem.most = problem.evaluations + (most or of_each * len(start))
    try:
        return search(problem, start, optimizer["step"], optimizer["seed"]), True
    except Spent:
        return problem.best_at, False
    finally:
        problem.most = 0


def _check(study: Study) -> None:
    if not study.residuals:
        raise ArgumentError(f'{study.file}: /: a fit needs "residuals": which quantity or column is held '
                            f"against what was measured", "DFM_E_ARG")
    for p in study.parameters:
        if p.values or p.whole:
            raise ArgumentError(f'{study.file}: /parameters/{p.name}: a fit varies within a range: give '
                                f'"from" and "to" without "values" and "whole"', "DFM_E_ARG")
    if study.optimizer["method"] == "cma" and len(study.parameters) == 1:
        raise ArgumentError(f'{study.file}: /optimizer/method: cma searches in two dimensions or more; one '
                            f'parameter is found by "differential_evolution"', "DFM_E_ARG")
    n = sum(len(r.measured) for r in study.residuals)
    if n <= len(study.parameters):
        raise ArgumentError(f"{study.file}: /residuals: {n} measured numbers for {len(study.parameters)} "
                            f"parameters; intervals need more numbers than parameters", "DFM_E_ARG")
    try:
        import scipy.optimize  # noqa: F401
    except ImportError:
        raise UnsupportedError("deform fit needs SciPy for this Python: Debian's python3-scipy, or pip "
                               "install scipy", "DFM_E_UNSUPPORTED") from None


def fit(study: Any, *, out: Any = None, executor: str = "local", workers: int | None = None,
        address: str = "", tell: Callable[[str], None] | None = None) -> Fit:
    """Fits the parameters of a study (the path of STUDY.json, or a dict of the same form) to its residuals.

    out: folder for write() (out/STUDY); executor, workers, address: as of sweep(); tell: called with a
    sentence whenever the residuals have become smaller."""
    require_posix()
    read = study if isinstance(study, Study) else read_study(study)
    _check(read)
    refuse_foreign(out_folder(read, out) / "fit.json", MARKS["fit.json"])  # before the search, not after it
    method, step = read.optimizer["method"], read.optimizer["step"]
    start = np.array([p.share(p.start) for p in read.parameters])
    with ExitStack() as stack:
        pool = stack.enter_context(named_executor(executor, workers, address))
        problem = Problem(read, pool, tell or (lambda _: None))
        at_start = problem.curves(start)
        with np.errstate(over="ignore"):
            problem.residuals([start])  # the best, until a search finds a better one
        if not math.isfinite(problem.best):
            raise ArgumentError(f"{read.file}: /residuals: the sum of squares of residuals over sigma is no "
                                f"number that a computer holds; give a larger sigma", "DFM_E_ARG")
        best, ended = _search(problem, start, method, read.optimizer, read.optimizer["evaluations"])
        searched = [] if ended or method == "least_squares" else [
            f'{method} was stopped by "evaluations" after {problem.evaluations} points, and least squares '
            f"went on from its best one: raise it, or a better minimum elsewhere may remain unseen"]
        if method != "least_squares":  # which only makes the residuals smaller
            best, ended = _search(problem, best, "least_squares", read.optimizer, 0)
        jacobian, coarse = problem.jacobian(best, step), problem.jacobian(best, 2 * step)
        at_best = problem.curves(best)
    spread = Spread(jacobian, problem.of_curves(at_best), read.confidence)
    rows = []
    for i, p in enumerate(read.parameters):
        low, high = (p.place(min(max(best[i] + sign * spread.half[i], 0.0), 1.0)) for sign in (-1, 1))
        rows.append({"parameter": p.name, "value": p.place(best[i]), "low": low, "high": high, "unit": p.unit,
                     "start": p.start})
    notes = [_summary(spread, len(jacobian), problem.evaluations), *searched,
             *_notes(read, spread, best, ended, coarse)]
    return Fit(read, rows, notes, _curves(read, at_start, at_best), spread, problem.evaluations,
               out_folder(read, out))


def _notes(study: Study, spread: Spread, best: np.ndarray, ended: bool, coarse: np.ndarray) -> list[str]:
    """What there is to say beside the values. ended: the search did by itself; coarse: the Jacobian of steps
    twice as long."""
    # The residuals of a search that was stopped are no noise: only the stated size tells how near it came.
    left = spread.left(best, spread.noise if ended else spread.stated)
    names, notes = [p.name for p in study.parameters], []
    if left.max() > LEFT:
        notes.append(f"the search has not converged: {names[left.argmax()]} is {left.max():.2g} half widths "
                     f"of {'its interval' if ended else 'an interval by sigma'} from where it goes on to, so "
                     f'the values are no fit yet: raise "evaluations" of the optimizer, or give another '
                     f'"start" or "method"')
        if not ended:
            return notes
    else:
        notes += spread.sentences(names)
        if spread.scatter > 2:
            notes.append(f"the residuals are {spread.scatter:.3g} times as large as sigma says: this input "
                         f"does not give the measured curve, or sigma is too small")
        for r, r1 in zip(study.residuals, spread.correlated):
            if r1:
                notes.append(f"neighbors in {r.name} have residuals with a correlation of {r1:.2f}, by noise "
                             f"that lasts or an input that does not give this curve: its {len(r.measured)} "
                             f"numbers count as {len(r.measured) * (1 - r1) / (1 + r1):.3g}")
    step = study.optimizer["step"]
    for i, p in enumerate(study.parameters):
        if min(best[i], 1 - best[i]) < 1e-6:
            notes.append(f"{p.name} lies at the end of its range, {p.place(best[i]):.6g}: widen the range, "
                         f"or the interval means nothing")
        rough = float(np.linalg.norm((spread.jacobian - coarse)[:, i])
                      / max(np.linalg.norm(spread.jacobian[:, i]), 1e-300))
        if rough > ROUGH and i not in spread.untold:
            notes.append(f"derivatives by {p.name} change by {100 * rough:.0f} % between a step of {step:g} "
                         f'and {2 * step:g} of its range, so intervals are rough: set another "step" of the '
                         f'optimizer, or search by "differential_evolution" or "cma"')
    return notes


def _summary(spread: Spread, n: int, evaluations: int) -> str:
    return (f"{n} residuals of {spread.scatter:.3g} sigma after {evaluations} points; intervals by t "
            f"quantiles of {spread.free:.3g} degrees of freedom, for all parameters at once")


def _curves(study: Study, start: list[np.ndarray], best: list[np.ndarray]) -> list[dict[str, Any]]:
    out = []
    for r, first, last in zip(study.residuals, start, best):
        x = r.against if r.against is not None else np.zeros(1)
        along = str(r.read.get("against", "single number"))
        units = {along: r.unit_against, r.name: r.unit}
        out.append({"name": r.name, "x": x, "measured": r.measured, "sigma": r.sigma, "start": first,
                    "fitted": last, "labels": (titled(along, units), titled(r.name, units))})
    return out

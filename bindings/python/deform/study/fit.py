"""deform.fit(): values of a scene from measured curves."""
from __future__ import annotations

import json
import math
import pathlib
from contextlib import ExitStack
from typing import Any, Callable, Sequence

import numpy as np

from .._command import Table
from .._library import ArgumentError, Error, UnsupportedError
from . import plots
from .executors import Dask, Local, executor as named_executor
from .page import page, table
from .spec import Residual, Study, read_study
from .statistics import Spread
from .sweep import out_folder
from .tables import titled

ROUGH = 0.2  # relative difference of two Jacobians from which the residuals are no smooth function


class Fit(Table):
    """What fit() found: a row for each parameter (parameter, value, low, high, unit, start), and sentences in
    notes. values: {name: value}; intervals: {name: (low, high)}, which hold all at once with the stated
    confidence; curves: measured and fitted; scatter: of the residuals over sigma; evaluations: runs."""

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
        written[0].write_text(json.dumps(_finite(report), indent=1) + "\n")
        sentences, figures = list(self.notes), {}
        try:
            figures["fit"] = plots.png(self.figure())
            written.append(self.folder / "fit.png")
            written[-1].write_bytes(figures["fit"])
        except UnsupportedError as missing:
            sentences.append(str(missing))
        written[1].write_text(page(f"Fit {self.study.name}", sentences, figures,
                                   [table(self, self.columns, {})]))
        return written


def _finite(value: Any) -> Any:
    """JSON has no other numbers."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


class Problem:
    """Residuals of points in shares of the ranges; each is found once."""

    def __init__(self, study: Study, pool: Local | Dask, tell: Callable[[str], None]):
        self.study, self.pool, self.tell = study, pool, tell
        self.known: dict[tuple[float, ...], list[np.ndarray]] = {}
        self.evaluations = 0
        self.best = math.inf

    def point(self, shares: Sequence[float]) -> dict[str, Any]:
        return {p.name: p.place(float(s)) for p, s in zip(self.study.parameters, shares)}

    def curves(self, many: Sequence[Sequence[float]]) -> list[list[np.ndarray]]:
        """What the runs of each point give, in the form of the measurements."""
        keys = [tuple(float(s) for s in shares) for shares in many]
        new = list(dict.fromkeys(key for key in keys if key not in self.known))
        for which, outcome in self.pool.map([self._task(key) for key in new]):
            self.evaluations += 1
            if outcome["state"] == "failed":
                point = ", ".join(f"{name} = {value:.6g}" for name, value in self.point(new[which]).items())
                raise Error(f"the run at {point} failed: {outcome['said']}; narrow the ranges to where the "
                            f"scene runs")
            self.known[new[which]] = self._in_measured_form(outcome["read"])
        return [self.known[key] for key in keys]

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
        of = self.study.residuals
        out = [np.concatenate([(c - r.measured) / r.sigma for r, c in zip(of, curves)])
               for curves in self.curves(many)]
        for values in out:
            cost = float(values @ values)
            if cost < self.best:
                self.best = cost
                self.tell(f"{self.evaluations} runs: residuals are {math.sqrt(cost / len(values)):.4g} sigma")
        return out

    def jacobian(self, shares: np.ndarray, step: float) -> np.ndarray:
        """By central differences, one-sided where a bound is nearer than the step."""
        ends = []
        for i in range(len(shares)):
            for sign in (-1, 1):
                end = np.array(shares, dtype=float)
                end[i] = min(max(end[i] + sign * step, 0.0), 1.0)
                ends.append(end)
        values = self.residuals(ends)
        return np.array([(values[2 * i + 1] - values[2 * i]) / (ends[2 * i + 1][i] - ends[2 * i][i])
                         for i in range(len(shares))]).T


def _at_measured(residual: Residual, read: Any) -> np.ndarray:
    if residual.against is None:
        return np.array([read])
    x, y = map(np.array, read)
    if not np.all(np.diff(x) > 0):
        raise Error(f'residual "{residual.name}": the column "{residual.read["against"]}" of the run does '
                    f'not increase from row to row, so nothing can be read off between rows; use "against": '
                    f'"t"')
    slack = 1e-9 * (x[-1] - x[0])
    if residual.against[0] < x[0] - slack or residual.against[-1] > x[-1] + slack:
        raise Error(f'residual "{residual.name}": measured from {residual.against[0]:g} to '
                    f'{residual.against[-1]:g}, and the run gives {x[0]:g} to {x[-1]:g}; make the run '
                    f"longer or leave out what it does not reach")
    return np.interp(residual.against, x, y)


def _least_squares(problem: Problem, start: np.ndarray, step: float, most: int, _seed: int) -> np.ndarray:
    from scipy.optimize import least_squares
    found = least_squares(lambda u: problem.residuals([u])[0], start, jac=lambda u: problem.jacobian(u, step),
                          bounds=(0.0, 1.0), xtol=1e-6, ftol=1e-9, gtol=1e-12, max_nfev=most or 50)
    return np.array(found.x)


def _cost(problem: Problem, many: Sequence[Any]) -> list[float]:
    return [float(r @ r) for r in problem.residuals(many)]


def _differential_evolution(problem: Problem, start: np.ndarray, step: float, most: int,
                            seed: int) -> np.ndarray:
    from scipy.optimize import differential_evolution
    per_round = 15 * len(start)
    found = differential_evolution(lambda u: u, [(0.0, 1.0)] * len(start), x0=start, seed=seed, polish=False,
                                   updating="deferred", workers=lambda _, many: _cost(problem, list(many)),
                                   maxiter=max(1, (most or 40 * per_round) // per_round - 1), tol=1e-3)
    return _least_squares(problem, np.array(found.x), step, 0, seed)  # it only makes them smaller


def _cma(problem: Problem, start: np.ndarray, step: float, most: int, seed: int) -> np.ndarray:
    try:
        import cma
    except ImportError:
        raise UnsupportedError('the optimizer cma needs the package cma for this Python (pip install cma); '
                               '"differential_evolution" does without', "DFM_E_UNSUPPORTED") from None
    search = cma.CMAEvolutionStrategy(start, 0.25, {"bounds": [0, 1], "seed": seed + 1, "verbose": -9,
                                                    "maxfevals": most or 400 * len(start), "tolx": 1e-4})
    while not search.stop():
        many = search.ask()
        search.tell(many, _cost(problem, many))
    return _least_squares(problem, np.array(search.result.xbest), step, 0, seed)


OPTIMIZERS: dict[str, Callable[[Problem, np.ndarray, float, int, int], np.ndarray]] = {
    "least_squares": _least_squares, "differential_evolution": _differential_evolution, "cma": _cma}


def _check(study: Study) -> None:
    if not study.residuals:
        raise ArgumentError(f'{study.file}: /: a fit needs "residuals": which quantity or column is held '
                            f"against what was measured", "DFM_E_ARG")
    for p in study.parameters:
        if p.values or p.whole:
            raise ArgumentError(f'{study.file}: /parameters/{p.name}: a fit varies within a range: give '
                                f'"from" and "to" without "values" and "whole"', "DFM_E_ARG")
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
    read = study if isinstance(study, Study) else read_study(study)
    _check(read)
    names, step = [p.name for p in read.parameters], read.optimizer["step"]
    start = np.array([p.share(p.start) for p in read.parameters])
    with ExitStack() as stack:
        pool = stack.enter_context(named_executor(executor, workers, address))
        problem = Problem(read, pool, tell or (lambda _: None))
        best = OPTIMIZERS[read.optimizer["method"]](problem, start, step, read.optimizer["evaluations"],
                                                    read.optimizer["seed"])
        jacobian, coarse = problem.jacobian(best, step), problem.jacobian(best, 2 * step)
        residuals = problem.residuals([best])[0]
        at_start, at_best = problem.curves([start, best])
    spread = Spread(jacobian, residuals, read.confidence)
    rows, notes = [], [_summary(spread, len(residuals), problem.evaluations)]
    for i, p in enumerate(read.parameters):
        low, high = (p.place(min(max(best[i] + sign * spread.half[i], 0.0), 1.0)) for sign in (-1, 1))
        rows.append({"parameter": p.name, "value": p.place(best[i]), "low": low, "high": high, "unit": p.unit,
                     "start": p.start})
        if min(best[i], 1 - best[i]) < 1e-6:
            notes.append(f"{p.name} lies at the end of its range, {p.place(best[i]):.6g}: widen the range, "
                         f"or the interval means nothing")
    notes += spread.sentences(names)
    if spread.scatter > 2:
        notes.append(f"the residuals are {spread.scatter:.3g} times as large as sigma says: this input does "
                     f"not give the measured curve, or sigma is too small")
    rough = float(np.linalg.norm(jacobian - coarse) / max(np.linalg.norm(jacobian), 1e-300))
    if rough > ROUGH:
        notes.append(f"the derivatives change by {100 * rough:.0f} % between a step of {step:g} and "
                     f'{2 * step:g} of the ranges, so the intervals are rough: set another "step" of the '
                     f'optimizer, or search by "differential_evolution" or "cma"')
    return Fit(read, rows, notes, _curves(read, at_start, at_best), spread, problem.evaluations,
               out_folder(read, out))


def _summary(spread: Spread, n: int, evaluations: int) -> str:
    return (f"{n} residuals of {spread.scatter:.3g} sigma after {evaluations} points; intervals by t "
            f"quantiles of {spread.free} degrees of freedom, for all parameters at once")


def _curves(study: Study, start: list[np.ndarray], best: list[np.ndarray]) -> list[dict[str, Any]]:
    out = []
    for r, first, last in zip(study.residuals, start, best):
        x = r.against if r.against is not None else np.zeros(1)
        along = str(r.read.get("against", "single number"))
        units = {along: r.unit_against, r.name: r.unit}
        out.append({"name": r.name, "x": x, "measured": r.measured, "sigma": r.sigma, "start": first,
                    "fitted": last, "labels": (titled(along, units), titled(r.name, units))})
    return out

"""What a fit says of its parameters: intervals from the Jacobian, and which the data cannot tell apart.

Everything is in shares of the parameters' ranges (0 .. 1, of the logarithm where the scale is log).
"""
from __future__ import annotations

import math
from typing import Sequence

import numpy as np

WIDE = 0.5    # half width of an interval, in ranges, from which the data say nothing of a parameter
PART = 0.3    # of the largest component of a direction, from which a parameter belongs to it
ALIKE = 0.99  # correlation from which two parameters hardly differ in what they do


class Spread:
    """jacobian: [n,p] of the residuals over sigma; residuals: of each curve, [n] in all; confidence: that all
    intervals hold at once (Bonferroni)."""

    def __init__(self, jacobian: np.ndarray, residuals: Sequence[np.ndarray], confidence: float):
        from scipy.stats import t
        n, p = jacobian.shape
        self.correlated = [correlation(curve) for curve in residuals]
        # As many independent numbers bear what n correlated ones do (Bayley and Hammersley 1946).
        self.share = sum(len(curve) * (1 - r) / (1 + r) for curve, r in zip(residuals, self.correlated)) / n
        self.free = (n - p) * self.share
        # The scatter of the residuals tells the noise; sigma is its stated size.
        total = float(sum(curve @ curve for curve in residuals))
        self.scatter = math.sqrt(total / (n - p))
        independent, self.quantile = map(float, t.ppf(1 - (1 - confidence) / (2 * p), [n - p, self.free]))
        _, self.singular, rows = np.linalg.svd(jacobian, full_matrices=False)
        self.directions = rows
        floor = self.singular.max(initial=0) * np.finfo(float).eps * n
        inverse = np.array([1 / s if s > floor else math.inf for s in self.singular])
        # along singular vector k the data bear a displacement of 1/s_k
        unit = np.sqrt(np.array(
            [sum(0.0 if v == 0 else (v * w) ** 2 for v, w in zip(rows[:, i], inverse)) for i in range(p)]))
        scaled = [u if math.isinf(u) else self.scatter * u for u in unit]  # the scatter may be 0
        self.deviation = np.array(scaled) / math.sqrt(self.share)
        self.half = self.quantile * self.deviation
        self.jacobian, self.residuals = jacobian, np.concatenate(residuals)
        with np.errstate(invalid="ignore", divide="ignore"):
            covariance = (rows.T * np.minimum(inverse, 1e100) ** 2) @ rows
            root = np.sqrt(np.diag(covariance))
            self.correlation = covariance / np.outer(root, root)
        # What cannot be told is judged with noise of at least the stated size: a fit without noise has none.
        self.unit, self.stated = unit, independent
        self.noise = max(1.0, self.scatter) * independent
        self.open = [k for k in range(p) if self.noise * inverse[k] > WIDE]

    def part(self, k: int) -> list[int]:
        """The parameters to which direction k belongs."""
        size = np.abs(self.directions[k])
        return [int(i) for i in np.flatnonzero(size >= PART * size.max())]

    @property
    def untold(self) -> set[int]:
        """The parameters of the directions that the data leave open."""
        return {i for k in self.open for i in self.part(k)}

    def left(self, at: np.ndarray, noise: float) -> np.ndarray:
        """How far a search that ended at these shares of the ranges is from its end, in half widths of
        intervals by this noise: by a step of Gauss and Newton along what the data tell with noise of the
        stated size, to the ends of the ranges at most."""
        step, inside = np.zeros(len(at)), np.ones(len(at), dtype=bool)
        while inside.any():
            u, s, rows = np.linalg.svd(self.jacobian[:, inside], full_matrices=False)
            resolved = self.stated < WIDE * s
            residuals = self.residuals + self.jacobian[:, ~inside] @ step[~inside]
            step[inside] = -rows[resolved].T @ ((u.T @ residuals)[resolved] / s[resolved])
            to = np.clip(at + step, 0, 1) - at
            beyond = inside & (to != at + step - at)
            if not beyond.any():
                break
            step[beyond] = to[beyond]
            inside &= ~beyond
        return np.abs(step) / (noise * self.unit)

    def sentences(self, names: Sequence[str]) -> list[str]:
        """On identifiability: a sentence for each direction that the data leave open, and for each pair that
        is nearly one."""
        out: list[str] = []
        for k in self.open:
            part = self.part(k)
            of = [names[i] for i in part]
            if len(of) == 1:
                out.append(f"{of[0]} cannot be found from these data: over its whole range the residuals "
                           f"change by less than the noise")
                continue
            direction = self.directions[k] / max(self.directions[k], key=abs)
            along = ", ".join(f"{names[i]} {direction[i]:+.2f}" for i in part)
            out.append(f"{_listed(of)} cannot be told apart by these data: a change of them together (in "
                       f"shares of their ranges: {along}) changes the residuals by less than the noise")
        for i in range(len(names)):
            for j in range(i + 1, len(names)):
                if not self.untold & {i, j} and abs(self.correlation[i, j]) > ALIKE:
                    out.append(f"{names[i]} and {names[j]} are hard to tell apart by these data: the "
                               f"correlation of their errors is {self.correlation[i, j]:.4f}")
        return out


def correlation(residuals: np.ndarray) -> float:
    """Of neighbors in a row of residuals; 0 where it is negative, or less than the 2/sqrt(n) that independent
    residuals have by chance (Bartlett 1946)."""
    total = float(residuals @ residuals)
    r = float(residuals[1:] @ residuals[:-1]) / total if total > 0 else 0.0
    return r if r > 2 / math.sqrt(len(residuals)) else 0.0


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:-1]) + " and " + names[-1]

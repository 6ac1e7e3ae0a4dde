"""What a fit says of its parameters: intervals from the Jacobian, and which the data cannot tell apart.

Everything is in shares of the parameters' ranges (0 .. 1, of the logarithm where the scale is log).
"""
from __future__ import annotations

import math
from typing import Sequence

import numpy as np

WIDE = 0.5    # half width of an interval, in ranges, from which the data say nothing of a parameter
PART = 0.3    # component of a unit vector from which a parameter belongs to a direction
ALIKE = 0.99  # correlation from which two parameters hardly differ in what they do


class Spread:
    """jacobian: [n,p] of the residuals over sigma; residuals: [n]; confidence: that all intervals hold at
    once (Bonferroni)."""

    def __init__(self, jacobian: np.ndarray, residuals: np.ndarray, confidence: float):
        from scipy.stats import t
        n, p = jacobian.shape
        self.free = n - p
        # The scatter of the residuals tells the noise; sigma is its stated size.
        self.scatter = math.sqrt(float(residuals @ residuals) / self.free) if self.free > 0 else math.nan
        self.quantile = float(t.ppf(1 - (1 - confidence) / (2 * p), self.free)) if self.free > 0 else math.nan
        _, self.singular, rows = np.linalg.svd(jacobian, full_matrices=False)
        self.directions = rows
        floor = self.singular.max(initial=0) * np.finfo(float).eps * n
        inverse = np.array([1 / s if s > floor else math.inf for s in self.singular])
        # along singular vector k the data bear a displacement of 1/s_k
        self.deviation = self.scatter * np.sqrt(np.array(
            [sum(0.0 if v == 0 else (v * w) ** 2 for v, w in zip(rows[:, i], inverse)) for i in range(p)]))
        self.half = self.quantile * self.deviation
        with np.errstate(invalid="ignore", divide="ignore"):
            covariance = (rows.T * np.minimum(inverse, 1e100) ** 2) @ rows
            root = np.sqrt(np.diag(covariance))
            self.correlation = covariance / np.outer(root, root)
        # What cannot be told is judged with noise of at least the stated size: a fit without noise has none.
        noise = max(1.0, self.scatter) * self.quantile
        self.open = [k for k in range(p) if noise * inverse[k] > WIDE]

    def sentences(self, names: Sequence[str]) -> list[str]:
        """On identifiability: a sentence for each direction that the data leave open, and for each pair that
        is nearly one."""
        out: list[str] = []
        told: set[int] = set()
        for k in self.open:
            direction = self.directions[k]
            part = [i for i in np.argsort(-np.abs(direction)) if abs(direction[i]) >= PART]
            of = [names[i] for i in sorted(part)]
            told.update(part)
            if len(of) == 1:
                out.append(f"{of[0]} cannot be found from these data: over its whole range the residuals "
                           f"change by less than the noise")
                continue
            lead = part[0]
            along = ", ".join(f"{names[i]} {direction[i] / direction[lead]:+.2f}" for i in sorted(part))
            out.append(f"{_listed(of)} cannot be told apart by these data: a change of them together (in "
                       f"shares of their ranges: {along}) changes the residuals by less than the noise")
        for i in range(len(names)):
            for j in range(i + 1, len(names)):
                if not told & {i, j} and abs(self.correlation[i, j]) > ALIKE:
                    out.append(f"{names[i]} and {names[j]} are hard to tell apart by these data: the "
                               f"correlation of their errors is {self.correlation[i, j]:.4f}")
        return out


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:-1]) + " and " + names[-1]

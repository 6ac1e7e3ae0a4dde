"""Figures of a sweep and of a fit, by matplotlib."""
from __future__ import annotations

import io
from typing import Any, Mapping, Sequence

import numpy as np

from .._library import UnsupportedError
from .spec import Parameter
from .tables import titled

MARK = "Software\0deform"  # in each picture
BLUE, ORANGE, GRAY = "#2f6db3", "#d97b29", "#8a8a8a"


def figure(width: float, height: float) -> Any:
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise UnsupportedError("plots need matplotlib for this Python: Debian's python3-matplotlib, or pip "
                               "install matplotlib", "DFM_E_UNSUPPORTED") from None
    return Figure(figsize=(width, height), dpi=110)


def png(drawn: Any) -> bytes:
    out = io.BytesIO()
    drawn.savefig(out, format="png", metadata={"Software": "deform"})
    return out.getvalue()


def _plain(axis: Any) -> None:
    axis.spines[["top", "right"]].set_visible(False)
    axis.grid(True, alpha=0.25)
    axis.tick_params(labelsize=8)


class Columns:
    """The runs that are done, as arrays."""

    def __init__(self, rows: Sequence[Mapping[str, Any]], parameters: Sequence[Parameter],
                 quantities: Sequence[str], units: Mapping[str, str]):
        self.rows = [row for row in rows if row["state"] == "done"]
        self.parameters = [p for p in parameters if p.numeric]
        self.quantities, self.units = list(quantities), units

    def of(self, name: str) -> np.ndarray:
        return np.array([row[name] for row in self.rows], dtype=float)

    def label(self, name: str) -> str:
        return titled(name, self.units)


def response_curves(data: Columns) -> Any:
    """Each quantity over each parameter: all runs, and their mean where several share a value."""
    high, wide = len(data.quantities), len(data.parameters)
    drawn = figure(max(3.4 * wide, 4), 2.5 * high + 0.2)
    axes = drawn.subplots(high, wide, squeeze=False)
    for i, quantity in enumerate(data.quantities):
        y = data.of(quantity)
        for axis, parameter in zip(axes[i], data.parameters):
            x = data.of(parameter.name)
            axis.plot(x, y, "o", color=BLUE, markersize=3, alpha=0.5)
            values = np.unique(x)
            if 1 < len(values) <= len(x) / 2 or len(data.parameters) == 1:
                axis.plot(values, [y[x == v].mean() for v in values], "-", color=ORANGE, linewidth=1.5)
            if parameter.log:
                axis.set_xscale("log")
            axis.set_xlabel(data.label(parameter.name), fontsize=9)
            axis.set_ylabel(data.label(quantity), fontsize=9)
            _plain(axis)
    drawn.tight_layout()
    return drawn


def _edges(middles: np.ndarray, log: bool) -> np.ndarray:
    """Of cells around values, halfway on the scale of the axis."""
    at = np.log(middles) if log else middles
    inner = (at[1:] + at[:-1]) / 2
    out = np.concatenate([[2 * at[0] - inner[0]], inner, [2 * at[-1] - inner[-1]]])
    return np.exp(out) if log else out


def maps(data: Columns) -> Any:
    """Each quantity over the first two parameters, by color."""
    first, second = data.parameters[:2]
    wide = min(3, len(data.quantities))
    high = -(-len(data.quantities) // wide)
    drawn = figure(4.2 * wide, 3.3 * high)
    axes = drawn.subplots(high, wide, squeeze=False)
    x, y = data.of(first.name), data.of(second.name)
    across, up = np.unique(x), np.unique(y)
    full = len(set(zip(x, y))) == len(across) * len(up) == len(x)
    for axis, quantity in zip(axes.flat, data.quantities):
        z = data.of(quantity)
        if full and min(len(across), len(up)) > 1:
            grid = np.full((len(up), len(across)), np.nan)
            grid[np.searchsorted(up, y), np.searchsorted(across, x)] = z
            colors = axis.pcolormesh(_edges(across, first.log), _edges(up, second.log), grid, cmap="viridis")
        else:
            colors = axis.scatter(x, y, c=z, s=18, cmap="viridis")
        drawn.colorbar(colors, ax=axis).set_label(data.label(quantity), fontsize=9)
        if first.log:
            axis.set_xscale("log")
        if second.log:
            axis.set_yscale("log")
        axis.set_xlabel(data.label(first.name), fontsize=9)
        axis.set_ylabel(data.label(second.name), fontsize=9)
    for axis in axes.flat[len(data.quantities):]:
        axis.set_visible(False)
    drawn.tight_layout()
    return drawn


def parallel_coordinates(data: Columns) -> Any:
    """A line for each run across all parameters and quantities, colored by the last quantity."""
    from matplotlib import colormaps
    names = [p.name for p in data.parameters] + data.quantities
    log = {p.name for p in data.parameters if p.log}
    shares = []
    drawn = figure(max(1.7 * len(names), 5), 3.6)
    axis = drawn.subplots()
    for i, name in enumerate(names):
        column = data.of(name)
        low, high = column.min(), column.max()
        axis.text(i, -0.03, f"{low:.3g}", ha="center", va="top", fontsize=8)
        axis.text(i, 1.03, f"{high:.3g}", ha="center", va="bottom", fontsize=8)
        scaled = np.log(column / low) if name in log else column - low
        shares.append(scaled / scaled.max() if high > low else np.full(len(column), 0.5))
        axis.axvline(i, color=GRAY, linewidth=0.8)
    table = np.array(shares).T
    for line in table[np.argsort(table[:, -1])]:
        axis.plot(range(len(names)), line, color=colormaps["viridis"](line[-1]), linewidth=0.8, alpha=0.7)
    axis.set_xticks(range(len(names)), [data.label(n) for n in names], fontsize=8)
    axis.tick_params(axis="x", pad=14)
    axis.set_yticks([])
    axis.set_ylim(0, 1)
    axis.spines[["top", "right", "left", "bottom"]].set_visible(False)
    drawn.tight_layout()
    return drawn


def sweep_figures(data: Columns) -> dict[str, Any]:
    """{name: figure} of what the rows can show."""
    out: dict[str, Any] = {}
    if len(data.rows) < 2 or not data.quantities or not data.parameters:
        return out
    out["curves"] = response_curves(data)
    if len(data.parameters) > 1:
        out["map"] = maps(data)
        out["parallel"] = parallel_coordinates(data)
    return out


def fit_figure(curves: Sequence[Mapping[str, Any]]) -> Any:
    """Measured and fitted curves. Each: name, x, measured, sigma, start, fitted, labels (x, y)."""
    wide = min(3, len(curves))
    high = -(-len(curves) // wide)
    drawn = figure(4.4 * wide, 3.2 * high)
    axes = drawn.subplots(high, wide, squeeze=False)
    for axis, curve in zip(axes.flat, curves):
        x = curve["x"]
        axis.errorbar(x, curve["measured"], curve["sigma"], fmt="o", color=GRAY, markersize=2, linewidth=0.5,
                      zorder=1, label="measured")
        axis.plot(x, curve["start"], "--", color=ORANGE, linewidth=1.2, label="start")
        axis.plot(x, curve["fitted"], "-", color=BLUE, linewidth=1.6, label="fit")
        axis.set_xlabel(curve["labels"][0], fontsize=9)
        axis.set_ylabel(curve["labels"][1], fontsize=9)
        axis.set_title(curve["name"], fontsize=9)
        axis.legend(fontsize=8, frameon=False)
        _plain(axis)
    for axis in axes.flat[len(curves):]:
        axis.set_visible(False)
    drawn.tight_layout()
    return drawn

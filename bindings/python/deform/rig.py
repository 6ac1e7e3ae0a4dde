"""A friction law on the rig of the command: rows as arrays, and plots of them."""
from __future__ import annotations

import csv
import importlib.util
import os
import pathlib
import tempfile
from contextlib import nullcontext
from typing import Any, Mapping

import numpy as np

from . import rig_plot
from ._context import choice
from ._library import ArgumentError
from ._command import command
from ._values import json_of, read_json
from .law import Law, PythonLaw

INPUTS: dict[str, dict[str, Any]] = {
    "sine_velocity": {"V": 0.02, "freq": 1.0, "T": 2.0, "dt": 0.002},
    "bias_sine_force": {"bias": 0.2, "amp": 3.0, "freq": 1.0, "T": 3.0, "dt": 0.005},
    "spring_pull": {"k": 1000.0, "V": 0.01, "T": 3.0, "dt": 0.002},
    "force_ramps": {"rates": [1, 10, 100]},
    "displacement_path": {"path": [0, 2e-4, 5e-5, 2e-4, -2e-4, 2e-4]},
    "circle_velocity": {"V": 0.01, "R": 0.01, "T": 6.0, "dt": 0.01},
    "sine_velocity_sine_load": {"F0": 10.0, "a_open": 1.2, "freq": 1.0, "V": 0.01, "vfreq": 0.2, "T": 5.0,
                                "dt": 0.005},
}


def friction(law: Any, kind: str | None = None, *, normal: float | None = None,
             input: Mapping[str, Any] | None = None, case: Any = None, step: float | None = None,
             **params: Any) -> dict[str, np.ndarray]:
    """Drives one contact of 1 m2 by a law and returns its rows, an array for each column (t, x, v, F, z,
    ...; SI).

    law: a name, a plugin file, or a PythonLaw. kind: what drives it: "sine_velocity" (the default),
    "bias_sine_force", "spring_pull", "force_ramps", "displacement_path", "circle_velocity",
    "sine_velocity_sine_load" (normal force: F0 of its input); input: its numbers, where others than the usual
    ones are wanted. normal: N (1). case: a whole case instead, as a dict or the path of a JSON file. params:
    of the law, by key. step: s, the longest; not given: 1e-4, of a Python law 1e-3, on a displacement path,
    which is slow, 1e-2."""
    if isinstance(law, type) and issubclass(law, PythonLaw):
        law = law()
    if normal is not None and kind == "sine_velocity_sine_load":
        raise ArgumentError('the normal force of this kind is F0 of its input: give input={"F0": ...}',
                            "DFM_E_ARG")
    if case is None:
        kind = kind or "sine_velocity"
        choice("input", kind, INPUTS)
        known = law.parameters if isinstance(law, PythonLaw) else Law(law).type.parameters
        usual = {row.key: row.default for row in known if row.width == 1 and not row.names}
        if "mu" in params:
            usual = {key: value for key, value in usual.items() if key not in ("mu_C", "mu_S")}
        case = {"mass": (1 if normal is None else normal) / 9.81, "gravity": 9.81,
                "params": {**usual, **params}, "input": {"kind": kind, **{**INPUTS[kind], **(input or {})}}}
    elif params or input or kind or normal is not None:
        raise ArgumentError("a case holds its own input, params and normal force", "DFM_E_ARG")
    elif not isinstance(case, Mapping):
        case = read_json(case)
    if step is None:
        slow = case.get("input", {}).get("kind") == "displacement_path"
        step = 1e-2 if slow else 1e-3 if isinstance(law, PythonLaw) else 1e-4
    served: Any = law.served() if isinstance(law, PythonLaw) else nullcontext((law, {}))
    with tempfile.TemporaryDirectory() as name, served as (file, environment):
        folder = pathlib.Path(name)
        (folder / "case.json").write_text(json_of(case))
        command("friction", folder / "case.json", "--law", os.fspath(file), "--step", step, "--csv",
                folder / "rows.csv", environment=environment)
        with open(folder / "rows.csv", newline="") as rows:
            table = list(csv.DictReader(rows))
    return {column: np.array([float(row[column]) for row in table]) for column in (table[0] if table else [])}


def plot_friction(law: Any, kind: str | None = None, *, path: Any = None, **options: Any) -> Any:
    """What friction() gives, as a matplotlib Figure (matplotlib is needed); path: where to write it, too."""
    if not importlib.util.find_spec("matplotlib"):
        raise ImportError("plot_friction needs matplotlib: pip install matplotlib")
    rows = friction(law, kind, **options)
    case = options.get("case")
    if case is not None:
        case = case if isinstance(case, Mapping) else read_json(case)
        kind = case["input"]["kind"]
    name = law if isinstance(law, str) else getattr(law, "id", None) or str(law)
    kind = kind or "sine_velocity"
    figure = rig_plot.draw(rows, kind, f"{name}, {kind}")
    if path is not None:
        figure.savefig(path)
    return figure

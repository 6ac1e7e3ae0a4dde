"""STUDY.json, read and checked: what varies, what is run, what is kept of a run."""
from __future__ import annotations

import difflib
import functools
import hashlib
import json
import math
import os.path
import pathlib
import sys
from dataclasses import dataclass, field
from typing import Any, Callable, Iterable, Mapping

import numpy as np

from .._context import Context
from .._library import PATH, FileError, FormatError, command_path
from .._values import json_of, read_json
from .tables import finite, read_csv

TABLES = {"bodies", "contacts", "probes", "attachments", "sensors", "tools", "rows"}
OF_ROWS = ("state", "said", "seconds")  # what a sweep's rows say beside parameters and quantities
TETGEN = (".ele", ".node", ".face")  # whichever a scene names, those beside it are read too
LONGEST = 1e6         # s, of a run; poll() counts milliseconds in 32 bits
MOST_SEED = 2**32 - 2  # NumPy's, of 32 bits, from 1 on for cma
TAKES = ("last", "first", "min", "max", "mean", "change", "period", "peak_to_peak")


class Place:
    """A value of the study with its JSON pointer, for sentences that say where something is wrong."""

    def __init__(self, value: Any, file: str, pointer: str = ""):
        self.value, self.file, self.pointer = value, file, pointer

    def fail(self, sentence: str) -> FormatError:
        return FormatError(f"{self.file}: {self.pointer or '/'}: {sentence}", "DFM_E_FORMAT")

    def of(self, key: str) -> Place:
        return Place(self.value[key], self.file, f"{self.pointer}/{key}")

    def keys(self, known: Iterable[str], needed: Iterable[str] = ()) -> Place:
        """Checks that this is an object with no other keys than these."""
        if not isinstance(self.value, Mapping):
            raise self.fail(f"expected an object, found {json.dumps(self.value)}")
        known = list(known)
        for key in self.value:
            if key not in known:
                near = difflib.get_close_matches(key, known, 1)
                hint = f'did you mean "{near[0]}"?' if near else f"known are {', '.join(known)}"
                raise self.fail(f'unknown key "{key}"; {hint}')
        for key in needed:
            if key not in self.value:
                raise self.fail(f'the key "{key}" is missing')
        return self

    def has(self, key: str) -> bool:
        return key in self.value

    def number(self, key: str, default: float | None = None, above: float = -math.inf,
               most: float = sys.float_info.max) -> float:
        if default is not None and key not in self.value:
            return default
        at = self.of(key)
        if isinstance(at.value, bool) or not isinstance(at.value, (int, float)) or not (
                max(above, -sys.float_info.max) <= at.value <= most) or at.value == above:
            of = "" if above == -math.inf else f" above {above:g}"
            of += "" if most == sys.float_info.max else f" and at most {most:g}"
            raise at.fail(f"expected a number{of}, found {json.dumps(at.value)}")
        return float(at.value)

    def whole(self, key: str, default: int | None = None, least: int = 1, most: int | None = None) -> int:
        if default is not None and key not in self.value:
            return default
        at = self.of(key)
        if isinstance(at.value, bool) or not isinstance(at.value, int) or at.value < least or (
                most is not None and at.value > most):
            to = f"{least} or more" if most is None else f"{least} to {most}"
            raise at.fail(f"expected a whole number, {to}, found {json.dumps(at.value)}")
        return at.value

    def text(self, key: str, default: str | None = None, one_of: Iterable[str] = ()) -> str:
        if default is not None and key not in self.value:
            return default
        at, words = self.of(key), list(one_of)
        if not isinstance(at.value, str) or (words and at.value not in words):
            want = "one of " + ", ".join(words) if words else "a text"
            raise at.fail(f"expected {want}, found {json.dumps(at.value)}")
        return at.value

    def list(self, key: str, least: int = 1) -> list[Any]:
        at = self.of(key)
        if not isinstance(at.value, list) or len(at.value) < least:
            raise at.fail(f"expected a list of {least} or more, found {json.dumps(at.value)}")
        return at.value


def is_pointer(value: Any) -> bool:
    return isinstance(value, str) and value.startswith("/") and "=" not in value


def pointers(place: Place, key: str) -> list[str]:
    value = place.value[key]
    found = value if isinstance(value, list) else [value]
    if not found or not all(map(is_pointer, found)):
        raise place.of(key).fail(f"expected a JSON pointer into the scene, as /gravity/2, or a list of "
                                 f"them, found {json.dumps(value)}")
    return found


@dataclass(frozen=True)
class Parameter:
    """What varies: values in a list, or the range low .. high, on a linear or a logarithmic scale."""

    name: str
    at: list[str]
    unit: str
    values: list[Any] = field(default_factory=list)
    low: float = 0.0
    high: float = 0.0
    log: bool = False
    whole: bool = False
    count: int = 0
    start: float = math.nan  # of a fit

    def place(self, share: float) -> Any:
        """The value at a share 0 .. 1 of the range, or of the list."""
        if self.values:
            return self.values[min(int(share * len(self.values)), len(self.values) - 1)]
        top = self.high + self.whole  # each whole number has as much of the range as the others
        value = self.low * (top / self.low) ** share if self.log else self.low + (top - self.low) * share
        value = float(min(max(value, self.low), self.high))
        return math.floor(value) if self.whole else value

    def share(self, value: float) -> float:
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    @property
    def numeric(self) -> bool:
        return all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in self.values)


def read_parameter(name: str, at: Place) -> Parameter:
    at.keys(["at", "unit", "values", "from", "to", "scale", "count", "whole", "start"], ["at"])
    to, unit = pointers(at, "at"), at.text("unit", "")
    if at.has("values"):
        for key in ("from", "to", "scale", "count", "whole", "start"):
            if at.has(key):
                raise at.fail(f'"values" and "{key}" exclude each other: give the values, or a range')
        return Parameter(name, to, unit, at.list("values"))
    at.keys(at.value, ["from", "to"])
    low, high = at.number("from"), at.number("to")
    log = at.text("scale", "linear", ("linear", "log")) == "log"
    if not low < high:
        raise at.fail(f'"from" ({low:g}) must be below "to" ({high:g})')
    if log and low <= 0:
        raise at.fail(f'a range with "scale": "log" begins above 0, and "from" is {low:g}')
    if not math.isfinite(high / low if log else high - low):
        raise at.fail(f"the range {low:g} to {high:g} is wider than numbers reach: give a narrower one")
    whole = at.value.get("whole", False)
    if not isinstance(whole, bool):
        raise at.of("whole").fail(f"expected true or false, found {json.dumps(whole)}")
    if whole and (low % 1 or high % 1):
        raise at.fail(f'a "whole" range goes from a whole number to one, and this from {low:g} to {high:g}')
    out = Parameter(name, to, unit, [], low, high, log, whole, at.whole("count", 5, 2))
    start = at.number("start", out.place(0.5))
    if not low <= start <= high:
        raise at.fail(f'"start" ({start:g}) lies outside of the range {low:g} to {high:g}')
    return Parameter(name, to, unit, [], low, high, log, whole, out.count, start)


def _column(at: Place) -> dict[str, Any]:
    """Which rows of which table, and where its numbers are."""
    out = {"table": at.text("table", one_of=sorted(TABLES)), "column": at.text("column")}
    where = at.value.get("where", {})
    if not isinstance(where, Mapping):
        raise at.of("where").fail('expected an object as {"probe": "tip"}')
    return {**out, "where": {key: str(value) for key, value in where.items()}}


def read_quantity(at: Place) -> tuple[dict[str, Any], str]:
    """What is read of a run as one number, and its unit."""
    at.keys(["summary", "table", "where", "column", "take", "unit"])
    unit = at.text("unit", "")
    if at.has("summary") == at.has("table"):
        raise at.fail('a quantity is read from "summary" (a JSON pointer into summary.json) or from '
                      '"table": give one of them')
    if at.has("summary"):
        for key in ("where", "column", "take"):
            if at.has(key):
                raise at.fail(f'"summary" and "{key}" exclude each other: that is of a table')
        pointer = at.text("summary")
        if not pointer.startswith("/"):
            raise at.of("summary").fail(f'expected a JSON pointer as /steps, found "{pointer}"')
        return {"summary": pointer}, unit
    at.keys(at.value, ["column"])
    return {**_column(at), "take": at.text("take", "last", TAKES)}, unit


@dataclass(frozen=True)
class Residual:
    """A measurement: numbers against which a curve or a quantity of a run is held."""

    name: str
    run: int          # which of the study's runs it is of
    read: dict[str, Any]
    against: np.ndarray | None  # where the curve was measured; None: a single quantity
    measured: np.ndarray
    sigma: np.ndarray
    unit: str
    unit_against: str


@dataclass
class Study:
    """All of a study. runs: what is run for each point: an input file and the values that it always sets."""

    file: str
    name: str
    kind: str                                # "scene" or "rig"
    parameters: list[Parameter]
    runs: list[tuple[str, dict[str, Any]]]
    quantities: dict[str, dict[str, Any]]    # name: what to read
    units: dict[str, str]
    design: dict[str, Any]
    residuals: list[Residual]
    optimizer: dict[str, Any]
    confidence: float
    limit: float                             # s for a run; 0: none

    def values(self, point: Mapping[str, Any]) -> dict[str, Any]:
        """{pointer: value} of a point {parameter: value}."""
        return {at: point[p.name] for p in self.parameters for at in p.at}

    def keys(self, points: Iterable[Mapping[str, Any]]) -> list[str]:
        """Of each point: the same as long as its results would be, which depend on its values and on library,
        files, fixed values and what is read of a run."""
        of_file = functools.lru_cache(maxsize=None)(_of_file)  # the points of a study name the same few
        set_by_points = [at for p in self.parameters for at in p.at]
        inputs = [(of_file(file), _of_named(scene, file, of_file), fixed, _of_named(fixed, file, of_file),
                   _of_costs(scene, [*fixed, *set_by_points]))
                  for file, fixed in self.runs for scene in [read_json(file)]]
        digest = _of_json([_built(), self.kind, inputs, list(self.quantities.items())])
        keys = []
        for values in map(self.values, points):
            named = [_of_named(values, file, of_file) for file, _ in self.runs]
            keys.append(_of_json([digest, values, named])[:24])
        return keys


def _of_json(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def _of_file(path: str) -> str:
    return hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()


def _built() -> list[str]:
    """Of what makes the runs: the library, the command and all plugins."""
    plugins = (plugin.file for plugin in Context().types)
    return sorted(map(_of_file, {str(PATH), str(command_path()), *filter(None, plugins)}))


def _of_costs(scene: Any, pointers: Iterable[str]) -> list[str]:
    """Of the measured costs (bindings/cli/costs_file.cpp), where the planner chooses by them."""
    settings = os.environ.get("XDG_CONFIG_HOME") or os.path.expanduser("~/.config")
    file = os.environ.get("DEFORM_COSTS") or f"{settings}/deform/costs.json"
    keys = {pointer.split("/")[1] for pointer in pointers}.union(scene if isinstance(scene, Mapping) else ())
    return [_of_file(file)] if keys & {"accuracy", "budget"} and os.path.isfile(file) else []


def _of_named(value: Any, file: str, of_file: Callable[[str], str]) -> list[str]:
    """Of the files that texts in a value name, counted from the folder of the input file, and of those that
    are read with them."""
    if isinstance(value, str):
        path = os.path.join(os.path.dirname(file), value)
        name, ending = os.path.splitext(path)
        paths = [path] + [name + other for other in TETGEN if ending.lower() in TETGEN]
        return [of_file(one) for one in dict.fromkeys(paths) if value and os.path.isfile(one)]
    items = value.values() if isinstance(value, Mapping) else value if isinstance(value, list) else ()
    return [digest for item in items for digest in _of_named(item, file, of_file)]


def _input(at: Place, folder: pathlib.Path) -> tuple[str, str]:
    if at.has("scene") == at.has("rig"):
        raise at.fail('a study runs a "scene" or a "rig" (a case of `deform friction`): name one file')
    kind = "scene" if at.has("scene") else "rig"
    path = (folder / at.text(kind)).absolute()  # a worker may run in another folder
    try:
        str(path).encode()
        read_json(path)
    except UnicodeEncodeError:  # workers get it as JSON
        raise at.of(kind).fail("the path of this file is not UTF-8; rename it or its folder") from None
    except OSError as error:
        raise at.of(kind).fail(f"{path}: cannot be opened: {error.strerror}") from None
    except ValueError as error:
        raise at.of(kind).fail(f"{path} cannot be read as JSON: {error}") from None
    return kind, str(path)


def _fixed(at: Place) -> dict[str, Any]:
    if not at.has("set"):
        return {}
    value = at.of("set").value
    if not isinstance(value, Mapping) or not all(map(is_pointer, value)):
        raise at.of("set").fail('expected an object as {"/time/duration": 0.5}')
    return dict(value)


def read_columns(path: pathlib.Path, names: list[str], at: Place) -> list[np.ndarray]:
    try:
        rows = read_csv(path)
    except OSError as error:
        raise at.fail(f"{path}: cannot be opened: {error.strerror}") from None
    except ValueError as error:
        raise at.fail(f"{path}: {error}") from None
    out = []
    for name in names:
        if not rows or name not in rows[0]:
            has = ", ".join(filter(None, rows[0])) if rows else "no rows"
            raise at.fail(f'{path} has no column "{name}"; it has {has}')
        try:
            out.append(np.array(finite(rows, name)))
        except ValueError as error:
            raise at.fail(f'{path}: column "{name}" holds {error}, no finite number') from None
    return out


def read_residual(at: Place, run: int, folder: pathlib.Path) -> Residual:
    at.keys(["name", "scene", "rig", "set", "summary", "table", "where", "column", "take", "against",
             "measured", "columns", "sigma", "unit", "unit_against"], ["measured", "sigma"])
    unit, sigma = at.text("unit", ""), at.number("sigma", above=0)
    if isinstance(at.value["measured"], (int, float)):
        quantity = Place({key: at.value[key] for key in ("summary", "table", "where", "column", "take")
                          if at.has(key)}, at.file, at.pointer)
        read, _ = read_quantity(quantity)
        name = at.text("name", read.get("column", read.get("summary", "")))
        return Residual(name, run, read, None, np.array([at.number("measured")]), np.array([sigma]), unit, "")
    if at.has("take"):
        raise at.of("take").fail('"take" is for a single measured number; a curve is read whole')
    at.keys(at.value, ["table", "column"])
    read = {**_column(at), "against": at.text("against", "t")}
    columns = at.list("columns", 2) if at.has("columns") else [read["against"], read["column"]]
    if len(columns) > 2 or not all(isinstance(name, str) for name in columns):
        raise at.of("columns").fail(f"expected two names of columns, found {json.dumps(columns)}")
    x, y = read_columns(folder / at.text("measured"), columns, at.of("measured"))
    if not np.all(np.diff(x) > 0):
        raise at.of("measured").fail(f'column "{columns[0]}" must increase from row to row')
    return Residual(at.text("name", read["column"]), run, read, x, y, np.full(len(y), sigma), unit,
                    at.text("unit_against", "s" if read["against"] == "t" else ""))


def read_study(source: Any) -> Study:
    """From the path of a file, or from a dict, whose paths count from the working folder."""
    if isinstance(source, Mapping):
        value, file, folder = json.loads(json_of(dict(source))), "study", pathlib.Path()
    else:
        file = str(source)
        try:
            value = read_json(source)
        except OSError as error:
            raise FileError(f"{file}: cannot be opened: {error.strerror}", "DFM_E_IO") from None
        except ValueError as error:
            raise FormatError(f"{file}: cannot be read as JSON: {error}", "DFM_E_FORMAT") from None
        folder = pathlib.Path(source).parent
    at = Place(value, file)
    if isinstance(value, Mapping) and value.get("format") == "deform-scene":
        raise at.fail('this is a scene; a study names one: {"scene": "FILE.json", "parameters": ...}')
    at.keys(["format", "version", "about", "scene", "rig", "set", "design", "parameters", "quantities",
             "residuals", "optimizer", "confidence", "limit_s"], ["parameters"])
    if at.text("format", "deform-study") != "deform-study" or at.whole("version", 1) != 1:
        raise at.fail('expected "format": "deform-study", "version": 1')
    kind, main = _input(at, folder)
    fixed = _fixed(at)
    of = at.of("parameters").keys(value["parameters"])
    parameters = [read_parameter(name, of.of(name)) for name in of.value]
    if not parameters:
        raise of.fail("a study varies one parameter or more")
    quantities, units = {}, {p.name: p.unit for p in parameters}
    of_pointer: dict[str, str] = {}
    for p in parameters:
        for pointer in p.at:
            if of_pointer.setdefault(pointer, p.name) != p.name:
                raise of.of(p.name).fail(f"{pointer} is set by {of_pointer[pointer]} already")
    if at.has("quantities"):
        listed = at.of("quantities").keys(value["quantities"])
        for name in listed.value:
            if name in units:
                raise listed.fail(f'"{name}" is a parameter already; a quantity needs a name of its own')
            quantities[name], units[name] = read_quantity(listed.of(name))
    for name in OF_ROWS:
        if name in units:
            raise at.fail(f'"{name}" is a column of every sweep: give it another name')
    runs = [(main, fixed)]
    residuals = []
    for i, one in enumerate(at.list("residuals") if at.has("residuals") else []):
        place = Place(one, file, f"/residuals/{i}").keys(one)
        own = _input(place, folder) if place.has("scene") or place.has("rig") else (kind, main)
        if own[0] != kind:
            raise place.fail(f"all inputs of a study are of one kind, and this study's is a {kind}")
        run = (own[1], {**fixed, **_fixed(place)})
        if run not in runs:
            runs.append(run)
        residuals.append(read_residual(place, runs.index(run), folder))
    design = at.of("design") if at.has("design") else Place({}, file, "/design")
    method = design.keys(["method", "runs", "seed"]).text(
        "method", "grid", ("grid", "list", "random", "latin_hypercube", "sobol"))
    if method in ("grid", "list"):
        design.keys(["method"])
    elif counted := [name for name in of.value if of.of(name).has("count")]:
        raise of.of(counted[0]).fail(f'"count" is of the designs grid and list; {method} has "runs"')
    optimizer = at.of("optimizer") if at.has("optimizer") else Place({}, file, "/optimizer")
    optimizer.keys(["method", "step", "evaluations", "seed"])
    search = optimizer.text("method", "least_squares", ("least_squares", "differential_evolution", "cma"))
    if search == "least_squares":
        optimizer.keys(["method", "step", "evaluations"])
    confidence = at.number("confidence", 0.95, 0)
    if confidence >= 1:
        raise at.of("confidence").fail(f"expected a number between 0 and 1, found {confidence:g}")
    return Study(file, pathlib.Path(file).stem, kind, parameters, runs, quantities, units,
                 {"method": method, "runs": design.whole("runs", 0, 0),
                  "seed": design.whole("seed", 0, 0), "place": design},
                 residuals,
                 {"method": search, "step": optimizer.number("step", 0.01, 1e-12),
                  "evaluations": optimizer.whole("evaluations", 0, 0),
                  "seed": optimizer.whole("seed", 0, 0, MOST_SEED)},
                 confidence, at.number("limit_s", 0.0, 0, LONGEST))

"""Numbers and arrays of numbers that a caller gives: what is not one is refused by the argument's name."""
from __future__ import annotations

import ctypes
import json
import math
import numbers
import pathlib
from typing import Any

import numpy as np

from . import _abi
from ._library import ArgumentError


class KindError(ArgumentError, TypeError):
    """A value of another kind than what was expected: a text, None or a list where a number belongs."""


def real(value: Any, what: str) -> float:
    """A number; neither a text nor a list of numbers."""
    try:
        if isinstance(value, (str, bytes, bytearray)) or np.ndim(value):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise KindError(f"{what} is {value!r}; expected a number", "DFM_E_ARG") from None
    except OverflowError:
        raise ArgumentError(f"{what} is a number beyond the range of a float", "DFM_E_ARG") from None


def read_json(path: Any) -> Any:
    """Of a file, which editors may have begun with a byte order mark."""
    return json.loads(pathlib.Path(path).read_text("utf-8-sig"), object_pairs_hook=_once)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object whose keys differ, as those of a scene do; the standard reader keeps the last of a key."""
    out: dict[str, Any] = {}
    for key, value in pairs:
        if key in out:
            raise ValueError(f"the key {json.dumps(key)} is given twice in one object")
        out[key] = value
    return out


def json_of(value: Any) -> str:
    """As JSON, NumPy's numbers and arrays too."""
    def plain(given: Any) -> Any:
        if isinstance(given, (np.generic, np.ndarray)):
            return given.tolist()
        raise KindError(f"{given!r} is no value of JSON; expected numbers, texts, lists, dicts", "DFM_E_ARG")
    return json.dumps(value, default=plain)


def finite_or_none(value: Any) -> Any:
    """The same, with None for numbers that JSON cannot hold."""
    if isinstance(value, dict):
        return {key: finite_or_none(item) for key, item in value.items()}
    if isinstance(value, list):
        return [finite_or_none(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def whole(value: Any, what: str, least: int = 0, bits: int = 32) -> int:
    """A whole number from `least` on that fits into so many bits."""
    most = (1 << bits) - 1
    if isinstance(value, (numbers.Integral, np.integer)) or (isinstance(value, float) and value.is_integer()):
        if least <= value <= most:
            return int(value)
    elif not isinstance(value, (float, np.floating)):
        raise KindError(f"{what} is {value!r}; expected a whole number", "DFM_E_ARG")
    raise ArgumentError(f"{what} is {value!r}; expected a whole number from {least} to {most}", "DFM_E_ARG")


def array_of(values: Any, what: str, expected: str) -> np.ndarray:
    """Numbers of any shape as float64. NumPy alone would read texts, and None as nan."""
    try:
        given = np.asarray(values)
        if given.dtype.kind == "O" and not any(isinstance(v, (str, bytes)) or v is None for v in given.flat):
            given = given.astype(np.float64)  # integers beyond 64 bits, fractions
    except (TypeError, ValueError):
        given = np.empty(0, dtype=object)
    if given.size and given.dtype.kind not in "biuf" or given.dtype.kind == "O":
        raise KindError(f"{what} is {_shown(values)}; expected {expected}", "DFM_E_ARG")
    return np.asarray(given, dtype=np.float64)


def _shown(values: Any) -> str:
    text = repr(values)
    return text if len(text) <= 80 else text[:77] + "..."


def text(value: Any, what: str) -> bytes:
    """A text as the library takes it."""
    if not isinstance(value, str):
        raise KindError(f"{what} is {_shown(value)}; expected a text", "DFM_E_ARG")
    if "\0" in value or any("\ud800" <= letter <= "\udfff" for letter in value):
        raise ArgumentError(f"{what} is {_shown(value)}; expected characters of UTF-8, none of them 0",
                            "DFM_E_ARG")
    return value.encode()


def name_or_none(value: Any) -> bytes | None:
    """A name as the library takes it; None: it makes one."""
    return None if value is None else text(value, "name")


def vector(values: Any, what: str, width: int = 3) -> Any:
    """`width` numbers as a C array."""
    array = array_of(values, what, f"{width} numbers").ravel()
    if array.size != width:
        raise ArgumentError(f"{what} has {array.size} numbers; expected {width}", "DFM_E_ARG")
    return (ctypes.c_double * width)(*array)


def pose_of(position: Any, rotation: Any) -> _abi.dfm_pose:
    """position [3] m, rotation a quaternion x, y, z, w."""
    return _abi.dfm_pose(vector(position, "position"), vector(rotation, "rotation", 4))

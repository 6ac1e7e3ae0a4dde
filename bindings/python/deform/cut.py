"""Cuts of bodies: what is asked for, and what has been done."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _abi
from ._context import choice
from ._library import ArgumentError, default
from ._values import pose_of, real, vector, whole

CUT_SHAPES = {"ellipsoid": 0, "box": 1, "blade": 2, "plane": 3}
CUT_WORDS = {"sphere": 0, **CUT_SHAPES}
CUT_WAYS = {"remove": 0, "split": 1}
CRUMBS = {"stay": 0, "remove": 1}


@dataclass
class CutInfo:
    """What a cut has done: cells that have gone, `left` by its limit, points that were copied, parts that
    the body consists of now, area of the new surface m2 (both sides, at rest); mass kg, momentum [3] N s,
    kinetic and elastic energy J that have gone (elastic nan where the model tells none)."""

    cells: int
    left: int
    points: int
    parts: int
    area: float
    mass: float
    momentum: np.ndarray
    kinetic: float
    elastic: float

    @classmethod
    def of(cls, info: _abi.dfm_cut_info) -> CutInfo:
        return cls(info.cells, info.left, info.points, info.parts, info.area, info.mass,
                   np.array(info.momentum), info.kinetic, info.elastic)


def separate_def(least_cells: int, crumbs: str) -> Any:
    """Of Body.separate and Body.set_separate."""
    out = default(_abi.dfm_separate_def)
    out.least_cells = whole(least_cells, "least_cells", 1)
    out.crumbs = CRUMBS[choice("crumbs", crumbs, CRUMBS)]
    return out


def cut_def(shape: str, corners: Any, point: Any, normal: Any, position: Any, rotation: Any, half_size: Any,
            motion: Any, how: str | None, most: int, radius: Any) -> Any:
    """Of Body.cut and Body.plan_cut."""
    out = default(_abi.dfm_cut_def)
    out.shape = CUT_WORDS[choice("shape", shape, CUT_WORDS)]
    if (shape == "sphere") != (radius is not None):
        raise ArgumentError("a sphere needs a radius, and no other shape has one", "DFM_E_ARG")
    if (shape in ("ellipsoid", "box")) != (half_size is not None):
        raise ArgumentError("an ellipsoid and a box need half_size [3], and no other shape has it",
                            "DFM_E_ARG")
    if shape == "sphere":
        half_size = [real(radius, "radius")] * 3
    word = how if how is not None else "split" if shape in ("blade", "plane") else "remove"
    out.how = CUT_WAYS[choice("how", word, CUT_WAYS)]
    if (shape == "blade") != (corners is not None):
        raise ArgumentError("a blade needs corners [4,3], and no other shape has them", "DFM_E_ARG")
    if (shape == "plane") != (point is not None) or (shape == "plane") != (normal is not None):
        raise ArgumentError("a plane needs point [3] and normal [3], no other shape has them", "DFM_E_ARG")
    if corners is not None:
        out.blade = vector(corners, "corners", 12)
    if shape == "plane":
        out.blade[0:3], out.blade[3:6] = vector(point, "point"), vector(normal, "normal")
    out.pose = pose_of(position, rotation)
    if half_size is not None:
        out.half_size = vector(half_size, "half_size")
    out.motion, out.most = vector(motion, "motion"), whole(most, "most")
    return out

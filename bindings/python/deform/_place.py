"""A body put on an obstacle: World.add_body(on=...), as the scene key "place" does."""
from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _abi
from ._library import ArgumentError
from .body import Obstacle, handle_of
from .picture import turned, upright_of
from .query import Filter, Shape

if TYPE_CHECKING:
    from .world import World

_STEEP = 0.1  # cosine of a plane's normal to up: what is steeper is a wall
_GAP = 1e-4   # of the body's size; about the rest distance of contacts


def _reach(definition: Any) -> float:
    """m, of all points of an obstacle from its origin."""
    points = np.zeros((1, 3))
    if definition.npoint:
        memory = (ctypes.c_double * (3 * definition.npoint)).from_address(definition.points)
        points = np.frombuffer(memory, dtype=np.float64).reshape(-1, 3)
    own = definition.radius + definition.half_length + float(np.linalg.norm(list(definition.half_size)))
    return max(own, float(np.linalg.norm(points, axis=1).max()))


def put_on(world: World, on: Obstacle, points: np.ndarray, pose: Any) -> None:
    """Moves a pose along gravity so that the convex hull of points [n,3] m lies on the obstacle."""
    handle = handle_of(on, Obstacle, "on is an obstacle, as add_obstacle and find_obstacle return it")
    up = upright_of(world).at(world.time)
    x = turned(np.array(pose.rotation), points) + np.array(pose.position)
    origin, rotation = on.pose
    definition = on.definition()
    if definition.shape == _abi.DFM_SHAPE_PLANE:
        normal = turned(rotation, np.array([[0.0, 0.0, 1.0]]))[0]
        if normal @ up < _STEEP:
            raise ArgumentError(f"'{on.name}' is a wall, on which nothing lies; name an obstacle whose upper "
                                "side is level", "DFM_E_ARG")
        lift = (normal @ origin - (x @ normal).min()) / (normal @ up)
    else:
        # from where all of them are above it to where all are below
        height, reach = float(np.ptp(x @ up)), 1.001 * _reach(definition)
        raised = float(up @ origin) + reach + 1e-3 * height - float((x @ up).min())
        alone = Filter(("obstacles", "rigids", "sensors"), accept=lambda thing: bool(thing.handle == handle))
        hit = world.query_cast(Shape.hull(x + raised * up), -(2 * reach + height) * up, alone)
        if hit is None:
            raise ArgumentError(f"the body is not above or below '{on.name}'; move it there by position",
                                "DFM_E_ARG")
        lift = raised - hit.distance
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    pose.position[:] = (np.array(pose.position) + (lift + _GAP * size) * up).tolist()

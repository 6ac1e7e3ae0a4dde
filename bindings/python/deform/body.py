"""Deformable bodies, obstacles and rigid bodies of a world."""
from __future__ import annotations

import ctypes
import math
from typing import TYPE_CHECKING, Any, Mapping, Sequence

import numpy as np

from . import _abi
from ._arrays import Column, Report
from ._context import Asked
from ._library import ArgumentError, OfThisProcess, check, default, encoded, lib, quick, sized
from ._values import array_of, pose_of, real, text, vector, whole
from .cut import CutInfo, cut_def, separate_def
from .mesh import points_of

if TYPE_CHECKING:
    from .query import Shape
    from .world import World

EVERYTHING = 0xFFFFFFFF


def held_bits(fixed: Any, npoint: int) -> np.ndarray:
    """[npoint] bits 1 x, 2 y, 4 z of components that are held."""
    given = np.asarray(fixed)
    if given.dtype == bool and given.shape == (npoint,):
        return np.where(given, 7, 0).astype(np.uint8)
    if given.dtype == bool and given.shape == (npoint, 3):
        return (given @ np.array([1, 2, 4])).astype(np.uint8)
    if given.shape != (npoint,) or given.dtype.kind not in "iuf" or not np.isin(given, range(8)).all():
        raise ArgumentError(f"fixed has the shape {given.shape} and the type {given.dtype}; expected "
                            f"({npoint},): True where a point is held, or bits 1 x, 2 y, 4 z; or "
                            f"({npoint}, 3): True where a component is held; Body.hold takes numbers of "
                            "points", "DFM_E_ARG")
    return np.ascontiguousarray(given, dtype=np.uint8)


def rotation(axis: Sequence[float], degrees: float) -> tuple[float, float, float, float]:
    """The quaternion x, y, z, w of a turn about an axis [3] of any length, as every argument `rotation` here
    takes it."""
    along = tuple(vector(axis, "axis"))
    length = math.hypot(*along)
    degrees = real(degrees, "degrees")
    if not 0 < length < math.inf or not math.isfinite(degrees):
        raise ArgumentError(f"a turn by {degrees} degrees about the axis {along}; both must be finite, the "
                            "axis not zero", "DFM_E_ARG")
    half = math.radians(degrees) / 2
    x, y, z = (math.sin(half) * c / length for c in along)
    return x, y, z, math.cos(half)


def vector_keys(times: Any, values: Any, what: str) -> Any:
    """values [n,3] at times [n] s, as the library takes them."""
    at, path = array_of(times, "times", "a number for each key"), points_of(values, what)
    if at.shape != (len(path),):
        raise ArgumentError(f"times has the shape {at.shape}; expected ({len(path)},), as many as {what}",
                            "DFM_E_ARG")
    keys = (_abi.dfm_vector_key * max(len(path), 1))()
    for key, t, value in zip(keys, at, path):
        key.t = t
        key.value[:] = value
    return keys


def numbers_of(numbers: Any, what: str = "points") -> np.ndarray:
    """Numbers of points, or of `what`, as the library takes them."""
    given = np.atleast_1d(np.asarray(numbers))
    if given.ndim != 1 or (given.size and (
            given.dtype.kind not in "iu" or given.min() < 0 or given.max() >= 2**32)):
        raise ArgumentError(f"{what} must be a list of whole numbers from 0 on, numbers of {what} of the "
                            "body", "DFM_E_ARG")
    return np.ascontiguousarray(given, dtype=np.uint32)


def handle_of(thing: Any, kind: Any, expected: str) -> int:
    """The handle of something of this kind; ArgumentError with what was expected if it is something else."""
    if not isinstance(thing, kind):
        raise ArgumentError(f"{expected}, not {thing!r}", "DFM_E_ARG")
    return int(thing.handle)


def things(of: Any, kind: Any, function: Any, *arguments: Any) -> list[Any]:
    """What a function lists of a part of a world, as objects of its world; of this kind alone."""
    found = map(of.world.owner, of._listed(function, *arguments))
    return [thing for thing in found if isinstance(thing, kind)]


class _Part(Asked, OfThisProcess):
    """What lives in a world under a handle. `user` is yours; a misspelled attribute is an error."""

    __slots__ = ("__weakref__", "_columns", "handle", "name", "user", "world")
    _instead = "give its name, and find it by World.find_body or find_obstacle; its arrays can be pickled"

    def __init__(self, world: World, handle: int, name: str):
        self.world = world
        self.handle = handle
        self.name = name
        self.user: Any = None
        self._columns: dict[str, Any] = {}

    def _free(self) -> None:
        self.world.free()

    def _look(self, key: str, make: Any) -> Any:
        self._free()
        column = self._columns.get(key)
        if column is None:
            column = self._columns[key] = make()
        array = column.look()
        if array is None:  # the body has been cut since
            column = self._columns[key] = make()
            array = column.look()
        return array

    @property
    def is_sensor(self) -> bool:
        """Does it report what overlaps it, and push nothing (set_sensor)?"""
        return bool(self._answer(ctypes.c_bool, quick.dfm_is_sensor).value)

    @property
    def sensed(self) -> list[Body | Obstacle]:
        """What overlapped this sensor at the end of the last step: bodies, then obstacles and rigid bodies,
        each in order of creation. World.events tells what comes and goes."""
        return things(self, _Part, quick.dfm_sensor_things)

    def __repr__(self) -> str:
        return f"<deform.{type(self).__name__} '{self.name}'>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Part) and other.handle == self.handle

    def __hash__(self) -> int:
        return hash(self.handle)


class Body(_Part):
    """A deformable body. Made by World.add_body.

    Its arrays are views of the library's answers. An array that you keep keeps its values: a later look gives
    other memory. They are read-only, are never freed beneath you, and stay when the world is gone; a new look
    at a world that is gone raises HandleError, one during a step BusyError.
    """

    __slots__ = ("_info",)

    def __init__(self, world: World, handle: int):
        self._info = sized(_abi.dfm_body_info)
        check(quick.dfm_body_get_info(handle, ctypes.byref(self._info)))
        super().__init__(world, handle, self._info.name.decode())

    def _renew_name(self) -> None:
        """For World.restore."""
        if quick.dfm_body_get_info(self.handle, ctypes.byref(self._info)) == 0:
            self.name = self._info.name.decode()

    def _number(self, what: str) -> int:
        """Of now, or of the last look where the body is gone."""
        quick.dfm_body_get_info(self.handle, ctypes.byref(self._info))
        return int(getattr(self._info, what))

    @property
    def npoint(self) -> int:
        """Number of points; a cut changes it."""
        return self._number("npoint")

    @property
    def ntet(self) -> int:
        """Number of cells; a cut changes it."""
        return self._number("ntet")

    @property
    def nsurfel(self) -> int:
        """Number of surface points; a cut changes it."""
        return self._number("nsurfel")

    @property
    def ntriangle(self) -> int:
        """Number of surface triangles; a cut changes it."""
        return self._number("ntriangle")

    def _surface(self, key: str, function: Any) -> np.ndarray:
        return self._look(key, lambda: Column(function, self.handle, self.nsurfel, 3))

    @property
    def positions(self) -> np.ndarray:
        """Surface points now, [nsurfel,3] m; a view."""
        return self._surface("positions", quick.dfm_surface_positions)

    @property
    def displacements(self) -> np.ndarray:
        """Of the surface points from the rest shape at the body's pose, [nsurfel,3] m; a view."""
        return self._surface("displacements", quick.dfm_debug_surface_displacements)

    @property
    def velocities(self) -> np.ndarray:
        """Of the surface points, [nsurfel,3] m/s; a view."""
        return self._surface("velocities", quick.dfm_surface_velocities)

    @property
    def normals(self) -> np.ndarray:
        """Outward unit normals of the surface points, [nsurfel,3]; a view."""
        return self._surface("normals", quick.dfm_surface_normals)

    @property
    def forces(self) -> np.ndarray:
        """Contact force on each surface point in the last sub-step, [nsurfel,3] N; a view."""
        return self._surface("forces", quick.dfm_surface_forces)

    @property
    def triangles(self) -> np.ndarray:
        """Surface triangles, [ntriangle,3] numbers of surface points, counter-clockwise from outside; a
        view."""
        return self._look("triangles", lambda: Column(quick.dfm_surface_triangles, self.handle,
                                                      self.ntriangle, 3, np.uint32))

    @property
    def surface_points(self) -> np.ndarray:
        """Numbers of the points of the body under its surface points, [nsurfel]; a view. UnsupportedError of
        a body with a surface of its own."""
        return self._look("surface_points", lambda: Column(quick.dfm_surface_points, self.handle,
                                                           self.nsurfel, 0, np.uint32))

    def _state(self, which: int) -> np.ndarray:
        def fill(handle: int, rows: int, address: int, count: Any) -> int:
            pair = (address, None) if which == 0 else (None, address)
            return quick.dfm_body_get_state(handle, rows, *pair, count)
        return self._look(f"state{which}", lambda: Column(fill, self.handle, self.npoint, 3))

    @property
    def points(self) -> np.ndarray:
        """All points of the body now, [npoint,3] m; a view."""
        return self._state(0)

    @property
    def point_velocities(self) -> np.ndarray:
        """Of all points, [npoint,3] m/s; a view."""
        return self._state(1)

    def set_state(self, points: Any = None, velocities: Any = None) -> None:
        """Sets all points [npoint,3] m, or their velocities [npoint,3] m/s, or both."""
        self.world.free()
        x = None if points is None else points_of(points)
        v = None if velocities is None else points_of(velocities, "velocities")
        given = {len(a) for a in (x, v) if a is not None}
        if not given or len(given) > 1:
            raise ArgumentError("set_state takes points, velocities or both, of one length", "DFM_E_ARG")
        check(quick.dfm_body_set_state(self.handle, given.pop(), None if x is None else x.ctypes.data,
                                       None if v is None else v.ctypes.data))

    @property
    def rest_points(self) -> np.ndarray:
        """[npoint,3] m at rest, before the body's pose."""
        out = np.empty((self.npoint, 3))
        check(quick.dfm_body_get_rest(self.handle, self.npoint, out.ctypes.data, 0, None))
        return out

    @property
    def tets(self) -> np.ndarray:
        """[ntet,4] numbers of points."""
        out = np.empty((self.ntet, 4), dtype=np.uint32)
        check(quick.dfm_body_get_rest(self.handle, 0, None, self.ntet, out.ctypes.data))
        return out

    @property
    def measure(self) -> Any:
        """Sums over the body as a record, a view: mass kg, com [3] m, velocity [3] m/s, momentum, angular,
        kinetic and elastic J, volume m3, speed_max m/s, contact_impulse [3] N s, inverted cells."""
        return self._look("measure", lambda: Report(quick.dfm_body_get_measure, self.handle,
                                                    _abi.dfm_body_measure))

    def _filled(self, name: str, function: Any, rows: str, width: int) -> np.ndarray:
        def fill(handle: int, capacity: int, address: int, count: Any) -> int:
            count._obj.value = getattr(self, rows)  # which a cut changes
            return function(handle, capacity, address)
        return self._look(name, lambda: Column(fill, self.handle, getattr(self, rows), width))

    @property
    def energy_density(self) -> np.ndarray:
        """Of each cell, [ntet] J/m3; a view."""
        return self._filled("energy_density", quick.dfm_body_energy_density, "ntet", 0)

    @property
    def stress(self) -> np.ndarray:
        """Cauchy stress of each cell, [ntet,6] Pa: xx yy zz xy yz zx, world axes, tension > 0; a view."""
        return self._filled("stress", quick.dfm_body_stress, "ntet", 6)

    @property
    def point_stress(self) -> np.ndarray:
        """The same at the phyxels, [npoint,6] Pa, fitted to the cells around each; a view."""
        return self._filled("point_stress", quick.dfm_body_point_stress, "npoint", 6)

    def hold(self, points: Any, axes: str = "xyz") -> None:
        """Holds components ("xyz", "z", "": none, which releases) of points, given by their numbers."""
        if not isinstance(axes, str) or not set(axes) <= set("xyz"):
            raise ArgumentError(f"axes is {axes!r}; expected a text of the letters x, y and z", "DFM_E_ARG")
        bits = sum(1 << "xyz".index(a) for a in set(axes))
        numbers = numbers_of(points)
        self._ask(quick.dfm_body_hold, numbers.size, numbers.ctypes.data, bits)

    def move_held(self, points: Any, times: Sequence[float], positions: Any) -> None:
        """Moves held points together along positions [n,3] m at times [n] s, relative to the first."""
        numbers, path = numbers_of(points), points_of(positions, "positions")
        at = array_of(times, "times", "a number for each position")
        if at.shape != (len(path),):
            raise ArgumentError(f"{at.size} times for {len(path)} positions", "DFM_E_ARG")
        keys = (_abi.dfm_pose_key * len(path))()
        for key, t, p in zip(keys, at, path):
            key.t = t
            key.pose.position[:] = p
        self._ask(quick.dfm_body_move_held, numbers.size, numbers.ctypes.data, len(path), keys, None)

    def add_load(self, points: Any, force: Any) -> int:
        """A lasting force [3] N on each of the points, or [n,3] N on each its own. Returns its number."""
        numbers = numbers_of(points)
        given = array_of(force, "force", "3 numbers, or 3 for each point")
        if given.shape not in ((3,), (numbers.size, 3)):
            raise ArgumentError(f"force has the shape {given.shape}; expected (3,), or ({numbers.size}, 3): "
                                "one for each point", "DFM_E_ARG")
        forces = np.ascontiguousarray(np.broadcast_to(given, (numbers.size, 3)))
        return int(self._answer(ctypes.c_uint32, quick.dfm_body_add_load, numbers.size, numbers.ctypes.data,
                                forces.ctypes.data, 0, None, None).value)

    def remove_load(self, load: int) -> None:
        """Ends a load by the number that add_load returned."""
        self._ask(quick.dfm_body_remove_load, whole(load, "load"))

    def add_spring(self, points: Any, to: Any, stiffness: float, damping: float = 0, *, weights: Any = None,
                   times: Any = None) -> int:
        """A spring without a rest length from points of the body to a place in the world. Returns its number.

        points: their numbers; the spring pulls at their mean by weights [n], or at their center of mass.
        to: [3] m; or [n,3] m at times [n] s. stiffness N/m, damping N s/m. It limits the stable step."""
        chosen, definition = numbers_of(points), sized(_abi.dfm_spring_def)
        definition.npoint, definition.points = chosen.size, chosen.ctypes.data
        keep: Any = None
        if weights is not None:
            keep = np.ascontiguousarray(array_of(weights, "weights", "a number for each point"))
            if keep.shape != (chosen.size,):
                raise ArgumentError(f"weights has the shape {keep.shape}; expected ({chosen.size},): one for "
                                    "each point", "DFM_E_ARG")
            definition.weights = keep.ctypes.data
        if times is None:
            definition.to = vector(to, "to")
        else:
            keys = vector_keys(times, to, "to")
            definition.nkey, definition.keys = len(keys), ctypes.addressof(keys)
        definition.stiffness, definition.damping = real(stiffness, "stiffness"), real(damping, "damping")
        return int(self._answer(ctypes.c_uint32, quick.dfm_body_add_spring, ctypes.byref(definition)).value)

    def set_spring_target(self, spring: int, to: Any) -> None:
        """Moves the end of a spring to a place [3] m, at which it stays."""
        self._ask(quick.dfm_body_set_spring_target, whole(spring, "spring"), vector(to, "to"))

    def spring_force(self, spring: int) -> np.ndarray:
        """Force of a spring on the body now, [3] N."""
        return np.array(self._answer(ctypes.c_double * 3, quick.dfm_body_get_spring_force,
                                     whole(spring, "spring")))

    def remove_spring(self, spring: int) -> None:
        """Ends a spring by the number that add_spring returned."""
        self._ask(quick.dfm_body_remove_spring, whole(spring, "spring"))

    def apply_impulse(self, point: Any, impulse: Any) -> None:
        """An impulse [3] N s at a point [3] m, on the nearest surface triangle."""
        self._ask(quick.dfm_body_apply_impulse, vector(point, "point"), vector(impulse, "impulse"))

    def set_params(self, **params: Any) -> None:
        """Changes run-time parameters of the body's model by key."""
        values = self.world.context.params("model", self.model, params)
        self.world.call(lib.dfm_body_set_params, self.handle, ctypes.byref(values.struct))

    def set_model(self, model: str, params: Mapping[str, Any] | None = None) -> None:
        """Gives the body another model between two steps; positions and velocities stay."""
        values = self.world.context.params("model", model, params or {})
        with self.world.alone():
            status = lib.dfm_body_set_model(self.handle, text(model, "model"), ctypes.byref(values.struct))
        self.world.accept(status)

    @property
    def model(self) -> str:
        """The id of its model."""
        info = sized(_abi.dfm_body_info)
        check(quick.dfm_body_get_info(self.handle, ctypes.byref(info)))
        return (info.model or b"").decode()

    @property
    def mass_scaled(self) -> tuple[float, float]:
        """By mass_scaling of add_body: the share of the mass that was moved, and the share by which the
        frequency of a mode quadratic in the place may change."""
        info = sized(_abi.dfm_body_info)
        check(quick.dfm_body_get_info(self.handle, ctypes.byref(info)))
        return info.mass_moved, info.frequency_change

    def set_filter(self, category: int = 1, collides_with: int = EVERYTHING) -> None:
        """A pair touches if each one's category is among the bits that the other collides with."""
        self._ask(quick.dfm_body_set_filter, whole(category, "category"),
                  whole(collides_with, "collides_with"))

    def set_sensor(self, sensor: bool = True) -> None:
        """Makes it a sensor, which reports what overlaps it and pushes nothing; False: it touches again."""
        self._ask(quick.dfm_body_set_sensor, sensor)

    def query_triangles(self, shape: Shape) -> np.ndarray:
        """Numbers of the surface triangles that a Shape touches or holds, [n], ascending."""
        from .query import query_triangles
        self.world.free()
        return query_triangles(self, shape)

    def attach(self, to: Body | Obstacle, *, points: Any = None, surfels: Any = None,
               group: str | None = None, box: Any = None, max_distance: float = 0, stiffness: float = 0,
               damping: float = 0, release: float = 0, touch: bool = False) -> int:
        """Holds a part of its surface where it is now by an obstacle, a rigid body or another body.

        points: numbers of points [n]; surfels: numbers of surfels [n]; group: of its surface; box: [2, 3] m,
        in the world. max_distance in m from another body's surface, 0 for any. stiffness in N/m and damping
        in N s/m of the whole, 0 for rigid. release in N, 0 for never. touch: the two touch each other
        meanwhile.
        Returns the number of the attachment."""
        definition = default(_abi.dfm_attach_def)
        definition.to = handle_of(to, _Part, "attach needs a body, an obstacle or a rigid body")
        definition.flags = _abi.DFM_ATTACH_TOUCH if touch else 0
        keep = []
        for name, values in (("point", points), ("surfel", surfels)):
            if values is None:
                continue
            numbers = numbers_of(values)
            keep.append(numbers)
            setattr(definition, f"n{name}", numbers.size)
            setattr(definition, f"{name}s", numbers.ctypes.data)
        if box is not None:
            corners = vector(box, "box", 6)
            keep.append(corners)
            definition.box = ctypes.addressof(corners)
        definition.group = None if group is None else text(group, "group")
        for key, value in (("max_distance", max_distance), ("release", release), ("stiffness", stiffness),
                           ("damping", damping)):
            setattr(definition, key, real(value, key))
        number = ctypes.c_uint32()
        self.world.call(lib.dfm_body_attach, self.handle, ctypes.byref(definition), ctypes.byref(number))
        return number.value

    def detach(self, attachment: int) -> None:
        """Ends an attachment."""
        self.world.call(lib.dfm_body_detach, self.handle, whole(attachment, "attachment"))

    @property
    def attachments(self) -> list[int]:
        """Numbers of the attachments that hold now, in order of creation."""
        return self._listed(quick.dfm_body_attachments, kind=ctypes.c_uint32)

    def attachment(self, number: int) -> _abi.dfm_attachment:
        """What it does, as the C struct: to (a handle), nsurfel, stiffness N/m, damping N s/m, release N,
        point [3] m (mean of its surfels), force [3] N and moment [3] N m about it on the body (means over the
        last sub-step), impulse [3] N s since it was made, stretch m."""
        return self._answer(_abi.dfm_attachment, quick.dfm_body_get_attachment, whole(number, "number"))

    def cut(self, shape: str = "blade", *, corners: Any = None, point: Any = None, normal: Any = None,
            position: Any = (0, 0, 0), rotation: Any = (0, 0, 0, 1), half_size: Any = None,
            radius: float | None = None, motion: Any = (0, 0, 0), how: str | None = None,
            most: int = 0) -> CutInfo:
        """Cuts the body between two steps. Points and cells get new numbers (origins).

        shape: a "blade" has corners [4,3] m in the world: an edge from 0 to 1, which has come to 3 and 2. A
        "plane" through the whole body has a point [3] m and a normal [3]. A "sphere" has a radius m, an
        "ellipsoid" or a "box" has half_size [3] m (semi-axes, half edges), at position [3] m with rotation (a
        quaternion x, y, z, w), and goes by motion [3] m. how: "split" opens the faces that a blade
        or a plane crosses, "remove" takes the cells that the shape meets; None: "split" of a blade and a
        plane. most: faces or cells, 0: all.
        UnsupportedError where the model needs all of its cells: msm and corotational_fem do not."""
        definition = cut_def(shape, corners, point, normal, position, rotation, half_size, motion, how, most,
                             radius)
        info = sized(_abi.dfm_cut_info)
        self.world.call(lib.dfm_body_cut, self.handle, ctypes.byref(definition), ctypes.byref(info))
        return CutInfo.of(info)

    def plan_cut(self, t: float, shape: str = "plane", *, corners: Any = None, point: Any = None,
                 normal: Any = None, position: Any = (0, 0, 0), rotation: Any = (0, 0, 0, 1),
                 half_size: Any = None, radius: float | None = None, motion: Any = (0, 0, 0),
                 how: str | None = None, most: int = 0) -> None:
        """Plans a cut (see cut) of the body and of its pieces, at the end of the first step that ends at t s
        or later."""
        definition = cut_def(shape, corners, point, normal, position, rotation, half_size, motion, how, most,
                             radius)
        self.world.call(lib.dfm_body_plan_cut, self.handle, real(t, "t"), ctypes.byref(definition))

    def plan_no_cuts(self) -> None:
        """No planned cut of the body and of its pieces is to come any more."""
        self.world.call(lib.dfm_body_plan_cut, self.handle, 0, None)

    def separate(self, least_cells: int = 1, crumbs: str = "stay") -> CutInfo:
        """Makes parts that hang together no more bodies of their own: each but the heaviest that has
        least_cells or more. They are named "NAME.1", "NAME.2" and so on, and world.bodies has them. crumbs,
        the smaller parts: "stay" with the part next to them, or "remove": they go with their mass."""
        rule, info = separate_def(least_cells, crumbs), sized(_abi.dfm_cut_info)
        self.world.call(lib.dfm_body_separate, self.handle, ctypes.byref(rule), ctypes.byref(info))
        return CutInfo.of(info)

    def set_separate(self, least_cells: int | None = 1, crumbs: str = "stay") -> None:
        """From now on each cut and each tear is followed by a separation (see separate); with least_cells
        None parts stay in one body."""
        rule = None if least_cells is None else ctypes.byref(separate_def(least_cells, crumbs))
        self.world.call(lib.dfm_body_set_separate, self.handle, rule)

    def remove_cells(self, cells: Any) -> CutInfo:
        """Takes cells away by their numbers [n], between two steps."""
        numbers, info = numbers_of(cells, "cells"), sized(_abi.dfm_cut_info)
        self.world.call(lib.dfm_body_remove_cells, self.handle, numbers.size, numbers.ctypes.data,
                        ctypes.byref(info))
        return CutInfo.of(info)

    def set_cut_delay(self, delay: float = 0) -> None:
        """From now on faces that the edge of a tool passes open `delay` s later, and a second thread makes
        the cut body meanwhile; 0: at the end of the step in which it passes them."""
        seconds = real(delay, "delay")
        self.world.call(lib.dfm_body_set_cut_delay, self.handle, seconds)

    @property
    def cut_delay(self) -> float:
        """s, of set_cut_delay."""
        out = ctypes.c_double()
        self._ask(quick.dfm_body_cut_delay, ctypes.byref(out), None)
        return out.value

    @property
    def cuts_waiting(self) -> int:
        """Number of faces that an edge has passed, and that open when the cut delay is over."""
        return int(self._answer(ctypes.c_uint32, quick.dfm_body_cut_delay, None).value)

    @property
    def pieces(self) -> list[Body]:
        """Bodies that have come off it (set_separate), in order of creation; of a piece, those of the body
        that it came off."""
        return things(self, Body, quick.dfm_body_pieces)

    @property
    def origins(self) -> tuple[np.ndarray, np.ndarray]:
        """Where points [npoint] and cells [ntet] come from: their numbers when the body was made. Copies of
        a point have its number."""
        points, cells = np.empty(self.npoint, np.uint32), np.empty(self.ntet, np.uint32)
        self._ask(quick.dfm_body_origins, len(points), points.ctypes.data, len(cells), cells.ctypes.data)
        return points, cells

    def wake(self) -> None:
        """Ends the sleep of the body and of what touches it."""
        self._ask(quick.dfm_body_wake)

    @property
    def asleep(self) -> bool:
        """Whether the body sleeps: it rested long enough in a world with sleep=True, and is not stepped."""
        return bool(self._answer(ctypes.c_bool, quick.dfm_body_is_asleep).value)

    def write(self, path: Any) -> None:
        """Its points and cells as *.vtu."""
        self.world.call(lib.dfm_debug_write_body, self.handle, encoded(path))

    def write_surface(self, path: Any) -> None:
        """Its surface with displacements, velocities and contact forces as *.vtu."""
        self.world.call(lib.dfm_debug_write_surface, self.handle, encoded(path))

    def remove(self) -> None:
        """Takes the body out of its world; its contacts end. Arrays keep their last values."""
        self.world.call(lib.dfm_body_destroy, self.handle)

    def to_meshio(self) -> Any:
        """Its present state as a `meshio.Mesh`, with the velocity of each point."""
        import meshio
        return meshio.Mesh(self.points.copy(), [("tetra", self.tets.astype(np.int64))],
                           point_data={"velocity": self.point_velocities.copy()})


class Obstacle(_Part):
    """A rigid thing that feels nothing: plane, sphere, box, capsule, mesh. Made by World.add_obstacle."""

    __slots__ = ()

    @property
    def pose(self) -> tuple[np.ndarray, np.ndarray]:
        """position [3] m, rotation [4], a quaternion x, y, z, w."""
        out = self._answer(_abi.dfm_pose, quick.dfm_obstacle_get_pose)
        return np.array(out.position), np.array(out.rotation)

    def move_to(self, position: Any, rotation: Any = (0, 0, 0, 1)) -> None:
        """Where it is at the end of the next step; it moves there at constant speed."""
        self._ask(quick.dfm_obstacle_move_to, ctypes.byref(pose_of(position, rotation)))

    def teleport(self, position: Any, rotation: Any = (0, 0, 0, 1)) -> None:
        """Puts it there at once, without a motion."""
        self._ask(quick.dfm_obstacle_teleport, ctypes.byref(pose_of(position, rotation)))

    def set_sensor(self, sensor: bool = True) -> None:
        """Makes it a sensor, which reports what overlaps it and pushes nothing; False: it touches again."""
        self._ask(quick.dfm_obstacle_set_sensor, sensor)

    def set_velocity_surface(self, velocity: Any) -> None:
        """Velocity of its surface, a belt's, beside that of its pose: [3] m/s, in the world's axes."""
        self._ask(quick.dfm_obstacle_set_velocity_surface, vector(velocity, "velocity"))

    def set_filter(self, category: int = 1, collides_with: int = EVERYTHING) -> None:
        """A pair touches if each one's category is among the bits that the other collides with."""
        self._ask(quick.dfm_obstacle_set_filter, whole(category, "category"),
                  whole(collides_with, "collides_with"))

    def set_material(self, material: Any = None) -> None:
        """Its material, of World.add_material or as a dict of entries, for friction by material; None: no
        material."""
        self._ask(quick.dfm_obstacle_set_material, self.world._material(material))

    def definition(self) -> _abi.dfm_obstacle_def:
        """Its def as created, as the C struct."""
        return self._answer(_abi.dfm_obstacle_def, quick.dfm_obstacle_get_def)

    def remove(self) -> None:
        """Takes the obstacle out of its world; its contacts end."""
        self.world.call(lib.dfm_obstacle_destroy, self.handle)


class Rigid(Obstacle):
    """A rigid body that soft bodies push. Made by World.add_rigid."""

    __slots__ = ()

    def _state(self) -> _abi.dfm_rigid_state:
        return self._answer(_abi.dfm_rigid_state, quick.dfm_rigid_get_state)

    @property
    def position(self) -> np.ndarray:
        """Center of mass, [3] m."""
        return np.array(self._state().position)

    @property
    def rotation(self) -> np.ndarray:
        """Quaternion x, y, z, w."""
        return np.array(self._state().rotation)

    @property
    def velocity(self) -> np.ndarray:
        """Of the center of mass, [3] m/s."""
        return np.array(self._state().velocity)

    @property
    def spin(self) -> np.ndarray:
        """[3] rad/s."""
        return np.array(self._state().spin)

    def set_state(self, position: Any = None, rotation: Any = None, velocity: Any = None,
                  spin: Any = None) -> None:
        """Puts it somewhere, at once; what is not given stays."""
        state = self._state()
        for name, value in (("position", position), ("rotation", rotation), ("velocity", velocity),
                            ("spin", spin)):
            if value is not None:
                setattr(state, name, vector(value, name, 4 if name == "rotation" else 3))
        check(quick.dfm_rigid_set_state(self.handle, ctypes.byref(state)))

    def joint(self, number: int = 0) -> tuple[float, float, float]:
        """Of a hinge or slider of its set: position (rad or m since creation), rate (rad/s or m/s), and the
        motor's effort (N m or N)."""
        out = [ctypes.c_double() for _ in range(3)]
        self._ask(quick.dfm_rigid_joint, whole(number, "number"), *map(ctypes.byref, out))
        return out[0].value, out[1].value, out[2].value

    def set_motor(self, velocity: float, max: float, number: int = 0) -> None:
        """Motor of a joint of its set: rad/s and N m, or m/s and N; max 0: off."""
        self._ask(quick.dfm_rigid_set_motor, whole(number, "number"), real(velocity, "velocity"),
                  real(max, "max"))

    @property
    def measure(self) -> Any:
        """Sums as a record, a view, as Body.measure: mass kg, com [3] m, velocity [3] m/s, momentum, angular,
        kinetic J, volume m3, speed_max m/s; elastic is 0."""
        return self._look("measure", lambda: Report(quick.dfm_rigid_get_measure, self.handle,
                                                    _abi.dfm_body_measure))

    @property
    def wrench(self) -> tuple[np.ndarray, np.ndarray]:
        """Of contact in the last sub-step, means: force [3] N, moment [3] N m about the center of mass."""
        return self._wrench(quick.dfm_rigid_contact_wrench)

    def remove(self) -> None:
        """Takes the whole set that it came with out of the world."""
        self.world.call(lib.dfm_rigid_destroy, self.handle)

"""Questions about present positions, functions that decide about contacts, and export, as a base of World."""
from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Callable, Iterable

import numpy as np

from . import _abi
from ._context import Asked, choice
from ._library import ArgumentError, StateError, check, default, encoded, lib, quick
from ._values import pose_of, real, vector, whole
from .body import EVERYTHING, Body, Obstacle
from .mesh import points_of

if TYPE_CHECKING:
    from .world import World

KINDS = {"bodies": _abi.DFM_QUERY_BODIES, "obstacles": _abi.DFM_QUERY_OBSTACLES,
         "rigids": _abi.DFM_QUERY_RIGIDS, "sensors": _abi.DFM_QUERY_SENSORS}
_AcceptFn = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p, ctypes.c_uint64)
_MayTouchFn = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint64)
_PreSolveFn = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
_NoteFn = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p)


class Shape:
    """A convex shape that a query asks with. Made by Shape.point, .sphere, .box, .capsule and .hull.

    position: [3] m; rotation: [4], a quaternion x, y, z, w. Sizes may be zero: a sphere of radius 0 is a
    point.
    """

    def __init__(self, kind: int, position: Any, rotation: Any):
        self.struct = default(_abi.dfm_query_shape)
        self.struct.shape = kind
        self.struct.pose = pose_of(position, rotation)
        self._points: np.ndarray | None = None

    @classmethod
    def point(cls, position: Any = (0, 0, 0)) -> Shape:
        """To which surfaces alone count, and not what encloses it: a ray, or the closest point."""
        return cls(_abi.DFM_SHAPE_POINT, position, (0, 0, 0, 1))

    @classmethod
    def sphere(cls, radius: float = 0, position: Any = (0, 0, 0)) -> Shape:
        """radius: m."""
        out = cls(_abi.DFM_SHAPE_SPHERE, position, (0, 0, 0, 1))
        out.struct.radius = real(radius, "radius")
        return out

    @classmethod
    def box(cls, half_size: Any, position: Any = (0, 0, 0), rotation: Any = (0, 0, 0, 1), *,
            radius: float = 0) -> Shape:
        """half_size: [3] m. radius: m by which the shape reaches beyond the box, and which rounds it."""
        out = cls(_abi.DFM_SHAPE_BOX, position, rotation)
        out.struct.half_size, out.struct.radius = vector(half_size, "half_size"), real(radius, "radius")
        return out

    @classmethod
    def capsule(cls, radius: float, half_length: float, position: Any = (0, 0, 0),
                rotation: Any = (0, 0, 0, 1)) -> Shape:
        """radius: m; half_length: m, half of the axis between the centers of its caps, along z."""
        out = cls(_abi.DFM_SHAPE_CAPSULE, position, rotation)
        out.struct.radius = real(radius, "radius")
        out.struct.half_length = real(half_length, "half_length")
        return out

    @classmethod
    def hull(cls, points: Any, position: Any = (0, 0, 0), rotation: Any = (0, 0, 0, 1), *,
             radius: float = 0) -> Shape:
        """The convex hull of points [n,3] m. radius: m by which the shape reaches beyond them."""
        out = cls(_abi.DFM_SHAPE_CONVEX, position, rotation)
        out._points = points_of(points)
        out.struct.npoint, out.struct.points = len(out._points), out._points.ctypes.data
        out.struct.radius = real(radius, "radius")
        return out


@dataclass(frozen=True)
class Hit:
    """What a query has met. owner: Body, Obstacle or Rigid. triangle: of its surface, None of a shape in
    closed form. distance: m, along the ray or the path, or to the closest point. point: [3] m, on the owner.
    normal: [3], outward from the surface; of a cast from the owner to the shape. inside: of a cast, the shape
    overlaps the owner where it starts."""

    owner: Body | Obstacle
    triangle: int | None
    distance: float
    point: np.ndarray
    normal: np.ndarray
    inside: bool = False


class _Ended:
    """Stands for the library's memory once the call of it is over."""

    def __getattr__(self, _key: str) -> Any:
        raise StateError("a ContactChoice is valid only during the call that gets it; keep the values that "
                         "you need", "DFM_E_STATE")

    def __setattr__(self, key: str, _value: Any) -> None:
        getattr(self, key)


class ContactChoice:
    """A contact that is about to be solved; valid during the call of the function that gets it.

    a, b: the two, of which a is a Body; time, dt: s, start of the sub-step and its length; gap: m, distance
    of the surfaces less the rest distance; touched: it carried load, or was not yet apart, at the end of the
    last sub-step; key: the same for as long as the contact lasts. To be changed: enabled, friction_scale (the
    coefficient of friction times this), law (number of the friction law), surface_velocity.
    """

    __slots__ = ("_of", "_world")

    def __init__(self, world: Queries, of: Any):
        self._world, self._of = world, of

    @property
    def a(self) -> Body | Obstacle:
        """The body that the normal points to."""
        return self._world._thing(self._of.a)

    @property
    def b(self) -> Body | Obstacle:
        """What it touches."""
        return self._world._thing(self._of.b)

    @property
    def key(self) -> int:
        """The same for as long as the contact lasts."""
        return self._of.key

    @property
    def substep(self) -> int:
        """Solves since the world was created, as a number of the sub-step."""
        return self._of.substep

    @property
    def time(self) -> float:
        """s, start of the sub-step."""
        return self._of.time

    @property
    def dt(self) -> float:
        """s, length of the sub-step."""
        return self._of.dt

    @property
    def gap(self) -> float:
        """m, distance of the surfaces less the rest distance."""
        return self._of.gap

    @property
    def touched(self) -> bool:
        """It carried load, or was not yet apart, at the end of the last sub-step."""
        return bool(self._of.flags & _abi.DFM_CHOICE_TOUCHED)

    @property
    def point(self) -> np.ndarray:
        """[3] m."""
        return np.array(self._of.point)

    @property
    def normal(self) -> np.ndarray:
        """[3], unit, from b to a."""
        return np.array(self._of.normal)

    @property
    def velocity(self) -> np.ndarray:
        """[3] m/s, of a against b over the sub-step if nothing touched."""
        return np.array(self._of.velocity)

    @property
    def enabled(self) -> bool:
        """False: it pushes nothing in this sub-step."""
        return bool(self._of.enabled)

    @enabled.setter
    def enabled(self, value: bool) -> None:
        self._of.enabled = bool(value)

    @property
    def friction_scale(self) -> float:
        return self._of.friction_scale

    @friction_scale.setter
    def friction_scale(self, value: float) -> None:
        self._of.friction_scale = real(value, "friction_scale")

    @property
    def law(self) -> int:
        return self._of.law

    @law.setter
    def law(self, value: int) -> None:
        self._of.law = whole(value, "law")

    @property
    def surface_velocity(self) -> np.ndarray:
        """[3] m/s: how b's surface moves along itself, beside its motion."""
        return np.array(self._of.surface_velocity)

    @surface_velocity.setter
    def surface_velocity(self, value: Any) -> None:
        self._of.surface_velocity = vector(value, "surface_velocity")


class Filter:
    """Which things a query looks at. kinds: of "bodies", "obstacles", "rigids" and "sensors". category,
    collides_with: masks of the query, as two bodies collide. accept: called with each Body, Obstacle or Rigid
    that these let pass; those for which it returns False are passed by. It must not change the world."""

    def __init__(self, kinds: Iterable[str] = ("bodies", "obstacles", "rigids"), *,
                 category: int = EVERYTHING, collides_with: int = EVERYTHING,
                 accept: Callable[[Any], bool] | None = None):
        if isinstance(kinds, str):
            kinds = [kinds]
        self.struct = default(_abi.dfm_query_filter)
        self.struct.what = 0
        for kind in kinds:
            self.struct.what |= KINDS[choice("kind", kind, KINDS)]
        self.struct.category = whole(category, "category")
        self.struct.collides_with = whole(collides_with, "collides_with")
        self.accept = accept


class _Query:
    """A filter during one query: its function with handles in place of objects, and what that has raised."""

    def __init__(self, world: Queries, given: Filter | None):
        self.raised: BaseException | None = None
        self.at: Any = None
        if given is None:
            return
        if not isinstance(given, Filter):
            raise TypeError(f"a filter is a deform.Filter, not {given!r}")
        self._struct = _abi.dfm_query_filter.from_buffer_copy(given.struct)
        accept: Callable[[Any], bool] | None = given.accept
        if accept is not None:
            function: Callable[[Any], bool] = accept
            answers: dict[int, bool] = {}  # a query for more hits asks no thing again

            def call_host(_user: int, handle: int) -> bool:
                if self.raised is not None:
                    return False
                try:
                    if handle not in answers:
                        answers[handle] = bool(function(world.owner(handle)))
                    return answers[handle]
                except BaseException as error_:  # nothing may pass through the library's frames
                    self.raised = error_
                    return False
            self._accept = _AcceptFn(call_host)
            self._struct.accept = ctypes.cast(self._accept, ctypes.c_void_p).value
        self.at = ctypes.byref(self._struct)

    def done(self, status: int) -> None:
        if self.raised is not None:
            raise self.raised
        check(status)


class Queries(Asked):
    """What World has of deform/query.h, deform/callback.h and dfm_world_write_scene."""

    __slots__ = ("_known", "_raised")

    _busy: int
    _raised: BaseException | None
    _known: dict[int, Any] | None

    def free(self) -> None:
        raise NotImplementedError

    def owner(self, handle: int) -> Body | Obstacle:
        raise NotImplementedError

    # ---- queries ---------------------------------------------------------------------------------------

    def _hit(self, out: Any) -> Hit:
        triangle = None if out.triangle == 0xFFFFFFFF else int(out.triangle)
        return Hit(self.owner(out.thing), triangle, out.distance, np.array(out.point), np.array(out.normal),
                   bool(out.flags & _abi.DFM_QUERY_INSIDE))

    def query(self, shape: Shape, path: Any = None, reach: float = 0, filter: Filter | None = None, *,
              each: bool = False, most: int | None = None) -> list[Hit]:
        """What a shape meets, nearest first (dfm_world_query): on a path [3] m, which it follows without
        turning up to reach m, 0: its length; without a path what is within reach m, 0: what it overlaps.
        A Shape.point meets surfaces alone: on a path it is a ray. each: all triangles of a thing, and where
        a ray leaves it, in place of its nearest hit. most: so many hits at most."""
        self.free()
        query, capacity = _Query(self, filter), 16 if most is None else whole(most, "most")
        if not isinstance(shape, Shape):
            raise TypeError(f"a query asks with a deform.Shape, not {shape!r}")
        struct = _abi.dfm_query_shape.from_buffer_copy(shape.struct)
        struct.flags = ((_abi.DFM_QUERY_EACH if each else 0) |
                        (_abi.DFM_QUERY_COUNT if most is None else 0))
        at, along = ctypes.byref(struct), None if path is None else vector(path, "path")
        while True:
            out = (_abi.dfm_query_hit * capacity)()
            hits = _abi.dfm_query_hits(ctypes.sizeof(_abi.dfm_query_hits), ctypes.sizeof(_abi.dfm_query_hit),
                                       capacity, 0, ctypes.addressof(out))
            query.done(quick.dfm_world_query(self.handle, at, along, real(reach, "reach"), query.at, None,
                                             ctypes.byref(hits)))
            if hits.n <= capacity or most is not None:
                return [self._hit(hit) for hit in out[:hits.n]]
            capacity = hits.n

    def _first(self, *arguments: Any) -> Hit | None:
        return next(iter(self.query(*arguments, most=1)), None)

    def query_ray(self, origin: Any, direction: Any, max_distance: float = np.inf,
                  filter: Filter | None = None) -> Hit | None:
        """The first surface that a ray meets. origin: [3] m; direction: [3], of any length; max_distance: m.
        None: nothing is met."""
        return self._first(Shape.point(vector(origin, "origin")), vector(direction, "direction"),
                           _reach(max_distance), filter)

    def query_ray_all(self, origin: Any, direction: Any, max_distance: float = np.inf,
                      filter: Filter | None = None) -> list[Hit]:
        """All surfaces that a ray enters or leaves, nearest first. A ray through an edge meets the triangles
        on both sides."""
        return self.query(Shape.point(vector(origin, "origin")), vector(direction, "direction"),
                          _reach(max_distance), filter, each=True)

    def query_closest(self, point: Any, max_distance: float = np.inf,
                      filter: Filter | None = None) -> Hit | None:
        """The closest point of all surfaces within max_distance m of a point [3] m, or None."""
        return self._first(Shape.point(vector(point, "point")), None, _reach(max_distance), filter)

    def query_overlap(self, shape: Shape, filter: Filter | None = None) -> list[Body | Obstacle]:
        """Things that a shape touches or holds, or that hold it: bodies, then obstacles and rigid bodies,
        each in order of creation."""
        return [hit.owner for hit in self.query(shape, None, 0, filter)]

    def query_aabb(self, low: Any, high: Any, filter: Filter | None = None) -> list[Body | Obstacle]:
        """The same of the axis-parallel box from low [3] m to high [3] m."""
        low, high = np.array(vector(low, "low")), np.array(vector(high, "high"))
        return self.query_overlap(Shape.box((high - low) / 2, (low + high) / 2), filter)

    def query_cast(self, shape: Shape, path: Any, filter: Filter | None = None) -> Hit | None:
        """The first thing that a shape meets while it moves along a straight path [3] m without turning;
        None: the path is free. A shape that overlaps a thing at the start hits it at distance 0, `inside`."""
        return self._first(shape, vector(path, "path"), 0, filter)

    # ---- functions that decide about contacts ----------------------------------------------------------

    def _thing(self, handle: int) -> Any:
        """The object of a handle within a step, in which pieces and the parts of a tool may be new."""
        assert self._known is not None
        known = self._known.get(handle)
        return self._know(self.owner(handle)) if known is None else known

    def _know(self, thing: Any) -> Any:
        """Keeps what is made while functions decide about contacts, who are called with it."""
        if self._known is not None:
            self._known[thing.handle] = thing
        return thing

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Result of a function of the user; an exception in it ends the step or call, which raises it."""
        if self._raised is None:
            try:
                return function(*arguments)
            except BaseException as raised:  # nothing may pass through the library's frames
                self._raised = raised
                if self._busy:  # else no step would be ended but the next one
                    quick.dfm_world_interrupt(self.handle)
        return None

    def _take_raised(self) -> BaseException | None:
        """What a function has raised. The library keeps what was answered in its place: it asks again."""
        raised, self._raised = self._raised, None
        if raised is not None and self._functions.get("may_touch") is not None:
            check(quick.dfm_world_ask_again(self.handle, 0, 0))
        return raised

    def _decide(self, key: str, setter: Any, call: Any) -> None:
        self._ask(setter, ctypes.cast(call, ctypes.c_void_p) if call else None, None)
        self._functions[key] = call
        if any(f is not None for f in self._functions.values()):
            if self._known is None:
                self._known = {thing.handle: thing for thing in [*self.bodies, *self.obstacles]}
        else:
            self._known = None

    _functions: dict[str, Any]
    bodies: Any
    obstacles: Any

    def set_may_touch(self, function: Callable[[Any, Any], bool] | None) -> None:
        """A function of two things that says whether they may touch; None: none any more.

        It is asked once for each pair that masks and rules let touch, in the thread that steps, and the
        answer is kept until ask_again(). It must not use the world beyond names and `==`. An exception in it
        discards the step, which raises it."""
        def call_host(_user: int, a: int, b: int) -> bool:
            answer = self._call(lambda: bool(function(self._thing(a), self._thing(b))))  # type: ignore[misc]
            return True if answer is None else answer
        self._decide("may_touch", quick.dfm_world_set_may_touch,
                     None if function is None else _MayTouchFn(call_host))

    def ask_again(self, a: Body | Obstacle | None = None, b: Body | Obstacle | None = None) -> None:
        """Discards decisions of the function of set_may_touch: of the pair, of all pairs of a, or all."""
        if a is None and b is not None:
            raise ArgumentError("ask_again takes a, a and b, or neither", "DFM_E_ARG")
        self._ask(quick.dfm_world_ask_again, *(0 if thing is None else thing.handle for thing in (a, b)))

    def set_pre_solve(self, function: Callable[[ContactChoice], None] | None) -> None:
        """A function that gets each contact, a ContactChoice, before it is solved, in every sub-step, and may
        change it; None: none any more.

        A contact may come several times in a sub-step and must be answered alike each time. Contacts in reach
        need not touch yet. The function runs in the thread that steps, with the interpreter's lock, and must
        not use the world. An exception in it discards the step, which raises it."""
        def call_host(_user: int, address: int) -> None:
            choice = ContactChoice(self, _abi.dfm_contact_choice.from_address(address))
            self._call(function, choice)  # type: ignore[arg-type]
            choice._of = _Ended()
        self._decide("pre_solve", quick.dfm_world_set_pre_solve,
                     None if function is None else _PreSolveFn(call_host))

    # ---- export ----------------------------------------------------------------------------------------

    def write_scene(self, path: str | os.PathLike[str], *, duration: float = 1, step: float = 0,
                    snapshot: bool = False, partial: bool = False) -> list[str]:
        """Writes the world as a scene that deform.run, deform.Scene and `deform run` go on with.

        path: a file whose name ends in .json; meshes and states go to the folder STEM_files beside it.
        duration: s, of the scene, from the world's time on. step: s, 0 for the world's own. snapshot: the
        state to the last bit too, as STEM_files/snapshot.state, for `deform run --from`. A world with
        something that a scene cannot say is refused with UnsupportedError; with partial the rest is written.
        Returns a sentence for each thing left out, and for each plugin that a run needs."""
        self.free()
        return write_scene(lib.dfm_world_write_scene, self.handle, path, duration, step, snapshot, partial)


def write_scene(function: Any, handle: int, path: str | os.PathLike[str], duration: float, step: float,
                snapshot: bool, partial: bool) -> list[str]:
    """World.write_scene and Scene.write_scene by a function of the library."""
    sentences: list[str] = []
    note = _NoteFn(lambda _user, sentence: sentences.append(sentence.decode()))
    definition = default(_abi.dfm_scene_write_def)
    definition.duration, definition.step = real(duration, "duration"), real(step, "step")
    definition.flags = ((_abi.DFM_SCENE_SNAPSHOT if snapshot else 0)
                        | (_abi.DFM_SCENE_PARTIAL if partial else 0))
    definition.note = ctypes.cast(note, ctypes.c_void_p).value
    check(function(handle, encoded(path), ctypes.byref(definition), None))
    return sentences


def _reach(max_distance: float) -> float:
    """0 is no distance here, and not the length of the path."""
    return real(max_distance, "max_distance") or -1


def query_triangles(body: Body, shape: Shape) -> np.ndarray:
    """Body.query_triangles."""
    alone = Filter()
    alone.struct.only = body.handle
    hits = body.world.query(shape, None, 0, alone, each=True)
    return np.array([hit.triangle for hit in hits if hit.triangle is not None], dtype=np.uint32)

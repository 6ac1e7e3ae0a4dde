"""Tools: rigid things that a hand or a program moves, that feel what they touch, and that cut."""
from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any, Mapping, Sequence

import numpy as np

from . import _abi
from ._context import Asked, choice
from ._library import ArgumentError, check, default, lib, quick, sized
from ._values import name_or_none, pose_of, real, vector, whole
from .body import EVERYTHING, Body, Obstacle, handle_of, things
from .cut import CUT_WAYS
from .mesh import TriMesh, surface_of

if TYPE_CHECKING:
    from .world import Material, World

TOOL_SHAPES = {"sphere": 0, "capsule": 1, "box": 2, "mesh": 3, "grasper": 4, "scissors": 5, "ellipsoid": 6,
               "blade": 7}


class Tool(Asked):
    """A rigid thing that is moved once per step and feels what it touches. Made by World.add_tool."""

    __slots__ = ("handle", "name", "user", "world")

    def __init__(self, world: World, handle: int, name: str):
        self.user: Any = None
        self.world, self.handle, self.name = world, handle, name

    def _free(self) -> None:
        self.world.free()

    def __repr__(self) -> str:
        return f"<deform.Tool '{self.name}'>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Tool) and other.handle == self.handle

    def __hash__(self) -> int:
        return hash(self.handle)

    def set_pose(self, position: Any, rotation: Any = (0, 0, 0, 1), velocity: Any = None) -> None:
        """Where it is at the end of the next step: position [3] m, rotation a quaternion x, y, z, w.

        velocity: [6] m/s and rad/s then, as the device of a coupled tool measures it; None: that of the way
        there. A coupled tool follows by its spring."""
        speed = None if velocity is None else vector(velocity, "velocity", 6)
        self._ask(quick.dfm_tool_set_pose, ctypes.byref(pose_of(position, rotation)), speed)

    def set_opening(self, angle: float) -> None:
        """Angle between the jaws at the end of the next step, rad, 0 to 3."""
        self._ask(quick.dfm_tool_set_opening, real(angle, "angle"))

    def teleport(self, position: Any, rotation: Any = (0, 0, 0, 1)) -> None:
        """Puts it there at once, at rest, without a motion."""
        self._ask(quick.dfm_tool_teleport, ctypes.byref(pose_of(position, rotation)))

    def keys_at(self, t: float) -> tuple[np.ndarray, np.ndarray, float]:
        """Where its keys, of a scene, want it at t s, whether it follows them or not: position [3] m,
        rotation (a quaternion x, y, z, w) and opening rad. ArgumentError of a tool without keys."""
        pose, opening = _abi.dfm_pose(), ctypes.c_double()
        self._ask(quick.dfm_tool_keys_at, real(t, "t"), ctypes.byref(pose), ctypes.byref(opening))
        return np.array(pose.position), np.array(pose.rotation), opening.value

    def follow_keys(self) -> None:
        """Its keys, of a scene, lead it again from the next step on, after set_pose and set_opening; far from
        where they want it (keys_at), bring it near first."""
        self._ask(quick.dfm_tool_follow_keys)

    @property
    def force(self) -> tuple[np.ndarray, np.ndarray]:
        """What the world did to it in the last step: force [3] N and torque [3] N m about its origin, means
        over the step, in the tool's frame."""
        return self._wrench(quick.dfm_tool_force)

    @property
    def feedback(self) -> tuple[np.ndarray, np.ndarray]:
        """What a device has to put on the hand: force [3] N and torque [3] N m, in the device's frame."""
        return self._wrench(quick.dfm_tool_feedback)

    @property
    def state(self) -> _abi.dfm_tool_state:
        """As the C struct: pose and device (position [3] m, rotation x, y, z, w), velocity [3] m/s, spin [3]
        rad/s, opening rad, work and port_work J."""
        return self._answer(_abi.dfm_tool_state, quick.dfm_tool_get_state)

    @property
    def position(self) -> np.ndarray:
        """Of the tool now, [3] m."""
        return np.array(self.state.pose.position)

    @property
    def rotation(self) -> np.ndarray:
        """Of the tool now, a quaternion x, y, z, w."""
        return np.array(self.state.pose.rotation)

    @property
    def opening(self) -> float:
        """Angle between the jaws now, rad."""
        return float(self.state.opening)

    @property
    def parts(self) -> list[Obstacle]:
        """Its rigid bodies: frame or shaft, then the left and the right jaw."""
        return things(self, Obstacle, quick.dfm_tool_parts)

    def grab(self, body: Body, reach: float = 0, release: float = 0) -> list[int]:
        """Attaches what it touches, or what is nearer than `reach` (m), to its parts.

        release: N, a larger force ends the attachment; 0: none does. Returns numbers of the attachments, for
        Body.attachment and Body.detach; none where nothing is in reach."""
        out, n = (ctypes.c_uint32 * 3)(), ctypes.c_uint32()
        self._ask(quick.dfm_tool_grab, handle_of(body, Body, "grab needs a body"), real(reach, "reach"),
                  real(release, "release"), 3, out, ctypes.byref(n))
        return list(out[:n.value])

    def set_cuts(self, bodies: Sequence[Body], how: str | None = None, most: int = 0) -> None:
        """From now on it cuts these bodies where it meets them, and does not touch them; [] ends it.

        how: "split" opens faces along the edge, of a blade or scissors; "remove" takes the cells that it
        meets; None: "split" where there is an edge. most: faces or cells of one body in one step, 0: no
        limit. World.events tells of each cut (kind 7)."""
        if isinstance(bodies, Body):
            bodies = [bodies]
        if how is None:
            shape = self._answer(_abi.dfm_tool_def, quick.dfm_tool_get_def).shape
            how = "split" if shape in (TOOL_SHAPES["blade"], TOOL_SHAPES["scissors"]) else "remove"
        expected = "set_cuts needs a list of bodies"
        if isinstance(bodies, str):
            raise ArgumentError(f"{expected}, not {bodies!r}", "DFM_E_ARG")
        given = [handle_of(body, Body, expected) for body in bodies]
        handles = (ctypes.c_uint64 * max(len(given), 1))(*given)
        self.world.call(lib.dfm_tool_set_cuts, self.handle, CUT_WAYS[choice("how", how, CUT_WAYS)],
                        whole(most, "most"), len(given), ctypes.byref(handles))

    @property
    def cuts(self) -> list[Body]:
        """The bodies that it cuts."""
        return things(self, Body, quick.dfm_tool_cuts, None, None)

    def remove(self) -> None:
        """Takes it out of its world with its parts; contacts and attachments end."""
        self.world.call(lib.dfm_tool_destroy, self.handle)


class Tools:
    """The part of World that has tools."""

    __slots__ = ()

    def add_tool(self: Any, shape: str = "sphere", *, name: str | None = None,
                 position: Sequence[float] = (0, 0, 0), rotation: Sequence[float] = (0, 0, 0, 1),
                 radius: float | None = None, half_size: Sequence[float] = (0, 0, 0), half_length: float = 0,
                 mesh: TriMesh | None = None, opening: float = 0, stiffness: float = 0, damping: float = 0,
                 turn_stiffness: float = 0, turn_damping: float = 0, mass: float = 0.05,
                 inertia: float = 1e-5, late: float = 0, passive: bool = False,
                 material: Material | Mapping[str, Any] | None = None, category: int = 1,
                 collides_with: int = EVERYTHING) -> Tool:
        """A "sphere" (radius, 5 mm if it is not given), "capsule" (radius, half_length, along z), "box" or
        "ellipsoid" (half_size [3]), "mesh", "blade" (half_size [3]: x its thickness, its edge along y at
        -z), "grasper" or "scissors" (half_size [3] of one jaw, opening rad; radius and half_length of a
        shaft, which has none by default). m.

        stiffness N/m, damping N s/m, turn_stiffness N m/rad, turn_damping N m s/rad: of a spring and damper
        between the pose that is set and the tool, which then has a mass (kg) and an inertia (kg m2); 0: it
        goes where it is put. late: s, how much later the device is; passive: a controller bounds what the
        hand gets."""
        definition = default(_abi.dfm_tool_def)
        definition.shape = TOOL_SHAPES[choice("shape", shape, TOOL_SHAPES)]
        definition.name = name_or_none(name)
        definition.pose = pose_of(position, rotation)
        definition.half_size = vector(half_size, "half_size")
        if radius is None:  # the library's default is for shapes that have one; a shaft is only on request
            radius = definition.radius if shape in ("sphere", "capsule") else 0
        for key, value in (("radius", radius), ("half_length", half_length), ("opening", opening),
                           ("stiffness", stiffness), ("damping", damping), ("turn_stiffness", turn_stiffness),
                           ("turn_damping", turn_damping), ("mass", mass), ("inertia", inertia),
                           ("late", late)):
            setattr(definition, key, real(value, key))
        definition.flags = _abi.DFM_TOOL_PASSIVE if passive else 0
        definition.material = self._material(material)
        definition.category = whole(category, "category")
        definition.collides_with = whole(collides_with, "collides_with")
        if (shape == "mesh") != (mesh is not None):
            raise ArgumentError('a tool of the shape "mesh" needs a mesh, and no other tool has one',
                                "DFM_E_ARG")
        if mesh is not None:
            mesh = surface_of(mesh, "the mesh of a tool")
            points, triangles = mesh.points, mesh.triangles
            definition.npoint, definition.ntriangle = len(points), len(triangles)
            definition.points, definition.triangles = points.ctypes.data, triangles.ctypes.data
        return self._tool(self._created(lib.dfm_tool_create, definition))

    def _tool(self: Any, handle: int) -> Tool:
        out = sized(_abi.dfm_tool_def)
        check(quick.dfm_tool_get_def(handle, ctypes.byref(out)))
        return Tool(self, handle, (out.name or b"").decode())

    @property
    def tools(self: Any) -> list[Tool]:
        """In order of creation."""
        return [self._tool(h) for h in self._listed(quick.dfm_world_tools)]

    def find_tool(self: Any, name: str) -> Tool:
        """The tool of that name; ArgumentError names the nearest one."""
        return self._tool(self._found(quick.dfm_world_find_tool, name))

"""Materials, and the definitions of rigid bodies and joints that make a set of them."""
from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Mapping, Sequence

from . import _abi
from ._context import word
from ._library import OfThisProcess, default, sized
from ._values import name_or_none, pose_of, real, vector, whole

if TYPE_CHECKING:
    from .world import World

SHAPES = {"plane": 0, "sphere": 1, "box": 2, "capsule": 3, "mesh": 4, "voxels": 5}
JOINTS = {"hinge": 0, "slider": 1, "ball": 2, "fixed": 3}
MATERIAL = "a material is made by add_material, or given as a dict of its entries, as {'young': 2e5}"


class Material(OfThisProcess):
    """A named parameter set of a world. Made by World.add_material."""

    __slots__ = ("handle", "name", "world")
    _instead = "give its entries, a dict"

    def __init__(self, world: World, handle: int, name: str | None):
        self.world, self.handle, self.name = world, handle, name


@dataclass
class RigidDef:
    """A rigid "sphere" (radius), "box" (half_size [3]) or "capsule" (radius, half_length, along z), m; mass
    kg; inertia [3] kg m2 (all zero: solid); position [3] m, rotation [4] (x, y, z, w), velocity [3] m/s,
    spin [3] rad/s. fixed: it never moves."""

    shape: str = "sphere"
    mass: float = 1.0
    name: str | None = None
    position: Sequence[float] = (0, 0, 0)
    rotation: Sequence[float] = (0, 0, 0, 1)
    radius: float = 0.5
    half_size: Sequence[float] = (0, 0, 0)
    half_length: float = 0
    inertia: Sequence[float] = (0, 0, 0)
    velocity: Sequence[float] = (0, 0, 0)
    spin: Sequence[float] = (0, 0, 0)
    material: Material | Mapping[str, Any] | None = None
    fixed: bool = False

    def struct(self, world: World) -> _abi.dfm_rigid_def:
        out = default(_abi.dfm_rigid_def)
        out.shape = word("shape", self.shape, {k: SHAPES[k] for k in ("sphere", "box", "capsule")})
        out.name, out.fixed = name_or_none(self.name), self.fixed
        out.pose = pose_of(self.position, self.rotation)
        for key in ("mass", "radius", "half_length"):
            setattr(out, key, real(getattr(self, key), key))
        for key in ("half_size", "inertia", "velocity", "spin"):
            setattr(out, key, vector(getattr(self, key), key))
        out.material = world._material(self.material)
        return out


@dataclass
class JointDef:
    """A "hinge", "slider", "ball" or "fixed" joint of body number `body` of a set with number `to`, or with
    the world (None). anchor [3] m and axis [3], world frame. motor: (velocity rad/s or m/s, max N m or N),
    of hinge and slider."""

    type: str
    body: int
    to: int | None = None
    anchor: Sequence[float] = (0, 0, 0)
    axis: Sequence[float] = (0, 0, 1)
    motor: tuple[float, float] | None = None

    def struct(self) -> _abi.dfm_joint_def:
        out = sized(_abi.dfm_joint_def)
        out.type, out.body = word("joint", self.type, JOINTS), whole(self.body, "body")
        setattr(out, "with", 0xFFFFFFFF if self.to is None else whole(self.to, "to"))
        out.anchor, out.axis = vector(self.anchor, "anchor"), vector(self.axis, "axis")
        if self.motor is not None:
            out.motor, (out.velocity, out.max) = 1, vector(self.motor, "motor", 2)
        return out

"""Worlds: bodies and obstacles, friction between them, steps, and what a step did."""
from __future__ import annotations

import contextlib
import ctypes
import difflib
import enum
import logging
import weakref
from threading import get_ident
from typing import Any, Iterable, Iterator, Mapping, Sequence

import numpy as np

from . import _abi
from ._arrays import Report, Rows
from ._context import Context, Params, default_context, strings, word
from ._library import ArgumentError, BusyError, OfThisProcess, check, default, encoded, lib, quick, sized
from ._signals import watch
from ._values import array_of, name_or_none, pose_of, real, text, vector, whole
from .body import EVERYTHING, Body, Obstacle, Rigid, handle_of, held_bits, vector_keys
from .mesh import TetMesh, TriMesh, cells_of, points_of, surface_of
from .picture import Shown, Upright
from .query import Queries
from .rigid_set import MATERIAL, SHAPES, JointDef, Material, RigidDef
from .report import Reports
from .tool import Tools

_LOG = logging.getLogger("deform")
INTEGRATORS = {"auto": 0, "symplectic_euler": 1, "implicit_euler": 2, "tr_bdf2": 3}
SELF_CONTACT = {"off": 0, "on": 1, "auto": 2}
COUPLINGS = {"barycentric": 0, "mls": 1}
MATERIAL_MEMBERS = {"density", "young", "poisson", "damping_mass", "damping_stiffness"}
MATERIAL_ENTRIES = {"friction", "tear", "fracture_energy"}  # further ones are parameters of models


class Trouble(enum.IntFlag):
    """Bits that a step returns; none: no trouble. Remedies: libdeform/doc and deform/world.h."""

    SUBSTEPS = _abi.DFM_TROUBLE_SUBSTEPS
    UNCONVERGED = _abi.DFM_TROUBLE_UNCONVERGED
    NONFINITE = _abi.DFM_TROUBLE_NONFINITE
    INVERTED = _abi.DFM_TROUBLE_INVERTED
    PLUGIN = _abi.DFM_TROUBLE_PLUGIN
    OVERLAP = _abi.DFM_TROUBLE_OVERLAP
    ENERGY = _abi.DFM_TROUBLE_ENERGY
    BUDGET = _abi.DFM_TROUBLE_BUDGET
    INTERRUPTED = _abi.DFM_TROUBLE_INTERRUPTED


def _side(given: Any) -> bytes:
    """A side of a rule: its text, or the name of the thing."""
    if isinstance(given, Material) and given.name is None:
        raise ArgumentError("a material needs a name to be a side of a rule; give it one in add_material",
                            "DFM_E_ARG")
    name = f"material={given.name}" if isinstance(given, Material) else getattr(given, "name", given)
    if not isinstance(name, str):
        raise ArgumentError("a side of a rule is a body, an obstacle, a tool, a material, or a text, not "
                            f"{given!r}", "DFM_E_ARG")
    return text(name, "a side of a rule")


def _scaled(points: np.ndarray, scale: float) -> np.ndarray:
    scale = real(scale, "scale")
    if not (np.isfinite(scale) and scale > 0):
        raise ArgumentError(f"scale is {scale}; expected a finite number above 0", "DFM_E_ARG")
    return points if scale == 1 else np.ascontiguousarray(points * scale)


def _turn(normal: Any) -> list[float]:
    """The quaternion that turns z to the normal."""
    n = array_of(normal, "normal", "3 numbers")
    length = float(np.linalg.norm(n))
    if n.shape != (3,) or not length > 0:
        raise ArgumentError("normal needs three numbers that are not all zero", "DFM_E_ARG")
    x, y, z = n / length
    if z < -1 + 1e-12:
        return [1.0, 0.0, 0.0, 0.0]
    w = np.sqrt((1 + z) / 2)
    return [-y / (2 * w), x / (2 * w), 0.0, w]


def _destroy(handle: int, _keep: Any) -> None:
    quick.dfm_world_destroy(handle)


_NO_TROUBLE = Trouble(0)
_step = lib.dfm_world_step


class World(Queries, Reports, Tools, OfThisProcess):
    """A world of soft bodies: build it, step it, look at it. SI units.

        with deform.World() as world:
            world.add_obstacle("plane")
            ball = world.add_body(deform.TetMesh.ball(0.1, cells=500), position=(0, 0, 0.15))
            for _ in range(500):
                world.step(1e-3)
            print(world.contacts["fn"].sum(), "N")

    gravity: [3] m/s2. integrator: "auto", "symplectic_euler", "implicit_euler", "tr_bdf2"; step: s, how long
    steps are to be, for "auto" to choose by. sleep: islands at rest sleep. self_contact: "off", "on",
    "auto". effects: names that select what is simulated, None: what parameters call for. contact_offset: m,
    rest distance of surfaces, 0: from the meshes. energy_watch: a step stops if a body has gained this share
    of its energy without a cause, 0: never. recovery_speed: m/s at which penetrating surfaces separate, 0: a
    tenth of the rest distance in a sub-step. obstacle_speed: m/s, a step in which an obstacle would move
    faster is refused, 0: 200. threads: on which a step may run. context: loaded plugins to share; by default
    one for all worlds of one thread.

    A world may be stepped in any thread, one at a time; two worlds step at once in two threads, since a step
    releases the interpreter's lock. At the end of a `with` block, or by close(), the world is gone: its
    arrays keep their last values, and everything else raises HandleError.
    """

    __slots__ = ("__weakref__", "_stop", "_bits", "_bits_at", "_bodies", "_busy", "_finalize", "_functions",
                 "_lists", "_owner", "_streamed", "context", "handle", "shown", "user")
    _finalize: Any
    _instead = ("World.snapshot() gives bytes, which restore() of a world with the same contents takes, and "
                "World.write_scene a file")

    def __init__(self, gravity: Sequence[float] = (0, 0, -9.81), *, integrator: str = "auto",
                 step: float = 0, sleep: bool = False, self_contact: str = "off",
                 effects: Iterable[str] | None = None, contact_offset: float = 0, max_substeps: int = 10000,
                 max_sweeps: int = 200, max_time: float = 0, untangle: bool = False,
                 solver: str | None = None, energy_watch: float = 0.01, recovery_speed: float = 0,
                 obstacle_speed: float = 0, threads: int = 1, context: Context | None = None):
        if context is None:
            threads = whole(threads, "threads")
            context = default_context() if threads == 1 else Context(threads)
        definition = default(_abi.dfm_world_def)
        definition.gravity = vector(gravity, "gravity")
        definition.integrator = word("integrator", integrator, INTEGRATORS)
        definition.step, definition.sleep = real(step, "step"), bool(sleep)
        definition.self_contact = word("self_contact", self_contact, SELF_CONTACT)
        words = None if effects is None else strings(effects)
        definition.effects = None if words is None else ctypes.addressof(words)
        definition.contact_offset = real(contact_offset, "contact_offset")
        definition.max_substeps = whole(max_substeps, "max_substeps")
        definition.max_sweeps = whole(max_sweeps, "max_sweeps")
        definition.max_time = real(max_time, "max_time")
        definition.energy_watch = real(energy_watch, "energy_watch")
        definition.recovery_speed = real(recovery_speed, "recovery_speed")
        definition.obstacle_speed = real(obstacle_speed, "obstacle_speed")
        definition.flags = _abi.DFM_WORLD_UNTANGLE if untangle else 0
        definition.solver = encoded(solver)
        out = ctypes.c_uint64()
        check(lib.dfm_world_create(context.address, ctypes.byref(definition), ctypes.byref(out)))
        self._begin(context, out.value)
        self.shown.upright = Upright(0, gravity)
        self._finalize = weakref.finalize(self, _destroy, out.value, context)

    def _begin(self, context: Context, handle: int, owner: Any = None) -> None:
        self._finalize = None
        self.context, self.handle = context, handle
        self._owner = owner
        self.user: Any = None
        self.shown = Shown()
        self._busy = 0  # the thread that is inside a call
        self._streamed = 64  # bytes, more than a stream has had
        self._stop = False  # to stop, by a signal
        self._bits = ctypes.c_uint32(0)
        self._bits_at = ctypes.byref(self._bits)
        self._lists: dict[str, Any] = {}
        self._bodies: weakref.WeakValueDictionary[int, Body] = weakref.WeakValueDictionary()
        self._raised = None  # by a function that decides about contacts
        self._known = None  # objects by handle, while there is such a function
        self._functions = {}
        watch(self)

    @classmethod
    def of_scene(cls, context: Context, handle: int, owner: Any) -> World:
        """The world of a scene, which owns it."""
        world = cls.__new__(cls)
        world._begin(context, handle, owner)
        return world

    # ---- life ------------------------------------------------------------------------------------------

    def close(self) -> None:
        """Destroys the world with all that is in it. Twice is allowed."""
        self.free()
        if self._owner is not None:
            self._owner.close()
        elif self._finalize is not None:
            self._finalize()

    @property
    def closed(self) -> bool:
        """Whether the world is gone: close() was called, or a `with` has ended."""
        return quick.dfm_handle_kind(self.handle) != _abi.DFM_HANDLE_WORLD

    def __enter__(self) -> World:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        if self.closed:
            return "<deform.World, closed>"
        return f"<deform.World: {len(self.bodies)} bodies, t = {self.time:.6g} s>"

    def free(self) -> None:
        """Raises BusyError while another thread is inside a step, and in a callback of a step."""
        if self._busy == get_ident():
            raise BusyError("the world is inside a step, and this is a callback of that step, which can use "
                            "only what it is given; look after the step", "DFM_E_BUSY")
        if self._busy:
            raise BusyError("the world is inside a step of another thread; look when that has returned",
                            "DFM_E_BUSY")

    _free = free

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """For calls that release the interpreter's lock while they change the world."""
        self.free()
        self._busy = get_ident()
        try:
            yield
        finally:
            self._busy = 0

    def call(self, function: Any, *arguments: Any) -> None:
        """Such a call; raises what its status means."""
        with self.alone():
            status = function(*arguments)
        if status < 0:
            raise self.context.failed(status)

    def _created(self, function: Any, definition: Any) -> int:
        """The handle of what a function of the library makes in this world."""
        out = ctypes.c_uint64()
        self.call(function, self.handle, ctypes.byref(definition), ctypes.byref(out))
        return out.value

    def accept(self, status: int, by_law: BaseException | None = None) -> int:
        """Raises what a status means, a discarded call included; by_law: what a Python law has raised, if it
        was asked already."""
        if status == _abi.DFM_OK and (by_law is None or isinstance(by_law, Exception)):
            return status
        raised = self.context.failed(status, raised=by_law)
        own = self._take_raised()
        if own is not None:
            raise own
        if status == _abi.DFM_DISCARD:
            raised.trouble = Trouble(self._bits.value)  # type: ignore[attr-defined]
        raise raised

    # ---- contents --------------------------------------------------------------------------------------

    def add_material(self, name: str | None = None, *, density: float = 1000, young: float = 1e5,
                     poisson: float = 0.3, damping_mass: float = 0, damping_stiffness: float = 0,
                     **extra: float) -> Material:
        """density kg/m3, young Pa, poisson 1, damping_mass 1/s, damping_stiffness s; `extra`: further
        entries that models take by key, and friction=..., the coefficient where no rule names the pair."""
        definition = default(_abi.dfm_material_def)
        self._check_entries(extra)
        values = Params(extra)
        definition.name = name_or_none(name)
        for key, value in (("density", density), ("young", young), ("poisson", poisson),
                           ("damping_mass", damping_mass), ("damping_stiffness", damping_stiffness)):
            setattr(definition, key, real(value, f"{key} of a material"))
        definition.extra = values.struct
        out = ctypes.c_uint64()
        self.call(lib.dfm_material_create, self.handle, ctypes.byref(definition), ctypes.byref(out))
        self.shown.softest = min(self.shown.softest, definition.young)
        return Material(self, out.value, name)

    def _material(self, material: Material | Mapping[str, Any] | None) -> int:
        if material is None:
            return 0
        if isinstance(material, Mapping):
            material = self.add_material(**material)
        return handle_of(material, Material, MATERIAL)

    def _check_entries(self, extra: Mapping[str, Any]) -> None:
        if all(key in MATERIAL_ENTRIES for key in extra):
            return
        known = {p.key for t in self.context.types if t.kind == "model" for p in t.parameters}
        known.update(MATERIAL_ENTRIES)
        for key in extra:
            if key not in known:
                near = difflib.get_close_matches(key, known | MATERIAL_MEMBERS, 1)
                entries = ", ".join(sorted(MATERIAL_MEMBERS | MATERIAL_ENTRIES))
                meant = (f", did you mean '{near[0]}'?" if near else
                         f" ({entries}); load the plugin that has it first")
                raise ArgumentError(f"no loaded model has a parameter '{key}', and it is no entry of a "
                                    f"material{meant}", "DFM_E_ARG")

    def add_body(self, mesh: TetMesh | str | None = None, *, points: Any = None, tets: Any = None,
                 name: str | None = None, model: str | None = None, params: Mapping[str, Any] | None = None,
                 material: Material | Mapping[str, Any] | None = None,
                 position: Sequence[float] = (0, 0, 0), rotation: Sequence[float] = (0, 0, 0, 1),
                 velocity: Sequence[float] = (0, 0, 0), spin: Sequence[float] = (0, 0, 0), fixed: Any = None,
                 surface: TriMesh | str | None = None, coupling: str = "barycentric",
                 fields: Mapping[str, Any] | None = None, integrator: str = "auto", category: int = 1,
                 collides_with: int = EVERYTHING, scale: float = 1, on: Obstacle | None = None,
                 mass_scaling: float = 0, smooth: float = 0) -> Body:
        """A body of a mesh (a TetMesh or the path of its file), or of points [n,3] m and tets [m,4].

        model: "msm" (default for first-order tetrahedra), "corotational_fem" (default for other cells),
        ...; params: of the model, by key. material: of add_material, or its entries as a dict. position [3]
        m, rotation [4] (a quaternion x, y, z, w), velocity [3] m/s, spin [3] rad/s. fixed: [n] True for
        points that are held, or bits 1 x, 2 y, 4 z of components that are; or [n,3] True for these.
        surface: a finer one that hangs on the cells, a TriMesh or the path of its file. fields: model
        parameters that differ by cell, [m] or [m,width] by key. scale: of the points of mesh and surface,
        0.001 where they are in millimeters. on: an obstacle, onto which the body is moved from its position
        along gravity. mass_scaling: share of its mass, at most 0.1, that may be moved to the points that
        bound explicit sub-steps. smooth: degrees; across edges with smaller angles the body touches planes,
        spheres, boxes and capsules as a curved surface.
        """
        if isinstance(mesh, (str, bytes)) or hasattr(mesh, "__fspath__"):
            mesh = TetMesh.read(mesh)
        definition = default(_abi.dfm_body_def)
        keep: list[Any] = [mesh]
        if mesh is not None and not isinstance(mesh, TetMesh):
            raise TypeError(f"a body is made of a deform.TetMesh, of a file, or of points and tets; not "
                            f"{mesh!r}")
        if mesh is not None:
            if points is not None or tets is not None:
                raise ArgumentError("add_body takes a mesh, or points and tets, not both", "DFM_E_ARG")
            points, tets = mesh.points, mesh.tets
            info, groups = mesh.info, mesh.surface_groups()
            definition.cell, definition.cells = info.cell, info.cells
            definition.cell_inside, definition.cell_share = info.inside, info.share
            if groups is not None:
                definition.groups = ctypes.addressof(groups)
            keep.append(groups)
        elif points is None or tets is None:
            raise ArgumentError("add_body needs a mesh, or points and tets", "DFM_E_ARG")
        x, cells = _scaled(points_of(points), scale), cells_of(tets, 4, "tets")
        keep += [x, cells]
        definition.npoint, definition.ntet = len(x), len(cells)
        definition.points, definition.tets = x.ctypes.data, cells.ctypes.data
        usual = "msm" if definition.cell in (0, _abi.DFM_CELL_TET) else "corotational_fem"
        values = self.context.params("model", model or usual, params or {})
        definition.name, definition.model = name_or_none(name), encoded(model)
        definition.model_params = values.struct
        definition.material = self._material(material)
        definition.pose = pose_of(position, rotation)
        definition.velocity, definition.spin = vector(velocity, "velocity"), vector(spin, "spin")
        if fixed is not None:
            held = held_bits(fixed, len(x))
            definition.fixed = held.ctypes.data
            keep.append(held)
        if surface is not None:
            surface = surface_of(surface, "surface")
            hung = _abi.dfm_surface_def(ctypes.sizeof(_abi.dfm_surface_def),
                                        word("coupling", coupling, COUPLINGS))
            sp, st = _scaled(surface.points, scale), surface.triangles
            hung.npoint, hung.ntriangle, hung.points = len(sp), len(st), sp.ctypes.data
            hung.triangles = st.ctypes.data
            definition.surface = ctypes.addressof(hung)
            keep += [hung, sp, st]
        if on is not None:
            from ._place import put_on
            put_on(self, on, x if surface is None else sp, definition.pose)
        rows = (_abi.dfm_cell_field * max(len(fields or {}), 1))()
        for row, (key, given) in zip(rows, (fields or {}).items()):
            field = np.ascontiguousarray(array_of(given, f"field '{key}'", "a number for each cell"))
            if field.size == 0 or field.size % len(cells) != 0:
                raise ArgumentError(f"field '{key}' has the shape {field.shape}; expected ({len(cells)},): a "
                                    "value for each cell", "DFM_E_ARG")
            field = field.reshape(len(cells), -1)
            row.key, row.values, row.width = key.encode(), field.ctypes.data, field.shape[1]
            keep.append(field)
        definition.nfield, definition.fields = len(fields or {}), ctypes.addressof(rows)
        definition.integrator = word("integrator", integrator, INTEGRATORS)
        definition.mass_scaling = real(mass_scaling, "mass_scaling")
        definition.smooth = real(smooth, "smooth")
        definition.category = whole(category, "category")
        definition.collides_with = whole(collides_with, "collides_with")
        return self._know(self._body(self._created(lib.dfm_body_create, definition)))

    def add_obstacle(self, shape: str = "plane", *, name: str | None = None,
                     position: Sequence[float] = (0, 0, 0), rotation: Sequence[float] | None = None,
                     normal: Sequence[float] | None = None, radius: float = 0,
                     half_size: Sequence[float] = (0, 0, 0), half_length: float = 0,
                     mesh: TriMesh | str | None = None, cells: int = 0,
                     velocity_surface: Sequence[float] = (0, 0, 0),
                     material: Material | Mapping[str, Any] | None = None,
                     category: int = 1, collides_with: int = EVERYTHING, scale: float = 1) -> Obstacle:
        """A "plane" (through position, with a normal), "sphere" (radius), "box" (half_size [3]), "capsule"
        (radius, half_length, along z), "mesh" or "voxels" (mesh, a TriMesh or the path of its file, whose
        points times scale are in m). m.
        velocity_surface: of a belt, [3] m/s."""
        definition = default(_abi.dfm_obstacle_def)
        definition.shape = word("shape", shape, SHAPES)
        definition.name = name_or_none(name)
        if rotation is not None and normal is not None:
            raise ArgumentError("an obstacle is turned by rotation or by normal, not by both", "DFM_E_ARG")
        turned = _turn(normal) if normal is not None else rotation if rotation is not None else (0, 0, 0, 1)
        definition.pose = pose_of(position, turned)
        definition.radius = real(radius, "radius")
        definition.half_length = real(half_length, "half_length")
        definition.half_size = vector(half_size, "half_size")
        definition.velocity_surface = vector(velocity_surface, "velocity_surface")
        definition.category = whole(category, "category")
        definition.collides_with = whole(collides_with, "collides_with")
        definition.material, cells = self._material(material), whole(cells, "cells")
        if mesh is None and (scale != 1 or cells != 0):
            raise ArgumentError("scale and cells are of the mesh of an obstacle; give mesh, too", "DFM_E_ARG")
        if mesh is not None:
            mesh = surface_of(mesh, "the mesh of an obstacle")
            p, t = _scaled(mesh.points, scale), mesh.triangles
            definition.npoint, definition.ntriangle = len(p), len(t)
            definition.points, definition.triangles, definition.cells = p.ctypes.data, t.ctypes.data, cells
        return self._know(self._obstacle(self._created(lib.dfm_obstacle_create, definition)))

    def add_rigid(self, shape: str = "sphere", **options: Any) -> Rigid:
        """A rigid body that soft bodies push; options: those of RigidDef."""
        return self.add_rigids([RigidDef(shape, **options)])[0]

    def add_rigids(self, bodies: Sequence[RigidDef], joints: Sequence[JointDef] = (),
                   host: str | None = None) -> list[Rigid]:
        """A set of rigid bodies and the joints between them. host: what moves them; None: the library's own
        solver."""
        rows = (_abi.dfm_rigid_def * max(len(bodies), 1))(*(body.struct(self) for body in bodies))
        links = (_abi.dfm_joint_def * max(len(joints), 1))(*(joint.struct() for joint in joints))
        group = sized(_abi.dfm_rigid_set_def)
        group.nbody, group.bodies = len(bodies), ctypes.addressof(rows)
        group.njoint, group.joints = len(joints), ctypes.addressof(links)
        out = (ctypes.c_uint64 * max(len(bodies), 1))()
        self.call(lib.dfm_rigid_create, self.handle, encoded(host), ctypes.byref(group), ctypes.byref(out))
        return [self._know(self._obstacle(handle)) for handle in out[:len(bodies)]]

    def _obstacle(self, handle: int) -> Obstacle:
        out = sized(_abi.dfm_obstacle_def)
        check(quick.dfm_obstacle_get_def(handle, ctypes.byref(out)))
        kind = Rigid if quick.dfm_handle_kind(handle) == _abi.DFM_HANDLE_RIGID else Obstacle
        return kind(self, handle, (out.name or b"").decode())

    def _body(self, handle: int) -> Body:
        """One object for a body as long as anybody has it, so that its arrays are the same ones."""
        body = self._bodies.get(handle)
        if body is None:
            body = self._bodies[handle] = Body(self, handle)
        return body

    @property
    def bodies(self) -> list[Body]:
        """In order of creation."""
        return [self._body(h) for h in self._listed(quick.dfm_world_bodies)]

    @property
    def rigids(self) -> list[Rigid]:
        """Rigid bodies in order of creation, without the parts of tools."""
        found = [self._obstacle(h) for h in self._listed(quick.dfm_world_rigids)]
        return [rigid for rigid in found if isinstance(rigid, Rigid)]

    @property
    def obstacles(self) -> list[Obstacle]:
        """In order of creation, rigid bodies among them."""
        return [self._obstacle(h) for h in self._listed(quick.dfm_world_obstacles)]

    def _found(self, function: Any, name: str) -> int:
        return int(self._answer(ctypes.c_uint64, function, text(name, "name")).value)

    def find_body(self, name: str) -> Body:
        """The body of that name; ArgumentError names the nearest one."""
        return self._body(self._found(quick.dfm_world_find_body, name))

    def find_obstacle(self, name: str) -> Obstacle:
        """The obstacle or rigid body of that name; ArgumentError names the nearest one."""
        return self._obstacle(self._found(quick.dfm_world_find_obstacle, name))

    def find_rigid(self, name: str) -> Rigid:
        """The rigid body of that name; ArgumentError names the nearest one."""
        return Rigid(self, self._found(quick.dfm_world_find_rigid, name), name)

    def owner(self, handle: int) -> Body | Obstacle:
        """The object of a handle in a report (contacts["body_a"], pairs["b"])."""
        if quick.dfm_handle_kind(int(handle)) == _abi.DFM_HANDLE_BODY:
            return self._body(int(handle))
        return self._obstacle(int(handle))

    # ---- friction --------------------------------------------------------------------------------------

    def add_friction(self, a: Any = "*", b: Any = "*", law: Any = "coulomb",
                     restitution: float | None = None, **params: Any) -> None:
        """A law between two sides: a body, an obstacle, a tool or a material, or a text: "*",
        "material=NAME", the name of a body or an obstacle, or "body:GROUP".

        law: a name, or a deform.PythonLaw; params: of the law, by key ("mu" sets mu_C and mu_S).
        restitution: 0 to 1, the least share of the speed of an impact at which the two leave each other,
        where a sub-step does not resolve it; None: contact adds no speed."""
        name = self.context.use_law(law)
        values = self.context.params("friction", name, params)
        sides = [_side(a), _side(b)]
        definition = sized(_abi.dfm_friction_def)
        between = (ctypes.c_char_p * 2)(*sides)
        definition.between[:] = (ctypes.c_void_p * 2).from_buffer(between)[:]
        definition.law, definition.params = name.encode(), values.struct
        if restitution is not None:
            definition.flags = _abi.DFM_FRICTION_RESTITUTION
            definition.restitution = real(restitution, "restitution")
        self.call(lib.dfm_world_add_friction, self.handle, ctypes.byref(definition))

    def set_friction(self, a: Any, b: Any, **params: Any) -> None:
        """Changes parameters of a rule while the world runs; those that are not given keep their values."""
        values = Params(params)
        self.call(lib.dfm_world_set_friction, self.handle, _side(a), _side(b), ctypes.byref(values.struct))

    def remove_friction(self, a: Any, b: Any) -> None:
        """Takes back what add_friction or set_friction said of the two; less specific rules count again."""
        self.call(lib.dfm_world_remove_friction, self.handle, _side(a), _side(b))

    def filter_pair(self, a: Any, b: Any, collide: bool) -> None:
        """Lets two named sides pass (False) or touch (True)."""
        self.call(lib.dfm_world_filter_pair, self.handle, _side(a), _side(b), collide)

    def remove_filter(self, a: Any, b: Any) -> None:
        """Takes back what filter_pair said of the two."""
        self.call(lib.dfm_world_remove_filter, self.handle, _side(a), _side(b))

    # ---- time ------------------------------------------------------------------------------------------

    def step(self, dt: float) -> Trouble:
        """Advances the world by dt (s). Returns bits of Trouble, none where all is well.

        Raises Diverged where a sub-step could not be taken (the world stays at the last good one) and
        Discarded where the step was given up and nothing has changed. Releases the interpreter's lock.
        Ctrl-C in the main thread ends the step at once: KeyboardInterrupt, and nothing has changed."""
        seconds = dt if type(dt) is float else real(dt, "dt")
        if self._busy:
            self.free()
        if self._raised is not None:  # in a call since then that needs the decisions
            raise self._take_raised()  # type: ignore[misc]
        self._busy = get_ident()
        try:
            status = _step(self.handle, seconds, self._bits_at)
        except BaseException:  # raised by the handler of a signal
            self._by_signal()
            raise
        finally:
            self._busy = 0
        if status or self.context._laws:
            by_law = self.context.raised_by_law(bool(status))
            if status and self._by_signal() and by_law is None:  # by a handler that has not raised
                return self.step(seconds)
            self.accept(status, by_law)
        if self._raised is not None:
            raise self._take_raised()  # type: ignore[misc]
        return Trouble(self._bits.value) if self._bits.value else _NO_TROUBLE

    def _by_signal(self) -> bool:
        """Did a signal end the last step?"""
        ended = self._stop and bool(self._bits.value & _abi.DFM_TROUBLE_INTERRUPTED)
        self._stop = self._stop and not ended
        return ended

    def run(self, duration: float, dt: float | None = None) -> Trouble:
        """Steps until `duration` s have passed, by dt or, where none is given, by the stable step, with a
        warning where that takes more than 100,000 steps."""
        duration = real(duration, "duration")
        dt = None if dt is None else real(dt, "dt")
        if not 0 <= duration < np.inf:
            raise ArgumentError(f"a duration of {duration} s; it must be finite and not negative",
                                "DFM_E_ARG")
        seen, end = _NO_TROUBLE, self.time + duration
        if dt is None and duration > 1e5 * self.stable_step:
            _LOG.warning("run takes %.3g steps of %.3g s, the stable step: give dt for longer steps, with "
                         "the integrator 'auto' or 'tr_bdf2' for stiff bodies",
                         duration / self.stable_step, self.stable_step)
        while True:
            left, step = end - self.time, self.stable_step if dt is None else dt
            if dt is None and not np.isfinite(step):
                step = 1e-3  # nothing bounds it
            if not step > 0:
                raise ArgumentError(f"a step of {step} s; it must be positive and finite", "DFM_E_ARG")
            if left <= 1e-6 * min(step, duration):
                return seen
            seen |= self.step(left if left < step * 1.001 else step)

    def equilibrium(self, load_steps: int = 1, *, load_from: float = 0, load_to: float = 1,
                    time: float = 0) -> None:
        """Moves all bodies to where forces balance. Diverged where there is no such place.

        load_steps: on the way from load_from to load_to, shares of gravity and loads; time: s that pass."""
        definition = default(_abi.dfm_equilibrium_def)
        definition.load_steps, definition.time = whole(load_steps, "load_steps", 1), real(time, "time")
        definition.load_from = real(load_from, "load_from")
        definition.load_to = real(load_to, "load_to")
        try:
            with self.alone():
                status = lib.dfm_world_equilibrium(self.handle, ctypes.byref(definition), None)
        except BaseException:  # raised by the handler of a signal
            self._stop = False
            raise
        by_law = self.context.raised_by_law() if status else None
        if status == _abi.DFM_DISCARD and self._stop:  # by a signal
            self._stop = False
            if by_law is None:  # and a handler that has not raised
                return self.equilibrium(load_steps, load_from=load_from, load_to=load_to, time=time)
        self.accept(status, by_law)

    def interrupt(self) -> None:
        """Asks the step that runs in another thread to stop; it raises Discarded there. Any thread."""
        check(quick.dfm_world_interrupt(self.handle))

    @property
    def time(self) -> float:
        """Simulated, s."""
        self.free()
        return float(quick.dfm_world_time(self.handle))

    @property
    def stable_step(self) -> float:
        """s, a step that is not cut into sub-steps; inf if nothing bounds it."""
        out = ctypes.c_double()
        self._ask(quick.dfm_world_stable_step, ctypes.byref(out), None, None)
        if self._raised is not None:
            raise self._take_raised()  # type: ignore[misc]
        return out.value

    def set_gravity(self, gravity: Sequence[float]) -> None:
        """[3] m/s2 from now on."""
        self._ask(quick.dfm_world_set_gravity, vector(gravity, "gravity"))
        self.shown.upright = Upright(0, gravity)

    def set_gravity_keys(self, times: Any, gravity: Any) -> None:
        """Gravity [n,3] m/s2 at times [n] s, linear between them; [] and [] end it."""
        keys = vector_keys(times, gravity if np.size(gravity) else np.empty((0, 3)), "gravity")
        self._ask(quick.dfm_world_set_gravity_keys, np.size(times), ctypes.byref(keys))
        if np.size(times):
            self.shown.upright = Upright(times, gravity)
        else:
            self.shown.asked = False

    def set_sleep(self, sleep: bool = True) -> None:
        """Lets islands at rest sleep from now on; False: wakes all bodies and keeps them awake."""
        self._ask(quick.dfm_world_set_sleep, bool(sleep))

    def set_budget(self, max_time: float = 0, max_work: float | None = 0) -> None:
        """Limits of one step from now on. max_time: s by the clock, 0: none. max_work: units of work, counted
        in stats.work, the same on every machine; 0: automatic, None: no limit. A step that nears a limit is
        simplified (Trouble.BUDGET); one that reaches it raises Discarded, and nothing has changed."""
        self.free()
        most, max_time = 2**64 - 1, real(max_time, "max_time")
        max_work = None if max_work is None else real(max_work, "max_work")
        if max_work is not None and not 0 <= max_work <= most:
            raise ArgumentError(f"max_work is {max_work}; expected 0 to {most}, or None for no limit",
                                "DFM_E_ARG")
        check(quick.dfm_world_set_budget(self.handle, max_time, most if max_work is None else int(max_work)))

    # ---- reports ---------------------------------------------------------------------------------------

    def _list(self, key: str, make: Any) -> Any:
        if self._busy:
            self.free()
        found = self._lists.get(key)
        if found is None:
            found = self._lists[key] = make()
        return found.look()

    @property
    def contacts(self) -> np.ndarray:
        """All contacts of the last sub-step, a structured array [n], a view: body_a, body_b, point [3] m,
        normal [3], tangent [3], gap m, area m2, fn N, ft [2] N, slip [2] m/s, bristle [2] m, flags, key,
        kind, law. Of two rigid things (kind 3) body_a is a rigid body or a part of a tool."""
        return self._list("contacts", lambda: Rows(quick.dfm_world_contacts_sized, self.handle,
                                                   _abi.dfm_contact))

    @property
    def pairs(self) -> np.ndarray:
        """Resultants of each touching pair, a structured array [n], a view: a, b, count, sticking, normal N,
        force [3] N, friction [3] N, moment [3] N m, slip_max m/s, friction_work J."""
        return self._list("pairs", lambda: Rows(quick.dfm_world_pairs_sized, self.handle,
                                                _abi.dfm_pair_report))

    @property
    def impulses(self) -> np.ndarray:
        """What contact did to each pair over the whole last step, a structured array [n], a view: a, b,
        impulse [3] N s, normal_impulse N s, peak_normal N, peak_force N, point [3] m, touching s,
        part [8] N s: normal_impulse by eighths of the step."""
        return self._list("impulses", lambda: Rows(quick.dfm_world_pair_impulses_sized, self.handle,
                                                   _abi.dfm_pair_impulse))

    @property
    def events(self) -> np.ndarray:
        """What has begun and ended since the last look, a structured array [n], a view: kind, a, b, key, t s.

        kind: 1 and 2, a contact of a soft body, or the touch of two rigid things, has begun and ended; 3, an
        attachment has ended (key: its number); 4 and 5, something (b) has come into a sensor (a) and left
        it; 6, body a has torn (key: points that were split); 7, part b of a tool has cut body a (key: faces
        or cells)."""
        return self._list("events", lambda: Rows(quick.dfm_world_events_sized, self.handle,
                                                 _abi.dfm_contact_event))

    @property
    def stats(self) -> Any:
        """The step report as a record, a view: steps, substeps, contacts, sticking, passes, sweeps, residual
        m/s, stable_step s, asleep, energy_start J, ... (dfm_world_stats)."""
        return self._list("stats", lambda: Report(quick.dfm_world_get_stats, self.handle,
                                                  _abi.dfm_world_stats))

    def snapshot(self) -> bytes:
        """All that a later result depends on; restore() takes it, in another process too."""
        self.free()
        size = ctypes.c_size_t(0)
        check(quick.dfm_world_snapshot(self.handle, None, ctypes.byref(size)))
        buffer = ctypes.create_string_buffer(size.value)
        check(quick.dfm_world_snapshot(self.handle, buffer, ctypes.byref(size)))
        return buffer.raw[:size.value]

    def stream(self, scene: bool = False, contacts: bool = False, frame: int = 0, packet: int = 0,
               floats: bool = False) -> bytes:
        """The present state as packets for viewers elsewhere, one behind the other (dfm_world_stream).

        scene: names, triangles and shapes in place of a frame. contacts: with those of the last sub-step.
        frame: number that the packets carry. packet: bytes that none exceeds, 0 for one packet. floats:
        displacements as floats, not in 16 bits."""
        self.free()
        given = default(_abi.dfm_stream_def)
        given.kind = _abi.DFM_STREAM_SCENE if scene else _abi.DFM_STREAM_FRAME
        given.flags = 0 if scene else contacts * _abi.DFM_STREAM_CONTACTS | floats * _abi.DFM_STREAM_FLOAT32
        given.frame, given.packet = whole(frame, "frame"), whole(packet, "packet")
        size = ctypes.c_size_t(self._streamed)
        buffer = ctypes.create_string_buffer(self._streamed)
        status = quick.dfm_world_stream(self.handle, ctypes.byref(given), buffer, ctypes.byref(size))
        if size.value > self._streamed:  # more than the last time, and a half for the next ones
            self._streamed = size.value + size.value // 2
            return self.stream(scene, contacts, frame, packet, floats)
        check(status)
        return buffer.raw[:size.value]

    def restore(self, snapshot: Any) -> None:
        """Back to a snapshot (bytes, or any buffer of bytes) of this world, or of one with the same contents:
        the next steps give the same bits. Contents are found by their names, or by their order where they
        have none."""
        try:
            taken = bytes(memoryview(snapshot))
        except TypeError:
            raise ArgumentError("restore takes the bytes that World.snapshot() has returned, not a "
                                f"{type(snapshot).__name__}", "DFM_E_ARG") from None
        self._ask(quick.dfm_world_restore, taken, len(taken))
        self.shown.asked = False
        for body in list(self._bodies.values()):
            body._renew_name()  # a name that the library has made may be another one

    # ---- pictures --------------------------------------------------------------------------------------

    def picture(self, **options: Any) -> Any:
        """The present state as a Picture (deform.picture has the options); a notebook shows it."""
        from .picture import picture
        return picture(self, **options)

    def film(self, color: str = "body", camera: Any = None, color_range: Any = None) -> Any:
        """A Run that records this world while it is stepped by hand: `film.add()` after a step adds a frame,
        and a notebook shows it. color, color_range: as of picture(), the range over all frames if it is not
        given; camera: (eye [3], look_at [3]) m, of its pictures."""
        from .scene import Run
        return Run.of(self, color, camera, color_range)

    def _repr_png_(self) -> bytes | None:
        from .picture import png_or_none
        return png_or_none(self)

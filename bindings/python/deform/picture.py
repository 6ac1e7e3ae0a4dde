"""Pictures of a world without a display, by the renderer of the command."""
from __future__ import annotations

import collections
import contextlib
import ctypes
import json
import math
import pathlib
import struct
import tempfile
import threading
import zlib
from typing import TYPE_CHECKING, Any, Iterable, Sequence

import numpy as np

from ._library import PATH, ArgumentError, Error, UnsupportedError, at_fork, error, write_whole
from .body import vector

if TYPE_CHECKING:
    from .world import World

_lock = threading.Lock()
_module: Any = None
_renderers: collections.OrderedDict[tuple[int, int], ctypes.c_void_p] = collections.OrderedDict()
_forked = False  # from a process that has drawn
_MODULE = "libdeform_python.so"
_LARGEST = 8192   # pixels, of the renderer
_KEPT = 4         # renderers, of the sizes that were drawn last
_THROUGH = 0.45   # of a contact patch that something hides
_ROUNDING = 1e-10  # strains, and displacements for coordinates of 1 m, that are drawn as zero
# what colors may mean: title and unit
COLORS = {"speed": ("speed", "m/s"), "contact": ("contact force", "N"), "displacement": ("displacement", "m"),
          "stress": ("von Mises stress", "Pa")}


def _forget() -> None:
    """In a forked process: threads are the parent's, those of its driver and who holds the lock."""
    global _lock, _forked
    _lock, _forked = threading.Lock(), bool(_renderers)


at_fork(after_in_child=_forget)


def _native() -> Any:
    global _module
    if _forked:
        raise UnsupportedError("no pictures in a process forked from one that has drawn, whose driver it "
                               "lacks; start it by 'spawn' (multiprocessing.get_context)",
                               "DFM_E_UNSUPPORTED")
    if _module is None:
        path = PATH.resolve().parent / _MODULE
        if not path.exists():
            raise UnsupportedError(f"{path}, which draws pictures, is not there: `make wheel` and "
                                   f"`make test` build it, unless CMake was given -DDEFORM_RENDER=OFF",
                                   "DFM_E_UNSUPPORTED")
        module = ctypes.CDLL(str(path))
        p, u, t, d = ctypes.c_void_p, ctypes.c_uint32, ctypes.c_char_p, ctypes.c_double
        for name, result, arguments in (
                ("create", ctypes.c_int, [u, u, p, p, ctypes.c_size_t]), ("destroy", None, [p]),
                ("palette", None, [u, p]), ("map", None, [u, u, p]), ("begin", None, [p, p, u]),
                ("legend", None, [p, u, d, d, t, t]),
                ("surface", None, [p, u, p, u, p, p, p, d]), ("shape", None, [p, u, p, p, p]),
                ("camera", None, [p, p, p]), ("text", None, [p, t]),
                ("draw", ctypes.c_int, [p, p, p, ctypes.c_size_t])):
            function = getattr(module, f"deform_picture_{name}")
            function.restype, function.argtypes = result, arguments
        _module = module
    return _module


def png_bytes(rgb: np.ndarray) -> bytes:
    """An image [height,width,3] of uint8 as PNG."""
    height, width = rgb.shape[:2]
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)
    rows[:, 1:] = rgb.reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b""))


class Picture:
    """An image: `rgb` [height,width,3] uint8. A notebook shows it; save() writes PNG."""

    def __init__(self, rgb: np.ndarray):
        self.rgb = rgb

    def save(self, path: Any) -> pathlib.Path:
        """Writes PNG, whole or not at all."""
        target = pathlib.Path(path)
        if target.suffix.lower() != ".png":
            raise ArgumentError(f"{target}: pictures are written as .png", "DFM_E_ARG")
        write_whole(target, self._repr_png_())
        return target

    def _repr_png_(self) -> bytes:
        return png_bytes(self.rgb)

    def __repr__(self) -> str:
        return f"<deform.Picture: {self.rgb.shape[1]} x {self.rgb.shape[0]}>"


def palette(number: int) -> tuple[float, float, float]:
    """The color of body `number`, 0..1 each."""
    rgb = (ctypes.c_double * 3)()
    _native().deform_picture_palette(number, rgb)
    return rgb[0], rgb[1], rgb[2]


def color_map(color: str, n: int) -> np.ndarray:
    """The colors of a quantity from its least value to its largest, [n,3] 0..1."""
    rgb = np.empty((n, 3))
    _native().deform_picture_map(int(color == "displacement"), n, rgb.ctypes.data)
    return rgb


class Upright:
    """Which way is up in pictures: against gravity, so that slopes made by tilting it look like slopes.
    Gravity by keys: times [n] s and values [n,3]."""

    def __init__(self, times: Any, gravity: Any):
        values = np.reshape(np.asarray(gravity, dtype=np.float64), (-1, 3))
        some = np.linalg.norm(values, axis=1) > 0
        self.times, self.values = np.atleast_1d(np.asarray(times, dtype=np.float64))[some], values[some]
        ways = self.values / np.linalg.norm(self.values, axis=1, keepdims=True)
        self.tilts = bool(len(ways) and (ways @ ways[0]).min() < 1 - 1e-9)

    @classmethod
    def of_scene(cls, gravity: Any) -> Upright:
        """From the value of a scene's key "gravity"."""
        keys = gravity["keyframes"] if isinstance(gravity, dict) else [{"t": 0, "value": gravity}]
        return cls([key["t"] for key in keys], [key["value"] for key in keys])

    def at(self, t: float) -> np.ndarray:
        """[3] unit, at a time of the world in s; z without gravity."""
        if not len(self.times):
            return np.array([0.0, 0.0, 1.0])
        down = np.array([np.interp(t, self.times, self.values[:, k]) for k in range(3)])
        length = np.linalg.norm(down)
        return -down / length if length > 0 else np.array([0.0, 0.0, 1.0])


class Shown:
    """What pictures of a world need from its past. softest: Young's modulus of its softest material, Pa."""

    def __init__(self) -> None:
        self.softest = math.inf
        self.upright = Upright([], [])
        self.asked = True  # False: only the world knows its gravity; upright_of() asks it


def upright_of(world: World) -> Upright:
    """Of a world, which may have the gravity of a snapshot."""
    if not world.shown.asked:
        world.shown.asked = True
        # a name that no scene may have, no room: the last one known stays
        with contextlib.suppress(Error, OSError), tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "world.json"
            world.write_scene(path, partial=True)
            world.shown.upright = Upright.of_scene(json.loads(path.read_bytes())["gravity"])
    return world.shown.upright


class Solid:
    """A shape of an obstacle where it is: kind as DFM_SHAPE_*, pose [7], axis [3], size [3]; or triangles."""

    def __init__(self, kind: int, pose: np.ndarray, axis: np.ndarray, size: Sequence[float],
                 points: np.ndarray, triangles: np.ndarray, handle: int):
        self.kind, self.pose, self.axis, self.size, self.handle = kind, pose, axis, list(size), handle
        self.points, self.triangles = points, triangles


def turned(rotation: np.ndarray, points: np.ndarray) -> np.ndarray:
    """points [n,3] turned by a quaternion x, y, z, w (all zero: not at all)."""
    if not np.any(rotation):
        return points
    q = rotation / np.linalg.norm(rotation)
    t = 2 * np.cross(q[:3], points)
    return points + q[3] * t + np.cross(q[:3], t)


def solids(world: World) -> list[Solid]:
    """All obstacles and rigid bodies of a world as they are now."""
    out = []
    for obstacle in world.obstacles:
        definition = obstacle.definition()
        position, rotation = obstacle.pose
        axis = turned(rotation, np.array([[0.0, 0.0, 1.0]]))[0]
        pose = np.concatenate([position, rotation if np.any(rotation) else [0, 0, 0, 1]])
        size = (list(definition.half_size) if definition.shape == 2 else
                [definition.radius, definition.half_length, 0])
        points, triangles = np.empty((0, 3)), np.empty((0, 3), np.uint32)
        if definition.ntriangle:
            shape = (ctypes.c_double * (3 * definition.npoint)).from_address(definition.points)
            rest = np.frombuffer(shape, dtype=np.float64).reshape(-1, 3)
            points = np.ascontiguousarray(turned(rotation, rest) + position)
            memory = (ctypes.c_uint32 * (3 * definition.ntriangle)).from_address(definition.triangles)
            triangles = np.frombuffer(memory, dtype=np.uint32).reshape(-1, 3).copy()
        out.append(Solid(definition.shape, pose, axis, size, points, triangles, obstacle.handle))
    return out


def draw(surfaces: Iterable[tuple[Any, Any, Sequence[float], Any]], obstacles: Iterable[Solid], *,
         size: tuple[int, int] = (960, 720), eye: Any = None, look_at: Any = None,
         texts: Sequence[str] = (), color: str = "body",
         value_range: tuple[float, float], upright: Upright, t: float) -> Picture:
    """Draws surfaces (points [n,3] m, triangles [m,3], color [3], values [n] 0..1 or None) and obstacles,
    with a legend of what the values mean."""
    across, down = vector(size, "size", 2)
    key = width, height = int(across), int(down)
    if not (0 < width <= _LARGEST and 0 < height <= _LARGEST):
        raise ArgumentError(f"a picture of {width} x {height} pixels; 1 to {_LARGEST} each are allowed",
                            "DFM_E_ARG")
    if (eye is None) != (look_at is None):
        raise ArgumentError("a camera has both eye and look_at", "DFM_E_ARG")
    native, why = _native(), ctypes.create_string_buffer(512)
    with _lock:
        if key not in _renderers:
            made = ctypes.c_void_p()
            if status := native.deform_picture_create(width, height, ctypes.byref(made), why, len(why)):
                raise error(status, f"no pictures: {why.value.decode()}")
            _renderers[key] = made
        _renderers.move_to_end(key)
        picture = _renderers[key]
        if len(_renderers) > _KEPT:
            native.deform_picture_destroy(_renderers.popitem(last=False)[1])
        native.deform_picture_begin(picture, vector(upright.at(t), "up"), upright.tilts)
        if color in COLORS:
            title, unit = (word.encode() for word in COLORS[color])
            native.deform_picture_legend(picture, int(color == "displacement"), *value_range, title, unit)
        others = list(obstacles)
        meshes = [(solid.points, solid.triangles, (0.72, 0.73, 0.75), None) for solid in others
                  if len(solid.points)]
        read = []  # while the picture is drawn
        for points, triangles, own, values in [*surfaces, *meshes]:
            xyz = np.ascontiguousarray(points, dtype=np.float64)
            tri = np.ascontiguousarray(triangles, dtype=np.uint32)
            scalar = None if values is None else np.ascontiguousarray(values, dtype=np.float32)
            read.append((xyz, tri, scalar))
            native.deform_picture_surface(picture, len(xyz), xyz.ctypes.data, len(tri), tri.ctypes.data,
                                          vector(own, "color"),
                                          None if scalar is None else scalar.ctypes.data,
                                          _THROUGH if color == "contact" else 0.0)
        for solid in others:
            if not len(solid.points):
                native.deform_picture_shape(picture, solid.kind, vector(solid.pose, "pose", 7),
                                            vector(solid.axis, "axis"), vector(solid.size, "size"))
        if eye is not None:
            native.deform_picture_camera(picture, vector(eye, "eye"), vector(look_at, "look_at"))
        for line in texts:
            native.deform_picture_text(picture, line.encode("ascii", "replace"))
        rgb = np.empty((height, width, 3), dtype=np.uint8)
        if status := native.deform_picture_draw(picture, rgb.ctypes.data, why, len(why)):
            raise error(status, f"no picture: {why.value.decode()}")
    return Picture(rgb)


def _nearest(body: Any) -> np.ndarray:
    """The point that is nearest to each surfel, [nsurfel]."""
    origin = body.points[:1]  # squares of places far from it have no digits for distances
    points, surfels = body.points - origin, body.positions - origin
    rows = max(1, 4_000_000 // max(len(points), 1))
    squares = (points**2).sum(axis=1)
    return np.concatenate([(squares - 2 * surfels[i:i + rows] @ points.T).argmin(axis=1)
                           for i in range(0, len(surfels), rows)] or [np.empty(0, int)])


def _von_mises(body: Any) -> np.ndarray:
    """[nsurfel] Pa: the mean over the cells around the nearest point, by volume."""
    s = body.stress
    cell = np.sqrt(0.5 * ((s[:, 0] - s[:, 1])**2 + (s[:, 1] - s[:, 2])**2 + (s[:, 2] - s[:, 0])**2)
                   + 3 * (s[:, 3:]**2).sum(axis=1))
    tets, rest = body.tets, body.rest_points
    a, b, c, d = (rest[tets[:, k]] for k in range(4))
    volume = np.abs(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a))
    total, weight = np.zeros(len(rest)), np.zeros(len(rest))
    for k in range(4):
        np.add.at(total, tets[:, k], volume * cell)
        np.add.at(weight, tets[:, k], volume)
    near = _nearest(body)
    return total[near] / weight[near]


def body_values(body: Any, color: str) -> np.ndarray | None:
    """What a surface is colored by, [nsurfel] in its own unit; None: by body, also where a model gives no
    stress. What rounding leaves is zero."""
    if color == "body":
        return None
    if color == "contact":  # exactly zero where nothing touches
        return np.linalg.norm(body.forces, axis=1)
    noise = _ROUNDING * np.abs(body.positions).max(initial=0)
    if color == "speed":
        values = np.linalg.norm(body.velocities, axis=1)
    elif color == "displacement":
        values = np.linalg.norm(body.displacements, axis=1)
    elif color == "stress":
        noise = _ROUNDING * min(body.world.shown.softest, 1e5)  # that of a body without a material
        try:
            values = _von_mises(body)
        except UnsupportedError:
            return None
    else:
        raise ArgumentError(f"color '{color}' is not known; known: body, {', '.join(COLORS)}", "DFM_E_ARG")
    return np.where(values < noise, 0, values)


def scaled(values: np.ndarray | None, value_range: tuple[float, float], color: str) -> np.ndarray | None:
    """Values 0..1 for the renderer; where nothing touches a body keeps its own color."""
    if values is None:
        return None
    low, high = value_range
    out = (values - low) / (high - low) if high > low else np.zeros_like(values)
    return np.where(values == 0, np.nan, out) if color == "contact" else out


def largest(values: Iterable[np.ndarray | None]) -> float:
    """0 where there is none."""
    return max((float(v.max(initial=0)) for v in values if v is not None), default=0.0)


def ends(value_range: Sequence[float] | None, top: float) -> tuple[float, float]:
    """The values at the ends of the colors: those given, or 0 and top."""
    if value_range is None:
        return 0.0, top
    low, high = vector(value_range, "color_range", 2)
    if not low < high:
        raise ArgumentError(f"color_range is {low:g} to {high:g}; the second value must be larger",
                            "DFM_E_ARG")
    return low, high


def picture(world: World, *, size: tuple[int, int] = (960, 720), color: str = "body", eye: Any = None,
            look_at: Any = None, label: bool = True, color_range: Sequence[float] | None = None) -> Picture:
    """The present state of a world. size: width, height in pixels; color: "body", "speed", "contact",
    "displacement" (from the rest shape at its pose) or "stress" (von Mises); color_range: the
    values at the ends of the colors, 0 and the largest one if not given; eye, look_at: [3] m, the camera (it
    finds its own place where they are not given)."""
    bodies = world.bodies
    values = [body_values(b, color) for b in bodies]
    if all(v is None for v in values):
        color = "body"
    span = ends(color_range, largest(values))
    surfaces = [(b.positions, b.triangles, palette(i), scaled(v, span, color))
                for i, (b, v) in enumerate(zip(bodies, values))]
    return draw(surfaces, solids(world), size=size, eye=eye, look_at=look_at, color=color, value_range=span,
                upright=upright_of(world), t=world.time, texts=[f"t = {world.time:.3f} s"] if label else [])


def png_or_none(shown: Any) -> bytes | None:
    """For a notebook, which shows the text where there is no picture."""
    try:
        return shown.picture()._repr_png_()
    except (UnsupportedError, ReferenceError, RuntimeError):
        return None

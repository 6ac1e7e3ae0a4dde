"""Pictures of a world without a display, by the renderer of the command."""
from __future__ import annotations

import ctypes
import os
import pathlib
import struct
import threading
import zlib
from typing import TYPE_CHECKING, Any, Iterable, Sequence

import numpy as np

from ._library import PATH, ArgumentError, UnsupportedError
from .body import vector

if TYPE_CHECKING:
    from .world import World

_lock = threading.Lock()
_module: Any = None
_renderers: dict[tuple[int, int], int] = {}
_MODULE = "libdeform_python.so"
_LARGEST = 16384  # pixels


def _native() -> Any:
    global _module
    if _module is None:
        path = PATH.resolve().parent / _MODULE
        if not path.exists():
            raise UnsupportedError(f"{path} is not there: this library was built without the renderer "
                                   f"(cmake -DDEFORM_RENDER=ON)", "DFM_E_UNSUPPORTED")
        module = ctypes.CDLL(str(path))
        p, u, t = ctypes.c_void_p, ctypes.c_uint32, ctypes.c_char_p
        for name, result, arguments in (
                ("create", p, [u, u, p, ctypes.c_size_t]), ("palette", None, [u, p]),
                ("surface", None, [p, u, p, u, p, p, p]), ("shape", None, [p, u, p, p, p]),
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
        partial = target.with_name(f"{target.name}.part{os.getpid()}")
        partial.write_bytes(self._repr_png_())
        partial.replace(target)
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


class Solid:
    """A shape of an obstacle where it is: kind as DFM_SHAPE_*, pose [7], axis [3], size [3]; or triangles."""

    def __init__(self, kind: int, pose: np.ndarray, axis: np.ndarray, size: Sequence[float],
                 points: np.ndarray | None = None, triangles: np.ndarray | None = None):
        self.kind, self.pose, self.axis, self.size = kind, pose, axis, list(size)
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
        points = triangles = None
        if definition.ntriangle:
            shape = (ctypes.c_double * (3 * definition.npoint)).from_address(definition.points)
            rest = np.frombuffer(shape, dtype=np.float64).reshape(-1, 3)
            points = np.ascontiguousarray(turned(rotation, rest) + position)
            memory = (ctypes.c_uint32 * (3 * definition.ntriangle)).from_address(definition.triangles)
            triangles = np.frombuffer(memory, dtype=np.uint32).reshape(-1, 3).copy()
        out.append(Solid(definition.shape, pose, axis, size, points, triangles))
    return out


def draw(surfaces: Iterable[tuple[Any, Any, Sequence[float], Any]], obstacles: Iterable[Solid], *,
         size: tuple[int, int] = (960, 720), eye: Any = None, look_at: Any = None,
         texts: Sequence[str] = ()) -> Picture:
    """Draws surfaces (points [n,3] m, triangles [m,3], color [3], values [n] 0..1 or None) and obstacles."""
    width, height = size
    if not (0 < width <= _LARGEST and 0 < height <= _LARGEST):
        raise ArgumentError(f"a picture of {width} x {height} pixels; 1 to {_LARGEST} each are allowed",
                            "DFM_E_ARG")
    if (eye is None) != (look_at is None):
        raise ArgumentError("a camera has both eye and look_at", "DFM_E_ARG")
    native, why = _native(), ctypes.create_string_buffer(512)
    with _lock:
        picture = _renderers.get(size) or native.deform_picture_create(width, height, why, len(why))
        if not picture:
            raise UnsupportedError(f"no pictures: {why.value.decode()}", "DFM_E_UNSUPPORTED")
        _renderers[size] = picture
        for points, triangles, color, values in surfaces:
            xyz = np.ascontiguousarray(points, dtype=np.float64)
            tri = np.ascontiguousarray(triangles, dtype=np.uint32)
            scalar = None if values is None else np.ascontiguousarray(values, dtype=np.float32)
            native.deform_picture_surface(picture, len(xyz), xyz.ctypes.data, len(tri), tri.ctypes.data,
                                          vector(color, "color"),
                                          None if scalar is None else scalar.ctypes.data)
        for solid in obstacles:
            if solid.points is not None and solid.triangles is not None:
                native.deform_picture_surface(picture, len(solid.points), solid.points.ctypes.data,
                                              len(solid.triangles), solid.triangles.ctypes.data,
                                              vector((0.72, 0.73, 0.75), "color"), None)
            else:
                native.deform_picture_shape(picture, solid.kind, vector(solid.pose, "pose", 7),
                                            vector(solid.axis, "axis"), vector(solid.size, "size"))
        if eye is not None:
            native.deform_picture_camera(picture, vector(eye, "eye"), vector(look_at, "look_at"))
        for line in texts:
            native.deform_picture_text(picture, line.encode("ascii", "replace"))
        rgb = np.empty((height, width, 3), dtype=np.uint8)
        if not native.deform_picture_draw(picture, rgb.ctypes.data, why, len(why)):
            raise UnsupportedError(f"no picture: {why.value.decode()}", "DFM_E_UNSUPPORTED")
    return Picture(rgb)


def body_values(body: Any, color: str) -> np.ndarray | None:
    """What a surface is colored by, [nsurfel] in its own unit; None: by body."""
    if color == "body":
        return None
    if color in ("speed", "contact"):
        return np.linalg.norm(body.velocities if color == "speed" else body.forces, axis=1)
    raise ArgumentError(f"color '{color}' is not known; known: body, speed, contact", "DFM_E_ARG")


def scaled(values: np.ndarray | None, top: float, color: str) -> np.ndarray | None:
    """Values 0..1 for the renderer; where nothing touches a body keeps its own color."""
    if values is None:
        return None
    out = values / top if top > 0 else np.zeros_like(values)
    return np.where(values == 0, np.nan, out) if color == "contact" else out


def picture(world: World, *, size: tuple[int, int] = (960, 720), color: str = "body", eye: Any = None,
            look_at: Any = None, label: bool = True) -> Picture:
    """The present state of a world. size: width, height in pixels; color: "body", "speed" or "contact"; eye,
    look_at: [3] m, the camera (it finds its own place where they are not given)."""
    bodies = world.bodies
    values = [body_values(b, color) for b in bodies]
    top = max((float(v.max(initial=0)) for v in values if v is not None), default=0.0)
    surfaces = [(b.positions, b.triangles, palette(i), scaled(v, top, color))
                for i, (b, v) in enumerate(zip(bodies, values))]
    return draw(surfaces, solids(world), size=size, eye=eye, look_at=look_at,
                texts=[f"t = {world.time:.3f} s"] if label else [])


def png_or_none(shown: Any) -> bytes | None:
    """For a notebook, which shows the text where there is no picture."""
    try:
        return shown.picture()._repr_png_()
    except (UnsupportedError, ReferenceError, RuntimeError):
        return None

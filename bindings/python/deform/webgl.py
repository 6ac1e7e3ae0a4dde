"""A run as one HTML document: its surfaces in all frames, and a small viewer (viewer.js) that turns and
plays them."""
from __future__ import annotations

import base64
import html as markup
import json
import math
import pathlib
from typing import TYPE_CHECKING, Any

import numpy as np

from .picture import COLORS, Solid, color_map, palette, turned

if TYPE_CHECKING:
    from .scene import Run

_GRAY = (0.72, 0.73, 0.75)
_LEVELS = 65535  # positions travel as 16 bits of the box around everything
_AROUND = 24     # points on a circle
_COLORS = 17     # of a map, in equal distances


def _encoded(array: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


def _grid(rows: int, columns: int) -> np.ndarray:
    """Triangles of a sheet of points [rows,columns]."""
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    a = (i * columns + j).ravel()
    return np.concatenate([np.stack([a, a + columns + 1, a + 1], 1),
                           np.stack([a, a + columns, a + columns + 1], 1)])


def _capsule(radius: float, half: float) -> tuple[np.ndarray, np.ndarray]:
    """A sphere whose halves are moved apart along z; half 0: a sphere."""
    polar = np.concatenate([np.linspace(0, math.pi / 2, 9), np.linspace(math.pi / 2, math.pi, 9)])
    shift = np.repeat([half, -half], 9)
    turn = np.linspace(0, 2 * math.pi, _AROUND + 1)
    x = radius * np.sin(polar)[:, None] * np.cos(turn)
    y = radius * np.sin(polar)[:, None] * np.sin(turn)
    z = np.broadcast_to((radius * np.cos(polar) + shift)[:, None], x.shape)
    return np.stack([x, y, z], 2).reshape(-1, 3), _grid(len(polar), _AROUND + 1)


def mesh_of(solid: Solid, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Points [n,3] m where it is, and triangles [m,3]; a plane as a square of that reach, m."""
    if solid.points is not None and solid.triangles is not None:
        return solid.points, solid.triangles
    if solid.kind == 0:
        side = np.linspace(-reach, reach, 2)
        local = np.array([(x, y, 0.0) for x in side for y in side])
        triangles = np.array([[0, 2, 3], [0, 3, 1]])
    elif solid.kind == 2:
        corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        local = np.array(corners) * np.array(solid.size)
        triangles = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                              [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])
    else:
        local, triangles = _capsule(solid.size[0], solid.size[1] if solid.kind == 3 else 0.0)
    return turned(solid.pose[3:], local) + solid.pose[:3], triangles


def _to_z(up: np.ndarray) -> np.ndarray:
    """The rotation [3,3] that takes a unit vector to z, the viewer's up, by the shortest way."""
    x, y, z = up
    if z < -1 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    across = np.array([[0, 0, -x], [0, 0, -y], [x, y, 0]])
    return np.eye(3) + across + across @ across / (1 + z)


def _surfaces(run: Run) -> list[tuple[list[np.ndarray], np.ndarray, tuple[float, float, float], Any]]:
    """(points of each frame, triangles, color, values of each frame or None)"""
    out: list[Any] = []
    turns = [_to_z(run.upright.at(frame.t)).T if run.upright else np.eye(3) for frame in run.frames]
    for i, (name, triangles) in enumerate(run.triangles.items()):
        values = [frame.values[name] for frame in run.frames]
        points = [frame.positions[name] @ turn for frame, turn in zip(run.frames, turns)]
        out.append((points, triangles, palette(i), None if values[0] is None else values))
    shown = np.concatenate([points.reshape(-1, 3) for surface in out for points in surface[0]]
                           or [np.zeros((1, 3))])
    reach = 1.5 * float(np.linalg.norm(np.ptp(shown, axis=0))) or 1.0
    for k in range(len(run.frames[0].obstacles)):
        meshes = [mesh_of(frame.obstacles[k], reach) for frame in run.frames]
        points = [mesh[0] @ turn for mesh, turn in zip(meshes, turns)]
        still = all(np.array_equal(points[0], p) for p in points)
        out.append((points[:1] if still else points, meshes[0][1], _GRAY, None))
    return out


def data_of(run: Run) -> dict[str, Any]:
    """What the viewer is given."""
    surfaces = _surfaces(run)
    everything = np.concatenate([points for surface in surfaces for points in surface[0]])
    low = everything.min(axis=0)
    span = float((everything.max(axis=0) - low).max()) or 1.0
    bodies = surfaces[:len(run.triangles)]
    moving = np.concatenate([points for surface in bodies for points in surface[0]] or [everything])
    low_value, high_value = run.value_range()
    listed = []
    for frames, triangles, color, values in surfaces:
        points = np.rint((np.stack(frames) - low) / span * _LEVELS).astype("<u2")
        item = {"n": points.shape[1], "frames": points.shape[0], "points": _encoded(points),
                "triangles": _encoded(triangles.astype("<u4")), "color": list(color)}
        if values is not None:
            # 0: the body's own color
            stacked = np.stack(values)
            reach = high_value - low_value
            share = (stacked - low_value) / reach if reach > 0 else 0 * stacked
            levels = np.rint(1 + 254 * np.clip(share, 0, 1)).astype("u1")
            item["values"] = _encoded(np.where(stacked == 0, 0, levels).astype("u1")
                                      if run.color == "contact" else levels)
        listed.append(item)
    middle = (moving.min(axis=0) + moving.max(axis=0)) / 2
    return {"times": [round(frame.t, 6) for frame in run.frames], "low": low.tolist(), "span": span,
            "middle": middle.tolist(), "size": float(np.linalg.norm(np.ptp(moving, axis=0))) or 1.0,
            "map": color_map(run.color, _COLORS).ravel().tolist(), "surfaces": listed}


def _legend(run: Run) -> str:
    """What the colors mean, beside the slider."""
    if all(v is None for frame in run.frames for v in frame.values.values()):
        return ""
    (title, unit), (low, high) = COLORS[run.color], run.value_range()
    colors = ",".join(f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in 255 * color_map(run.color, _COLORS))
    bar = ("<i style=\"display:inline-block;width:80px;height:10px;"
           f"background:linear-gradient(to right,{colors})\"></i>")
    return f"<span id=\"legend\">{title}, {unit}: {low:.3g} {bar} {high:.3g}</span>"


def document(run: Run) -> str:
    """The whole document; its file may be opened by any browser."""
    viewer = pathlib.Path(__file__).with_name("viewer.js").read_text()
    data = json.dumps(data_of(run), separators=(",", ":"))
    return ("<!DOCTYPE html><html><head><meta charset=\"utf-8\"><title>deform</title><style>"
            "html,body{margin:0;height:100%;font:13px sans-serif;background:#f4f5f7}"
            "canvas{width:100%;height:calc(100% - 34px);display:block;touch-action:none}"
            "#bar{height:34px;display:flex;align-items:center;gap:8px;padding:0 8px}"
            "#at{flex:1}</style></head>"
            "<body><canvas id=\"view\"></canvas><div id=\"bar\"><button id=\"play\">play</button>"
            "<input id=\"at\" type=\"range\" min=\"0\" value=\"0\"><span id=\"time\"></span>"
            f"{_legend(run)}</div><script>const RUN={data};\n{viewer}</script></body></html>")


def html(run: Run, height: int = 480) -> str:
    """The document in a frame of its own, so that it lives beside others in a notebook."""
    return (f'<iframe style="width:100%;height:{int(height)}px;border:0" '
            f'srcdoc="{markup.escape(document(run), quote=True)}"></iframe>')

"""A run as one HTML document: the page of `deform serve` with a recording of its surfaces inside."""
from __future__ import annotations

import base64
import html as markup
import json
import struct
from typing import TYPE_CHECKING, Any, Iterable

import numpy as np

from ._library import ROOT
from .picture import COLORS, Solid, color_map, turned

if TYPE_CHECKING:
    from .scene import Run

_LEVELS = 65535  # of a range in 16 bits
_COLORS = 17     # of a map, in equal distances
_PLACES = (ROOT / "page.html", ROOT.parents[1] / "serve" / "page.html")  # of a wheel, of a clone


def _chunk(tag: bytes, *parts: Any) -> bytes:
    data = b"".join(part if isinstance(part, bytes) else part.tobytes() for part in parts)
    data += b"\0" * (-len(data) % 4)
    return tag + struct.pack("<I", len(data)) + data


def _packet(scene: bool, whole: bool, frame: int, t: float, chunks: Iterable[bytes]) -> bytes:
    data = b"".join(chunks)
    return struct.pack("<4sBBHIIIId", b"DFMS", 1, not scene, whole, 1, 0, 32 + len(data), frame, t) + data


def _named(name: str) -> bytes:
    text = name.encode()[:100]
    return struct.pack("<I", len(text)) + text


def _surface(number: int, shape: int, points: np.ndarray, triangles: np.ndarray) -> list[bytes]:
    return [_chunk(b"BASE", struct.pack("<4I", number, shape, 0, len(points)), points.astype("<f4")),
            _chunk(b"TRIS", struct.pack("<4I", number, shape, 0, len(triangles)), triangles.astype("<u4"))]


def _thing(number: int, solid: Solid) -> list[bytes]:
    """An obstacle or rigid body, which has the same shape in all frames."""
    points = turned(solid.pose[3:] * (-1, -1, -1, 1), solid.points - solid.pose[:3])
    radius, half = (solid.size[0], solid.size[1]) if solid.kind in (1, 3) else (0, 0)
    box = solid.size if solid.kind == 2 else (0, 0, 0)
    numbers = number, 1, len(points), len(solid.triangles), solid.kind
    return [_chunk(b"OBST", struct.pack("<5I5f", *numbers, radius, half, *box), _named("")),
            *_surface(number, 1, points, solid.triangles)]


def _moved(number: int, shape: int, moved: np.ndarray) -> bytes:
    low = moved.min(axis=0)
    step = ((moved.max(axis=0) - low) / _LEVELS).astype("<f4")
    rows = np.rint((moved - low) / np.where(step > 0, step, 1)).clip(0, _LEVELS)
    return _chunk(b"SURF", struct.pack("<5I", number, shape, 0, len(moved), 0), low.astype("<f4"), step,
                  struct.pack("<I", 0), rows.astype("<u2"))


def _values(color: str, span: tuple[float, float], values: np.ndarray) -> np.ndarray:
    """Levels from 1; 0: the body's own color."""
    low, high = span
    share = (values - low) / (high - low) if high > low else 0 * values
    levels = np.rint(1 + 254 * np.clip(share, 0, 1)).astype("u1")
    return np.where(values == 0, 0, levels).astype("u1") if color == "contact" else levels


def packets_of(run: Run) -> bytes:
    """The run in the format of doc/reference/stream.md. A body whose triangles change is told again, what is
    added later when it is there."""
    out, span = [], run.value_range()
    numbers: dict[int, int] = {}  # of obstacles, behind those of bodies, by their handles
    known: dict[str, tuple[np.ndarray, np.ndarray]] = {}  # triangles, places that displacements count from
    shapes: dict[str, int] = {}
    for i, frame in enumerate(run.frames):
        scene, listed, surfaces, poses = [], [], [], []
        for number, (name, triangles) in enumerate(frame.triangles.items(), 1):
            points, values = frame.positions[name], frame.values[name]
            if len(points) == 0:
                continue
            if name not in known or known[name][0] is not triangles:
                known[name] = triangles, points.astype(np.float64)
                scene.append(_chunk(b"BODY", struct.pack("<4I", number, i, len(points), len(triangles)),
                                    _named(name)))
                scene += _surface(number, i, points, triangles)
                shapes[name] = i
            listed.append((number, shapes[name]))
            surfaces.append(_moved(number, shapes[name], points - known[name][1]))
            if values is not None:
                surfaces.append(_chunk(b"VALU", struct.pack("<4I", *listed[-1], 0, len(points)),
                                       _values(run.color, span, values)))
        for solid in frame.obstacles:
            if solid.handle not in numbers:
                numbers[solid.handle] = len(run.triangles) + len(numbers) + 1
                scene += _thing(numbers[solid.handle], solid)
            listed.append((numbers[solid.handle], 1))
            poses.append(struct.pack("<I7f", listed[-1][0], *solid.pose))
        if scene:
            out.append(_packet(True, i == 0, i, frame.t, scene))
        out.append(_packet(False, False, i, frame.t, [
            _chunk(b"LIST", np.array([len(listed), *np.ravel(listed)], "<u4")),
            _chunk(b"POSE", *poses), *surfaces]))
    return b"".join(out)


def _legend(run: Run) -> str:
    """What the colors mean, beside the slider."""
    if all(v is None for frame in run.frames for v in frame.values.values()):
        return ""
    (title, unit), (low, high) = COLORS[run.color], run.value_range()
    colors = ",".join(f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in 255 * color_map(run.color, _COLORS))
    bar = f"<i style=\"background:linear-gradient(to right,{colors})\"></i>"
    return f"{title}, {unit}: {low:.3g} {bar} {high:.3g}"


def document(run: Run) -> str:
    """The whole document; its file may be opened by any browser, and loads nothing."""
    page = next(path for path in _PLACES if path.exists()).read_text(encoding="utf-8")
    ups = [run.upright.at(frame.t).tolist() for frame in run.frames]
    film = json.dumps({"packets": base64.b64encode(packets_of(run)).decode(), "ups": ups,
                       "map": color_map(run.color, _COLORS).ravel().tolist(), "legend": _legend(run)},
                      separators=(",", ":")).replace("</", "<\\/")
    alone = ("<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
             "script-src 'unsafe-inline'; style-src 'unsafe-inline'\">")
    head = '<meta charset="utf-8">\n'
    return page.replace(head, f"{head}{alone}\n<script>const film={film};</script>\n", 1)


def html(run: Run, height: int = 480) -> str:
    """The document in a frame of its own, so that it lives beside others in a notebook."""
    return (f'<iframe style="width:100%;height:{int(height)}px;border:0" '
            f'srcdoc="{markup.escape(document(run), quote=True)}"></iframe>')

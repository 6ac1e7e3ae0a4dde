"""A world in browsers while a program steps it: the page and the server of `deform serve`."""
from __future__ import annotations

import ctypes
import json
import math
import sys
import time
import weakref
from typing import TYPE_CHECKING, Any, Callable

import numpy as np

from ._library import PATH, ArgumentError, Error, StateError, UnsupportedError, at_fork, quick
from ._values import finite_or_none, real, whole
from .body import Body
from .picture import upright_of

if TYPE_CHECKING:
    from .world import World

_MODULE = "libdeform_python_serve.so"
_FAR = 1e6       # m, of a viewer's coordinates
_RATE = 2 * math.pi * 4  # 1/s, at which a body swings on the spring that pulls it
_MOST = 256       # requests in one exchange
_native: Any = None
_servers: weakref.WeakSet[Any] = weakref.WeakSet()


def _module() -> Any:
    global _native
    if _native is None:
        path = PATH.resolve().parent / _MODULE
        try:
            module = ctypes.CDLL(str(path))
        except OSError as why:
            raise UnsupportedError(f"{why}: deform.serve needs it and libwebsockets; a build has it where "
                                   "Debian's libwebsockets-dev is installed", "DFM_E_UNSUPPORTED") from None
        p, u, n, t = ctypes.c_void_p, ctypes.c_uint32, ctypes.c_size_t, ctypes.c_char_p
        for name, result, arguments in (
                ("open", p, [p, p, t, t, n]), ("close", None, [p]), ("scene", None, [p, t, n, t, n]),
                ("frame", None, [p, t, n]), ("state", None, [p, t]), ("next", ctypes.c_int, [p, p, t]),
                ("viewers", u, [p]), ("control", u, [p])):
            function = getattr(module, f"deform_serve_{name}")
            function.restype, function.argtypes = result, arguments
        _native = module
    return _native


def _forget() -> None:
    """In a forked process: the network's threads are the parent's, and so are its connections."""
    for server in list(_servers):
        server._served = server._pull = None


at_fork(after_in_child=_forget)


def _numbers(request: dict[str, Any], key: str, n: int) -> np.ndarray:
    try:
        out = np.array(request.get(key), dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        out = np.empty(0)
    if out.shape != (n,) or not (np.abs(out) <= _FAR).all():
        raise ArgumentError(f'expected {n} numbers under "{key}"', "DFM_E_ARG")
    return out


class _Pull:
    """A spring from the points around a picked place of a body, the nearer the heavier, to the mouse."""

    def __init__(self, body: Body, place: np.ndarray):
        x = body.points
        wanted = min(max(len(x) // 20, min(len(x), 4)), 64)
        away = np.linalg.norm(x - place, axis=1)
        near = np.argsort(away, kind="stable")[:wanted]
        reach = np.partition(away, wanted)[wanted] if wanted < len(x) else 1.1 * away.max()
        weights = 1 - (away[near] / reach)**2
        self.body, self.near, self.triangles = body, near[weights > 0], body.triangles
        self.weights = weights[weights > 0] / weights[weights > 0].sum()
        self.offset = self.weights @ x[self.near] - place
        self.to = place
        mass = float(body.measure.mass)
        stiffness = mass * _RATE**2
        # half of the critical damping
        self.spring = body.add_spring(self.near, place + self.offset, stiffness, math.sqrt(stiffness * mass),
                                      weights=self.weights)

    def move(self, to: np.ndarray) -> None:
        self.body.set_spring_target(self.spring, to + self.offset)
        self.to = to

    def state(self) -> dict[str, Any]:
        if not np.array_equal(self.body.triangles, self.triangles):
            raise StateError("a cut has changed the numbers of the points that are held", "DFM_E_STATE")
        place = self.weights @ self.body.points[self.near] - self.offset
        return {"place": place.tolist(), "to": self.to.tolist(),
                "force": float(np.linalg.norm(self.body.spring_force(self.spring)))}


class Server:
    """What deform.serve() returns: a page at `url` that shows a world, pulls and cuts its bodies, and runs,
    pauses and resets it. A notebook shows the page itself. close() ends it, or `with`."""

    def __init__(self, world: World, port: int = 0, rate: float = 30, real_time: bool = False):
        self.world, self.rate, self.real_time = world, real(rate, "rate"), bool(real_time)
        if not 1 <= self.rate <= 240:
            raise ArgumentError(f"rate is {rate}; expected 1 to 240 pictures per second", "DFM_E_ARG")
        self._served = None
        own, given = ctypes.c_uint16(whole(port, "port", bits=16)), ctypes.create_string_buffer(65)
        why = ctypes.create_string_buffer(512)
        self._native = _module()
        first = world.snapshot()
        self._served = self._native.deform_serve_open(
            ctypes.cast(quick.dfm_stream_pack, ctypes.c_void_p), ctypes.byref(own), given, why, len(why))
        if not self._served:
            raise StateError(why.value.decode(), "DFM_E_STATE")
        self.url = f"http://127.0.0.1:{own.value}/?token={given.value.decode()}"
        _servers.add(self)
        self.running = True
        self._steps = 0  # that viewers have asked for and that are still to come
        self._first = first
        self._sliders: list[tuple[dict[str, Any], float, Callable[[float], Any]]] = []
        self._pull: _Pull | None = None
        self._holder = self._frame = 0
        self._shapes: bytes | None = None  # LIST of the last frame that was shown
        self._message = ""
        self._next, self._took = 0.0, 0.0  # s; ms from one update to the next, smoothed
        self._left = time.monotonic()      # the last one
        self._seen = self._began = (self._left, world.time)

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<deform.Server: {self.url}>" if self._served else "<deform.Server, closed>"

    def _repr_html_(self) -> str | None:
        return (f'<iframe style="width:100%;height:560px;border:0" src="{self.url}"></iframe>'
                if self._served else None)

    def close(self) -> None:
        """Ends the page; the world stays as it is, less a pull."""
        if self._served:
            self._release()
            self._native.deform_serve_close(self._served)
            self._served = None

    def __del__(self) -> None:
        if getattr(self, "_served", None):
            self._native.deform_serve_close(self._served)

    @property
    def closed(self) -> bool:
        """Is it?"""
        return not self._served

    @property
    def viewers(self) -> int:
        """How many pages and programs look on."""
        return int(self._native.deform_serve_viewers(self._served)) if self._served else 0

    def add_slider(self, label: str, value: float, low: float, high: float,
                   apply: Callable[[float], Any], logarithmic: bool = False) -> None:
        """A slider on the page: it calls apply(value), between two steps."""
        value, low, high = real(value, "value"), real(low, "low"), real(high, "high")
        if any(slider["name"] == label for slider, *_ in self._sliders):
            raise ArgumentError(f"there is a slider '{label}' already", "DFM_E_ARG")
        if not all(map(math.isfinite, (value, low, high))):
            raise ArgumentError(f"slider '{label}': expected finite numbers", "DFM_E_ARG")
        if not low <= value <= high or low == high or (logarithmic and low <= 0):
            raise ArgumentError(f"slider '{label}' from {low:g} to {high:g} at {value:g}: expected a range "
                                "that has the value, and is positive where it is logarithmic", "DFM_E_ARG")
        self._sliders.append(({"name": label, "label": label, "value": value, "low": low, "high": high,
                               "logarithmic": bool(logarithmic)}, value, apply))

    def update(self) -> None:
        """To be called after each step: does what viewers have asked for, and shows the world where a picture
        is due. It waits while they have paused it, and with real_time while the world is ahead of the
        clock."""
        if not self._served:
            raise StateError("this server is closed", "DFM_E_STATE")
        now = time.monotonic()
        self._took += 0.05 * (1e3 * (now - self._left) - self._took)
        try:
            self._update(now)
        finally:
            self._left = time.monotonic()

    def _update(self, now: float) -> None:
        if self.real_time:
            while self.running and (ahead := self._ahead(now)) > 0:
                time.sleep(min(ahead, 1 / self.rate))
                now = time.monotonic()
                if now >= self._next:  # viewers do not wait for a long step
                    self._exchange()
            if self._ahead(now) < -0.1:  # it does not catch up
                self._began = (now, self.world.time)
        if self.running and now < self._next:
            return
        if not self._steps:
            self._exchange()
        while not self.running and not self._steps:
            if not self.viewers:  # nobody is there who could let it go on
                self.running = True
                break
            time.sleep(1 / self.rate)
            self._exchange()
            self._began = (time.monotonic(), self.world.time)
        self._steps = max(self._steps - 1, 0)

    def _ahead(self, now: float) -> float:
        """s, of the world before the clock."""
        return float(self.world.time - self._began[1]) - (now - self._began[0])

    def run(self, duration: float = math.inf, dt: float | None = None) -> None:
        """Steps the world for `duration` s, by dt or the stable step, no faster than the clock, and shows
        it. Without a duration until Ctrl-C."""
        end, kept = self.world.time + real(duration, "duration"), self.real_time
        self.real_time, self._began = True, (time.monotonic(), self.world.time)
        try:
            while self.world.time < end - 1e-9:
                step = self.world.stable_step if dt is None else real(dt, "dt")
                step = step if math.isfinite(step) else 1e-3
                self.world.step(min(step, end - self.world.time))
                self.update()
        except KeyboardInterrupt:
            if math.isfinite(duration):
                raise
        finally:
            self.real_time = kept
        self._show()

    # ---- what viewers ask for --------------------------------------------------------------------------

    def _exchange(self) -> None:
        """Requests in, a picture out."""
        viewer, text = ctypes.c_uint32(), ctypes.create_string_buffer(1025)
        for _ in range(_MOST):
            came = self._native.deform_serve_next(self._served, ctypes.byref(viewer), text)
            if came < 0:
                raise Error("serve: the network has failed; serve the world again")
            if not came:
                break
            self._message = ""
            try:
                request = json.loads(text.value)
            except (ValueError, RecursionError):
                request = None
            try:
                self._handle(request, viewer.value)
            except Error as refused:
                self._message = str(refused)
        if self._pull and self._native.deform_serve_control(self._served) != self._holder:
            self._release()
        self._next = time.monotonic() + 1 / self.rate
        if self.viewers:
            self._show()

    def _handle(self, request: Any, viewer: int) -> None:
        """The requests of doc/reference/stream.md."""
        if not isinstance(request, dict):
            raise ArgumentError("a request is an object of JSON", "DFM_E_ARG")
        what = request.get("do")
        if what == "grab":
            self._grab(_numbers(request, "from", 3), _numbers(request, "along", 3), viewer)
        elif what == "pull":
            if self._pull:
                self._pull.move(_numbers(request, "to", 3))
        elif what == "release":
            self._release()
        elif what == "slider":
            self._slide(request.get("name"), request.get("value"))
        elif what == "cut":
            self._cut(_numbers(request, "blade", 12).reshape(4, 3))
        elif what == "run":
            self.running, self._steps = request.get("on") is True, 0
        elif what == "step":
            self.running = False
            self._steps += 1
        elif what == "reset":
            self._release()
            self.world.restore(self._first)
            self._began = (time.monotonic(), self.world.time)
            for slider, value, apply in self._sliders:
                if slider["value"] != value:
                    apply(value)
                    slider["value"] = value
        else:
            raise ArgumentError(f'"{what}" is nothing that a viewer can ask for', "DFM_E_ARG")

    def _grab(self, origin: np.ndarray, along: np.ndarray, viewer: int) -> None:
        self._release()
        if not np.any(along):
            raise ArgumentError('"along" is zero', "DFM_E_ARG")
        hit = self.world.query_ray(origin, along)
        if hit is not None and isinstance(hit.owner, Body):
            self._pull, self._holder = _Pull(hit.owner, np.array(hit.point)), viewer

    def _release(self) -> None:
        pull, self._pull = self._pull, None
        if pull:
            try:
                pull.body.remove_spring(pull.spring)
            except Error:  # a cut has taken what was held
                pass

    def _slide(self, name: Any, value: Any) -> None:
        for slider, _, apply in self._sliders:
            if slider["name"] != name:
                continue
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not (
                    slider["low"] <= value <= slider["high"]):
                raise ArgumentError(f"slider '{name}': the value is outside of its range", "DFM_E_ARG")
            apply(float(value))
            slider["value"] = float(value)
            return
        raise ArgumentError(f"there is no slider '{name}'", "DFM_E_ARG")

    def _cut(self, corners: np.ndarray) -> None:
        self._release()
        for body in self.world.bodies:
            try:
                body.cut(corners=corners)
            except UnsupportedError:  # its model needs all of its cells
                pass

    # ---- what viewers see ------------------------------------------------------------------------------

    def _show(self) -> None:
        frame = self.world.stream(contacts=True, frame=self._frame, floats=True)
        at, shapes = 32, b""
        while at < len(frame):  # LIST tells what is new or has other triangles
            size = int.from_bytes(frame[at + 4:at + 8], "little")
            if frame[at:at + 4] == b"LIST":
                shapes += frame[at + 8:at + 8 + size]
            at += 8 + size
        if shapes != self._shapes:
            self._shapes = shapes
            scene = self.world.stream(scene=True, frame=self._frame)
            self._native.deform_serve_scene(self._served, scene, len(scene), b"", 0)
        state = json.dumps(finite_or_none(self._state()), allow_nan=False).encode()
        self._native.deform_serve_state(self._served, state)
        self._native.deform_serve_frame(self._served, frame, len(frame))
        self._frame += 1

    def _state(self) -> dict[str, Any]:
        now, at = time.monotonic(), self.world.time
        passed = max(now - self._seen[0], 1e-9)
        speed, self._seen = (at - self._seen[1]) / passed, (now, at)
        out = {"scene": "", "time": at, "frame": self._frame, "running": self.running,
               "message": self._message, "step_ms": self._took, "real": speed, "viewers": self.viewers,
               "control": int(self._native.deform_serve_control(self._served)),
               "up": upright_of(self.world).at(at).tolist(), "probes": [],
               "sliders": [slider for slider, *_ in self._sliders]}
        if self._pull:
            try:
                out["pull"] = self._pull.state()
            except Error:
                self._release()
        return out


def serve(world: World, port: int = 0, rate: float = 30, real_time: bool = False) -> Server:
    """Shows a world in browsers on this machine, and prints the URL.

        with deform.serve(world) as server:
            while world.time < 5:
                world.step(1e-3)
                server.update()

    port: of 127.0.0.1, 0 for a free one. rate: pictures per second. real_time: no faster than the clock.
    Whoever has the URL can pull, cut, pause and reset. Needs libwebsockets."""
    server = Server(world, port, rate, real_time)
    print(server.url, file=sys.stdout, flush=True)
    return server

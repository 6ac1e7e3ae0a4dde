"""Scenes from JSON files, and runs: a scene from its start to its end, with what was recorded on the way."""
from __future__ import annotations

import ctypes
import json
import math
import weakref
from dataclasses import dataclass
from typing import Any, Callable, Mapping

import numpy as np

from . import _abi
from ._arrays import row_type
from ._context import Context, default_context
from ._library import ArgumentError, OfThisProcess, check, encoded, lib, quick, read_text, sized
from ._values import KindError, json_of, real, whole
from .picture import (Picture, Solid, Upright, body_values, draw, ends, largest, palette, scaled, solids,
                      upright_of)
from .query import write_scene
from .world import Trouble, World


@dataclass(frozen=True)
class Settings:
    """What a scene says of its run: duration, step (0: the stable one) and every (between records), s;
    static: a search for equilibria instead of steps in time; color of pictures, and color_range, the values
    at its ends, or None; camera (eye, look_at), [3] m each, or None."""

    duration: float
    step: float
    every: float
    static: bool
    color: str
    camera: tuple[np.ndarray, np.ndarray] | None
    color_range: tuple[float, float] | None = None


def _close(handle: int, _context: Context) -> None:
    quick.dfm_scene_close(handle)


class Scene(OfThisProcess):
    """A scene file (JSON), loaded: its `world`, `settings` and `probes`.

    set: values to change, by JSON pointer: {"/contact/friction/0/params/mu": 0.4}. jitter: a number above 0
    changes the start a little, the same number always by the same. threads: on which a step may run.
    """

    _instead = "give the path of its file"

    def __init__(self, path: Any, set: Mapping[str, Any] | None = None, jitter: int = 0, threads: int = 1,
                 context: Context | None = None):
        if isinstance(path, Mapping):
            raise ArgumentError("a scene is given by the path of its file, not by a dict; write it first: "
                                "pathlib.Path('scene.json').write_text(json.dumps(scene))", "DFM_E_ARG")
        if context is None:
            context = default_context() if threads == 1 else Context(threads)
        if not isinstance(set or {}, Mapping):
            raise KindError(f"set is {set!r}; expected a dict of values by JSON pointer", "DFM_E_ARG")
        words = [encoded(f"{pointer}={json_of(value)}") for pointer, value in (set or {}).items()]
        pointers = (ctypes.c_char_p * max(len(words), 1))(*words)
        options = _abi.dfm_scene_options(ctypes.sizeof(_abi.dfm_scene_options), len(words),
                                         ctypes.addressof(pointers), whole(jitter, "jitter", bits=64))
        out, world = ctypes.c_uint64(), ctypes.c_uint64()
        check(lib.dfm_scene_open(context.address, encoded(path), ctypes.byref(options), ctypes.byref(out)))
        self.handle, self.path = out.value, str(path)
        self._finalize = weakref.finalize(self, _close, self.handle, context)
        check(quick.dfm_scene_world(self.handle, ctypes.byref(world)))
        # each keeps the other: `Scene(path).world` is a world to use
        self.world = World.of_scene(context, world.value, self)
        self.world.shown.upright = Upright.of_scene(self.value("/gravity"))
        young = [material["young"] for material in self.value().get("materials", {}).values()]
        self.world.shown.softest = min(young, default=math.inf)

    def close(self) -> None:
        """Closes the scene and destroys its world. Twice is allowed."""
        self.world.free()
        self._finalize()

    def __enter__(self) -> Scene:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def value(self, pointer: str = "") -> Any:
        """Any value of the scene, after defaults and `set`: value("/materials/rubber/young")."""
        return json.loads(read_text(quick.dfm_scene_value, self.handle, encoded(pointer)))

    @property
    def settings(self) -> Settings:
        """What the scene says of its run: step and duration in s, mode, output, camera."""
        out = sized(_abi.dfm_scene_settings)
        check(quick.dfm_scene_get_settings(self.handle, ctypes.byref(out)))
        camera = (np.array(out.eye), np.array(out.look_at)) if out.has_camera else None
        time = self.value("/time")
        return Settings(out.duration, out.step, out.every, time.get("mode") == "static",
                        (out.color or b"body").decode(), camera, self.value("/output").get("color_range"))

    @property
    def probes(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Position [3] m and velocity [3] m/s of each probe, by name; nan once a cut has taken its cell."""
        out = sized(_abi.dfm_scene_settings)
        check(quick.dfm_scene_get_settings(self.handle, ctypes.byref(out)))
        found = {}
        for i in range(out.nprobe):
            name, x, v = ctypes.c_char_p(), (ctypes.c_double * 3)(), (ctypes.c_double * 3)()
            check(quick.dfm_scene_probe(self.handle, i, ctypes.byref(name), x, v))
            found[(name.value or b"").decode()] = (np.array(x), np.array(v))
        return found

    def write_scene(self, path: Any, *, duration: float | None = None, step: float = 0,
                    snapshot: bool = False, partial: bool = False) -> list[str]:
        """World.write_scene for the scene's world as it is now, with the scene's probes and outputs.

        duration: s, of the scene that is written; None: that of this one. step: s, 0 for this one's."""
        self.world.free()
        return write_scene(lib.dfm_scene_write, self.handle, path,
                           self.settings.duration if duration is None else duration, step, snapshot, partial)

    def run(self, duration: float | None = None, every: float | None = None,
            watch: Callable[[World], Any] | None = None) -> Run:
        """Steps to the end as `deform run` does, bit by bit, and records a frame every `every` s.

        duration, every: s, instead of the scene's. watch: called after each step; it may look at the
        world."""
        for what, value in (("duration", duration), ("every", every)):
            if value is not None and not 0 <= real(value, what) < math.inf:
                raise ArgumentError(f"{what} is {value} s; it must be finite and not negative", "DFM_E_ARG")
        return _Runner(self, duration, every, watch).run()


@dataclass
class Frame:
    """A recorded state. positions: of each body, [nsurfel,3] m, float32; values: what its surface is colored
    by; obstacles: where they were; probes: [3] m by name; contacts: how many, of which sticking."""

    t: float
    positions: dict[str, np.ndarray]
    values: dict[str, np.ndarray | None]
    obstacles: list[Solid]
    probes: dict[str, np.ndarray]
    contacts: int
    sticking: int
    triangles: dict[str, np.ndarray]  # [ntriangle,3]; others than at the start where a body has been cut


class Run:
    """What a run recorded: `frames`, and at its end `stats` (dfm_world_stats) and `hash`. A notebook shows
    it as a view that can be turned and played (html()); picture(i) draws one frame."""

    def __init__(self, color: str, camera: Any, color_range: Any, upright: Upright):
        self.color, self.camera, self.color_range, self.upright = color, camera, color_range, upright
        self.frames: list[Frame] = []
        self._top = 0.0
        self.triangles: dict[str, np.ndarray] = {}
        self.steps = 0
        self.trouble = Trouble(0)
        self.stats: Any = None
        self.hash = 0
        self.world: Any = None

    @classmethod
    def of(cls, world: World, color: str = "body", camera: Any = None, color_range: Any = None) -> Run:
        """An empty one for a world that is stepped by hand; add() records a frame (World.film)."""
        run = cls(color, camera, color_range, upright_of(world))
        run.world = world
        run.triangles = {body.name: body.triangles.copy() for body in world.bodies}
        run.add()
        return run

    def add(self, probes: Mapping[str, np.ndarray] | None = None) -> None:
        """Records the world as it is now. Bodies that were made since are left out; a body of which a cut has
        taken all cells has no surface. ArgumentError: a body was removed."""
        world = self.world
        bodies = {body.name: body for body in world.bodies if body.name in self.triangles}
        for name in self.triangles:
            handle = ctypes.c_uint64()
            if name not in bodies and quick.dfm_world_find_body(world.handle, name.encode(),
                                                                ctypes.byref(handle)) != _abi.DFM_OK:
                raise ArgumentError(f"body '{name}' is gone: begin another film", "DFM_E_ARG")
        stats = world.stats
        self.steps = int(stats.steps)
        values = {name: body_values(bodies[name], self.color) if name in bodies else None
                  for name in self.triangles}
        self._top = max(self._top, largest(values.values()))
        self.frames.append(Frame(
            world.time, {name: bodies[name].positions.astype(np.float32) if name in bodies
                         else np.empty((0, 3), np.float32) for name in self.triangles},
            values, solids(world), dict(probes or {}), int(stats.contacts), int(stats.sticking),
            {name: self._surface(name, bodies.get(name)) for name in self.triangles}))

    def _surface(self, name: str, body: Any) -> np.ndarray:
        """Triangles now: those of the frame before where no cut has changed them."""
        last = self.frames[-1].triangles if self.frames else self.triangles
        now = np.empty((0, 3), np.uint32) if body is None else body.triangles
        return last[name] if np.array_equal(last[name], now) else now.copy()

    @property
    def times(self) -> np.ndarray:
        """Of the frames, [n] s."""
        return np.array([frame.t for frame in self.frames])

    def probe(self, name: str) -> np.ndarray:
        """Its path, [n,3] m."""
        return np.array([frame.probes[name] for frame in self.frames])

    def positions(self, body: str) -> np.ndarray:
        """Surface of a body in all frames, [n,nsurfel,3] m, float32; of a body that is not cut."""
        if body not in self.triangles:
            raise ArgumentError(f"'{body}' is no body of this run; it has {', '.join(self.triangles)}",
                                "DFM_E_ARG")
        return np.stack([frame.positions[body] for frame in self.frames])

    def top(self) -> float:
        """The largest value by which anything is colored, of all frames recorded."""
        return self._top

    def value_range(self) -> tuple[float, float]:
        """The values at the ends of the colors: color_range, or 0 and top()."""
        return ends(self.color_range, self._top)

    def picture(self, frame: int = -1, *, size: tuple[int, int] = (960, 720), eye: Any = None,
                look_at: Any = None) -> Picture:
        """A frame, drawn; negative numbers count from the end."""
        shown, span = self.frames[frame], self.value_range()
        if eye is None and look_at is None and self.camera is not None:
            eye, look_at = self.camera
        surfaces = [(shown.positions[name], shown.triangles[name], palette(i),
                     scaled(shown.values[name], span, self.color)) for i, name in enumerate(self.triangles)]
        color = self.color if any(v is not None for v in shown.values.values()) else "body"
        return draw(surfaces, shown.obstacles, size=size, eye=eye, look_at=look_at, color=color,
                    value_range=span, upright=self.upright, t=shown.t, texts=[f"t = {shown.t:.3f} s"])

    def html(self, height: int = 480) -> str:
        """The run as one piece of HTML with WebGL in it: no server, no other file, nothing from the
        network."""
        from .webgl import html
        return html(self, height)

    def _repr_html_(self) -> str:
        return self.html()

    def __repr__(self) -> str:
        end = self.frames[-1].t if self.frames else 0.0
        return f"<deform.Run: {self.steps} steps, {len(self.frames)} frames, {end:.6g} s>"


class _Runner:
    def __init__(self, scene: Scene, duration: float | None, every: float | None,
                 watch: Callable[[World], Any] | None):
        self.scene, self.world, self.watch = scene, scene.world, watch
        self.settings = scene.settings
        self.duration = self.settings.duration if duration is None else duration
        self.every = self.settings.every if every is None else every
        self.start = self.world.time
        self.next = self.steps = 0

    def run(self) -> Run:
        settings = self.settings
        out = self.run_ = Run(settings.color, settings.camera, settings.color_range, upright_of(self.world))
        out.world = self.world
        out.triangles = {body.name: body.triangles.copy() for body in self.world.bodies}
        self.record()
        while self.advance():
            self.steps += 1
            if self.watch is not None:
                self.watch(self.world)
            self.record()
        if out.frames[-1].t != self.world.time:
            self.record(always=True)
        memory = _abi.dfm_world_stats.from_buffer_copy(self.world.stats.tobytes())
        kind = np.dtype((np.record, row_type(_abi.dfm_world_stats)))
        out.stats = np.frombuffer(memory, dtype=kind)[0]  # type: ignore[call-overload]
        out.hash, out.steps, out.world = self.world.hash, self.steps, None
        return out

    def record(self, always: bool = False) -> None:
        t = self.world.time - self.start
        if not always:
            if self.every > 0 and t < self.next * self.every - 1e-9 * self.every:
                return
            self.next = math.floor(t / self.every + 1e-9) + 1 if self.every > 0 else 0
        self.run_.add({name: position for name, (position, _) in self.scene.probes.items()})

    def advance(self) -> bool:
        """One step toward the end, of the length that `deform run` takes; False when there."""
        if self.settings.static:
            return self.advance_load()
        left = self.start + self.duration - self.world.time
        step, automatic = self.settings.step, self.settings.step <= 0
        if automatic:
            step = self.world.stable_step
            if not math.isfinite(step):
                step = 1e-3
            if self.settings.every > 0:
                step = min(step, self.settings.every)
            if step < left < 2 * step:
                step = left / 2
        if left <= 1e-6 * min(step, self.duration):
            return False
        longer = 1 + (1e-6 if automatic else 1e-3)
        if left < step * longer and (automatic or abs(left - step) > 1e-6 * step):
            step = left
        self.run_.trouble |= self.world.step(step)
        return True

    def advance_load(self) -> bool:
        n = math.ceil(self.duration / self.settings.step - 1e-6) if self.settings.step > 0 else 1
        if self.steps == n:
            return False
        share = (self.steps + 1) / n
        self.world.equilibrium(load_from=self.steps / n, load_to=share,
                               time=self.start + self.duration * share - self.world.time)
        return True


def run(path: Any, *, duration: float | None = None, every: float | None = None,
        set: Mapping[str, Any] | None = None, threads: int = 1,
        watch: Callable[[World], Any] | None = None) -> Run:
    """Runs a scene file to its end and returns what was recorded: run("scene.json", set={"/gravity": [0, 0,
    -1.6]})."""
    with Scene(path, set=set, threads=threads) as scene:
        return scene.run(duration, every, watch)

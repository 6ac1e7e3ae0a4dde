"""What a world tells beside its lists of contacts, as a base of World."""
from __future__ import annotations

import ctypes
import json
from typing import Any, Sequence

import numpy as np

from . import _abi
from ._arrays import Rows
from ._library import lib, quick, read_text
from ._values import vector, whole
from .body import Body, Obstacle, handle_of


class Reports:
    """The part of World that has overlaps, laws, loads of pairs, creep, memory and time."""

    __slots__ = ()

    def law(self: Any, number: int) -> tuple[str, dict[str, Any]]:
        """The law of that number in contacts["law"] and pairs["law"]: its id, and its parameters by key."""
        out = self._answer(_abi.dfm_law_info, quick.dfm_world_law_info, whole(number, "number"))
        rows = (_abi.dfm_param_value * out.params.n).from_address(out.params.values) if out.params.n else ()
        values = {row.key.decode(): (ctypes.c_double * row.width).from_address(row.value)[:] for row in rows}
        return out.id.decode(), {key: v[0] if len(v) == 1 else np.array(v) for key, v in values.items()}

    @property
    def overlaps(self: Any) -> np.ndarray:
        """Pairs that overlapped when they were created or placed, as the last check found them, a structured
        array [n], a view: a, b, flags (1: b is an obstacle or a rigid body, 2: too deep, so that the two do
        not touch until they are apart, 4: moved apart), crossings, enclosed, depth m."""
        return self._list("overlaps", lambda: Rows(quick.dfm_world_overlaps_sized, self.handle,
                                                   _abi.dfm_overlap))

    def find_overlaps(self: Any) -> np.ndarray:
        """Checks all pairs now, and changes nothing: overlaps of the present state, as `overlaps`."""
        self.call(lib.dfm_world_find_overlaps, self.handle, None)
        return self.overlaps

    def untangle(self: Any) -> int:
        """Moves overlapping bodies apart, as whole bodies, without energy and speed. Returns the number of
        pairs that still overlap; the log says why."""
        left = ctypes.c_uint32()
        self.call(lib.dfm_world_untangle, self.handle, ctypes.byref(left))
        return left.value

    def wrench(self: Any, a: Body | Obstacle, b: Body | Obstacle,
               point: Sequence[float] = (0, 0, 0)) -> tuple[np.ndarray, np.ndarray]:
        """What contact with b did to a in the last sub-step: force [3] N, and moment [3] N m about a point
        [3] m; zeros where they do not touch."""
        expected = "wrench needs two bodies or obstacles"
        sides = [handle_of(thing, (Body, Obstacle), expected) for thing in (a, b)]
        return self._wrench(quick.dfm_world_pair_wrench, *sides, vector(point, "point"))

    def hold_begin(self: Any) -> None:
        """Starts a measurement of creep: contacts count that stick in every step from now on."""
        self._ask(quick.dfm_world_hold_begin)

    @property
    def hold(self: Any) -> tuple[float, int]:
        """Creep since hold_begin, m/s: the largest way of a contact that has stuck throughout, over the time
        (nan: there is none); and the number of such contacts."""
        creep, count = ctypes.c_double(), ctypes.c_uint32()
        self._ask(quick.dfm_world_hold, ctypes.byref(creep), ctypes.byref(count))
        return creep.value, count.value

    @property
    def memory(self: Any) -> dict[str, int]:
        """Bytes that the world uses now, by part: bodies, dynamics, obstacles, detection, contacts, steps;
        and their total."""
        out = self._answer(_abi.dfm_memory, quick.dfm_world_memory)
        return {key: int(getattr(out, key)) for key, *_ in out._fields_ if key not in ("size", "reserved")}

    @property
    def profile(self: Any) -> dict[str, tuple[float, int]]:
        """Of each stage of the steps since the world was created: seconds by the clock, and calls."""
        row = _abi.dfm_stage_time
        stages = self._listed(quick.dfm_world_profile_sized, ctypes.sizeof(row), kind=row)
        return {stage.name.decode(): (stage.seconds, int(stage.calls)) for stage in stages}

    @property
    def hash(self: Any) -> int:
        """Of the whole state: equal for equal bits."""
        self.free()
        return int(quick.dfm_world_hash(self.handle))

    def explain(self: Any) -> dict[str, Any]:
        """The plan: effects, stages and why, laws, bodies, what bounds the step."""
        self.free()
        return json.loads(read_text(quick.dfm_world_explain, self.handle))

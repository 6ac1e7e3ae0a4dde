"""Friction laws: those that are loaded, evaluated on their own, and laws as Python classes."""
from __future__ import annotations

import ctypes
import json
import os
import pathlib
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import weakref
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any, Iterator, Mapping, Sequence

import numpy as np

from . import _abi
from ._context import Context, Parameter, Params, PluginType, default_context, read_type
from ._library import PATH, ArgumentError, Error, check, command_path, encoded, lib, quick
from ._signals import interrupt
from ._values import array_of, real
from ._command import Table

NEEDS = {"fn": _abi.DFM_NEED_FN, "vt": _abi.DFM_NEED_VT, "ft_stop": _abi.DFM_NEED_FT_STOP,
         "area": _abi.DFM_NEED_AREA, "dwell": _abi.DFM_NEED_DWELL}
_INPUTS = (("fn", 1), ("vt", 2), ("ft_stop", 2), ("area", 1), ("dwell", 1))
_GIVEN = ("n", "dt", "state", *NEEDS)  # to evaluate, beside the parameters
_EvalFn = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p)
_CheckFn = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
_EntryFn = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32)
# What the validator asks of a compiled file, which the bridge to Python is not: memory, files, static
# variables.
_OF_THE_FILE = ("V01", "V02", "V05", "V09", "V10", "V12", "V14")
_RULES = ([f"V{i:02}" for i in range(1, 15)] + [f"F{i:02}" for i in range(1, 18)])


def _columns(address: int, columns: int, stride: int, n: int) -> np.ndarray:
    """[columns, n] over the library's memory."""
    memory = (ctypes.c_double * (columns * stride)).from_address(address)
    whole: np.ndarray = np.frombuffer(memory, dtype=np.float64)  # type: ignore[call-overload]
    return whole.reshape(columns, stride)[:, :n]


def _packed(address: int | None, width: int) -> np.ndarray:
    """A copy of all parameters; the library has no address for none."""
    return np.array((ctypes.c_double * width).from_address(address)) if address else np.zeros(0)


class PythonLaw:
    """A friction law as a Python class, to try an idea: slow, and as correct as a compiled one.

        class Tanh(deform.PythonLaw):
            id = "com.example.tanh"
            source = "regularized Coulomb"
            parameters = [deform.Parameter("mu", "friction coefficient", "1", 0, 10, 0.5),
                          deform.Parameter("v_s", "speed of transition", "m/s", 1e-6, 1, 1e-3)]

            def evaluate(self, x, out):
                speed = np.hypot(*x.vt)
                out.limit[:] = x.mu * x.fn
                out.ft[:] = -out.limit * np.tanh(speed / x.v_s) * x.vt / np.maximum(speed, 1e-300)

    and give the class to World.add_friction(law=Tanh, mu=0.3). check() holds it to the validator's rules.

    state: slots that the library keeps for each contact: "scalar" (one number), "tangent" (a pair that turns
    with the contact frame); zero is rest. needs: inputs that evaluate reads, of "fn", "vt", "ft_stop",
    "area", "dwell". isotropic, passive: claims; derivatives: evaluate fills dft_dvt and dft_dfn; set_valued:
    it holds with ft_stop.
    """

    id: str = ""
    name: str = ""
    version: str = "0"
    licence: str = "none"
    source: str = ""
    parameters: Sequence[Parameter] = ()
    effects: Sequence[str] = ()
    state: Sequence[str] = ()
    needs: Sequence[str] = ("fn", "vt")
    isotropic: bool = True
    passive: bool = True
    derivatives: bool = False
    set_valued: bool = False

    def evaluate(self, x: Any, out: Any) -> None:
        """Fills `out` from `x` for n contacts at once; a pure function, no more than arithmetic on arrays.

        x: n, dt (s), fn [n] N, vt [2,n] m/s (of this side against the other, mean over the step), ft_stop
        [2,n] N, area [n] m2, dwell [n] s, state [nstate,n] at t, and each parameter by its key. out: ft
        [2,n] N on this side, against the slip; state [nstate,n] at t + dt; limit [n] N; mode [n]: 0 open, 1
        stick, 2 slip; stored [n] J; with `derivatives` dft_dvt [4,n] N s/m (row-major) and dft_dfn [2,n].
        They begin as zero force, the old state, limit inf, mode 2 where fn > 0 and else 0, nothing
        stored."""
        raise NotImplementedError

    def refuse(self, params: Mapping[str, float]) -> str | None:
        """A sentence where parameters do not go together; None: they do."""
        return None

    # ---- how the library sees it -----------------------------------------------------------------------

    def answer(self, n: int, dt: float, params: np.ndarray, inputs: dict[str, Any],
               state: np.ndarray) -> SimpleNamespace:
        """evaluate() with its arguments made and its answer's shapes checked."""
        values = self.by_key(params)
        x = SimpleNamespace(n=n, dt=dt, state=state, **values, **inputs)
        fn = inputs["fn"]
        out = SimpleNamespace(ft=np.zeros((2, n)), state=state.copy(), dft_dvt=np.zeros((4, n)),
                              dft_dfn=np.zeros((2, n)), limit=np.full(n, np.inf), stored=np.zeros(n),
                              mode=np.full(n, 2, np.uint8) if fn is None else
                              np.where(fn > 0, 2, 0).astype(np.uint8))
        shapes = {key: array.shape for key, array in vars(out).items()}
        with np.errstate(all="ignore"):  # a lane may hold what is not finite; it must not leave its lane
            returned: Any = self.evaluate(x, out)  # type: ignore[func-returns-value]
        if returned is not None:
            raise ArgumentError(f"{self.id}: evaluate returned a {type(returned).__name__}, which nothing "
                                "reads; write the force into out.ft[:], and return nothing", "DFM_E_ARG")
        unread = [key for key in vars(out) if key not in shapes]
        if unread:
            raise ArgumentError(f"{self.id}: evaluate set out.{unread[0]}, which nothing reads; out has "
                                f"{', '.join(shapes)}", "DFM_E_ARG")
        for key, shape in shapes.items():
            if np.shape(getattr(out, key)) != shape:
                raise ArgumentError(f"{self.id}: evaluate left out.{key} with the shape "
                                    f"{np.shape(getattr(out, key))}; expected {shape}", "DFM_E_ARG")
        return out

    def by_key(self, params: np.ndarray) -> dict[str, Any]:
        """Values of all rows end to end, by key."""
        out, at = {}, 0
        for row in self.parameters:
            out[row.key] = float(params[at]) if row.width == 1 else params[at:at + row.width].copy()
            at += row.width
        return out

    def width(self) -> int:
        """Numbers of all parameters together."""
        return sum(row.width for row in self.parameters)

    def slots(self) -> list[tuple[int, int]]:
        """(width, kind) of each slot."""
        kinds = {"scalar": (1, _abi.DFM_SLOT_SCALAR), "tangent": (2, _abi.DFM_SLOT_TANGENT)}
        for slot in self.state:
            if slot not in kinds:
                raise ArgumentError(f"{self.id}: state '{slot}'; known: scalar, tangent", "DFM_E_ARG")
        return [kinds[slot] for slot in self.state]

    def bits(self) -> tuple[int, int]:
        """needs and flags."""
        unknown = [need for need in self.needs if need not in NEEDS]
        if unknown:
            raise ArgumentError(f"{self.id}: need '{unknown[0]}'; known: {', '.join(NEEDS)}", "DFM_E_ARG")
        flags = (_abi.DFM_FRIC_ISOTROPIC * self.isotropic | _abi.DFM_FRIC_PASSIVE * self.passive
                 | _abi.DFM_FRIC_JACOBIAN * self.derivatives | _abi.DFM_FRIC_SET_VALUED * self.set_valued)
        return sum(NEEDS[need] for need in self.needs), flags

    @contextmanager
    def served(self) -> Iterator[tuple[pathlib.Path, dict[str, str]]]:
        """While it lasts, a plugin file that is this law, for another process with that environment. At its
        end what evaluate has raised meanwhile is raised."""
        with _Server(self) as server:
            try:
                yield server.file, server.environment
            finally:
                raised = server.bridge.take_error()
                if raised is not None:
                    raise raised

    def check(self, only: Sequence[str] | None = None, seed: int = 1) -> Table:
        """Holds the law to the rules of `deform plugin check`, each in a process of its own: rows id, title,
        result ("pass", "fail", "skip"), detail. Rules about a compiled file (memory, symbols, static
        variables) are skipped. only: ids of rules. Takes half a minute."""
        only = [only] if isinstance(only, str) else only
        wanted = [rule for rule in only or _RULES if rule not in _OF_THE_FILE]
        rows = [{"id": rule, "title": "", "result": "skip", "detail": "of a compiled file"}
                for rule in _OF_THE_FILE if rule in (only or _RULES)]
        if wanted:
            rows += self._checked(wanted, seed)
        return Table(sorted(rows, key=lambda row: (row["id"][0] != "V", row["id"])),
                     ["id", "result", "title", "detail"])

    def _checked(self, wanted: Sequence[str], seed: int) -> list[dict[str, Any]]:
        with self.served() as (file, environment):
            arguments = [command_path(), "plugin", "check", file, "--json", "--seed", seed, "--limit", 60]
            for rule in wanted:
                arguments += ["--only", rule]
            done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True,
                                  env={**os.environ, **environment})
        if done.returncode not in (0, 1):
            raise Error(done.stderr.strip().removeprefix("deform: "))
        said = json.loads(done.stdout)
        return said["rules"] + [row for kind in said["types"] for row in kind["rules"]]


_unraisable: Any = None   # the hook before


def _hook(said: Any) -> None:
    """Where the handler of a signal raises as a callback begins, before its `try`, ctypes gives the exception
    to this hook alone."""
    frame = said.exc_traceback and said.exc_traceback.tb_frame
    if frame is None or frame.f_code not in (Bridge.evaluate.__code__, Bridge.refuse.__code__):
        return _unraisable(said)
    frame.f_locals["self"].error = said.exc_value
    interrupt()


class Bridge:
    """C tables of a Python law, and the functions that the library calls."""

    def __init__(self, law: PythonLaw, name: str):
        self.law, self.id = law, name
        self.error: BaseException | None = None
        global _unraisable
        if sys.unraisablehook is not _hook:
            _unraisable, sys.unraisablehook = sys.unraisablehook, _hook
        if not law.id or "." not in law.id:
            raise ArgumentError(f"a law needs an id in reverse-DNS form, such as 'com.example.tanh', not "
                                f"'{law.id}'", "DFM_E_ARG")
        for given in law.parameters:
            if not isinstance(given, Parameter):
                raise ArgumentError(f"{law.id}: parameters has {given!r}; expected rows "
                                    "deform.Parameter(key, label, unit, min, max, default)", "DFM_E_ARG")
            if given.key in _GIVEN or not given.key.isidentifier():
                raise ArgumentError(f"{law.id}: a parameter has the key '{given.key}'; expected a Python "
                                    f"name that is none of {', '.join(_GIVEN)}", "DFM_E_ARG")
            if given.names:
                raise ArgumentError(f"{law.id}: parameter '{given.key}' has names; a law in Python takes "
                                    "numbers", "DFM_E_ARG")
        rows = (_abi.dfm_param * max(len(law.parameters), 1))()
        for row, given in zip(rows, law.parameters):
            row.key, row.label, row.unit = (encoded(t) for t in (given.key, given.label, given.unit))
            row.min, row.max, row.width = given.min, given.max, given.width
            row.flags = _abi.DFM_PARAM_RUNTIME if given.runtime else 0
            setattr(row, "def", given.default)
        slots = law.slots()
        table = (_abi.dfm_slot * max(len(slots), 1))()
        for slot, (width, kind) in zip(table, slots):
            slot.unit, slot.width, slot.kind = _abi.DFM_PER_CONTACT, width, kind
        self.nstate = sum(width for width, _ in slots)
        effects = (ctypes.c_char_p * (len(law.effects) + 1))(*map(encoded, law.effects), None)
        self._eval, self._check = _EvalFn(self.evaluate), _CheckFn(self.refuse)
        needs, flags = law.bits()
        self.ops = _abi.dfm_friction(ctypes.sizeof(_abi.dfm_friction), needs, flags, len(slots),
                                     ctypes.addressof(table), ctypes.cast(self._eval, ctypes.c_void_p).value,
                                     ctypes.cast(self._check, ctypes.c_void_p).value)
        title = law.name or type(law).__name__
        self.type = _abi.dfm_type(
            ctypes.sizeof(_abi.dfm_type), _abi.DFM_KIND_FRICTION, encoded(self.id), encoded(title),
            encoded(law.version), encoded(law.licence), encoded(law.source or title), ctypes.addressof(rows),
            len(law.parameters), ctypes.sizeof(_abi.dfm_param), ctypes.addressof(effects),
            ctypes.addressof(self.ops))
        types = (ctypes.c_void_p * 1)(ctypes.addressof(self.type))
        self.plugin = _abi.dfm_plugin(ctypes.sizeof(_abi.dfm_plugin), _abi.DFM_ABI, _abi.DFM_ABI_DRAFT, 1,
                                      ctypes.addressof(types))
        address = ctypes.addressof(self.plugin)
        self.entry = _EntryFn(lambda _host, _abi_number, _abi_min: address)
        self.keep = [rows, table, effects, types]

    def take_error(self, failed: bool = True) -> BaseException | None:
        if not failed and isinstance(self.error, Exception):
            return None
        raised, self.error = self.error, None
        return raised

    def evaluate(self, given: int, wanted: int) -> int:
        """dfm_friction.eval; called with the interpreter's lock, whichever thread steps."""
        try:
            x = _abi.dfm_friction_in.from_address(given)
            out = _abi.dfm_friction_out.from_address(wanted)
            n, stride = x.n, x.stride
            params = _packed(x.params, self.law.width())
            inputs: dict[str, Any] = {}
            for key, columns in _INPUTS:
                address = getattr(x, key)
                array = _columns(address, columns, stride, n) if address else None
                inputs[key] = array[0] if array is not None and columns == 1 else array
            state = (_columns(x.state, self.nstate, stride, n) if self.nstate else np.zeros((0, n)))
            answer = self.law.answer(n, x.dt, params, inputs, state)
            widths = {"ft": 2, "state": self.nstate, "dft_dvt": 4, "dft_dfn": 2, "limit": 1, "stored": 1}
            for key, columns in widths.items():
                address = getattr(out, key)
                if address and columns:
                    _columns(address, columns, stride, n)[:] = getattr(answer, key)
            if out.mode:
                memory = (ctypes.c_uint8 * n).from_address(out.mode)
                np.frombuffer(memory, dtype=np.uint8)[:] = answer.mode
            return _abi.DFM_OK
        except BaseException as raised:  # nothing may pass through the library's frames
            self.error = self.error or raised
            return _abi.DFM_E_FATAL

    def refuse(self, params: int | None, why: int, capacity: int) -> int:
        """dfm_friction.check."""
        status, sentence = self.checked(_packed(params, self.law.width()))
        if sentence and why and capacity:
            said = sentence[:capacity - 1] + b"\0"
            ctypes.memmove(why, said, len(said))
        return status

    def checked(self, params: np.ndarray) -> tuple[int, bytes]:
        """The status of packed parameters, and why they are refused."""
        try:
            sentence = (self.law.refuse(self.law.by_key(params)) or "").encode()
            return _abi.DFM_E_ARG if sentence else _abi.DFM_OK, sentence
        except BaseException as raised:
            self.error = self.error or raised
            return _abi.DFM_E_FATAL, b""


class _Server:
    """Answers law_bridge.c, which is this law in another process; a thread for each connection."""

    def __init__(self, law: PythonLaw):
        self.law, self.bridge = law, Bridge(law, law.id)
        self.file = PATH.resolve().parent / "libdeform_python_law.so"
        if not self.file.exists():
            raise Error(f"{self.file} is not there: this library was built without it")

    def __enter__(self) -> _Server:
        self._folder = tempfile.TemporaryDirectory(prefix="deform", dir="/tmp")  # an address has 107 letters
        path = os.path.join(self._folder.name, "law")
        self.environment = {"DEFORM_PYTHON_LAW": path}
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(path)
        self._listener.listen(64)
        threading.Thread(target=self._accept, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._folder.cleanup()

    def _accept(self) -> None:
        while True:
            try:
                channel, _ = self._listener.accept()
            except OSError:
                return
            threading.Thread(target=self._serve, args=(channel,), daemon=True).start()

    def _description(self) -> bytes:
        law = self.law
        name = law.name or type(law).__name__

        def text(value: str) -> bytes:
            return struct.pack("I", len(value.encode())) + value.encode()

        out = b"".join(map(text, (law.id, name, law.version, law.licence, law.source or name)))
        out += struct.pack("I", len(law.parameters))
        for row in law.parameters:
            out += text(row.key) + text(row.label) + text(row.unit)
            out += struct.pack("=dddII", row.min, row.max, row.default,
                               _abi.DFM_PARAM_RUNTIME if row.runtime else 0, row.width)
        out += struct.pack("I", len(law.effects)) + b"".join(map(text, law.effects))
        out += struct.pack("III", *law.bits(), len(law.state))
        return out + b"".join(struct.pack("II", *slot) for slot in law.slots())

    def _serve(self, channel: socket.socket) -> None:
        stream = channel.makefile("rwb")
        try:
            stream.write(self._description())
            stream.flush()
            while head := stream.read(12):
                kind, n, present = struct.unpack("III", head)
                stream.write(self._evaluated(stream, n, present) if kind == 1 else self._checked(stream))
                stream.flush()
        except (OSError, ValueError, struct.error):
            pass  # the other process has ended, perhaps within a message
        finally:
            channel.close()

    def _doubles(self, stream: Any, *shape: int) -> np.ndarray:
        return np.frombuffer(stream.read(8 * int(np.prod(shape))), dtype=np.float64).reshape(shape)

    def _evaluated(self, stream: Any, n: int, present: int) -> bytes:
        dt, = struct.unpack("d", stream.read(8))
        params = self._doubles(stream, self.law.width())
        inputs: dict[str, Any] = {}
        for bit, (key, columns) in enumerate(_INPUTS):
            array = self._doubles(stream, columns, n) if present >> bit & 1 else None
            inputs[key] = array[0] if array is not None and columns == 1 else array
        state = self._doubles(stream, self.bridge.nstate, n)
        try:
            out = self.law.answer(n, dt, params, inputs, state)
        except BaseException as raised:
            self.bridge.error = self.bridge.error or raised
            return struct.pack("i", _abi.DFM_E_FATAL)
        doubles = (out.ft, out.state, out.dft_dvt, out.dft_dfn, out.limit, out.stored)
        packed = b"".join(np.asarray(a, np.float64).tobytes() for a in doubles)
        return struct.pack("i", _abi.DFM_OK) + packed + np.asarray(out.mode, np.uint8).tobytes()

    def _checked(self, stream: Any) -> bytes:
        status, sentence = self.bridge.checked(self._doubles(stream, self.law.width()))
        return struct.pack("iI", status, len(sentence[:511])) + sentence[:511]


class Law:
    """A friction law on its own, by short name, id or plugin file, or a PythonLaw: evaluate it, look at its
    parameters.

        deform.Law("lugre")(fn=[10, 10], vt=[[0.1, 0], [0, 0.2]], dt=1e-3)["ft"]     # [2,n] N
    """

    def __init__(self, law: Any, context: Context | None = None):
        self._context = context or default_context()
        out, address = ctypes.c_uint64(), ctypes.c_void_p()
        name = self._context.use_law(law) if not hasattr(law, "__fspath__") else os.fspath(law)
        check(lib.dfm_law_open(self._context.address, encoded(name), ctypes.byref(out)))
        self.handle = out.value
        self._finalize = weakref.finalize(self, lambda h, _context: quick.dfm_law_close(h), self.handle,
                                          self._context)
        check(quick.dfm_law_type(self.handle, ctypes.byref(address)))
        self.type: PluginType = read_type(address.value or 0)
        raw = _abi.dfm_type.from_address(address.value or 0)
        ops = _abi.dfm_friction.from_address(raw.ops)
        self.nstate = sum(_abi.dfm_slot.from_address(ops.slots + i * (ops.slot_size or 16)).width
                          for i in range(ops.nslot))

    def __call__(self, fn: Any, vt: Any, dt: float, *, state: Any = None, ft_stop: Any = None,
                 area: Any = 1.0, dwell: Any = 0.0, **params: Any) -> dict[str, np.ndarray]:
        """Evaluates n contacts: fn [n] N, vt [2,n] m/s, dt s, state [nstate,n], ft_stop [2,n] N (the force
        that would stop the slip; not given: far beyond what friction can do), area [n] m2, dwell [n] s;
        parameters by key. Returns ft [2,n] N, state [nstate,n], limit [n] N, mode [n], stored [n] J."""
        normal = np.ascontiguousarray(np.atleast_1d(array_of(fn, "fn", "a number for each contact")))
        n, dt = normal.size, real(dt, "dt")

        def column(values: Any, rows: int, what: str) -> np.ndarray:
            array, shape = array_of(values, what, "an array of numbers"), (rows, n) if rows > 1 else (n,)
            try:
                return np.ascontiguousarray(np.broadcast_to(array, shape))
            except ValueError:
                raise ArgumentError(f"{what} has the shape {array.shape}; expected {shape}",
                                    "DFM_E_ARG") from None
        if normal.ndim != 1:
            raise ArgumentError(f"fn has the shape {normal.shape}; expected (n,)", "DFM_E_ARG")

        values = Params(params)
        packed = np.empty(sum(row.width for row in self.type.parameters))
        count = ctypes.c_uint32()
        status = quick.dfm_law_pack(self.handle, ctypes.byref(values.struct), packed.size,
                                    packed.ctypes.data, ctypes.byref(count))
        if status < 0:
            raise self._context.failed(status)
        slip, lane, dwelt = column(vt, 2, "vt"), column(area, 1, "area"), column(dwell, 1, "dwell")
        if ft_stop is None:
            speed = np.hypot(*slip)
            ft_stop = -slip / np.where(speed > 0, speed, 1) * 1e6 * np.maximum(normal, 1)
        stop = column(ft_stop, 2, "ft_stop")
        before = np.zeros((self.nstate, n)) if state is None else np.ascontiguousarray(
            array_of(state, "state", "an array of numbers"))
        if before.shape != (self.nstate, n):
            raise ArgumentError(f"state has the shape {before.shape}; expected ({self.nstate}, {n})",
                                "DFM_E_ARG")
        given = _abi.dfm_friction_in(ctypes.sizeof(_abi.dfm_friction_in), n, n, 0, dt,
                                     packed.ctypes.data, None, *(array.ctypes.data for array in (
                                         normal, slip, stop, lane, dwelt, before)))
        # a law may use fewer rows of state with these parameters
        out = {"ft": np.empty((2, n)), "state": np.zeros((self.nstate, n)), "limit": np.empty(n),
               "mode": np.empty(n, np.uint8), "stored": np.empty(n)}
        wanted = _abi.dfm_friction_out(ctypes.sizeof(_abi.dfm_friction_out))
        for key, array in out.items():
            setattr(wanted, key, array.ctypes.data)
        status = lib.dfm_law_eval(self.handle, ctypes.byref(given), ctypes.byref(wanted))
        if status != _abi.DFM_OK:
            raise self._context.failed(status, None if status < 0 else
                                       "the law gave a value that is not finite")
        return out

    def __repr__(self) -> str:
        keys = ", ".join(row.key for row in self.type.parameters)
        return f"<deform.Law {self.type.id}: {keys}>"

"""Contexts: what holds loaded plugins and worlds; parameters by key; what plugins say of themselves."""
from __future__ import annotations

import contextlib
import ctypes
import difflib
import logging
import threading
import weakref
from dataclasses import dataclass
from typing import Any, Iterable, Iterator, Mapping

import numpy as np

from . import _abi
from ._library import ArgumentError, Error, check, default, encoded, error, lib, quick, sized
from ._values import array_of, whole

_LOG = logging.getLogger("deform")
_LEVELS = {_abi.DFM_LOG_DEBUG: logging.DEBUG, _abi.DFM_LOG_INFO: logging.INFO,
           _abi.DFM_LOG_WARNING: logging.WARNING, _abi.DFM_LOG_ERROR: logging.ERROR}
_LogFn = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int32, ctypes.c_char_p)
_VisitFn = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p)
_KINDS = {_abi.DFM_KIND_FRICTION: "friction", _abi.DFM_KIND_MODEL: "model", _abi.DFM_KIND_SOLVER: "solver"}


_names = threading.local()


@contextlib.contextmanager
def called(file: str, name: str) -> Iterator[None]:
    """While it lasts, errors and warnings of this thread name `name` in place of a file of our own."""
    _names.swap = (file, name)
    try:
        yield
    except Error as said:
        raise type(said)(str(said).replace(file, name), said.status) from None
    finally:
        del _names.swap


@_LogFn
def _log(_user: int, level: int, sentence: bytes) -> None:
    text = (sentence or b"").decode("utf-8", "replace")
    swap = getattr(_names, "swap", None)
    _LOG.log(_LEVELS.get(level, logging.ERROR), "%s", text.replace(*swap) if swap else text)


def choice(what: str, given: str, allowed: Iterable[str]) -> str:
    """given, if it is one of the allowed words; else an error that names the nearest."""
    words = list(allowed)
    if given in words:
        return given
    near = difflib.get_close_matches(str(given), words, 1)
    said = f", did you mean '{near[0]}'?" if near else ";"
    raise ArgumentError(f"{what} '{given}' is not known{said} known: {', '.join(words)}", "DFM_E_ARG")


def word(what: str, given: str, table: Mapping[str, int]) -> int:
    """The number of a word in a table; as choice() else."""
    return table[choice(what, given, table)]


def strings(words: Iterable[str]) -> Any:
    """A NULL-terminated array of C strings, which it keeps alive."""
    encoded_words = [encoded(w) for w in words]
    return (ctypes.c_char_p * (len(encoded_words) + 1))(*encoded_words, None)


@dataclass(frozen=True)
class Parameter:
    """One parameter of a law or a model: key, label, unit ("1": dimensionless), closed range and default."""

    key: str
    label: str
    unit: str
    min: float
    max: float
    default: float
    width: int = 1
    names: tuple[str, ...] = ()
    runtime: bool = False


@dataclass(frozen=True)
class PluginType:
    """What a plugin offers: `kind` is "friction", "model" or "solver"."""

    kind: str
    id: str
    name: str
    version: str
    licence: str
    source: str
    parameters: tuple[Parameter, ...]
    effects: tuple[str, ...]
    file: str

    @property
    def short_name(self) -> str:
        """The last word of its id, by which scenes and functions name it."""
        return self.id.rpartition(".")[2]


def _text(value: bytes | None) -> str:
    return (value or b"").decode("utf-8", "replace")


def _texts(address: int | None) -> tuple[str, ...]:
    out: list[str] = []
    while address:
        word = ctypes.c_char_p.from_address(address + 8 * len(out)).value
        if word is None:
            break
        out.append(_text(word))
    return tuple(out)


def read_type(address: int, file: str = "") -> PluginType:
    """A dfm_type as Python data."""
    raw = _abi.dfm_type.from_address(address)
    rows = []
    for i in range(raw.nparam):
        row = _abi.dfm_param.from_address(raw.params + i * raw.param_size)
        rows.append(Parameter(_text(row.key), _text(row.label), _text(row.unit), row.min, row.max,
                              getattr(row, "def"), row.width,
                              _texts(row.names) if row.flags & _abi.DFM_PARAM_ENUM else (),
                              bool(row.flags & _abi.DFM_PARAM_RUNTIME)))
    return PluginType(_KINDS.get(raw.kind, "other"), _text(raw.id), _text(raw.name), _text(raw.version),
                      _text(raw.licence), _text(raw.source), tuple(rows), _texts(raw.effects), file)


class Params:
    """Parameters by key as the library takes them; keeps the memory that they point to."""

    def __init__(self, values: Mapping[str, Any], known: PluginType | None = None):
        names = {p.key: p.names for p in known.parameters if p.names} if known else {}
        self._keep: list[Any] = []
        rows = (_abi.dfm_param_value * max(len(values), 1))()
        for row, (key, value) in zip(rows, values.items()):
            if isinstance(value, str):
                if key not in names:
                    raise ArgumentError(f"parameter '{key}' is the text '{value}'; expected a number",
                                        "DFM_E_ARG")
                value = names[key].index(choice(f"parameter '{key}':", value, names[key]))
            array = np.atleast_1d(array_of(value, f"parameter '{key}'", "a number")).ravel()
            self._keep.append(array)
            row.key, row.value, row.width = key.encode(), array.ctypes.data, array.size
        self._rows = rows
        self.struct = _abi.dfm_params(ctypes.sizeof(_abi.dfm_params), len(values),
                                      ctypes.addressof(rows))


def _destroy(address: int, _keep: list[Any]) -> None:
    lib.dfm_context_destroy(address)


class Context:
    """Loaded plugins and the worlds that use them. Most programs need none: worlds share a default one.

    threads: size of the pool on which a step may run; 1: none, 0: one per processor. Results do not depend
    on it. Worlds of one context may step at the same time, each in its own thread.
    """

    def __init__(self, threads: int = 1):
        definition = default(_abi.dfm_context_def)
        definition.threads = whole(threads, "threads")
        definition.log = ctypes.cast(_log, ctypes.c_void_p).value
        out = ctypes.c_void_p()
        check(lib.dfm_context_create(ctypes.byref(definition), ctypes.byref(out)))
        self.address: int = out.value or 0
        self.keep: list[Any] = [definition]
        self._laws: list[Any] = []
        self._of_class: dict[type, Any] = {}
        self._finalize = weakref.finalize(self, _destroy, self.address, self.keep)

    def load(self, path: Any) -> None:
        """Loads a plugin file (a law or model that is no part of the package)."""
        check(lib.dfm_plugin_load(self.address, encoded(path)))

    @property
    def types(self) -> list[PluginType]:
        """All loaded laws, models and solvers, by kind and id."""
        found: list[PluginType] = []
        visit = _VisitFn(lambda _user, address, file: found.append(read_type(address, _text(file))))
        check(lib.dfm_plugin_visit(self.address, ctypes.cast(visit, ctypes.c_void_p), None))
        return found

    def type(self, kind: str, name: str) -> PluginType | None:
        """The law or model of that short name or id; None where there is none."""
        of_kind = {t.id: t for t in self.types if t.kind == kind}
        named = [t for t in of_kind.values() if t.short_name == name]
        if name not in of_kind and len(named) > 1:
            ids = " and ".join(t.id for t in named)
            raise ArgumentError(f"'{name}' is the short name of {ids}; give the id", "DFM_E_ARG")
        return of_kind.get(name) or next(iter(named), None)

    def params(self, kind: str, name: str, values: Mapping[str, Any]) -> Params:
        """Values by key; a text names a value of an enumerated parameter."""
        asks = any(isinstance(v, str) for v in values.values())
        return Params(values, self.type(kind, name) if asks else None)

    def use_law(self, law: Any) -> str:
        """The id of a law given by name, as a PythonLaw or as its class; a Python law is made known here. A
        class that is written anew under its old id, as in a notebook, is another law: its id here ends in
        .2, .3, ..."""
        if isinstance(law, str):
            return law
        from .law import Bridge, PythonLaw
        if isinstance(law, type) and issubclass(law, PythonLaw):
            if law not in self._of_class:
                self._of_class[law] = law()
            law = self._of_class[law]
        if not isinstance(law, PythonLaw):
            raise TypeError(f"a law is a name or a deform.PythonLaw, not {type(law).__name__}")
        for known in self._laws:
            if known.law is law:
                return known.id
        same = sum(known.law.id == law.id for known in self._laws)
        bridge = Bridge(law, law.id if same == 0 else f"{law.id}.{same + 1}")
        check(lib.dfm_plugin_register_static(self.address, ctypes.cast(bridge.entry, ctypes.c_void_p),
                                             encoded(bridge.id.replace(".", "_"))))
        self._laws.append(bridge)
        self.keep.append(bridge)
        return bridge.id

    def raised_by_law(self, failed: bool = True) -> BaseException | None:
        """What a Python law has raised since the last look; what is no error, as KeyboardInterrupt, first.
        After a call that has not failed nothing else: an error is that of a call of another thread."""
        raised = [found for bridge in self._laws if (found := bridge.take_error(failed)) is not None]
        return min(raised, key=lambda found: isinstance(found, Exception), default=None)

    def failed(self, status: int, sentence: str | None = None,
               raised: BaseException | None = None) -> BaseException:
        """The exception that a failed call raises. An error that a Python law has raised is its cause; what
        is no error is raised itself."""
        raised = raised or self.raised_by_law()
        if raised is not None and not isinstance(raised, Exception):
            return raised
        said = error(status, sentence)
        said.__cause__ = raised
        return said


_default: Context | None = None
_lock = threading.Lock()


def default_context() -> Context:
    """The context that worlds without one share: one thread, the plugins of the package."""
    global _default
    with _lock:
        if _default is None:
            _default = Context()
        return _default


def listed(function: Any, *arguments: Any, kind: Any = ctypes.c_uint64) -> list[Any]:
    """All entries of a list of the library; the call with a capacity of 0 counts them."""
    count = ctypes.c_uint32(0)
    check(function(*arguments, 0, None, ctypes.byref(count)))
    out = (kind * max(count.value, 1))()
    if count.value:
        check(function(*arguments, count.value, ctypes.byref(out), None))
    return list(out[:count.value])


class Asked:
    """What the library knows by a handle, and what is asked of it while no step of its world runs."""

    __slots__ = ()
    handle: int

    def _free(self) -> None:
        """BusyError while a step runs."""
        raise NotImplementedError

    def _ask(self, function: Any, *arguments: Any) -> None:
        self._free()
        check(function(self.handle, *arguments))

    def _answer(self, kind: Any, function: Any, *arguments: Any) -> Any:
        """What a call writes by its last argument: a number of C or a struct."""
        out = sized(kind) if hasattr(kind, "size") else kind()
        self._ask(function, *arguments, ctypes.byref(out))
        return out

    def _wrench(self, function: Any, *arguments: Any) -> tuple[np.ndarray, np.ndarray]:
        """By its last two: a force and a moment, [3] each."""
        force, moment = (ctypes.c_double * 3)(), (ctypes.c_double * 3)()
        self._ask(function, *arguments, force, moment)
        return np.array(force), np.array(moment)

    def _listed(self, function: Any, *arguments: Any, kind: Any = ctypes.c_uint64) -> list[Any]:
        self._free()
        return listed(function, self.handle, *arguments, kind=kind)


__all__ = ["Context", "Parameter", "Params", "PluginType", "default_context", "quick"]

"""The C interface of libdeform for ctypes, read from the public headers: their constants and structs by name,
and FUNCTIONS, a pair (result, arguments) for each name."""
from __future__ import annotations

import ctypes
import pathlib
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    def __getattr__(name: str) -> Any: ...

_HERE = pathlib.Path(__file__).resolve().parent
# those that the wheel carries, or the tree's
INCLUDES = (_HERE / "native" / "include", *(up / "libdeform" / "include" for up in list(_HERE.parents)[2:3]))
_HEADERS = ("plugin base id math world body contact attach surface stream mesh scene obstacle law material "
            "model rigid toi debug query callback sensor cut tool").split()

_types: dict[str, Any] = {
    "double": ctypes.c_double, "float": ctypes.c_float, "uint64_t": ctypes.c_uint64,
    "uint32_t": ctypes.c_uint32, "int32_t": ctypes.c_int32, "uint8_t": ctypes.c_uint8,
    "size_t": ctypes.c_size_t, "bool": ctypes.c_bool, "int": ctypes.c_int, "dfm_status": ctypes.c_int32}
_constants: dict[str, int] = {}
FUNCTIONS: dict[str, tuple[Any, list[Any]]] = {}

_DECLARATION = re.compile(
    r"enum \{(?P<enum>[^}]*)\}"
    r"|typedef struct (?:\w+ )?\{(?P<members>[^}]*)\} ?(?P<struct>\w+);"
    r"|typedef struct \w+ \w+;"
    r"|typedef [^;{]*?\(\*(?P<callback>\w+)\)\([^;]*;"
    r"|typedef (?P<base>\w+) (?P<alias>\w+);"
    r"|DFM_API (?P<result>[^;(]*?)(?P<function>dfm_\w+)\((?P<arguments>(?:[^()]|\([^()]*\))*)\);")


def _plain(source: str) -> str:
    """Without comments, preprocessor lines and inline functions, on one line."""
    source = re.sub(r"/\*.*?\*/|//[^\n]*", " ", source, flags=re.S)
    source = re.sub(r"^[ \t]*#(?:[^\n\\]|\\\n|\\.)*", " ", source, flags=re.M)
    source = re.sub(r"\s+", " ", source.replace('extern "C" {', " "))
    # the library has a symbol of the same name, which ctypes calls instead
    return re.sub(r"static inline [^{;]*\{[^}]*\}", " ", source)


def _type(declared: str) -> Any:
    """The type of an argument or a result, of which a name may follow."""
    if "(*" in declared:
        return ctypes.c_void_p
    match = re.match(r"(?:const )?(\w+)((?: ?\*| ?const\b)*) ?\w*((?:\[\w*\])*)$", declared.strip())
    if not match:
        raise ValueError(f"this declaration is of no form that is known: {declared}")
    base, stars, sizes = match.groups()
    depth = stars.count("*") + sizes.count("[")
    if base == "char" and depth == 1 and declared.strip().startswith("const"):
        return ctypes.c_char_p
    return ctypes.c_void_p if depth else _types[base]


def _enum(text: str) -> None:
    value = 0
    for part in filter(None, (p.strip() for p in text.split(","))):
        name, _, given = (p.strip() for p in part.partition("="))
        value = int(given.rstrip("uU"), 0) if given else value
        _constants[name] = value
        value += 1


def _members(text: str) -> list[tuple[str, Any]]:
    out: list[tuple[str, Any]] = []
    for declaration in filter(None, (d.strip() for d in text.split(";"))):
        callback = re.match(r".*?\(\*(\w+)\)\(", declaration)
        if callback:
            out.append((callback.group(1), ctypes.c_void_p))
            continue
        base, names = re.match(r"(?:const )?(\w+) (.*)", declaration).groups()  # type: ignore[union-attr]
        for declared in names.split(","):
            stars = declared.count("*")
            bare = declared.replace("*", "").replace("const ", "").strip()
            name, sizes = re.match(r"(\w+)((?:\[\w+\])*)", bare).groups()  # type: ignore[union-attr]
            kind: Any = _types.get(base)
            if stars:
                kind = ctypes.c_char_p if (base, stars) == ("char", 1) else ctypes.c_void_p
            for size in re.findall(r"\[(\w+)\]", sizes):
                kind = kind * int(size)
            out.append((name, kind))
    return out


def _read(source: str) -> None:
    defined = re.findall(r"^#define (DFM_\w+) (\d+)u?\b", source, re.M)
    _constants.update((name, int(value)) for name, value in defined)
    for match in _DECLARATION.finditer(_plain(source)):
        found = match.groupdict()
        if found["enum"] is not None:
            _enum(found["enum"])
        elif found["struct"]:
            fields = {"_fields_": _members(found["members"]), "__module__": __name__}
            _types[found["struct"]] = type(found["struct"], (ctypes.Structure,), fields)
        elif found["callback"]:
            _types[found["callback"]] = ctypes.c_void_p
        elif found["alias"]:
            _types[found["alias"]] = _types[found["base"]]
        elif found["function"]:
            result, arguments = found["result"].strip(), found["arguments"].strip()
            FUNCTIONS[found["function"]] = (
                None if result == "void" else _type(result),
                [] if arguments in ("", "void")
                else [_type(argument) for argument in re.split(r",(?![^()]*\))", arguments)])


_folder = next((path / "deform" for path in INCLUDES if (path / "deform" / "plugin.h").is_file()), None)
if _folder is None:
    raise ImportError("deform: the C headers, which say what the library has, are in none of "
                      f"{', '.join(map(str, INCLUDES))}; install the package, or libdeform-dev")
for _header in _HEADERS:
    try:
        _read((_folder / f"{_header}.h").read_text("utf-8"))
    except Exception as _error:
        raise ImportError(f"deform: {_folder / _header}.h cannot be read ({_error}); install the headers of "
                          "the package's own version") from _error
globals().update({name: kind for name, kind in _types.items() if name.startswith("dfm_")}, **_constants)

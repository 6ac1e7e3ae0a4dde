"""Rules about the public headers: what they include and what each function's comment says."""
import re

from tree import includes, line_of, without_comments

PUBLIC = "libdeform/include/deform/"
C_HEADERS = {"stddef.h", "stdint.h", "stdbool.h"}
# memcpy is the one way to read the bits of a double that both C and C++ define.
MORE = {"elementary.h": {"string.h"}, "deprecated.h": {"math.h", "string.h"}}
# These two are for plugins, no part of the library.
NOT_IN_UMBRELLA = {"deform.h", "elementary.h", "plugin_draft.h"}
DECLARATION = re.compile(r"^DFM_API\b[^;{]*?\b(dfm_\w+)\s*\(", re.M)


ODE = "bindings/ode/include/deform/"


def declared(tree, folder=PUBLIC):
    """(path, line, name) of every function that the public headers of a folder export."""
    for path in tree.select(folder, ext=(".h",)):
        code = without_comments(tree.text(path))
        for match in DECLARATION.finditer(code):
            yield path, line_of(code, match.start()), match.group(1)


def public_headers(tree):
    """Public C headers include three C headers and each other, plugin.h only two; all have guards and C
    linkage."""
    for path in tree.select(PUBLIC, ext=(".h",)):
        name = path[len(PUBLIC):]
        content = tree.text(path)
        for line, _, other in includes(content):
            allowed = {"stddef.h", "stdint.h"} if name == "plugin.h" else C_HEADERS | MORE.get(name, set())
            beside = PUBLIC + other[len("deform/"):] in tree.paths
            if other not in allowed and (name == "plugin.h" or not beside):
                yield (path, line, f"includes {other}; allowed are {', '.join(sorted(allowed))}" +
                       ("" if name == "plugin.h" else " and deform/*.h"))
        guard = f"DEFORM_{name[:-2].upper()}_H"
        if f"#ifndef {guard}\n#define {guard}\n" not in content:
            yield path, 1, f"has no guard {guard}"
        if DECLARATION.search(without_comments(content)) and 'extern "C"' not in content:
            yield path, 1, "declares functions without extern \"C\" for C++"
    umbrella = PUBLIC + "deform.h"
    if umbrella in tree.paths:
        listed = {other for _, _, other in includes(tree.text(umbrella))}
        for path in tree.select(PUBLIC, ext=(".h",)):
            name = path[len(PUBLIC):]
            if name not in NOT_IN_UMBRELLA and "deform/" + name not in listed:
                yield umbrella, 1, f"does not include deform/{name}"


# Where what a plugin offers is called: the library, the command and its validator.
HOSTS = ("libdeform/src/", "bindings/cli/", "bindings/tools/")
# For plugins alone: the head of the entry.
NO_HOST = re.compile(r"DFM_(ABI_OK|CAT_?|EXPORT)$")
# Members that keep a place in a table, without a type: plugin_draft.h has it (plugins_and_abi.md).
SEATS = {"fetch"}


def plugin_callers(tree):
    """What plugin.h names has a caller: functions of its structs, constants, structs. The rest waits in
    plugin_draft.h."""
    path = PUBLIC + "plugin.h"
    if path not in tree.paths:
        return
    code = without_comments(tree.text(path))
    hosts = "\n".join(without_comments(tree.text(p)) for p in tree.select(*HOSTS, ext=(".cpp", ".h")))
    words = set(re.findall(r"\w+", hosts))
    members = set(re.findall(r"(?:\.|->)\s*(\w+)", hosts))
    constants = [name for names in re.findall(r"\b(DFM_\w+)\s*=|#define\s+(DFM_\w+)", code) for name in names]
    structs = re.findall(r"^typedef struct (dfm_\w+)", code, re.M)
    functions = [name for name in re.findall(r"\(\*(\w+)\)\s*\(", code)
                 if name not in SEATS and name != "fn" and not name.startswith("dfm_")]
    wanted = {name: words for name in constants + structs} | {name: members for name in functions}
    for name, used in wanted.items():
        if name and name not in used and not NO_HOST.match(name):
            line = line_of(code, re.search(rf"\b{name}\b", code).start())
            yield path, line, (f"{name} has no caller in {' or '.join(HOSTS)}; it belongs into "
                               "plugin_draft.h until it has one")


def threads(tree):
    """Each function says in a comment of its own, right above it, from which thread it may be called."""
    for path in tree.select(PUBLIC, ext=(".h",)):
        content = tree.text(path)
        code = without_comments(content)
        for match in DECLARATION.finditer(code):
            above = content[:match.start()].rstrip()
            if not above.endswith("*/") or "Threads:" not in above[above.rfind("/*"):]:
                yield (path, line_of(content, match.start()),
                       f"{match.group(1)} has no comment that says \"Threads: ...\" (see base.h for the four "
                       f"phrases)")


def cpp_complete(tree):
    """deform.hpp (with the headers that are parts of it) calls every function that the public headers
    declare, ode.hpp those of the binding. Of a function that is inline because it hands over a sizeof, either
    name will do."""
    parts_of = ["attach.hpp", "cut.hpp", "defs.hpp", "models.hpp", "obstacles.hpp", "queries.hpp",
                "result.hpp", "tools.hpp"]
    for folder, name, more in (PUBLIC, "deform.hpp", parts_of), (ODE, "ode.hpp", []):
        wrapper, functions = folder + name, list(declared(tree, folder))
        if wrapper not in tree.paths and (functions or folder == PUBLIC):
            yield wrapper, 1, "is not there"
            continue
        parts = [path for path in [wrapper, *(folder + other for other in more)] if path in tree.paths]
        used = set(re.findall(r"\bdfm_\w+", "".join(without_comments(tree.text(path)) for path in parts)))
        for path, line, function in functions:
            if not {function, function.removesuffix("_sized")} & used:
                yield wrapper, 1, f"does not reach {function} ({path}:{line}); give it a member"


def versions(tree):
    """One version: DFM_VERSION, CMake's and the newest of CHANGELOG.md; nothing came "since" a later one."""
    base = PUBLIC + "base.h"
    own = re.search(r"#define DFM_VERSION_MAJOR (\d+)\s+#define DFM_VERSION_MINOR (\d+)"
                    r"(?:\s+#define DFM_VERSION_PATCH (\d+))?", tree.text(base))
    if not own:
        return
    whole = ".".join(part for part in own.groups() if part)
    for path, pattern in (("CMakeLists.txt", r"project\(\w+ VERSION ([\d.]+)"),
                          ("CHANGELOG.md", r"^## (\d[\d.]*)")):
        said = re.search(pattern, tree.text(path) or "", re.M)
        if said and said.group(1) != whole:
            yield (path, line_of(tree.text(path), said.start()),
                   f"is of version {said.group(1)}, and DFM_VERSION in {base} says {whole}")
    for path in tree.select(PUBLIC, ODE, ext=(".h", ".hpp")):
        content = tree.text(path)
        for match in re.finditer(r"\bsince (\d+)\.(\d+)", content, re.I):
            if (int(match[1]), int(match[2])) > (int(own[1]), int(own[2])):
                yield (path, line_of(content, match.start()),
                       f"says \"{match[0]}\", and the version is {own[1]}.{own[2]}")


RULES = {"public_headers": public_headers, "plugin_callers": plugin_callers, "threads": threads,
         "cpp_complete": cpp_complete, "versions": versions}

"""Rules about code: who may include whom, where third parties stand, which numbers are allowed."""
import posixpath
import re

from tree import CODE, includes, line_of, without_comments

SRC = "libdeform/src/"
# A folder may include itself and what stands on a lower level; folders of one level never include each other.
LEVELS = [["core"], ["math"], ["geometry"], ["mesh", "plugin"], ["body"], ["dynamics", "contact"],
          ["friction", "broad", "narrow"], ["ccd"], ["plan"], ["state"], ["step"], ["world"], ["cut"],
          ["snapshot"], ["scene", "api"]]
RANK = {folder: rank for rank, folders in enumerate(LEVELS) for folder in folders}
# api/ holds one thin file per public header, and scene.h is one of them.
ALLOWED_BESIDE = {("api", "scene")}
LOOKS_INSIDE = ("tests/unit/", "tests/bench/", "tests/fuzz/", "tests/determinism/", "bindings/tools/check/",
                "bindings/tools/contact/", "bindings/tools/rollback/")

# A third party's name stands in one folder: (who, include, use in the code, folder).
THIRD_PARTIES = [
    ("Eigen", r"(Eigen|unsupported/Eigen)/", r"\bEigen::", "libdeform/src/math/"),
    ("nanoflann", r"nanoflann", r"\bnanoflann::", "libdeform/src/mesh/"),
    ("nlohmann JSON", r"nlohmann/", r"\bnlohmann::", "libdeform/src/scene/"),
    ("GL", r"(GL|GLES\d?|EGL|KHR)/", r"\b(egl[A-Z]\w+|OSMesa[A-Z]\w+)\s*\(", "bindings/render/"),
    ("PNG", r"png\.h", r"\bpng_\w+\s*\(", "bindings/render/"),
    ("GLFW", r"GLFW/", r"\bglfw[A-Z]\w*\s*\(", "bindings/view/"),
    ("Dear ImGui", r"(backends/)?imgui", r"\bImGui::", "bindings/view/"),
    ("libwebsockets", r"libwebsockets\.h", r"\blws_\w+\s*\(", "bindings/serve/"),
    ("CLI11", r"CLI/", r"\bCLI::", "bindings/cli/"),
    ("spdlog", r"spdlog/", r"\bspdlog::", "bindings/cli/"),
    ("HDF5", r"hdf5\.h", r"\bH5[A-Z]\w+\s*\(", "bindings/tools/"),
    ("ODE", r"ode/", r"\bd(World|Body|Geom|Space)Create\w*\s*\(", "bindings/ode/"),
    ("Bullet", r"(bullet/|bt[A-Z]\w+\.h|BulletDynamics|LinearMath/)", r"\bbt[A-Z]\w+", "bindings/bullet/"),
]

STEP_FOLDERS = tuple(SRC + f + "/" for f in (
    "math", "geometry", "body", "dynamics", "contact", "friction", "broad", "narrow", "ccd", "state", "step",
    "world", "cut", "snapshot"))
LIBM = ("exp exp2 expm1 log2 log10 log1p log sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh "
        "atanh sincos pow cbrt "
        "hypot erf erfc tgamma lgamma").split()
# elementary.h is header-only and needs nothing of the library: exp and pow with the same bits for everybody.
PLUGIN_HEADERS = ("deform/plugin.h", "deform/plugin.hpp", "deform/plugin_draft.h", "deform/elementary.h")
KERNEL_HEADERS = {"emmintrin.h", "simde/x86/sse2.h", "immintrin.h", "stdint.h", "stddef.h", "cstdint",
                  "cstddef", "deform/plugin.h", "math/kernel_vector.h"}


def _resolves(tree, path, name):
    return posixpath.normpath(posixpath.join(posixpath.dirname(path), name)) in tree.paths


def layers(tree):
    """core <- math <- geometry <- {mesh, plugin} <- body <- {dynamics, contact} <- {friction, broad,
    narrow} <- ccd <- plan <- state <- step <- world <- cut <- snapshot <- {scene, api}."""
    for path in tree.select(SRC):
        own = path[len(SRC):].split("/")[0]
        for line, _, name in includes(tree.text(path)):
            if name.startswith("../") or "/../" in name:
                yield path, line, f"includes {name}: name a header from libdeform/src, as in \"core/error.h\""
            other = name.split("/")[0]
            if (other not in RANK or own not in RANK or other == own or "/" not in name
                or (own, other) in ALLOWED_BESIDE):
                continue
            if RANK[other] == RANK[own]:
                yield (path, line, f"{own}/ includes {name}: {own}/ and {other}/ stand beside each other and "
                                   f"meet in a higher folder")
            elif RANK[other] > RANK[own]:
                yield path, line, f"{own}/ includes {name}, but {other}/ is built on {own}/"


def public_only(tree):
    """Bindings, examples and all tests but unit, bench, fuzz and determinism see the public headers only."""
    inside = {p[len(SRC):] for p in tree.paths if p.startswith(SRC)}
    for path in tree.select("bindings/", "examples/", "tests/"):
        if path.startswith(LOOKS_INSIDE):
            continue
        for line, _, name in includes(tree.text(path)):
            if "libdeform/src" in name or (name in inside and not _resolves(tree, path, name)):
                yield path, line, f"includes {name} from inside the library; only deform/*.h is open here"


def plugin_includes(tree):
    """A plugin is built from plugin.h alone: what it needs more, a stranger's plugin would not have. Plugins
    of one kind may share headers in plugins/KIND_common, which hold no .cpp."""
    for path in tree.select("plugins/"):
        for line, quote, name in includes(tree.text(path)):
            common = re.match(r"\.\./([a-z]+)_common/[a-z0-9_]+\.h$", name)
            shared = (common and path.startswith(f"plugins/{common.group(1)}_")
                      and f"plugins/{name[3:]}" in tree.paths)
            own = quote == '"' and (".." not in name and _resolves(tree, path, name) or shared)
            if quote == "<" and not name.startswith("deform/") or name in PLUGIN_HEADERS or own:
                continue
            yield (path, line, f"includes {name}; a plugin includes {', '.join(PLUGIN_HEADERS)}, its own "
                               f"files and header-only third parties")


def third_parties(tree):
    """A third party's name appears in one folder, so that it can be exchanged there."""
    for path in tree.select("libdeform/", "bindings/", "examples/"):
        content = tree.text(path)
        code = without_comments(content, strings=True)
        for who, include, use, folder in THIRD_PARTIES:
            if path.startswith((folder, "libdeform/doc/howto/", "examples/ode/")):   # programs of the reader
                continue
            for line, _, name in includes(content):
                if re.match(include, name):
                    yield path, line, f"includes {name}: {who} stays in {folder}"
            for match in re.finditer(use, code):
                yield (path, line_of(code, match.start()),
                       f"uses {match.group(0).strip('( ')}: {who} stays in {folder}")


def numbers(tree):
    """Same bits everywhere: no fast-math, no fused multiply-add, no estimates, no flags of one machine."""
    flags = re.compile(r"-ffast-math|-Ofast|-funsafe-math\S*|-fassociative-math|-freciprocal-math|-mfma\b|"
                       r"-march=native|-mtune=native|"
                       r"-ffp-contract=(?!off)\w+")
    calls = re.compile(r"\b(_mm\d*_(mask\w*_)?f(n?m(add|sub)(sub|add)?)_\w+|_mm\d*_(mask\w*_)?(rcp|rsqrt)\w*|"
                       r"__builtin_fmaf?|"
                       r"(std::)?fmaf?\s*\()")
    for path in tree.paths:
        content = tree.text(path)
        if content is None or path.startswith("tests/lint/"):
            continue
        if path.endswith(("CMakeLists.txt", ".cmake", ".json", "Makefile", ".sh", ".in")):
            for number, line in enumerate(content.split("\n"), 1):
                match = flags.search(line.split("#")[0])
                if match:
                    yield (path, number, f"{match.group(0)} changes results; the library is built with "
                                         f"-ffp-contract=off and plain IEEE operations")
        elif path.endswith(CODE):
            code = without_comments(content, strings=True)
            for match in calls.finditer(code):
                yield (path, line_of(code, match.start()),
                       f"{match.group(0).strip('( ')} gives other bits than a*b+c, a/b, sqrt; write those")
            for match in re.finditer(r"#\s*pragma\s+(STDC\s+FP_CONTRACT\s+ON|GCC\s+optimize)", code):
                yield path, line_of(code, match.start()), "a pragma may not change how numbers are computed"


def libm(tree):
    """libm picks its variant by processor, so inside a step only + - * / sqrt and math/elementary.h are
    used."""
    call = re.compile(r"(?<![\w.>:])(std::|::)?(" + "|".join(LIBM) + r")f?\s*\(")
    for path in tree.select(*STEP_FOLDERS, "plugins/", "libdeform/include/"):
        if path.startswith(SRC + "math/elementary"):
            continue
        code = without_comments(tree.text(path), strings=True)
        for match in call.finditer(code):
            before = code[:match.start()].rstrip(" *&")
            # a declaration of that name, not a call
            if re.search(r"\b(void|int|double|float|inline|Vec3)$", before):
                continue
            yield (path, line_of(code, match.start()),
                   f"calls libm's {match.group(2)}; take it from math/elementary.h "
                   f"(same bits on every processor)")


def kernels(tree):
    """Wide kernels see no STL and no Eigen and link internally: the linker may choose an inline function
    compiled with wide flags for the whole program, which then dies on an older processor."""
    pending = [p for p in tree.select(SRC, "plugins/") if "_kernel" in p.rsplit("/", 1)[1]]
    seen = set()
    while pending:
        path = pending.pop()
        if path in seen or tree.text(path) is None:
            continue
        seen.add(path)
        content = tree.text(path)
        for line, quote, name in includes(content):
            if name in KERNEL_HEADERS:
                continue
            shared = re.match(r"\.\./[a-z]+_common/[a-z0-9_]+\.h$", name)
            if quote == '"' and ("/" not in name or shared) and _resolves(tree, path, name):
                # its own header, or one that plugins of its kind share, keeps the same rules
                pending.append(posixpath.normpath(posixpath.join(posixpath.dirname(path), name)))
            else:
                yield (path, line, f"a kernel file includes {name}; allowed are "
                                   f"{', '.join(sorted(KERNEL_HEADERS))} and headers beside it or in "
                                   f"KIND_common")
        code = without_comments(content, strings=True)
        for match in re.finditer(r"\b(std|Eigen)::", code):
            yield path, line_of(code, match.start()), f"a kernel file uses {match.group(0)}"
        if (path.endswith(".cpp") and not re.search(r"\bnamespace\s*\{|\bstatic\b", code)
                and "#include" not in code):
            yield path, 1, "a kernel file keeps its functions in an anonymous namespace or static"
        for match in re.finditer(r"^(?:template\b[^;{]*?>\s*)?inline\b", code, re.M):
            if "namespace {" not in code[:match.start()]:
                yield (path, line_of(code, match.start()),
                       "an inline function in a kernel file needs internal linkage: static, or an anonymous "
                       "namespace")


def systems(tree):
    """In what is built for Windows, headers that it lacks are included in *_posix.cpp alone, and no name is
    converted by fs::path(name) or path.string(). Not found: implicit conversions, and functions that
    headers of both systems declare differently."""
    alone = re.compile(r"(dlfcn|elf|link|netdb|poll|spawn|arpa/\w+|"
                       r"sys/(file|mman|prctl|resource|socket|syscall|un|wait))\.h$")
    left_out = re.compile(r"_(posix|windows)\.cpp$|bindings/cli/(bullet_host|cmd_study|cmd_worker)\.cpp$")
    tools = [f"bindings/tools/{name}/" for name in ("check", "ccd", "rollback")]
    for path in tree.select(SRC, "bindings/cli/", *tools):
        content = tree.text(path)
        if left_out.search(path) or "__has_include(<link.h>)" in content:
            continue
        for line, _, name in includes(content):
            if alone.match(name):
                yield (path, line, f"includes {name}, which Windows has not: give system.h a function, and "
                                   f"system_posix.cpp and system_windows.cpp its two bodies")
        for match in re.finditer(r"filesystem::path\(|\bfs::path\(|\.string\(\)", without_comments(content)):
            if not path.endswith(("core/path.h", "bindings/cli/system.h")):
                yield (path, line_of(content, match.start()),
                       "names are UTF-8 on every system: path_of(name), name_of(path)")


def stages(tree):
    """No stage of a sub-step calls another one: step.cpp alone has their order."""
    code = {path: without_comments(tree.text(path)) for path in tree.select(SRC + "step/")}
    names = {name for text in code.values() for name in re.findall(r"\b(?:bool|Next) (stage_\w+)\(", text)}
    for path, text in code.items():
        for match in re.finditer(r"(?<!bool )(?<!Next )\b(stage_\w+)\(", text):
            if match.group(1) in names and not path.endswith("/step.cpp"):
                yield path, line_of(text, match.start()), f"calls {match.group(1)}: return Next, or a reason"


def ranges(tree):
    """What is used of std::ranges has a stand-in for the library of LLVM (WebAssembly, macOS)."""
    stand_ins = "".join(tree.text(path) for path in tree.select("cmake/libcxx.h"))
    given = set(re.findall(r"^(?:auto|bool|void) (\w+)\(R ", stand_ins, re.M))
    for path in tree.select("libdeform/src/", "plugins/", "bindings/"):
        for match in re.finditer(r"\branges::(\w+)", tree.text(path)):
            if match[1] not in given:
                yield (path, line_of(tree.text(path), match.start()),
                       f"std::ranges::{match[1]} has no stand-in in cmake/libcxx.h; add it there")


RULES = {"layers": layers, "public_only": public_only, "systems": systems, "plugin_includes": plugin_includes,
         "third_parties": third_parties, "stages": stages, "ranges": ranges,
         "numbers": numbers, "libm": libm, "kernels": kernels}

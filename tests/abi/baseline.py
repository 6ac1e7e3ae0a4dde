#!/usr/bin/env python3
"""Is what programs and plugins were built against still there? The public headers are compared with those
of ABI 1 (baseline/public.txt: one file, without comments): functions, types and layouts by abidiff, where
abigail-tools is installed, the values of constants by compiling both. Both sides go through the same
compiler, so that its version makes no difference. That the library exports what the headers declare is
asked by exports.py.

baseline.py CC INCLUDE_DIR STORED SCRATCH          compares; exit 77 where only abidiff's part was passed over
baseline.py CC INCLUDE_DIR STORED SCRATCH --self   spoils the stored headers in ways that must be found
baseline.py CC INCLUDE_DIR STORED SCRATCH --report   tells what changed, for release notes
baseline.py CC INCLUDE_DIR STORED --write          writes STORED again
"""
import pathlib
import re
import shutil
import subprocess
import sys

# plugin_draft.h and deprecated.h are no promise; elementary.h has inline functions only, which become part of
# the plugin.
LEFT_OUT = {"plugin_draft.h", "deprecated.h", "elementary.h", "deform.h"}
TOLD = """
An addition (a function, a constant, a member at the end of a struct): write the baseline anew with
  python3 tests/abi/baseline.py cc libdeform/include/deform tests/abi/baseline/public.txt --write
and add it to CHANGELOG.md. Anything else breaks programs or plugins that are built already: take it back; of
plugin.h it would need another DFM_ABI (libdeform/doc/reference/abi.md)."""


def without_comments(text):
    return re.sub(r"/\*.*?\*/|//[^\n]*", "", text, flags=re.S)


def merged(include):
    """The headers as one: each after those that it includes, without comments, guards and own includes."""
    done, out = set(), []

    def take(name):
        if name in done or name in LEFT_OUT:
            return
        done.add(name)
        text = without_comments((pathlib.Path(include) / name).read_text())
        for other in re.findall(r'^#include "deform/(\S+)"', text, re.M):
            take(other)
        text = re.sub(r'^#include "deform/\S+"[ \t]*\n', "", text, flags=re.M)
        text = re.sub(r"^#(?:ifndef|define) DEFORM_\w+_H\n", "", text, flags=re.M)
        text = re.sub(r"#endif\s*\Z", "", text)
        # __cplusplus: the stored file is C
        text = re.sub(r'^#ifdef __cplusplus\n(?:extern "C" \{|\})\n#endif\n', "", text, flags=re.M)
        out.append(re.sub(r"[ \t]+\n", "\n", re.sub(r"\n\s*\n+", "\n", text)).strip("\n"))

    for path in sorted(pathlib.Path(include).glob("*.h")):
        take(path.name)
    return "\n".join(out) + "\n"


def program(text):
    """A library in which every public function has a body and every type a variable that leads to it."""
    out = [text]
    for declaration in re.findall(r"^DFM_API\b[^;{]*?\bdfm_\w+\s*\([^;{]*\)(?=;)", text, re.M):
        out.append(declaration + " { __builtin_trap(); }")
    for name in re.findall(r"^static inline dfm_\w+ (dfm_\w+)\s*\(", text, re.M):
        out.append(f"__typeof__(&{name}) abi_{name} = {name};")
    for name in re.findall(r"^(?:\}|typedef struct \w+ \{[^{}]*\}) (dfm_\w+);", text, re.M):
        out.append(f"const {name} *abi_{name};")
    for name in re.findall(r"^typedef [^;{]*\(\*(dfm_\w+)\)\(", text, re.M):
        out.append(f"{name} abi_{name};")
    return "\n".join(out) + "\n"


def run(*argv, **more):
    done = subprocess.run([str(a) for a in argv], capture_output=True, text=True, **more)
    if done.returncode:
        sys.exit(" ".join(map(str, argv)) + f" failed:\n{done.stdout}{done.stderr}")
    return done.stdout


def library(compiler, text, folder, name):
    source, made = folder / f"{name}.c", folder / f"{name}.so"
    source.write_text(program(text))
    run(compiler, "-std=gnu11", "-g", "-O0", "-w", "-shared", "-fPIC", source, "-o", made)
    return made


def constants(compiler, text, folder, name):
    """{name: value} of enumerators and macros that are numbers or words."""
    code = re.sub(r"\\\n", "", text)
    rows = []
    for body in re.findall(r"\benum\b[^{;]*\{([^}]*)\}", code):
        words = re.findall(r"\b(DFM_\w+)\s*(?:=|,|$)", body)
        rows += [(word, "%lld", f"(long long)({word})") for word in words]
    for word, value in re.findall(r"^#define (DFM_\w+) +(\S.*)$", code, re.M):
        if value.startswith('"'):
            rows.append((word, "%s", word))
        elif re.match(r"[-(0-9]", value):
            rows.append((word, "%.17g", f"(double)({word})"))
    lines = [f'printf("{word}={form}\\n", {what});' for word, form, what in dict.fromkeys(rows)]
    source = folder / f"{name}_constants.c"
    source.write_text(text + "#include <stdio.h>\nint main(void) {\n" + "\n".join(lines) + "\n}\n")
    run(compiler, "-std=gnu11", "-w", "-c", source, "-o", folder / f"{name}_constants.o")
    run(compiler, "-w", folder / f"{name}_constants.o", "-o", folder / f"{name}_constants",
        "-Wl,--unresolved-symbols=ignore-all")
    said = run(folder / f"{name}_constants")
    return dict(line.split("=", 1) for line in said.splitlines())


def differences(compiler, before, after, folder):
    """Sentences; and whether abidiff was there."""
    folder.mkdir(parents=True, exist_ok=True)
    out = []
    old, new = (constants(compiler, text, folder, name) for text, name in ((before, "old"), (after, "new")))
    for name in sorted(old.keys() | new.keys()):
        if old.get(name) != new.get(name):
            out.append(f"{name} was {old.get(name, 'nothing')} and is {new.get(name, 'gone')}")
    tool = shutil.which("abidiff")
    if tool:
        files = [library(compiler, text, folder, name) for text, name in ((before, "old"), (after, "new"))]
        done = subprocess.run([tool, "--no-show-locs", *map(str, files)], capture_output=True, text=True)
        if done.returncode & 3:
            sys.exit(f"abidiff failed:\n{done.stdout}{done.stderr}")
        if done.returncode:
            out.append(done.stdout)
    return out, bool(tool)


# Each changes the text once, and must be found.
SPOILT = [
    ("a function that is gone", r"^DFM_API dfm_status dfm_body_wake\([^;]*;\n", ""),
    ("another type of an argument", r"(dfm_body_apply_impulse\([^;]*)const double impulse\[3\]",
     r"\1const float impulse[3]"),
    ("two members in another order", r"(typedef struct dfm_kin \{\s*)uint32_t size, stride;\s*double t, dt;",
     r"\1double t, dt; uint32_t size, stride;"),
    ("a member in the middle", r"(typedef struct dfm_mesh \{\s*uint32_t size,)", r"\1 flavor,"),
    ("another signature in a table", r"\(\*add_forces\)\(void \*self, const dfm_kin \*k, double \*f\)",
     "(*add_forces)(void *self, const dfm_kin *k, float *f)"),
    ("another value", r"\bDFM_NEED_VT = 2\b", "DFM_NEED_VT = 32"),
    ("another word", r'"dfm\.slots/1"', '"dfm.slots/2"'),
    ("a member at the end", r"(\bdouble \*state_out;\n)\} dfm_kin;", r"\1const uint8_t *held;\n} dfm_kin;"),
]


def main():
    compiler, include, stored = sys.argv[1:4]
    now = merged(include)
    if sys.argv[4] == "--write":
        pathlib.Path(stored).write_text(now)
        return 0
    before, folder = pathlib.Path(stored).read_text(), pathlib.Path(sys.argv[4])
    if sys.argv[-1] == "--report":
        print("\n".join(differences(compiler, before, now, folder)[0]) or "nothing changed")
        return 0
    if sys.argv[-1] == "--self":
        for number, (what, pattern, by) in enumerate(SPOILT):
            after, n = re.subn(pattern, by, before, count=1, flags=re.M)
            if n != 1:
                sys.exit(f"{what}: the pattern finds nothing to spoil")
            found, there = differences(compiler, before, after, folder / str(number))
            of_constants = "another" in what and ("value" in what or "word" in what)
            if not found and (there or of_constants):
                sys.exit(f"{what}: not found")
            print(f"{what}: found" if found else f"{what}: needs abidiff")
        return 0
    found, there = differences(compiler, before, now, folder)
    for sentence in found:
        print(sentence)
    if found:
        print(TOLD)
        return 1
    print("as stored" if there else "constants as stored; functions and layouts were not compared: abidiff "
          "is not here (abigail-tools of cmake/deps.txt)")
    return 0 if there else 77


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""deform.hpp costs nothing: in hpp_cost.cpp, compiled with -O2, what goes through the wrapper makes the same
calls as what goes through the C API, in as many instructions give or take MOVES register moves; and every
member compiles, without exceptions too, and may stand in two units of one program.

hpp_cost.py OBJDUMP INCLUDE_DIR SOURCE COMPILER...    compilers that are not there are passed by
"""
import itertools
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

MOVES = 2   # what gcc 12 and clang 14 need to take a struct of two registers apart
PAIRS = {"-fexceptions": 10, "-fno-exceptions": 6}


def functions(objdump, obj):
    """name: its instructions, padding left out, with what they refer to. What a compiler moves out of the way
    (NAME.cold) belongs to NAME."""
    text = subprocess.run([objdump, "-dr", "--no-show-raw-insn", "-Mintel", obj], capture_output=True,
                          text=True, check=True).stdout
    found, name = {}, None
    for line in text.splitlines():
        if head := re.match(r"[0-9a-f]+ <(\w+)(?:\.\w+)*>:$", line):
            name = head[1]
            found.setdefault(name, [])
        elif name and (target := re.match(r"\s+[0-9a-f]+: R_X86_64_\w+\s+(\S+?)(?:-0x4)?$", line)):
            found[name][-1] += " -> " + target[1]
        elif name and (code := re.match(r"\s+[0-9a-f]+:\s+(.*?)\s*$", line)):
            if not re.match(r"nop|data16|cs nop|xchg\s+ax,ax", code[1]):
                found[name].append(code[1])
    return found


def calls(code):
    """What a function calls, its own cold part left out."""
    return [line.split(" -> ")[1] for line in code if line.startswith("call") and " -> " in line]


def check(objdump, include, source, compiler, mode, folder):
    obj = pathlib.Path(folder) / "hpp_cost.o"
    flags = ["-std=c++20", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror", mode,
             f"-I{include}"]
    subprocess.run([compiler, *flags, "-c", source, "-o", obj], check=True)
    code = functions(objdump, obj)
    pairs = [name[2:] for name in code if name.startswith("c_")]
    dearer = 0
    for name in pairs:
        plain, wrapped = code["c_" + name], code["hpp_" + name]
        if calls(plain) != calls(wrapped) or len(wrapped) > len(plain) + MOVES:
            dearer += 1
            print(f"{compiler} {mode}: {name} costs more through the wrapper:")
            print("\n".join(f"  {a:60} {b}" for a, b in itertools.zip_longest(plain, wrapped, fillvalue="")))
    if len(pairs) != PAIRS[mode]:
        sys.exit(f"{compiler} {mode}: {len(pairs)} pairs found, {PAIRS[mode]} expected")
    total = [sum(len(code[side + name]) for name in pairs) for side in ("c_", "hpp_")]
    print(f"{compiler} {mode}: {len(pairs)} pairs, {total[0]} instructions in C, {total[1]} through the "
          f"wrapper; {dearer} cost more")
    return dearer


def header_only(include, compiler, folder):
    """A unit with every member and one with the header link into one library without a name defined twice."""
    header = "#include <deform/deform.hpp>\n"
    members = "".join(
        f"template class deform::basic::{name}<deform::{mode}>;\n" for mode in ("Values", "Throw")
        for name in ("Context", "World", "Body", "Obstacle", "Rigid", "Material", "Law", "Scene", "Mesh"))
    paths = [pathlib.Path(folder) / f"unit{i}.cpp" for i in (1, 2)]
    for path, text in zip(paths, (header + members, header)):
        path.write_text(text)
    subprocess.run([compiler, "-std=c++20", "-shared", "-fPIC", f"-I{include}", *paths, "-o",
                    pathlib.Path(folder) / "units.so"], check=True)


def main():
    objdump, include, source, *compilers = sys.argv[1:]
    dearer, tried = 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for compiler in {os.path.realpath(path): c for c in compilers if (path := shutil.which(c))}.values():
            for mode in PAIRS:
                dearer += check(objdump, include, source, compiler, mode, folder)
                tried += 1
        header_only(include, compilers[0], folder)
    return 1 if dearer or not tried else 0


if __name__ == "__main__":
    sys.exit(main())

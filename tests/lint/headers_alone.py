#!/usr/bin/env python3
"""Each public header compiles alone in every language that a host may speak; by clang, the headers for C also
for Windows with Microsoft's compiler, whose C library is a few declarations here.

headers_alone.py INCLUDE_DIR COMPILER...    C compilers; each is tried as C and as C++ (gcc -x c++, clang -x
                                            c++)
"""
import atexit
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

FLAGS = ["-fsyntax-only", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror"]
CPP20 = {"attach.hpp", "cut.hpp", "defs.hpp", "deform.hpp", "models.hpp", "obstacles.hpp", "queries.hpp",
         "tools.hpp", "result.hpp"}   # std::span
LANGUAGES = {"c99": "c", "c++17": "c++", "c++20": "c++"}
MICROSOFT = {"math.h": "#define INFINITY __builtin_inff()\n#define NAN __builtin_nanf(\"\")\n",
             "string.h": "void *memcpy(void *, const void *, __SIZE_TYPE__);\n"}


def standards(header):
    """The oldest of each language that the header is for."""
    if header.suffix == ".h":
        return ("c99", "c++17")
    return ("c++20",) if header.name in CPP20 else ("c++17",)


def targets(compiler, language, library):
    yield []
    if compiler == "clang" and language == "c":
        yield ["--target=x86_64-pc-windows-msvc", "-ffreestanding", "-fms-compatibility", "-isystem", library]


def main():
    include, compilers = pathlib.Path(sys.argv[1]), sys.argv[2:]
    headers = sorted(p for p in (include / "deform").iterdir() if p.suffix in (".h", ".hpp"))
    if not headers:
        print(f"no headers in {include}/deform")
        return 1
    failed = tried = 0
    library = tempfile.mkdtemp()
    atexit.register(shutil.rmtree, library)
    for name, text in MICROSOFT.items():
        (pathlib.Path(library) / name).write_text(text)
    for compiler in {os.path.realpath(path): c for c in compilers if (path := shutil.which(c))}.values():
        for standard, language in LANGUAGES.items():
            for header in headers:
                if standard not in standards(header):
                    continue
                # Twice: a header without a working guard fails.
                source = f'#include "deform/{header.name}"\n' * 2 + "extern int nothing_else;\n"
                for target in targets(compiler, language, library):
                    run = subprocess.run([compiler, *target, "-x", language, f"-std={standard}", *FLAGS,
                                          f"-I{include}", "-"], input=source, capture_output=True, text=True)
                    tried += 1
                    if run.returncode:
                        failed += 1
                        print(f"{compiler} {' '.join(target)} {standard} {header.name}:\n{run.stderr}")
    print(f"{tried} compilations, {failed} failed")
    return 1 if failed or not tried else 0


if __name__ == "__main__":
    sys.exit(main())

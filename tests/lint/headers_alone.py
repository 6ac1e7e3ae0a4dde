#!/usr/bin/env python3
"""Each public header compiles alone in every language that a host may speak.

headers_alone.py INCLUDE_DIR COMPILER...    C compilers; each is tried as C and as C++ (gcc -x c++, clang -x
                                            c++)
"""
import pathlib
import shutil
import subprocess
import sys

FLAGS = ["-fsyntax-only", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror"]
CPP20 = {"attach.hpp", "cut.hpp", "defs.hpp", "deform.hpp", "models.hpp", "obstacles.hpp", "queries.hpp",
         "tools.hpp", "result.hpp"}   # std::span
LANGUAGES = {"c99": "c", "c17": "c", "c++17": "c++", "c++20": "c++"}


def main():
    include, compilers = pathlib.Path(sys.argv[1]), sys.argv[2:]
    headers = sorted(p for p in (include / "deform").iterdir() if p.suffix in (".h", ".hpp"))
    if not headers:
        print(f"no headers in {include}/deform")
        return 1
    failed = tried = 0
    for compiler in filter(shutil.which, compilers):
        for standard, language in LANGUAGES.items():
            for header in headers:
                if (header.suffix == ".hpp" and language == "c" or header.name in CPP20
                    and standard != "c++20"):
                    continue
                # Twice: a header without a working guard fails.
                source = f'#include "deform/{header.name}"\n' * 2 + "extern int nothing_else;\n"
                run = subprocess.run([compiler, "-x", language, f"-std={standard}", *FLAGS, f"-I{include}",
                                      "-"], input=source,
                                     capture_output=True, text=True)
                tried += 1
                if run.returncode:
                    failed += 1
                    print(f"{compiler} {standard} {header.name}:\n{run.stderr}")
    print(f"{tried} compilations, {failed} failed")
    return 1 if failed or not tried else 0


if __name__ == "__main__":
    sys.exit(main())

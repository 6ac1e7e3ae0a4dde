#!/usr/bin/env python3
"""The Conan recipe, followed as somebody does who has no remote: conan create, with the headers of the
system, shared; then test_package against what came out. The objects are those of BUILD_DIR (ready.py), but
for the one that the place of the package goes into.

conan.py BUILD_DIR SOURCE_DIR SCRATCH_DIR CONAN
"""
import pathlib
import re
import shutil
import sys

import ready
from installed_tree import clean_environment, run, without_spaces


def main():
    build, source, scratch, conan = sys.argv[1:]
    scratch = without_spaces(scratch)
    shutil.rmtree(scratch, ignore_errors=True)
    env = {**clean_environment(), **ready.prepare(scratch / "ready", source, build),
           "CONAN_HOME": str(scratch / "home")}
    run(conan, "profile", "detect", env=env)
    run(conan, "remote", "disable", "*", env=env)
    recipe = pathlib.Path(source) / "cmake" / "packaging" / "conan"
    unity = ready.settings(build, "DEFORM_UNITY:")[0].split("=")[1]
    given = ["-o", "deform/*:system=True", "-s", "build_type=Release",
             "-c", "tools.cmake.cmaketoolchain:generator=Ninja",
             "-c", f"tools.cmake.cmaketoolchain:extra_variables={{'DEFORM_UNITY': '{unity}'}}"]
    run(conan, "create", recipe, "--test-folder=", *given, env=env)
    shutil.copytree(recipe / "test_package", scratch / "test",
                    ignore=shutil.ignore_patterns("build"))
    said = run("sh", "-c", '"$@" 2>&1', "sh", conan, "test", scratch / "test", "deform/0.1.0", *given,
               env=env)
    if not re.search(r"^deform [\d.]+: \d+ laws and models$", said, re.M):
        sys.exit("the program of test_package said nothing")
    compiled = scratch / "ready" / "compiled"
    files = re.findall(r"^\S+$", compiled.read_text(), re.M) if compiled.exists() else []
    if set(files) - {"libdeform/src/plugin/shared_object.cpp"}:
        sys.exit(f"other commands than those of {build}:\n{compiled.read_text()}")
    package = next((scratch / "home").glob("p/b/*/p/conaninfo.txt")).parent
    for needed in ("licenses/LICENSE", "lib/cmake/deform/deformConfig.cmake", "include/deform/deform.h"):
        if not (package / needed).exists():
            sys.exit(f"the package has no {needed}")


if __name__ == "__main__":
    main()

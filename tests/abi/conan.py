#!/usr/bin/env python3
"""The Conan recipe, followed as somebody does who has no remote: conan create, with the headers of the
system, shared; then test_package against what came out. The objects are those of BUILD_DIR (ready.py), but
for the one that the place of the package goes into.

conan.py BUILD_DIR SOURCE_DIR SCRATCH_DIR CONAN [arm64|windows]
The last one says for which other system BUILD_DIR was built; its emulator runs the program.
"""
import pathlib
import re
import shutil
import sys

import ready
from installed_tree import clean_environment, run, without_spaces


# By system: settings of Conan, and what runs its programs with the libraries of a folder.
PORTS = {"arm64": ("os=Linux arch=armv8 compiler.libcxx=libstdc++11",
                   lambda package: ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu", "-E",
                                    f"LD_LIBRARY_PATH={package}/lib"]),
         "windows": ("os=Windows arch=x86_64 compiler.threads=posix compiler.exception=seh "
                     "compiler.libcxx=libstdc++11",
                     lambda package: ["env", f"WINEPATH={package}/bin", "WINEDEBUG=-all", "wine"])}


def main():
    build, source, scratch, conan, *port = sys.argv[1:]
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
    for system in port:
        for word in f"compiler=gcc compiler.version=12 {PORTS[system][0]}".split():
            given += ["-s:h", word]
        toolchain = f"{source}/cmake/ports/{system}.cmake"
        given += ["-c:h", f"tools.cmake.cmaketoolchain:user_toolchain=['{toolchain}']"]
    run(conan, "create", recipe, "--test-folder=", *given, env=env)
    shutil.copytree(recipe / "test_package", scratch / "test",
                    ignore=shutil.ignore_patterns("build"))
    said = run("sh", "-c", '"$@" 2>&1', "sh", conan, "test", scratch / "test", "deform/0.1.0", *given,
               env=env)
    package = next((scratch / "home").glob("p/b/*/p/conaninfo.txt")).parent
    for system in port:
        example = next(p for p in (scratch / "test").rglob("example*") if p.suffix in ("", ".exe"))
        said = run(*PORTS[system][1](package), example, env=env)
    if not re.search(r"^deform [\d.]+: \d+ laws and models$", said, re.M):
        sys.exit("the program of test_package said nothing")
    compiled = scratch / "ready" / "compiled"
    files = re.findall(r"^\S+$", compiled.read_text(), re.M) if compiled.exists() else []
    if not port and set(files) - {"libdeform/src/plugin/shared_object.cpp"}:
        sys.exit(f"other commands than those of {build}:\n{compiled.read_text()}")
    for needed in ("licenses/LICENSE", "lib/cmake/deform/deformConfig.cmake", "include/deform/deform.h"):
        if not (package / needed).exists():
            sys.exit(f"the package has no {needed}")


if __name__ == "__main__":
    main()

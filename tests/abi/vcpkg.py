#!/usr/bin/env python3
"""The vcpkg port, by a stand-in for vcpkg's functions (vcpkg_stand_in.cmake): options, build and installation
are real, and a program and a plugin are built with the CMake package where vcpkg has moved it. The manifest
names what CMakeLists.txt asks for. The objects are those of BUILD_DIR (ready.py).

vcpkg.py BUILD_DIR SOURCE_DIR SCRATCH_DIR
"""
import json
import pathlib
import re
import shutil
import sys

import ready
from installed_tree import clean_environment, run, without_spaces


def main():
    build, source, scratch = sys.argv[1:]
    if not shutil.which("ninja"):
        print("no ninja on this machine, with which vcpkg builds")
        sys.exit(77)
    scratch = without_spaces(scratch)
    shutil.rmtree(scratch, ignore_errors=True)
    here = pathlib.Path(__file__).resolve().parent
    port = pathlib.Path(source) / "cmake" / "packaging" / "vcpkg" / "deform"
    manifest = json.loads((port / "vcpkg.json").read_text())
    project = (pathlib.Path(source) / "CMakeLists.txt").read_text()
    version = re.search(r"project\(deform VERSION ([\d.]+)", project).group(1)
    if manifest["version"] != version:
        sys.exit(f"vcpkg.json is of {manifest['version']}, the library of {version}")
    env = {**clean_environment(), **ready.prepare(scratch / "ready", source, build)}
    run("cmake", f"-DPORT_DIR={port}", f"-DOUT={scratch}", "-DVCPKG_LIBRARY_LINKAGE=dynamic",
        "-DARGUMENTS=" + ";".join(ready.settings(build)), "-P", here / "vcpkg_stand_in.cmake", env=env)
    compiled = scratch / "ready" / "compiled"
    files = re.findall(r"^\S+$", compiled.read_text(), re.M) if compiled.exists() else []
    if set(files) - {"libdeform/src/plugin/shared_object.cpp"}:
        sys.exit(f"other commands than those of {build}:\n{compiled.read_text()}")
    prefix = scratch / "installed"
    for needed in ("share/deform/usage", "share/deform/copyright", "share/deform/deformConfig.cmake",
                   "lib/libdeform.so.0"):
        if not (prefix / needed).exists():
            sys.exit(f"the package has no {needed}")
    prefix = prefix.rename(scratch / "moved")
    clean = clean_environment()
    run("cmake", "-S", here / "stranger", "-B", scratch / "host", f"-DCMAKE_PREFIX_PATH={prefix}",
        "-DCMAKE_BUILD_TYPE=Release", env=clean)
    run("cmake", "--build", scratch / "host", env=clean)
    run(scratch / "host" / "host", next((scratch / "host").glob("slab.*")), env=clean)


if __name__ == "__main__":
    main()

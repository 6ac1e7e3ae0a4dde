#!/usr/bin/env python3
"""The library as a part of somebody else's project (FetchContent, and add_subdirectory under it): configured
by a project with strict flags of its own, linked, run with the plugins that it finds at run time, and
installed with the project, since this one asks for it. The objects are those of BUILD_DIR where the commands
are the same (ready.py), and all must be. As an archive it is configured alone.

within.py BUILD_DIR SOURCE_DIR SCRATCH_DIR
"""
import pathlib
import shutil
import sys

import ready
from installed_tree import clean_environment, run, without_spaces


STRICT = "-Werror;-Wconversion;-Wold-style-cast;-ffast-math"   # none of which may reach the library


def main():
    build, source, scratch = sys.argv[1:]
    scratch = without_spaces(scratch)
    shutil.rmtree(scratch, ignore_errors=True)
    here = pathlib.Path(__file__).resolve().parent / "within"
    env = {**clean_environment(), **ready.prepare(scratch / "ready", source, build)}
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    configure = ["cmake", "-S", here, f"-DDEFORM_SOURCE={source}", f"-DSTRICT={STRICT}",
                 *ready.settings(build), *generator]
    project = scratch / "shared"
    env["READY_BUILD"] = str(project / "_deps" / "deform-build")
    run(*configure, "-B", project, "-DDEFORM_INSTALL=ON", env=env)
    run("cmake", "--build", project, "--target", "host", "slab", "--parallel", "2", env=env)
    run(project / "host", project / "slab.so", env=clean_environment())
    run("cmake", "--install", project, "--prefix", scratch / "installed", env=env)
    if not list((scratch / "installed").rglob("deformConfig.cmake")):
        sys.exit("DEFORM_INSTALL installed no CMake package")
    run(*configure, "-B", scratch / "archive", "-DDEFORM_SHARED=OFF", env=env)
    compiled = scratch / "ready" / "compiled"
    if compiled.exists():
        sys.exit(f"other commands than those of {build}:\n{compiled.read_text()}")


if __name__ == "__main__":
    main()

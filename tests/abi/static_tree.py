#!/usr/bin/env python3
"""A build with DEFORM_PLUGINS_STATIC, installed, moved, and linked whole (-static) into an application that
has no dynamic linker: by CMake and by pkg-config. The scene it runs ends in the same bits as in the build
that loads plugins from files, and nothing refers to dlopen.

static_tree.py STATIC_BUILD SOURCE_DIR SCRATCH_DIR DYNAMIC_BUILD [C_COMPILER]
"""
import json
import pathlib
import shutil
import subprocess
import sys

from installed_tree import clean_environment, install, run, without_spaces

SCENE, STEPS = "examples/scenes/slope_block.json", 200
DYNAMIC_LINKER = {"dlopen", "dlsym", "dlclose", "dlerror", "dladdr"}
# plugins/CMakeLists.txt keeps these out of the library: two link libraries under the GPL, one opens the
# Vulkan loader at run time.
FILES_ONLY = {"solver_cholmod", "solver_petsc", "model_gpu"}


def asked_for(*paths):
    """Symbols that object files, archives or programs leave to others."""
    out = subprocess.run(["nm", "-u", *map(str, paths)], capture_output=True, text=True, check=True).stdout
    return {words[-1].split("@")[0] for line in out.splitlines() if len(words := line.split()) == 2}


def hash_of_the_dynamic_build(build, source, scratch, step):
    out = scratch / "dynamic"
    run(pathlib.Path(build) / "bin" / "deform", "run", pathlib.Path(source) / SCENE, "--out", out, "--time",
        STEPS * step, "--quiet")
    summary = json.loads((out / "summary.json").read_text())
    if summary["steps"] != STEPS or summary["contacts"]["max"] == 0:
        sys.exit(f"{SCENE} took {summary['steps']} steps with {summary['contacts']['max']} contacts; {STEPS} "
                 f"steps that touch are compared")
    return summary["state_hash"]


def main():
    static_build, source, scratch, dynamic_build, *rest = sys.argv[1:]
    compiler = rest[0] if rest else "cc"
    scratch = without_spaces(scratch)
    here = pathlib.Path(__file__).resolve().parent / "embedded"
    env = clean_environment()
    prefix, libdir = install(static_build, source, scratch)
    archive = prefix / libdir / "libdeform.a"
    if found := asked_for(archive) & DYNAMIC_LINKER:
        sys.exit(f"{archive} refers to {', '.join(sorted(found))}")
    if list(prefix.rglob("*.so*")):
        sys.exit(f"{prefix} holds shared objects")

    run("cmake", "-S", here, "-B", scratch / "cmake", f"-DCMAKE_PREFIX_PATH={prefix}",
        "-DCMAKE_BUILD_TYPE=Release", env=env)
    # The linker warns where a program without a dynamic linker holds a call of one.
    built = run("cmake", "--build", scratch / "cmake", "--clean-first", env=env)
    if "warning: Using 'dl" in built:
        sys.exit("the application calls the dynamic linker")

    flags = run("pkg-config", "--cflags", "--libs", "deform",
                env={**env, "PKG_CONFIG_PATH": str(prefix / libdir / "pkgconfig")}).split()
    by_pkg_config = scratch / "embedded_by_pkg_config"
    run(compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", here / "embedded.c",
        scratch / "cmake" / "libslab.a", "-o", by_pkg_config, *flags, env=env)

    step = json.loads((pathlib.Path(source) / SCENE).read_text())["time"]["step"]
    wanted = hash_of_the_dynamic_build(dynamic_build, source, scratch, step)
    plugin = next(pathlib.Path(dynamic_build).glob("lib/deform/plugins-*/friction_none.so")).resolve()
    for program in (scratch / "cmake" / "embedded", by_pkg_config):
        if found := asked_for(program) & DYNAMIC_LINKER:
            sys.exit(f"{program} refers to {', '.join(sorted(found))}")
        said = run(program, pathlib.Path(source) / SCENE, STEPS, step, plugin, env=env)
        if f"state_hash {wanted}\n" not in said:
            sys.exit(f"{program} does not end {SCENE} in the bits of {dynamic_build}: {wanted}")
        for folder in sorted((pathlib.Path(source) / "plugins").iterdir()):
            inside = any(folder.glob("*.cpp")) and folder.name not in FILES_ONLY
            if inside and f"from static:{folder.name}\n" not in said:
                sys.exit(f"{program} does not hold plugin {folder.name}")
    print(f"static and dynamic build end {SCENE} after {STEPS} steps in {wanted}")


if __name__ == "__main__":
    main()

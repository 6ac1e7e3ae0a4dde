#!/usr/bin/env python3
"""Installs into a scratch prefix, moves it, and does there what a stranger does: build a host with CMake and
one with pkg-config, build a law with deform_add_plugin, run them, ask the command which plugins it finds.
Nothing may point back into the build or source tree.

installed_tree.py BUILD_DIR SOURCE_DIR SCRATCH_DIR C_COMPILER
"""
import atexit
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile


# Subcommands that are programs of their own.
PROGRAMS = [("plugin", "check"), ("cost",), ("calibrate",), ("friction",), ("mesh", "from-labels")]


def run(*argv, env=None):
    """Runs and returns stdout; prints everything and ends the test where it fails."""
    done = subprocess.run([str(a) for a in argv], capture_output=True, text=True, env=env)
    print("$", *argv)
    print(done.stdout + done.stderr)
    if done.returncode:
        sys.exit(f"exit {done.returncode}")
    return done.stdout


def clean_environment():
    """Nothing of this process tells a stranger's build where our trees are."""
    return {k: v for k, v in os.environ.items() if not k.startswith(("DEFORM_", "LD_", "CMAKE_"))}


def without_spaces(folder):
    """The folder, or one elsewhere: a shell splits what pkg-config prints at spaces, so the lines of the
    guides need a prefix without any."""
    folder = pathlib.Path(folder).resolve()
    if " " in str(folder):
        folder = pathlib.Path(tempfile.mkdtemp()) / folder.name
        atexit.register(shutil.rmtree, folder.parent)
    return folder


def install(build, source, scratch):
    """(prefix, name of its library folder) of a tree installed into scratch, then moved, that names neither
    build nor source tree."""
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    run("cmake", "--install", build, "--strip", "--prefix", scratch / "first", env=clean_environment())
    prefix = (scratch / "first").rename(scratch / "moved")
    for path in prefix.rglob("*"):
        if path.is_file() and path.suffix in (".cmake", ".pc", ".h",
                                              ".hpp") and any(str(place) in path.read_text()
                                                              for place in (build, source)):
            sys.exit(f"{path} names the build or source tree")
    return prefix, next(prefix.rglob("deform.pc")).parent.parent.relative_to(prefix)


def asks_for_a_component_that_is_not_there(prefix, scratch, clean):
    """CMake's own sentence says only that the package is not found."""
    project = scratch / "component"
    project.mkdir()
    (project / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.22)\nproject(host C CXX)\n"
                                            "find_package(deform REQUIRED COMPONENTS oed)\n")
    done = subprocess.run(["cmake", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={prefix}"],
                          capture_output=True, text=True, env=clean)
    if done.returncode == 0 or "deform has no component oed" not in done.stderr:
        sys.exit(f"component oed: {done.returncode} {done.stderr}")


def builds_from_a_prefix_with_a_space(prefix, libdir, source, scratch, clean):
    """The line of packages.md, to the letter."""
    spaced = prefix.rename(scratch / "moved here")
    page = (pathlib.Path(source) / "libdeform/doc/howto/packages.md").read_text()
    line = re.search(r'^eval "cc hello\.c .*$', page, re.M).group(0)
    run("sh", "-ec", f"cd '{scratch}' && rm hello && {line} && ./hello",
        env={**clean, "PKG_CONFIG_PATH": str(spaced / libdir / "pkgconfig")})


def pages_lead_somewhere(prefix):
    """Every link of an installed page, in text, that is no address of the network."""
    pages = sorted((prefix / "share/doc").rglob("*.md"))
    dead = []
    for page in pages:
        text = re.sub(r"^( *)```.*?^\1```", "", page.read_text(), flags=re.M | re.S)
        for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`\n]*`", "", text)):
            to = target.partition("#")[0]
            if to and not re.match(r"[a-z]+:", to) and not (page.parent / to).exists():
                dead.append(f"{page.relative_to(prefix)}: {target}")
    if dead or len(pages) < 100:
        sys.exit(f"{len(pages)} installed pages; links that lead nowhere (add the files to "
                 "cmake/DeformInstall.cmake):\n" + "\n".join(dead))


def main():
    build, source, scratch, compiler = sys.argv[1:]
    here = pathlib.Path(__file__).resolve().parent / "stranger"
    scratch = without_spaces(scratch)
    clean = clean_environment()
    prefix, libdir = install(build, source, scratch)
    pages_lead_somewhere(prefix)

    run("cmake", "-S", here, "-B", scratch / "cmake", f"-DCMAKE_PREFIX_PATH={prefix}",
        f"-DCMAKE_C_COMPILER={compiler}",
        "-DCMAKE_BUILD_TYPE=Release", env=clean)
    run("cmake", "--build", scratch / "cmake", env=clean)
    slab = next((scratch / "cmake").glob("slab.*"))
    run(scratch / "cmake" / "host", slab, env=clean)

    flags = run("pkg-config", "--cflags", "--libs", "deform",
                env={**clean, "PKG_CONFIG_PATH": str(prefix / libdir / "pkgconfig")}).split()
    host = scratch / "host_by_pkg_config"
    run(compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-missing-field-initializers",
        here / "host.c", "-o", host, *flags, "-lm", env=clean)
    run(host, slab, env={**clean, "LD_LIBRARY_PATH": str(prefix / libdir)})

    # The front page's line for its program, to the letter; it needs no LD_LIBRARY_PATH to run.
    line = re.search(r"^cc hello\.c .*$", (pathlib.Path(source) / "README.md").read_text(), re.M).group(0)
    shutil.copy(pathlib.Path(source) / "examples" / "01_hello.c", scratch / "hello.c")
    run("sh", "-ec", f"cd '{scratch}' && {line} && ./hello",
        env={**clean, "PKG_CONFIG_PATH": str(prefix / libdir / "pkgconfig")})

    library = (prefix / libdir / "libdeform.so").resolve()
    if b".debug_info" in library.read_bytes():
        sys.exit(f"{library} has debug information ({library.stat().st_size} bytes)")

    command = prefix / "bin" / "deform"
    listed = run(command, "plugin", "list", env=clean)
    for plugin in (prefix / libdir / "deform").glob("plugins-*/*.so"):
        if str(prefix) not in listed and plugin.name not in listed:
            sys.exit(f"{command} plugin list does not show {plugin}")
    if f"{build}/lib" in listed:  # the scratch prefix itself lies in the build folder
        sys.exit(f"the installed command found plugins of the build tree in {build}")
    run(command, "plugin", "check", slab, "--only", "V02", env=clean)
    for words in PROGRAMS:
        run(command, *words, "--help", env=clean)
    asks_for_a_component_that_is_not_there(prefix, scratch, clean)
    builds_from_a_prefix_with_a_space(prefix, libdir, source, scratch, clean)


if __name__ == "__main__":
    main()

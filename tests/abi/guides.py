#!/usr/bin/env python3
"""Every guide of doc/howto that has a folder of files is followed as a stranger would: the folder is copied
away from the source tree, and each sh block of the guide runs in it against an installed and moved tree. A
guide that begins with <!-- needs FILE --> is passed over where the installed tree has no such file; one that
begins with <!-- compilers C C++ --> may ask for both. So are examples/05_cpp.cpp and, where there is
libdeform_ode, examples/ode.

guides.py BUILD_DIR SOURCE_DIR SCRATCH_DIR CXX_COMPILER
"""
import importlib.util
import json
import os
import pathlib
import re
import shutil
import sys

from installed_tree import clean_environment, install, run, without_spaces


def follow(guide, prefix, libdir, scratch):
    folder = scratch / guide.stem
    shutil.copytree(guide.with_suffix(""), folder)
    env = {**clean_environment(), "CMAKE_PREFIX_PATH": str(prefix),
           "PKG_CONFIG_PATH": str(prefix / libdir / "pkgconfig"),
           "PATH": f"{prefix / 'bin'}:{os.environ['PATH']}"}
    if not (guide.read_text().startswith("<!-- compilers C C++ -->") or
            any("CXX" in path.read_text() for path in folder.rglob("CMakeLists.txt"))):
        env["CXX"] = "/bin/false"  # a guide whose project is in C asks for no other compiler
    blocks = re.findall(r"^```sh\n(.*?)^```", guide.read_text(), re.M | re.S)
    tools = " ".join(blocks)
    builds = any(folder.rglob("CMakeLists.txt"))
    if builds and ("cmake -S" not in tools or "pkg-config" not in tools):
        sys.exit(f"{guide} does not show both ways to build: CMake and pkg-config")
    here = os.getcwd()
    os.chdir(folder)
    for block in blocks:
        run("sh", "-ec", block, env=env)
    os.chdir(here)
    return folder


def copy_from_spaces(guide, prefix, libdir, scratch):
    """The first block of a guide, which copies a template, where the prefix has a space."""
    spaced = scratch / "a prefix"
    spaced.mkdir(exist_ok=True)
    if not (spaced / "tree").exists():
        (spaced / "tree").symlink_to(prefix)
    folder = scratch / f"{guide.stem} beside"
    folder.mkdir()
    block = re.search(r"^```sh\n(.*?)^```", guide.read_text(), re.M | re.S)[1]
    env = {**clean_environment(), "PKG_CONFIG_PATH": str(spaced / "tree" / libdir / "pkgconfig")}
    here = os.getcwd()
    os.chdir(folder)
    run("sh", "-ec", block, env=env)
    os.chdir(here)


def judge_law(folder):
    """What the guide of laws leaves behind: a law that holds a block in a scene, and its run on the rig."""
    summary = json.loads((folder / "out" / "summary.json").read_text())
    used = [p["file"] for p in summary["plugins"] if p["id"] == "com.example.mylaw"]
    creep = summary["hold"]["creep_max_um_per_s"]
    if used != ["build/mylaw.so"] or not summary["finite"] or creep is None or creep > 1:
        sys.exit(f"the scene of the guide: law from {used}, finite {summary['finite']}, creep {creep} um/s")
    rows = (folder / "rig.csv").read_text().splitlines()
    force = [float(row.split(",")[3]) for row in rows[1:]]
    if rows[0] != "t,x,v,F,z" or len(force) != 301 or not 1.49 < max(force) < 1.5 + 1e-9:
        sys.exit(f"the rig of the guide: {len(force)} rows of {rows[0]}, largest force {max(force)} N")
    if importlib.util.find_spec("matplotlib") and not (folder / "rig.png").exists():
        sys.exit("the rig of the guide drew no picture")


def judge_model(folder):
    """What the guide of models leaves behind: a model that a block falls and rests with."""
    summary = json.loads((folder / "out" / "summary.json").read_text())
    used = [p["file"] for p in summary["plugins"] if p["id"] == "com.example.mymodel"]
    speed, creep = summary["bodies"]["block"]["speed_max"], summary["hold"]["creep_max_um_per_s"]
    if used != ["build/mymodel.so"] or not summary["finite"] or not speed < 1e-3 or creep is None:
        sys.exit(f"the scene of the guide: model from {used}, finite {summary['finite']}, speed {speed} m/s, "
                 f"creep {creep} um/s")


def judge_flex(folder):
    """What the guide from MuJoCo leaves behind: a block that holds, and a beam that bends by 96 % of
    MuJoCo's, whose points weigh more at the tip."""
    creep = json.loads((folder / "out" / "summary.json").read_text())["hold"]["creep_max_um_per_s"]
    tip = float((folder / "out" / "probes.csv").read_text().split()[-1].split(",")[4]) - 0.5
    if creep is None or creep > 1e-3 or abs(tip / -37.2e-3 - 0.96) > 0.02:
        sys.exit(f"the scene of the guide: creep {creep} um/s, tip {tip} m")


def main():
    build, source, scratch, compiler = sys.argv[1:]
    scratch = without_spaces(scratch)
    prefix, libdir = install(build, source, scratch)
    guides = [path for path in sorted(pathlib.Path(source).glob("libdeform/doc/howto/*.md"))
              if path.with_suffix("").is_dir()]
    followed = []
    for guide in guides:
        needs = re.match(r"<!-- needs (\S+) -->", guide.read_text())
        if needs and not (prefix / libdir / needs[1]).exists():
            print(f"{guide.name} passed over: this build has no {needs[1]}")
            continue
        folder = follow(guide, prefix, libdir, scratch)
        if "templatedir" in guide.read_text():
            copy_from_spaces(guide, prefix, libdir, scratch)
        if guide.stem == "write-a-law":
            judge_law(folder)
        if guide.stem == "write-a-model":
            judge_model(folder)
        if guide.stem == "mujoco_flex":
            judge_flex(folder)
        followed.append(guide.name)
    must = {"mujoco_flex.md", "own_engine.md", "write-a-law.md", "write-a-model.md"}
    if not must <= set(followed):
        sys.exit(f"{sorted(must)} must be followed, not only {followed}")

    # The C++ header, as installed.
    env = clean_environment()
    flags = run("pkg-config", "--cflags", "--libs", "deform",
                env={**env, "PKG_CONFIG_PATH": str(prefix / libdir / "pkgconfig")}).split()
    program = scratch / "cpp"
    run(compiler, "-std=c++20", pathlib.Path(source) / "examples" / "05_cpp.cpp", "-o", program, *flags,
        env=env)
    run(program, env={**env, "LD_LIBRARY_PATH": str(prefix / libdir)})

    # The examples beside an ODE world, by CMake and without it.
    if (prefix / libdir / "libdeform_ode.so").exists():
        folder = scratch / "examples_ode"
        shutil.copytree(pathlib.Path(source) / "examples" / "ode", folder)
        env = {**env, "CMAKE_PREFIX_PATH": str(prefix), "PKG_CONFIG_PATH": str(prefix / libdir / "pkgconfig"),
               "LD_LIBRARY_PATH": str(prefix / libdir)}
        run("cmake", "-S", folder, "-B", folder / "build", "-DCMAKE_BUILD_TYPE=Release", env=env)
        run("cmake", "--build", folder / "build", env=env)
        flags = run("pkg-config", "--cflags", "--libs", "deform_ode", env=env).split()
        run("cc", "-O2", folder / "gripper.c", "-o", folder / "gripper", *flags, "-lm", env=env)
        run(folder / "gripper", env=env)
        run(folder / "build" / "gripper", env=env)   # adapters.ode runs the cart
    print("followed:", *followed)


if __name__ == "__main__":
    main()

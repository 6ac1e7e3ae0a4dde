#!/usr/bin/env python3
"""Instructions of three frozen scenes.

frozen.py off DEFORM_COMMAND                                                       what is off costs nothing
frozen.py count|update DEFORM_COMMAND --compiler "GNU 12.2.0" --build Release --flags "-O3"

Counts the instructions that libdeform and its plugins execute inside dfm_world_step, with callgrind, one
thread and vectors of two doubles (DEFORM_SIMD=sse2). What the C library, libm and libstdc++ execute is left
out: they choose their functions by processor.

off: a scene whose effects are all switched off by name against the same scene that does not mention them, to
0.1 %, and, so that this means something, one with an effect on, which must differ.
count: the scene against the count in counts.csv, to 3 %, where compiler, build type and flags are those
stored. update writes counts.csv again and prints what changed; the commit gives the reason.
"""
import argparse
import csv
import os
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
STORED = HERE / "counts.csv"
TOLERANCE = 1e-3
RECORDED_TOLERANCE = 3e-2
COUNTED = re.compile(r"/(libdeform\.so[.\d]*|plugins-\w+/\w+\.so)$")


def params(body, **values):
    return [f"/bodies/{body}/model/params/{key}={value}" for key, value in values.items()]


EVERYWHERE = ["/contact/self=false", "/contact/sleep=false", "/effects=auto"]
UNDAMPED = {"damping_stiffness": 0, "damping_mass": 0}
NO_SPRINGS_MORE = {"volume": 0, "anisotropy_slope": 0, "anisotropy_axis": "[0,0,1]", "damper": "voigt"}
NO_CELLS_MORE = {"yield": 0, "hardening": 0, "anisotropy_young": "auto", "anisotropy_poisson": "auto",
                 "anisotropy_shear": "auto", "anisotropy_axis": "[0,0,1]", "locking": "none"}
# By scene: what switches every effect off by name, and one that is switched on.
SCENES = {
    "slide_msm": (EVERYWHERE + params(0, **UNDAMPED, **NO_SPRINGS_MORE) +
                  params(1, **UNDAMPED, **NO_SPRINGS_MORE), params(0, volume=1)),
    "swing_corotational": (EVERYWHERE + params(0, **UNDAMPED, **NO_CELLS_MORE),
                           params(0, damping_stiffness=0.01)),
    "drop_modal": (EVERYWHERE + params(0, **UNDAMPED) + params(1, damping_mass=0, plastic_creep=0),
                   params(1, plastic_creep=1, plastic_yield=0)),
}


def counted(text):
    """Sum of the costs of the objects that count, of a callgrind output file."""
    names, own, total, after_call = {}, None, 0, False
    for line in text.splitlines():
        match = re.match(r"(c?ob)=\((\d+)\)(?: (.*))?$", line)
        if match:
            what, number, name = match.groups()
            if name:
                names[number] = name
            if what == "ob":
                own = number
        elif line.startswith("calls="):
            after_call = True
        elif re.match(r"[+\-*\d]", line):
            fields = line.split()
            if not after_call and len(fields) > 1 and own and COUNTED.search(names[own]):
                total += int(fields[1])
            after_call = False
    return total


def instructions(command, scene, assignments=(), simd="sse2", time=None):
    """Counted of a whole run, or of its first `time` s. simd: DEFORM_SIMD."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "callgrind.out"
        line = ["valgrind", "--tool=callgrind", "--toggle-collect=dfm_world_step",
                f"--callgrind-out-file={out}", command, "run", str(HERE / f"{scene}.json"), "--out",
                str(pathlib.Path(folder) / "run"), "--quiet", "--threads", "1"]
        if time is not None:
            line += ["--time", str(time)]
        for assignment in assignments:
            line += ["--set", assignment]
        done = subprocess.run(line, env={**os.environ, "DEFORM_SIMD": simd}, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"frozen.py: {' '.join(line)} failed:\n{done.stderr}")
        count = counted(out.read_text())
    if count == 0:
        sys.exit(f"frozen.py: {scene}: no instruction of libdeform or a plugin was counted")
    return count


def read_stored():
    with open(STORED, newline="") as file:
        return {row["scene"]: row for row in csv.DictReader(file)}


def check_off(command, scene):
    """What is wrong, as sentences."""
    off, on = SCENES[scene]
    wrong = []
    plain = instructions(command, scene)
    without = instructions(command, scene, off)
    change = without / plain - 1
    print(f"{scene}: {plain} instructions; with every effect switched off by name {100 * change:+.4f} %")
    if abs(change) > TOLERANCE:
        wrong.append(f"{scene}: effects that are off cost {100 * change:+.3f} % instructions, over 0.1 %")
    more = instructions(command, scene, on) / plain - 1
    print(f"{scene}: with {' '.join(on)} {100 * more:+.2f} %")
    if abs(more) < TOLERANCE:
        wrong.append(f"{scene}: {' '.join(on)} changes {100 * more:+.3f} %: effects are not seen")
    return wrong


def compare(counts, stored, built):
    """What is wrong, as sentences."""
    wrong = []
    for scene, count in counts.items():
        row = stored[scene]
        differs = [key for key, value in built.items() if row[key] != value]
        if differs:
            print(f"{scene}: not compared with the stored count: " +
                  ", ".join(f"{key} is {built[key]!r}, stored {row[key]!r}" for key in differs))
            continue
        change = count / int(row["instructions"]) - 1
        print(f"{scene}: {100 * change:+.4f} % against the stored count")
        if abs(change) > RECORDED_TOLERANCE:
            wrong.append(f"{scene}: {count} instructions, {100 * change:+.3f} % from those stored; "
                         "if that is meant, build update_frozen and say why in the commit")
    return wrong


def update(counts, stored, built):
    for scene, count in counts.items():
        before = int(stored[scene]["instructions"])
        print(f"{scene}: {before} -> {count} ({100 * (count / before - 1):+.3f} %)")
    with open(STORED, "w", newline="") as file:
        writer = csv.DictWriter(file, ["scene", "instructions", *built], lineterminator="\n")
        writer.writeheader()
        writer.writerows({"scene": scene, "instructions": count, **built} for scene, count in counts.items())
    return []


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["off", "count", "update"])
    parser.add_argument("command")
    for name in ("compiler", "build", "flags"):
        parser.add_argument(f"--{name}", default="")
    options = parser.parse_args()
    if options.what == "off":
        wrong = [sentence for scene in SCENES for sentence in check_off(options.command, scene)]
    else:
        built = {"compiler": options.compiler, "build": options.build,
                 "flags": " ".join(options.flags.split())}
        counts = {scene: instructions(options.command, scene) for scene in SCENES}
        wrong = (compare if options.what == "count" else update)(counts, read_stored(), built)
    for sentence in wrong:
        print(sentence, file=sys.stderr)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()

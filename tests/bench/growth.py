#!/usr/bin/env python3
"""How the cost of a step grows: with the tetrahedra of a body, with the bodies of a pile.

growth.py DEFORM_COMMAND OUT.csv [--commit ID] [--compiler NAME] [--repeats N] [--only body|pile|counted|heap]

body: a cantilever of 1e3 to 1e6 cells (msm, no contact) and the same body on a floor; per cell and sub-step.
heap: largest resident memory of a pile of 160 to 1,000 balls beyond that of 10, kB per ball.
pile: 10 to 1,000 balls that have fallen onto a floor in columns of up to ten; us per body, per contact.
counted: the same by instructions (callgrind, up to 1e5 cells and 160 balls), which a busy machine does not
change.

Processor time is that of the stepping alone (summary.json, cpu_s), the least of `repeats` runs. How even the
steps of a resting scene are: rest_bench.
"""
import argparse
import csv
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "abi" / "frozen"))
import frozen

RUBBER = {"rubber": {"density": 1000, "young": 2e5, "poisson": 0.3}}
FLOOR = [{"name": "floor", "shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}]
MSM = {"type": "msm", "params": {"damping_stiffness": 1e-4, "damping_mass": 2}}


def scene(bodies, obstacles, step, steps):
    return {"format": "deform-scene", "version": 1, "gravity": [0, 0, -9.81],
            "time": {"duration": step * steps, "step": step}, "materials": RUBBER, "bodies": bodies,
            "obstacles": obstacles,
            "contact": {"sleep": False,
                        "friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.5}}]},
            "output": {"every": step * steps}}


def beam(cells, on_floor, steps):
    body = {"name": "beam", "mesh": {"make": "beam", "size": [0.4, 0.1, 0.1], "cells": cells},
            "material": "rubber", "model": MSM, "pose": {"position": [0, 0, 1e-4 if on_floor else 0.5]}}
    if not on_floor:
        body["fix"] = [{"box": [[-1e-3, -1, -1], [1e-3, 1, 1]]}]
    step = 2e-4 * (1e3 / cells) ** (1 / 3)
    return scene([body], FLOOR if on_floor else [], step, steps)


def pile(count, steps):
    side = max(1, round((count / 10) ** 0.5))
    bodies = []
    for k in range(count):
        level, at = divmod(k, side * side)
        x, y = at % side, at // side
        bodies.append({"name": f"ball{k}", "mesh": {"make": "ball", "radius": 0.05, "cells": 100},
                       "material": "rubber", "model": MSM,
                       "pose": {"position": [0.12 * x + 0.003 * (level % 3), 0.12 * y + 0.002 * (level % 2),
                                             0.051 + 0.102 * level]}})
    return scene(bodies, FLOOR, 5e-4, steps)


def run(command, content, repeats):
    best = None
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "scene.json"
        path.write_text(json.dumps(content))
        for _ in range(repeats):
            out = pathlib.Path(folder) / "run"
            done = subprocess.run([command, "run", str(path), "--out", str(out), "--quiet", "--threads", "1"],
                                  capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(f"growth.py: {done.stderr}")
            found = json.loads((out / "summary.json").read_text())
            if best is None or found["cpu_s"] < best["cpu_s"]:
                best = found
    return best


def resident(command, content):
    """Largest resident memory of the run, kB."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "scene.json"
        path.write_text(json.dumps(content))
        child = subprocess.Popen([command, "run", str(path), "--out", str(pathlib.Path(folder) / "run"),
                                  "--quiet", "--threads", "1"], stdout=subprocess.DEVNULL)
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = status
        if status != 0:
            sys.exit("growth.py: the run for its memory failed")
        return used.ru_maxrss


def counted(command, content):
    """Instructions of dfm_world_step in libdeform and its plugins, and the run's summary."""
    with tempfile.TemporaryDirectory() as folder:
        path, out = pathlib.Path(folder) / "scene.json", pathlib.Path(folder) / "callgrind.out"
        path.write_text(json.dumps(content))
        done = subprocess.run(["valgrind", "--tool=callgrind", "--toggle-collect=dfm_world_step",
                               f"--callgrind-out-file={out}", command, "run", str(path), "--out",
                               str(pathlib.Path(folder) / "run"), "--quiet", "--threads", "1"],
                              env={**os.environ, "DEFORM_SIMD": "sse2"}, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"growth.py: {done.stderr}")
        return (frozen.counted(out.read_text()),
                json.loads((pathlib.Path(folder) / "run" / "summary.json").read_text()))


def commit_of_source():
    """Of the tree that this file lies in; with + where it has changes."""
    def git(*words):
        return subprocess.run(["git", "-C", str(pathlib.Path(__file__).parent), *words], capture_output=True,
                              text=True).stdout.strip()
    commit = git("rev-parse", "--short=8", "HEAD")
    return commit + "+" * bool(git("status", "--porcelain", "--untracked-files=no")) if commit else "unknown"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("command")
    parser.add_argument("out")
    parser.add_argument("--commit", default=commit_of_source())
    parser.add_argument("--compiler", default="unknown")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    names = [line for line in open("/proc/cpuinfo") if line.startswith("model name")]
    cpu = names[0].split(":", 1)[1].strip() if names else platform.machine()
    rows = []

    def note(figure, size, found, per, value, unit):
        contacts = found["contacts"]["mean"]
        rows.append([cpu, options.compiler, options.commit, figure, size, found["substeps"],
                     f"{contacts:.0f}", f"{value:.4g}", unit])
        print(f"{figure:24} {size:>9} {per}: {value:.4g} {unit}, {contacts:.0f} contacts", flush=True)

    if options.only in ("", "body"):
        for on_floor in (False, True):
            for cells, steps in ((1000, 4000), (10000, 600), (100000, 240), (1000000, 100)):
                early, late = (run(options.command, beam(cells, on_floor, n * steps), options.repeats)
                               for n in (1, 3))
                real = late["bodies"]["beam"]["cells"]
                cost = (late["cpu_s"] - early["cpu_s"]) / (late["substeps"] - early["substeps"])
                note("on a floor" if on_floor else "cantilever", real, late, "per cell and sub-step",
                     1e9 * cost / real, "ns")
    if options.only in ("", "pile"):
        for count in (10, 40, 160, 1000):
            early, late = (run(options.command, pile(count, steps), options.repeats) for steps in (200, 300))
            cost = (late["cpu_s"] - early["cpu_s"]) / (late["substeps"] - early["substeps"])
            note("pile", count, late, "per body and sub-step", 1e6 * cost / count, "us")
    if options.only in ("", "heap"):
        few = resident(options.command, pile(10, 40))
        for count in (160, 640, 1000):
            more = resident(options.command, pile(count, 40)) - few
            note("pile resident", count, {"contacts": {"mean": 0}, "substeps": 40}, "per further body",
                 more / (count - 10), "kB")
    if options.only in ("", "counted"):
        for cells, steps in ((1000, 40), (10000, 20), (100000, 10)):
            early, late = (counted(options.command, beam(cells, False, n * steps)) for n in (1, 2))
            real = late[1]["bodies"]["beam"]["cells"]
            note("cantilever counted", real, late[1], "per cell and sub-step",
                 (late[0] - early[0]) / (late[1]["substeps"] - early[1]["substeps"]) / real, "instructions")
        for count in (10, 40, 160):
            early, late = (counted(options.command, pile(count, steps)) for steps in (200, 220))
            note("pile counted", count, late[1], "per body and sub-step",
                 (late[0] - early[0]) / (late[1]["substeps"] - early[1]["substeps"]) / count, "instructions")
    with open(options.out, "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["machine", "compiler", "commit", "figure", "size", "substeps", "contacts", "value",
                         "unit"])
        writer.writerows(rows)


if __name__ == "__main__":
    main()

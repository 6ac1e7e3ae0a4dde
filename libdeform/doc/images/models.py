#!/usr/bin/env python3
"""One bar with every model: models.png, and the tables of doc/models/compared.md on stdout.

models.py DEFORM_COMMAND [OUT.png]

A bar of 1 x 0.1 x 0.1 m, clamped at x = 0, under its weight; E such that w L^3/(E I) = 8. The inextensible
elastica of that load sags by 0.64063 L and its tip draws back by 0.27558 L; a beam whose equations stay
those of the straight one sags by w L^4/(8 E I) + w L^2/(2 k G A) = 1.0104 L (Timoshenko, k = 5/6). Models
with forces come to rest in static mode; those that step themselves by drag, after 6 s. The picture has the
last frames.
The cost is processor time of the first 30 steps of 1/60 s of each bar alone, from its straight start, on one
thread.
"""
import csv
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile

LENGTH, SIDE, DENSITY, GRAVITY, LOAD, POISSON = 1.0, 0.1, 1000.0, 9.81, 8.0, 0.3
YOUNG = DENSITY * GRAVITY * SIDE**2 * LENGTH**3 / (LOAD * SIDE**4 / 12)
CELLS = 12000
DRAG = 8.0  # 1/s, about the critical one of the lowest frequency, 0.62 Hz
COST_STEP, COST_STEPS = 1 / 60, 30
BENT, STRAIGHT = 0.64063, 1 + LOAD * 2 * (1 + POISSON) / (2 * 5 / 6) / 12 * (SIDE / LENGTH)**2
AT_REST = {
    "msm": {"type": "msm"},
    "corotational_fem": {"type": "corotational_fem"},
    "neo_hookean": {"type": "corotational_fem", "params": {"energy": "neo_hookean"}},
    "stvk": {"type": "corotational_fem", "params": {"energy": "stvk"}},
    "meshless": {"type": "meshless"},
    "linear_fem": {"type": "linear_fem"},
}
BY_STEPS = {
    "modal": {"type": "modal"},
    "condensed": {"type": "condensed"},
    "shape_matching": {"type": "shape_matching"},
}
ANSWERS = {**dict.fromkeys(AT_REST, BENT), "linear_fem": STRAIGHT, "modal": STRAIGHT, "condensed": STRAIGHT}


def scene(bars, drag, time):
    bodies, probes = [], []
    material = {"density": DENSITY, "young": YOUNG, "poisson": POISSON, "damping": {"mass": drag}}
    for k, (name, model) in enumerate(bars.items()):
        bodies.append({
            "name": name, "mesh": {"make": "beam", "size": [LENGTH, SIDE, SIDE], "cells": CELLS},
            "material": "bar", "model": model, "pose": {"position": [0, 0.3 * k, 1.3]},
            "fix": [{"box": [[-1e-6, -1, -1], [1e-6, 1, 1]]}]})
        probes.append({"name": name, "body": name, "point": [LENGTH, SIDE / 2, SIDE / 2]})
    return {
        "format": "deform-scene", "version": 1, "gravity": [0, 0, -GRAVITY], "time": time,
        "materials": {"bar": material},
        "bodies": bodies, "probes": probes,
        "contact": {"filter": [{"between": ["*", "*"], "collide": False}]},
        "output": {"every": time["duration"] / 8, "color": "body",
                   "camera": {"eye": [1.15, -2.25, 1.3], "look_at": [0.5, 0.5, 0.72]}}}


def run(command, folder, what, frames=False):
    """The folder of a run."""
    folder.mkdir()
    (folder / "models.json").write_text(json.dumps(what))
    subprocess.run([command, "run", str(folder / "models.json"), "--out", str(folder / "out"), "--quiet",
                    "--threads", "1", *(["--frames", "8"] if frames else [])], check=True)
    return folder / "out"


def tips(out):
    with open(out / "probes.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for name in dict.fromkeys(row["probe"] for row in rows):
        own = [row for row in rows if row["probe"] == name]
        yield name, *((float(own[0][c]) - float(own[-1][c])) / LENGTH for c in "zx")


def machine():
    with open("/proc/cpuinfo") as file:
        names = [line.split(":")[1].strip() for line in file if line.startswith("model name")]
    commit = subprocess.run(["git", "-C", pathlib.Path(__file__).parent, "rev-parse", "--short=12", "HEAD"],
                            capture_output=True, text=True).stdout.strip()
    return f"{names[0] if names else platform.machine()}, load {os.getloadavg()[0]:.1f}, commit {commit}"


def main():
    command = sys.argv[1]
    out = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else pathlib.Path(__file__).with_suffix(".png")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        still = {"mode": "static", "duration": 1, "step": 0.125}
        rows = [("with forces", run(command, folder / "rest", scene(AT_REST, 0, still), True)),
                ("by themselves", run(command, folder / "steps",
                                      scene(BY_STEPS, DRAG, {"duration": 6, "step": 1 / 60}), True))]
        pictures = [arg for label, run_folder in rows
                    for arg in ("--row", label, str(sorted(run_folder.rglob("*.png"))[-1]))]
        subprocess.run([command, "montage", *pictures, "--out", str(out)], check=True)
        print(f"{machine()}; E {YOUNG:.4g} Pa, {CELLS} cells asked for\n")
        print("| model | sag of the tip / L | converged | shortening / L | sub-steps | ms per step |\n"
              "|---|---|---|---|---|---|")
        models = {**AT_REST, **BY_STEPS}
        for _, run_folder in rows:
            for name, sag, back in tips(run_folder):
                time = {"duration": COST_STEPS * COST_STEP, "step": COST_STEP}
                own = run(command, folder / name, scene({name: models[name]}, 0, time))
                cost = json.loads((own / "summary.json").read_text())
                answer = f"{ANSWERS[name]:.4f}" if name in ANSWERS else "-"
                substeps, spent = cost["substeps"] / cost["steps"], 1e3 * cost["cpu_s"] / cost["steps"]
                print(f"| `{name}` | {sag:.4f} | {answer} | {round(back, 4) + 0:.4f} | {substeps:.3g} | "
                      f"{spent:.3g} |")


if __name__ == "__main__":
    main()

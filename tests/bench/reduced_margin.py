#!/usr/bin/env python3
"""What a step of modal and condensed bodies of about 1,000 surfels takes on one core: results/reduced.csv.

reduced_margin.py DEFORM_COMMAND COMPILER [OUT.csv]

A plate of 0.3 x 0.2 x 0.03 m with 40 modes at steps of 1 ms: in free flight, and at rest on a plane that it
touches with all of one side. Shown is the median step of a run, the least of five runs; the margin is 1 ms
over that.
"""
import csv
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile

SIZE, CELLS, STEP, REPEATS = [0.3, 0.2, 0.03], 10200, 0.001, 5
DURATION = 0.4  # s


def scene(model, touches):
    body = {"name": "plate", "mesh": {"make": "beam", "size": SIZE, "cells": CELLS}, "material": "rubber",
            "model": {"type": model}, "pose": {"position": [-SIZE[0] / 2, -SIZE[1] / 2, 0.0003]}}
    floor = {"name": "floor", "shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}
    return {"format": "deform-scene", "version": 1, "gravity": [0, 0, -9.81],
            "time": {"duration": DURATION, "step": STEP},
            "materials": {"rubber": {"density": 1000, "young": 2e6, "poisson": 0.3,
                                     "damping": {"stiffness": 5e-4}}},
            "bodies": [body], "obstacles": [floor] if touches else [], "output": {"every": 10}}


def run(command, folder, what):
    (folder / "scene.json").write_text(json.dumps(what))
    out = pathlib.Path(tempfile.mkdtemp(dir=folder))
    subprocess.run([command, "run", str(folder / "scene.json"), "--out", str(out), "--quiet",
                    "--threads", "1"], check=True)
    return json.loads((out / "summary.json").read_text())


def measure(command, folder, what):
    runs = [run(command, folder, what) for _ in range(REPEATS)]
    plan = subprocess.run([command, "explain", str(folder / "scene.json"), "--json"], check=True,
                          capture_output=True, text=True).stdout
    body = json.loads(plan)["bodies"][0]
    least = min(one["ms_per_step"]["median"] for one in runs)
    return least, round(runs[0]["contacts"]["mean"]), body["surfels"], body["points"]


def main():
    command, compiler = sys.argv[1:3]
    out = pathlib.Path(sys.argv[3]) if len(sys.argv) > 3 else (
        pathlib.Path(__file__).parent / "results" / "reduced.csv")
    with open("/proc/cpuinfo") as file:
        names = [line.split(":")[1].strip() for line in file if line.startswith("model name")]
    commit = subprocess.run(["git", "-C", pathlib.Path(__file__).parent, "rev-parse", "--short=12", "HEAD"],
                            capture_output=True, text=True).stdout.strip()
    head = {"machine": names[0] if names else platform.machine(), "load": f"{os.getloadavg()[0]:.1f}",
            "compiler": compiler, "commit": commit, "simd": os.environ.get("DEFORM_SIMD", "widest")}
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for model in ("modal", "condensed"):
            for touches in (False, True):
                ms, contacts, surfels, points = measure(command, pathlib.Path(name), scene(model, touches))
                rows.append({**head, "model": model, "surfels": surfels, "points": points,
                             "contacts": contacts, "ms_per_step": f"{ms:.3f}", "margin": f"{1 / ms:.2f}"})
                print(rows[-1], flush=True)
    with open(out, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()

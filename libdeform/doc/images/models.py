#!/usr/bin/env python3
"""One bar with every model side by side: models.png, and the table of tips of doc/models/*.md on stdout.

models.py DEFORM_COMMAND [OUT.png]

A bar of 1 x 0.1 x 0.1 m, clamped at x = 0, under its weight; E such that w L^3/(E I) = 8. The inextensible
elastica of that load sags by 0.64063 L and its tip draws back by 0.27558 L. The picture is the last frame of
`deform run --frames`.
"""
import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

LENGTH, SIDE, DENSITY, GRAVITY, LOAD = 1.0, 0.1, 1000.0, 9.81, 8.0
YOUNG = DENSITY * GRAVITY * SIDE**2 * LENGTH**3 / (LOAD * SIDE**4 / 12)
CELLS = 12000
BARS = {
    "msm": {"type": "msm"},
    "corotational": {"type": "corotational_fem"},
    "neo_hookean": {"type": "corotational_fem", "params": {"energy": "neo_hookean"}},
    "stvk": {"type": "corotational_fem", "params": {"energy": "stvk"}},
    "linear_fem": {"type": "linear_fem"},
}
TABLE_ONLY = {"meshless": {"type": "meshless"}}


def scene(bars):
    bodies, probes = [], []
    for k, (name, model) in enumerate(bars.items()):
        bodies.append({
            "name": name, "mesh": {"make": "beam", "size": [LENGTH, SIDE, SIDE], "cells": CELLS},
            "material": "bar", "model": model, "pose": {"position": [0, 0.3 * k, 1.3]},
            "fix": [{"box": [[-1e-6, -1, -1], [1e-6, 1, 1]]}]})
        probes.append({"name": name, "body": name, "point": [LENGTH, SIDE / 2, SIDE / 2]})
    return {
        "format": "deform-scene", "version": 1, "gravity": [0, 0, -GRAVITY],
        "time": {"mode": "static", "duration": 1, "step": 0.125},
        "materials": {"bar": {"density": DENSITY, "young": YOUNG, "poisson": 0.3}},
        "bodies": bodies, "probes": probes,
        "contact": {"filter": [{"between": ["*", "*"], "collide": False}]},
        "output": {"every": 0.125, "color": "body",
                   "camera": {"eye": [1.15, -1.95, 1.38], "look_at": [0.5, 0.5, 0.83]}}}


def run(command, bars, picture=None):
    """Rows of the probes; the last frame where a picture is asked for."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "models.json").write_text(json.dumps(scene(bars)))
        subprocess.run([command, "run", str(folder / "models.json"), "--out", str(folder / "out"), "--quiet",
                        *(["--frames", "8"] if picture else [])], check=True)
        if picture:
            shutil.copy(sorted((folder / "out").rglob("*.png"))[-1], picture)
        with open(folder / "out" / "probes.csv", newline="") as file:
            return list(csv.DictReader(file))


def main():
    command = sys.argv[1]
    out = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else pathlib.Path(__file__).with_suffix(".png")
    rows = run(command, BARS, out) + run(command, TABLE_ONLY)
    print(f"E {YOUNG:.4g} Pa, {CELLS} cells asked for; sag and shortening of the tip over the length")
    for name in {**BARS, **TABLE_ONLY}:
        own = [row for row in rows if row["probe"] == name]
        first, last = own[0], own[-1]
        sag, back = float(first["z"]) - float(last["z"]), float(first["x"]) - float(last["x"])
        print(f"| {name} | {sag / LENGTH:.4f} | {back / LENGTH:.4f} |")


if __name__ == "__main__":
    main()

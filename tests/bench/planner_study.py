#!/usr/bin/env python3
"""What the planner predicts, beside what its choice does: scenes by targets and budgets, each run as the
planner chose and compared with the same mesh under corotational_fem in explicit time at a quarter of the
stable step.

    python3 tests/bench/planner_study.py build/release/bin/deform OUT.csv

Errors are those of model and time, which the planner adds; that of the mesh is not seen here. error: root
mean square over time of the probe's distance from its reference, over that of the reference's displacement;
in the scene `dent`, where a sphere's force is asked for, of that force, over the reference's. Times are those
of processors.
"""
import bisect
import csv
import json
import os
import subprocess
import sys
import tempfile

FLOOR = [{"name": "floor", "shape": "plane"}]
FRICTION = {"friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.5}}]}
BEAM = {"make": "beam", "size": [0.4, 0.1, 0.1], "cells": 1000}
BALL = {"make": "ball", "radius": 0.1, "cells": 1000}
CUBE = {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 600}


def scene(young, damping, bodies, probes, duration, floor):
    out = {"format": "deform-scene", "version": 1, "time": {"duration": duration},
           "materials": {"gel": {"young": young, "damping": {"stiffness": damping}}},
           "bodies": [dict(b, material="gel", lattice=None) for b in bodies],
           "probes": probes, "output": {"every": duration / 100}}
    if floor:
        out["obstacles"], out["contact"] = FLOOR, FRICTION
    return out


HELD = {"name": "bar", "mesh": BEAM, "fix": [{"box": [[-1, -1, -1], [1e-6, 1, 1]]}]}
TIP = [{"name": "tip", "body": "bar", "point": [0.4, 0.05, 0.05]}]
DROP = {"name": "ball", "mesh": BALL, "pose": {"position": [0, 0, 0.3]}}
TOP = [{"name": "top", "body": "ball", "point": [0, 0, 0.1]}]
STACK = [{"name": "low", "mesh": CUBE, "pose": {"position": [0, 0, 0.001]}},
         {"name": "high", "mesh": CUBE, "pose": {"position": [0, 0, 0.103]}}]
CORNER = [{"name": "corner", "body": "high", "point": [0.1, 0.1, 0.1]}]
SLIDE = {"name": "block", "mesh": CUBE, "pose": {"position": [0, 0, 0.001]}, "velocity": [1.5, 0, 0]}
FRONT = [{"name": "front", "body": "block", "point": [0.1, 0.05, 0.05]}]
# A sphere goes 8 mm into a block that is held at its base, and stays there.
BLOCK = {"name": "block", "mesh": {"make": "beam", "size": [0.2, 0.2, 0.1], "cells": 1500},
         "fix": [{"box": [[-1, -1, -1], [1, 1, 1e-6]]}]}
SPHERE = {"name": "sphere", "shape": "sphere", "radius": 0.05,
          "motion": {"keyframes": [{"t": 0, "position": [0.1, 0.1, 0.151]},
                                   {"t": 0.2, "position": [0.1, 0.1, 0.142]}]}}
UNDER = [{"name": "under", "body": "block", "point": [0.1, 0.1, 0.1]}]
SCENES = {
    "bar_stiff": scene(5e6, 2e-4, [HELD], TIP, 1, False),
    "bar_soft": scene(1e5, 1e-2, [HELD], TIP, 2, False),
    "bar_undamped": scene(5e6, 0, [HELD], TIP, 1, False),
    "drop_stiff": scene(2e6, 5e-4, [DROP], TOP, 0.6, True),
    "drop_soft": scene(2e4, 5e-3, [DROP], TOP, 0.6, True),
    "stack": scene(5e4, 2e-3, STACK, CORNER, 0.5, True),
    "slide": scene(2e5, 1e-3, [SLIDE], FRONT, 0.6, True),
    "dent": dict(scene(5e4, 4e-3, [BLOCK], UNDER, 0.4, True), obstacles=[SPHERE], gravity=[0, 0, 0]),
}
OF_FORCE = ("dent",)
WISHES = [("accuracy", {"target": 0.2}), ("accuracy", {"target": 0.05}), ("accuracy", {"target": 0.01}),
          ("budget", {"ms_per_step": 0.5}), ("budget", {"ms_per_step": 20})]


def probe(folder):
    with open(os.path.join(folder, "probes.csv"), encoding="utf-8") as f:
        return [[float(row[k]) for k in ("t", "x", "y", "z")] for row in csv.DictReader(f)]


def forces(folder):
    """[(t, N)] of the one pair; none before it touches."""
    with open(os.path.join(folder, "contacts.csv"), encoding="utf-8") as f:
        return [[float(row["t"]), float(row["normal_N"])] for row in csv.DictReader(f)]


def run(command, folder, tree, sets, name):
    path = os.path.join(folder, "scene.json")
    with open(path, "w", encoding="utf-8") as f:
        json.dump(tree, f)
    out = os.path.join(folder, "out")
    subprocess.run([command, "run", path, "--out", out, "--quiet"] + [a for s in sets for a in ("--set", s)],
                   check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(os.path.join(out, "summary.json"), encoding="utf-8") as f:
        return json.load(f), forces(out) if name in OF_FORCE else probe(out)


def at(path, t):
    """The place at a time, between records."""
    i = min(max(bisect.bisect_left(path, [t]), 1), len(path) - 1)
    p, q = path[i - 1], path[i]
    share = (t - p[0]) / (q[0] - p[0])
    return [a + share * (b - a) for a, b in zip(p[1:], q[1:])]


def difference(path, reference, name):
    start = [0] if name in OF_FORCE else reference[0][1:]
    path = [row for row in path if row[0] >= reference[0][0]]
    places = [at(reference, row[0]) for row in path]
    away = sum(sum((a - b) ** 2 for a, b in zip(row[1:], q)) for row, q in zip(path, places))
    scale = sum(sum((b - c) ** 2 for b, c in zip(q, start)) for q in places)
    return (away / scale) ** 0.5


def reference_of(command, folder, tree, name):
    """Explicit time at a quarter of the stable step; the stable step is what explain says."""
    path = os.path.join(folder, "scene.json")
    closed = dict(tree, bodies=[dict(b, model={"type": "corotational_fem"}) for b in tree["bodies"]])
    closed["time"] = dict(tree["time"], integrator="symplectic_euler")
    with open(path, "w", encoding="utf-8") as f:
        json.dump(closed, f)
    plan = json.loads(subprocess.run([command, "explain", path, "--json"], check=True, capture_output=True,
                                     text=True).stdout)
    closed["output"] = {"every": tree["time"]["duration"] / 2000}
    closed["time"]["step"] = float(plan["step"]["stable_s"]) / 4
    return run(command, folder, closed, [], name)[1]


def main():
    command, out = os.path.abspath(sys.argv[1]), sys.argv[2]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, tree in SCENES.items():
            reference = reference_of(command, folder, tree, name)
            for key, wish in WISHES:
                if key == "accuracy" and name in OF_FORCE:
                    wish = dict(wish, quantity="force")
                summary, path = run(command, folder, dict(tree, **{key: wish}), [], name)
                plan = summary["planner"]
                way = plan["predicted"]
                predicted = max(b["model_error"] + b["time_error"] for b in way["bodies"])
                rows.append({
                    "scene": name, "wish": f"{key} {list(wish.values())[0]}",
                    "model": way["bodies"][0]["model"], "integrator": way["bodies"][0]["integrator"],
                    "step": way["step"],
                    "meets": predicted <= wish["target"] if key == "accuracy" else plan["meets"],
                    "predicted_error": f"{predicted:.3g}",
                    "error": f"{difference(path, reference, name):.3g}",
                    "predicted_cpu_s_per_s": f"{way['cpu_s_per_s']:.3g}",
                    "cpu_s_per_s": f"{summary['cpu_s'] / summary['simulated_s']:.3g}"})
                print(rows[-1], flush=True)
    with open(out, "w", newline="", encoding="utf-8") as f:
        table = csv.DictWriter(f, list(rows[0]))
        table.writeheader()
        table.writerows(rows)


if __name__ == "__main__":
    main()

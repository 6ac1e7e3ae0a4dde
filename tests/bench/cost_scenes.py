#!/usr/bin/env python3
"""What `deform cost` and the planner say about ten scenes, beside solutions that neither of them uses.

    python3 tests/bench/cost_scenes.py build/release/bin/deform OUT.csv [--budget 60] [--scenes bar_sag,...]

A scene has one quantity and a solution with many more cells of a kind of its own; a second one, of other
cells, says how far that one is off. Rows: the reference of the study and the members of its front, and the
planner with a target of 5 %: the error as claimed, and as found here, by code of its own.
"""
import argparse
import bisect
import csv
import json
import math
import os
import subprocess
import tempfile

DATA = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "data")
TIMES = {"duration": 0.3, "step": "auto"}
EXACT = {"integrator": "tr_bdf2", "step": 0.0005}
EXPLICIT = {"integrator": "symplectic_euler", "step": "auto"}
AT_BASE = [{"box": [[-1, -1, -1], [1, 1, 1e-6]]}]
AT_LEFT = [{"box": [[-1, -1, -1], [1e-6, 1, 1]]}]


def scene(mesh, young, more=None, fix=None, poisson=0.3, damping=(0, 0.002), **keys):
    """One body of corotational_fem."""
    body = {"name": "body", "mesh": mesh, "material": "gel", "model": {"type": "corotational_fem"}}
    body.update(more or {})
    if fix:
        body["fix"] = fix
    out = {"format": "deform-scene", "version": 1, "time": dict(TIMES), "bodies": [body],
           "materials": {"gel": {"density": 1000, "young": young, "poisson": poisson,
                                 "damping": {"mass": damping[0], "stiffness": damping[1]}}},
           "contact": {"friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.3}}]}}
    out.update(keys)
    if "obstacles" not in out:
        del out["contact"]
    return out


def probe(*point):
    return [{"name": "place", "body": "body", "point": list(point)}]


def down(x, y, low, high):
    return {"keyframes": [{"t": 0, "position": [x, y, high]}, {"t": 0.2, "position": [x, y, low]}]}


def sphere(radius, x, y, low, high):
    """Comes down from `high` to `low` in 0.2 s and stays."""
    return {"name": "tool", "shape": "sphere", "radius": radius, "motion": down(x, y, low, high)}


def plate(low, high):
    return {"name": "tool", "shape": "box", "half_size": [0.2, 0.2, 0.02], "motion": down(0, 0, low, high)}


FLOOR = {"name": "floor", "shape": "plane"}
BAR = {"make": "beam", "size": [0.4, 0.08, 0.08], "cells": 600}
THIN = {"make": "beam", "size": [0.5, 0.05, 0.05], "cells": 500}
ROD = {"make": "cylinder", "radius": 0.03, "length": 0.3, "cells": 800}
BALL = {"make": "ball", "radius": 0.1, "cells": 800}
BLOCK = {"make": "beam", "size": [0.2, 0.2, 0.1], "cells": 1500}
TUBE = {"make": "tube", "inner": 0.035, "radius": 0.05, "length": 0.12, "cells": 1500}
ORGAN = os.path.join(DATA, "organ.obj")


def made(mesh, **keys):
    return lambda tree, folder: tree["bodies"][0].update(mesh=dict(mesh, **keys))


def bricks(mesh, cells):
    return made({"make": "bricks", "size": mesh["size"], "cells": cells})


def round_lattice(mesh, cells, around=96):
    """Of a tube, under a surface of its own."""
    def change(tree, folder):
        path = os.path.join(folder, "tube.obj")
        rings = [(mesh["inner"], 0), (mesh["radius"], 0), (mesh["radius"], mesh["length"]),
                 (mesh["inner"], mesh["length"])]
        with open(path, "w", encoding="utf-8") as file:
            for radius, z in rings:
                for i in range(around):
                    angle = 2 * math.pi * i / around
                    file.write(f"v {radius * math.cos(angle)} {radius * math.sin(angle)} {z}\n")
            for k in range(4):
                a, b = k * around + 1, (k + 1) % 4 * around + 1
                for i in range(around):
                    j = (i + 1) % around
                    file.write(f"f {a + i} {b + i} {b + j}\nf {a + i} {b + j} {a + j}\n")
        tree["bodies"][0].update(mesh=path, lattice={"cells": cells})
    return change


def filled(key, cells):
    def change(tree, folder):
        tree["bodies"][0].pop("fill")
        tree["bodies"][0][key] = {"cells": cells}
    return change


def lasts(seconds, **keys):
    return {"duration": seconds, "step": "auto", **keys}


ON_FLOOR = {"place": {"on": "floor"}}
TURNED = {"pose": {"position": [0, 0, 0.05], "rotation": {"axis": [1, 0, 0], "angle_deg": 90}}}


def at_height(z):
    return {"pose": {"position": [0, 0, z]}}


# name: quantity, scene, time of the solutions, the solution, and one of other cells
SCENES = {
    "bar_sag": (
        "place",
        scene(BAR, 2e5, fix=AT_LEFT, damping=(4, 0.001), time=lasts(0.4), probes=probe(0.4, 0.04, 0.04)),
        EXACT, made(BAR, cells=1500, order=2), bricks(BAR, 1000)),
    "bar_period": (
        "place",
        scene(THIN, 4e6, fix=AT_LEFT, damping=(0, 0), time=lasts(1), probes=probe(0.5, 0.025, 0.025)),
        EXACT, made(THIN, cells=1500, order=2), bricks(THIN, 640)),
    "rod_static": (
        "place",
        scene(ROD, 5e5, fix=AT_BASE, gravity=[-9.81, 0, 0], time=lasts(1, mode="static"),
              probes=probe(0, 0, 0.3)),
        {}, made(ROD, cells=20000, order=2), made(ROD, cells=100000)),
    "ball_drop": (
        "place",
        scene(BALL, 5e4, at_height(0.13), obstacles=[FLOOR], time=lasts(0.4), probes=probe(0, 0, 0.1)),
        EXPLICIT, made(BALL, cells=50000), made(BALL, cells=6000, order=2)),
    "ball_rests": (
        "com",
        scene(BALL, 2e4, at_height(0.1005), obstacles=[FLOOR], time=lasts(0.4), damping=(10, 0.005)),
        EXPLICIT, made(BALL, cells=50000), made(BALL, cells=6000, order=2)),
    "ball_pressed": (
        "force",
        scene(BALL, 5e4, at_height(0.1), damping=(10, 0.005), obstacles=[FLOOR, plate(0.205, 0.221)]),
        EXPLICIT, made(BALL, cells=30000), made(BALL, cells=12000)),
    "block_pressed": (
        "force",
        scene(BLOCK, 5e4, fix=AT_BASE, poisson=0.45, damping=(0, 0.004), gravity=[0, 0, 0],
              time=lasts(0.4), obstacles=[sphere(0.05, 0.1, 0.1, 0.142, 0.151)]),
        EXPLICIT, made(BLOCK, cells=60000), made(BLOCK, cells=8000, order=2)),
    "tube_pinched": (
        "force",
        scene(TUBE, 1e5, TURNED, damping=(10, 0.003), obstacles=[FLOOR, plate(0.11, 0.121)]),
        EXPLICIT, round_lattice(TUBE, 4000), round_lattice(TUBE, 1500)),
    "organ_lies": (
        "com",
        scene(ORGAN, 1e4, {"fill": {"cells": 1500}, **ON_FLOOR}, obstacles=[FLOOR], damping=(10, 0.005)),
        EXPLICIT, filled("lattice", 2000), filled("fill", 20000)),
    "organ_pressed": (
        "force",
        scene(ORGAN, 3e4, {"fill": {"cells": 1500}, **ON_FLOOR}, poisson=0.45, damping=(10, 0.004),
              obstacles=[FLOOR, plate(0.115, 0.128)]),
        EXPLICIT, filled("lattice", 2000), filled("fill", 20000)),
}


def rows_of(folder, name):
    path = os.path.join(folder, name)
    if not os.path.exists(path):
        return []
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def curve(folder, quantity):
    """[(t, values)] of the probe, the center of mass or the force of the tool"""
    if quantity == "force":
        times = {float(row["t"]): [0.0] for row in rows_of(folder, "bodies.csv")}
        for row in rows_of(folder, "contacts.csv"):
            if "tool" in (row["body_a"], row["body_b"]):
                times[float(row["t"])] = [float(row["normal_N"])]
        return sorted(times.items())
    file, keys = ("probes.csv", "xyz") if quantity == "place" else ("bodies.csv", ("com_x", "com_y", "com_z"))
    return [(float(row["t"]), [float(row[k]) for k in keys]) for row in rows_of(folder, file)]


def at(path, t):
    i = min(max(bisect.bisect_left(path, (t,)), 1), len(path) - 1)
    (t0, a), (t1, b) = path[i - 1], path[i]
    s = min(max((t - t0) / (t1 - t0), 0), 1)
    return [x + s * (y - x) for x, y in zip(a, b)]


def error(mine, truth, quantity):
    """Root mean square over time, relative to the displacement, or to the largest force."""
    if quantity == "force":
        scale = max(v[0] for _, v in truth)
    else:
        scale = math.sqrt(sum(math.dist(v, truth[0][1]) ** 2 for _, v in truth) / len(truth))
    mine = [row for row in mine if row[0] <= truth[-1][0]]
    if len(mine) == 1:
        return math.dist(mine[-1][1], truth[-1][1]) / scale
    off = weight = 0
    for i, (t, v) in enumerate(mine):
        w = mine[min(i + 1, len(mine) - 1)][0] - mine[max(i - 1, 0)][0]
        off += w * math.dist(v, at(truth, t)) ** 2
        weight += w
    return math.sqrt(off / weight) / scale


def run(command, tree, folder, quantity):
    """What a run gives, and its summary; one that the folder has is read."""
    os.makedirs(folder, exist_ok=True)
    path, out = os.path.join(folder, "scene.json"), os.path.join(folder, "out")
    if not os.path.exists(os.path.join(out, "summary.json")):
        with open(path, "w", encoding="utf-8") as file:
            json.dump(tree, file)
        subprocess.run([command, "run", path, "--out", out, "--quiet"], check=True, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)
    with open(os.path.join(out, "summary.json"), encoding="utf-8") as file:
        return curve(out, quantity), json.load(file)


def solution(command, folder, name, which):
    quantity, tree, time = SCENES[name][:3]
    tree = json.loads(json.dumps(tree))
    place = os.path.join(folder, name, f"solution{which}")
    os.makedirs(place, exist_ok=True)
    SCENES[name][3 + which](tree, place)
    tree["time"].update(time)
    tree["output"] = {"every": tree["time"]["duration"] / 1000}
    return run(command, tree, place, quantity)[0]


def study(command, folder, name, options, truth):
    quantity, tree = SCENES[name][:2]
    place = os.path.join(folder, name)
    path, out = os.path.join(place, "scene.json"), os.path.join(place, "cost")
    with open(path, "w", encoding="utf-8") as file:
        json.dump(tree, file)
    words = ["--quantity", {"place": "place", "com": "com.body", "force": "force.body/tool"}[quantity],
             "--budget", str(options.budget), "--axes", options.axes, "--quiet", "--threads", "1"]
    done = subprocess.run([command, "cost", path, "--out", out, *words], check=False, capture_output=True,
                          text=True)
    if done.returncode:
        print(name, done.stderr)
        return
    with open(os.path.join(out, "cost.json"), encoding="utf-8") as file:
        report = json.load(file)
    choices, reference = report["choices"], report["reference"]
    pick = report["pick"]["index"] if report["pick"] else -1
    shown = {i: choices[i]["headline"] for i in report["front"]}
    own = choices[reference["choice"]]["headline"] or reference["error"]  # 0: it is the limit itself
    for i, claimed in {**shown, reference["choice"]: own}.items():
        what = "reference" if i == reference["choice"] else "choice" if i == pick else "front"
        found = error(curve(choices[i]["folder"], quantity), truth, quantity)
        yield what, choices[i]["label"], choices[i]["cells"], claimed, found, choices[i]["cpu_s_per_s"]


def planned(command, folder, name, truth):
    quantity, tree = SCENES[name][:2]
    tree = json.loads(json.dumps(tree))
    if tree["time"].get("mode") == "static":
        return
    del tree["bodies"][0]["model"], tree["time"]["step"]
    tree["accuracy"] = {"target": 0.05, "quantity": quantity}
    path, summary = run(command, tree, os.path.join(folder, name, "planned"), quantity)
    body = summary["planner"]["predicted"]["bodies"][0]
    claimed = body["model_error"] + body["time_error"] + body["mesh_error"]
    lattice = ", lattice" if any("/lattice/" in key for key in summary["planner"]["set"]) else ""
    label = f'{body["model"]}, {body["integrator"]}{lattice}'
    cells = summary["bodies"]["body"]["cells"]
    yield "planner", label, cells, claimed, error(path, truth, quantity), body["cpu_s_per_s"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("command")
    parser.add_argument("table")
    parser.add_argument("--budget", type=float, default=60)
    parser.add_argument("--axes", default="time,mesh,cells")
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--out", help="folder for runs; one that is done there is not run again")
    options = parser.parse_args()
    command = os.path.abspath(options.command)
    with (tempfile.TemporaryDirectory() as scratch,
          open(options.table, "w", newline="", encoding="utf-8") as file):
        folder = os.path.abspath(options.out) if options.out else scratch
        table = csv.writer(file, lineterminator="\n")
        table.writerow(("scene", "what", "label", "cells", "claimed", "found", "cpu_s_per_s"))
        for name in options.scenes.split(","):
            quantity = SCENES[name][0]
            truth = solution(command, folder, name, 0)
            doubt = error(solution(command, folder, name, 1), truth, quantity)
            rows = [("solution", "by other cells", "", 0, doubt, 0)]
            rows += study(command, folder, name, options, truth)
            rows += planned(command, folder, name, truth)
            for what, label, cells, claimed, found, cost in rows:
                row = (name, what, label, cells, f"{claimed or 0:.4f}", f"{found:.4f}", f"{cost:.3g}")
                table.writerow(row)
                print(*row, sep=", ", flush=True)


if __name__ == "__main__":
    main()

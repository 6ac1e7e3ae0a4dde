"""Checks what `deform cost` shows against runs that are ten times finer.

python3 tests/bench/cost_check.py TABLE.csv [--command build/release/bin/deform] [--scene SCENE.json]
[--budget 120] [--target 0.05] [--quantity tip] [--times 10] [--out out/cost_check]

Two runs, both of the reference's model in explicit steps; the scene has probes:
  shorter  the scene's own mesh, steps ten times shorter than the longest stable ones: what is said of
           model and step on this mesh
  finer    ten times (--times) the scene's cells, which shortens the steps with them: what is said of all
           meshes
Written for the references and the members of both fronts: the error as shown, and against these runs, root
mean square over time relative to how far the probes move. Records are compared by code of its own. A run that
OUT has is not run again.
"""
import argparse
import bisect
import csv
import json
import math
import os
import subprocess


def probes(folder):
    """{probe: [(t, x, y, z)]}"""
    out = {}
    with open(os.path.join(folder, "probes.csv"), newline="") as file:
        for row in csv.DictReader(file):
            out.setdefault(row["probe"], []).append(tuple(float(row[k]) for k in ("t", "x", "y", "z")))
    return out


def at_time(path, t):
    times = [row[0] for row in path]
    i = min(max(bisect.bisect_left(times, t), 1), len(path) - 1)
    a, b = path[i - 1], path[i]
    s = min(max((t - a[0]) / (b[0] - a[0]), 0), 1)
    return [a[k] + s * (b[k] - a[k]) for k in (1, 2, 3)]


def error(mine, truth):
    """The largest over all probes."""
    worst = 0
    for name, path in truth.items():
        off = moved = 0
        for row in mine[name]:
            there = at_time(path, row[0])
            off += sum((row[k + 1] - there[k]) ** 2 for k in range(3))
            moved += sum((there[k] - path[0][k + 1]) ** 2 for k in range(3))
        worst = max(worst, math.sqrt(off / moved))
    return worst


def cells_of(choice):
    """{body: cells} of a choice that was run; None of one that did not come to its end"""
    path = os.path.join(choice["folder"], "summary.json")
    if choice["state"] != "done" or not os.path.exists(path):
        return None
    with open(path) as file:
        return {name: body["cells"] for name, body in json.load(file)["bodies"].items()}


def finer(scene, out, choice, times):
    """Words of --set that give every body so many times the cells of the choice."""
    cells = cells_of(choice)
    words = []
    for i, body in enumerate(scene["bodies"]):
        surface = os.path.join(out, "surfaces", body["name"] + ".obj")
        wanted = round(times * cells[body["name"]])
        key = f"/bodies/{i}"
        if isinstance(body["mesh"], dict):
            words.append(f"{key}/mesh/cells={wanted}")
        else:
            words.append(f"{key}/fill/cells={wanted}")
        if os.path.exists(surface):
            words.append(f'{key}/mesh="{os.path.abspath(surface)}"')
    return words


def run(options, folder, words):
    if not os.path.exists(os.path.join(folder, "summary.json")):
        command = [options.command, "run", options.scene, "--out", folder, "--quiet", "--threads", "1"]
        for word in words:
            command += ["--set", word]
        subprocess.run(command, check=True)
    return probes(folder)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("table")
    parser.add_argument("--command", default="build/release/bin/deform")
    parser.add_argument("--scene", default="examples/scenes/two_cylinders.json")
    parser.add_argument("--budget", default="120")
    parser.add_argument("--target", default="0.05")
    parser.add_argument("--quantity", default="tip")
    parser.add_argument("--times", type=float, default=10)
    parser.add_argument("--out", default="out/cost_check")
    options = parser.parse_args()
    subprocess.run([options.command, "cost", options.scene, "--budget", options.budget, "--target",
                    options.target, "--quantity", options.quantity, "--out", options.out], check=True)
    with open(os.path.join(options.out, "cost.json")) as file:
        report = json.load(file)
    with open(options.scene) as file:
        scene = json.load(file)
    choices, here = report["choices"], report["this_mesh"]
    reference = choices[report["reference"]["choice"]]
    if cells_of(choices[0]) is None:
        raise SystemExit(f"{options.scene}: the scene as it is does not come to its end within --budget "
                         f"{options.budget}, so there is nothing to check; give more")
    words = ['/time/integrator="symplectic_euler"']
    for i in range(len(scene["bodies"])):
        model = reference["set"].get(f"/bodies/{i}/model")
        words += [f"/bodies/{i}/model={json.dumps(model)}"] if model else []
    truths = {"finer": run(options, os.path.join(options.out, "finer"), words + ['/time/step="auto"'] +
                           finer(scene, options.out, choices[0], options.times))}
    shown = {"finer": {i: choices[i]["headline"] for i in report["front"]}}
    shown["finer"][report["reference"]["choice"]] = report["reference"]["error"]  # null: nothing checks it
    if here:
        step = choices[here["check"]]["step"] / 10
        truths["shorter"] = run(options, os.path.join(options.out, "shorter"),
                                words + [f"/time/step={step:.6g}"])
        shown["shorter"] = {row["choice"]: row["error"] for row in here["front"]}
        shown["shorter"][here["choice"]] = here["error"]
    picked = report["pick"]["index"] if report["pick"] else None
    with open(options.table, "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(("against", "choice", "cells", "shown", "found", "cpu_s_per_s", "picked"))
        for against, truth in truths.items():
            for i, error_shown in shown[against].items():
                choice = choices[i]
                if cells_of(choice) is None or error_shown is None:
                    print(against, choice["label"], "not compared: it did not come to its end", sep=", ")
                    continue
                found = error(probes(choice["folder"]), truth)
                row = (against, choice["label"], sum(cells_of(choice).values()), f"{error_shown:.4f}",
                       f"{found:.4f}", f"{choice['cpu_s_per_s']:.3g}", "yes" if i == picked else "")
                table.writerow(row)
                print(*row, sep=", ")


main()

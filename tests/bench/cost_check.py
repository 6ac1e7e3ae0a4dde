"""Checks what `deform cost` shows against a run of ten times the cells.

python3 tests/bench/cost_check.py [--command build/release/bin/deform] [--scene SCENE.json] [--budget 120]
[--target 0.05] [--out out/cost_check]

The check run has the reference's model, explicit steps at the proven bound, which shrink with the cells, and
ten times the cells of the choice (of the front's most accurate member where nothing was chosen). The scene
has probes. Printed for the reference and each member of the front: the error as shown, and the error against
the check run, both root mean squares over time relative to how far the probes move. Records are compared by
code of its own."""
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


def finer(scene, out, choice, times):
    """Words of --set that give every body so many times the cells of the choice."""
    with open(os.path.join(choice["folder"], "summary.json")) as file:
        cells = {name: body["cells"] for name, body in json.load(file)["bodies"].items()}
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


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--command", default="build/release/bin/deform")
    parser.add_argument("--scene", default="examples/scenes/two_cylinders.json")
    parser.add_argument("--budget", default="120")
    parser.add_argument("--target", default="0.05")
    parser.add_argument("--out", default="out/cost_check")
    options = parser.parse_args()
    subprocess.run([options.command, "cost", options.scene, "--budget", options.budget, "--target",
                    options.target, "--out", options.out], check=True)
    with open(os.path.join(options.out, "cost.json")) as file:
        report = json.load(file)
    with open(options.scene) as file:
        scene = json.load(file)
    choices = report["choices"]
    reference = choices[report["reference"]["choice"]]
    chosen = report["pick"]["index"] if report["pick"] else report["front"][-1]
    words = finer(scene, options.out, choices[chosen], 10)
    words += ['/time/integrator="symplectic_euler"', '/time/step="auto"']
    for i in range(len(scene["bodies"])):
        model = reference["set"].get(f"/bodies/{i}/model")
        words += [f"/bodies/{i}/model={json.dumps(model)}"] if model else []
    fine = os.path.join(options.out, "ten_times_finer")
    command = [options.command, "run", options.scene, "--out", fine, "--quiet"]
    for word in words:
        command += ["--set", word]
    subprocess.run(command, check=True)
    truth = probes(fine)
    print(f"the reference's own error: shown {report['reference']['error']}, "
          f"against the check {error(probes(reference['folder']), truth):.4f}")
    for i in report["front"]:
        choice = choices[i]
        print(f"{'* ' if i == chosen else '  '}{choice['label']}: shown {choice['headline']:.4f}, "
              f"against the check {error(probes(choice['folder']), truth):.4f}, "
              f"{choice['cpu_s_per_s']:.3g} s per s")


main()

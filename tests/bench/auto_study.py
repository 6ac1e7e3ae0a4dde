#!/usr/bin/env python3
"""Undamped bodies at "step": "auto": every model at its defaults, but without damping, in a free spin, as a
cantilever and dropped on a floor, and what the energy watch says. A row each; rows that the table has are
left alone, so that the run may be stopped and taken up again.

auto_study.py DEFORM_COMMAND TABLE.csv [--steps N] [--seconds N] [--only TEXT] [--but TEXT]
             [--meshes FOLDER]...
    N steps of each row (100000), the row being left out that takes more than N seconds (300). Meshes are all
    of tetrahedra in the folders (examples/data), the coarsest first; where a model does not take a mesh, the
    row says so.
"""
import argparse
import csv
import json
import math
import pathlib
import subprocess
import tempfile

DATA = pathlib.Path(__file__).resolve().parents[2] / "examples/data"
SUFFIXES = (".msh", ".vtk", ".vtu", ".mesh")
UNDAMPED = {"damping_mass": 0, "damping_stiffness": 0}
# shape_matching calls the damping of its shape by another name
MODELS = {"msm": {}, "linear_fem": {}, "corotational_fem": {}, "meshless": {}, "modal": {}, "condensed": {},
          "shape_matching": {"damping_ratio": 0}}
CASES = ("spin", "cantilever", "drop")
YOUNG, DENSITY = 1e5, 1000
AXIS = (2, 10, 20)
RIM = 0.2  # of the wave speed, at the corner of the box that is farthest from its center
COLUMNS = ("row", "points", "step_s", "simulated_s", "steps", "substeps", "exit", "start_J", "max_J", "end_J",
           "gain_J", "says")


def spin_of(low, high):
    """rad/s, about AXIS: how fast a body may turn depends on its size."""
    radius = math.dist(low, high) / 2
    return [RIM * math.sqrt(YOUNG / DENSITY) / radius * a / math.hypot(*AXIS) for a in AXIS]


def scene(mesh, box, case, model, params):
    low, high = box
    body = {"name": "body", "mesh": str(mesh), "material": "rubber",
            "model": {"type": model, "params": params}}
    out = {"format": "deform-scene", "version": 1, "time": {"duration": 1, "step": "auto"},
           "gravity": [0, 0, 0],
           "materials": {"rubber": {"density": DENSITY, "young": YOUNG, "poisson": 0.3,
                                    "damping": {"mass": 0, "stiffness": 0}}},
           "bodies": [body], "output": {"every": 1}}
    if case == "spin":
        body["spin"] = spin_of(low, high)
    elif case == "cantilever":
        body["fix"] = [{"box": [[-9, -9, low[2] - 1e-6], [9, 9, low[2] + 1e-6]]}]
        out["gravity"] = [1, 0, 0]
    else:
        body["pose"] = {"position": [0, 0, 0.02 - low[2]]}
        out["gravity"] = [0, 0, -9.81]
        out["obstacles"] = [{"name": "floor", "shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}]
    return out


def deform(command, *arguments, seconds=None):
    return subprocess.run([command, *arguments], capture_output=True, text=True, timeout=seconds)


def step_of(command, path):
    done = deform(command, "explain", path, "--json")
    if done.returncode:
        raise ValueError(" ".join(done.stderr.split()).replace(path, "scene")[:300])
    return json.loads(done.stdout)["step"]["stable_s"]


def run(command, definition, steps, seconds):
    with tempfile.TemporaryDirectory() as folder:
        path, out = f"{folder}/scene.json", f"{folder}/run"
        pathlib.Path(path).write_text(json.dumps(definition))
        bound = step_of(command, path)
        # what nothing bounds takes the step of the command itself
        step = 0.8 * bound if bound else 1e-3
        definition["time"]["duration"] = steps * step
        definition["output"]["every"] = steps * step / 1000
        pathlib.Path(path).write_text(json.dumps(definition))
        done = deform(command, "run", path, "--out", out, "--quiet", "--threads", "1", seconds=seconds)
        summary = pathlib.Path(out) / "summary.json"
        found = json.loads(summary.read_text()) if summary.exists() else {}
        rows = pathlib.Path(out) / "bodies.csv"
        # of what has no elastic energy (shape_matching), kinetic alone
        energies = []
        if rows.exists():
            for row in csv.DictReader(rows.open()):
                elastic = float(row["elastic_J"] or 0)
                energies.append(float(row["kinetic_J"]) + (elastic if elastic == elastic else 0))
        energy = found.get("energy", {})
        return {"step_s": step, "simulated_s": found.get("simulated_s"), "steps": found.get("steps"),
                "substeps": found.get("substeps"), "exit": done.returncode,
                "start_J": energies[0] if energies else None, "max_J": max(energies, default=None),
                "end_J": energies[-1] if energies else None, "gain_J": energy.get("gain_J"),
                "says": " ".join(done.stderr.split())[:300]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("command")
    parser.add_argument("table", type=pathlib.Path)
    parser.add_argument("--steps", type=int, default=100000)
    parser.add_argument("--seconds", type=float, default=300)
    parser.add_argument("--only", default="")
    parser.add_argument("--but", metavar="TEXT")
    parser.add_argument("--meshes", action="append", metavar="FOLDER")
    options = parser.parse_args()
    done = {row["row"] for row in csv.DictReader(options.table.open())} if options.table.exists() else set()
    for points, box, name, mesh in meshes(options.command, options.meshes or [DATA]):
        for model, case, volume in kinds():
            row = f"{name} {model} {case}" + (" volume 0" if volume == 0 else "")
            if row in done or options.only not in row or (options.but and options.but in row):
                continue
            params = {**MODELS[model], **({"volume": 0} if volume == 0 else {})}
            try:
                found = run(options.command, scene(mesh, box, case, model, params), options.steps,
                            options.seconds)
            except subprocess.TimeoutExpired:
                found = {"says": f"takes more than {options.seconds:g} s"}
            except ValueError as refusal:
                found = {"says": str(refusal)}
            new = not options.table.exists()
            with options.table.open("a", newline="") as file:
                writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
                if new:
                    writer.writeheader()
                writer.writerow({"row": row, "points": points, **found})
            print(row, found, flush=True)


def kinds():
    for model in MODELS:
        for case in CASES:
            for volume in ([None, 0] if model == "msm" else [None]):
                yield model, case, volume


def meshes(command, folders):
    """(points, corners of the box, name, file), the coarsest first."""
    found = []
    for folder in folders:
        for path in sorted(pathlib.Path(folder).rglob("*")):
            if path.suffix not in SUFFIXES:
                continue
            done = deform(command, "mesh", "info", str(path), "--json")
            info = json.loads(done.stdout) if done.returncode == 0 else {}
            if info.get("tets", 0) > 1:
                name = str(path.relative_to(folder).with_suffix(""))
                found.append((info["points"], (info["lo"], info["hi"]), name, path))
    return sorted(found)


if __name__ == "__main__":
    main()

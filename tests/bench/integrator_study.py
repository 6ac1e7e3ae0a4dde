#!/usr/bin/env python3
"""How many explicit sub-steps cost as much as one implicit step: the threshold of `"integrator": "auto"`.

A cylinder, held at one end or dropped on a plane with friction, is run for half a second at 1/60 s with each
model, in three sizes, at Young's moduli that make explicit time take N sub-steps per step.

usage: integrator_study.py DEFORM_COMMAND [--sizes 800,5000,20000] [--models msm] [--substeps 50,200]
writes a table: case, model, points, n, processor ms per step explicit and implicit, their ratio
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

STEP = 1 / 60
SUBSTEPS = (25, 50, 100, 200, 400)


def scene(mesh, model, young, case, duration):
    body = {"name": "bar", "mesh": str(mesh), "material": "m", "model": {"type": model},
            "pose": {"rotation": {"axis": [0, 1, 0], "angle_deg": 90}, "position": [0, 0, 0.105]}}
    out = {"format": "deform-scene", "version": 1, "time": {"duration": duration, "step": STEP},
           "materials": {"m": {"density": 1000, "young": young, "poisson": 0.3}},
           "bodies": [body], "output": {"every": duration}}
    if case == "held":
        body["fix"] = [{"box": [[-1, -1, -0.001], [1, 1, 0.001]]}]
    else:
        out["obstacles"] = [{"name": "floor", "shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}]
        out["contact"] = {"friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.5}}]}
    return out


def call(command, *args):
    done = subprocess.run([command, *args], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    return done.stdout


def cost(command, folder, text, integrator):
    """processor ms per step"""
    path = folder / "scene.json"
    text["time"]["integrator"] = integrator
    path.write_text(json.dumps(text), encoding="utf-8")
    call(command, "run", str(path), "--out", str(folder / "out"), "--threads", "1", "--quiet")
    summary = json.loads((folder / "out" / "summary.json").read_text(encoding="utf-8"))
    return 1e3 * summary["cpu_s"] / summary["steps"]


def stable(command, folder, text):
    path = folder / "scene.json"
    text["time"]["integrator"] = "symplectic_euler"
    path.write_text(json.dumps(text), encoding="utf-8")
    return json.loads(call(command, "explain", str(path), "--json"))["step"]["stable_s"]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("command")
    parser.add_argument("--sizes", default="800,5000,20000")
    parser.add_argument("--models", default="corotational_fem,msm,linear_fem")
    parser.add_argument("--substeps", default=",".join(map(str, SUBSTEPS)))
    options = parser.parse_args()
    print("case model points n explicit_ms implicit_ms ratio")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for cells in options.sizes.split(","):
            mesh = folder / f"bar{cells}.msh"
            call(options.command, "mesh", "make", "cylinder", "--cells", cells, "--radius", "0.1", "--length",
                 "0.6", "--out", str(mesh))
            for model in options.models.split(","):
                for case in ("held", "dropped"):
                    if case == "dropped" and model == "linear_fem":
                        continue  # small rotations only
                    soft = scene(mesh, model, 1e5, case, 0.5)
                    base = stable(options.command, folder, soft)
                    for n in map(int, options.substeps.split(",")):
                        # the stable step falls with the root of Young's modulus
                        young = 1e5 * (base * n / STEP) ** 2
                        text = scene(mesh, model, young, case, 0.5)
                        taken = STEP / stable(options.command, folder, text)
                        explicit = cost(options.command, folder, text, "symplectic_euler")
                        implicit = cost(options.command, folder, text, "implicit_euler")
                        points = json.loads(call(options.command, "explain", str(folder / "scene.json"),
                                                 "--json"))["bodies"][0]["points"]
                        print(case, model, points, f"{taken:.0f} {explicit:.2f} {implicit:.2f}"
                              f" {explicit / implicit:.2f}", flush=True)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Makes the set of contact problems, contact_problems.tar.xz, by runs of the command: the stability suite,
stacks, mass ratios, grooves, piles, pads, grips, laws that remember, tears, rigid bodies, tools, models that
step themselves. Of each run a few problems spread over its time are kept, and the unsolved ones.

make_set.py COMMAND contact_problems.tar.xz [PART_OF_A_NAME]

The name of a problem is RUN-STEP-NUMBER[-unsolved].contact.
"""
import io
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
KEPT, LARGEST = 4, 200_000  # problems of a run; bytes of one


def material(young=2e5, density=1000, damping=1e-3):
    return {"density": density, "young": young, "poisson": 0.3, "damping": {"mass": 2, "stiffness": damping}}


def block(name, size, position, of="gel", cells=24, **more):
    return {"name": name, "mesh": {"make": "beam", "size": size, "cells": cells}, "material": of,
            "pose": {"position": position}, **more}


def friction(mu, law="coulomb", **params):
    names = ["mu"] if law == "coulomb" else ["mu_C"] if law == "dahl" else ["mu_C", "mu_S"]
    return {"friction": [{"between": ["*", "*"], "law": law, "params": {**{n: mu for n in names}, **params}}]}


FLOOR = {"name": "floor", "shape": "plane"}


def world(bodies, mu=0.5, obstacles=(FLOOR,), materials=None, gravity=(0, 0, -9.81), **more):
    return {"format": "deform-scene", "version": 1, "gravity": list(gravity),
            "time": {"duration": 0.3, "step": 0.001}, "materials": materials or {"gel": material()},
            "bodies": bodies, "obstacles": list(obstacles), "contact": friction(mu), **more}


def stack(n, young=2e5):
    return world([block(f"box{i}", [0.1, 0.1, 0.05], [0.003 * (i % 2), 0, 0.001 + 0.051 * i])
                  for i in range(n)], materials={"gel": material(young)})


def falling(mu):
    """Friction falls from 0.6 to mu as contacts slide."""
    bodies = [block("low", [0.08] * 3, [0, 0, 0.06], velocity=[0.5, 0.2, -1], cells=48),
              block("high", [0.08, 0.06, 0.06], [0.01, 0, 0.16], velocity=[-0.3, 0.1, -1], cells=48)]
    for body, axis, angle in zip(bodies, ([1, 2, 0.3], [2, 1, 0.5]), (25, 40)):
        body["pose"]["rotation"] = {"axis": axis, "angle_deg": angle}
    return world(bodies, materials={"gel": material(2e6)}, gravity=(1, 0, -9.81),
                 contact=friction(0.6, mu_S=0.6, mu_C=mu))


def ratio(r):
    return world([block("light", [0.1, 0.1, 0.1], [0, 0, 0.001]),
                  block("heavy", [0.1, 0.1, 0.1], [0.02, 0.01, 0.102], "heavy")],
                 materials={"gel": material(1e6, 200), "heavy": material(1e7, 200 * r)})


def groove(mu, half_angle):
    a = math.radians(half_angle)
    planes = [{"name": side, "shape": "plane", "normal": [s * math.cos(a), 0, math.sin(a)]}
              for side, s in (("left", 1), ("right", -1))]
    wedge = block("wedge", [0.04, 0.1, 0.04], [0, 0, 0.003])
    wedge["pose"]["rotation"] = {"axis": [0, 1, 0], "angle_deg": -45}
    return world([wedge], mu, planes, gravity=(0, 0, -49))


def pile(mu):
    walls = [{"name": f"wall{i}", "shape": "plane", "point": [0.09 * x, 0.09 * y, 0],
              "normal": [-0.9 * x, -0.9 * y, 0.4]}
             for i, (x, y) in enumerate([(1, 0), (-1, 0), (0, 1), (0, -1)])]
    bodies = []
    for i in range(20):
        place = [0.065 * (i % 2) - 0.06, 0.055 * (i // 2 % 2) - 0.05, 0.05 * (i // 4) + 0.003]
        b = block(f"b{i}", [0.06, 0.05, 0.04], place)
        b["pose"]["rotation"] = {"axis": [1, 0.5, i % 3], "angle_deg": 7 * (i % 5)}
        bodies.append(b)
    return world(bodies, mu, [FLOOR, *walls])


def bed():
    return block("bed", [0.2, 0.2, 0.05], [-0.1, -0.1, 0], cells=96,
                 fix=[{"box": [[-1, -1, -1], [1, 1, 0.001]]}])


def pad(young, share):
    slope = math.atan(0.5 * share)
    return world([bed(), block("pad", [0.08, 0.08, 0.03], [-0.04, -0.04, 0.051])], obstacles=[],
                 materials={"gel": material(young)},
                 gravity=(9.81 * math.sin(slope), 0, -9.81 * math.cos(slope)))


def grip(mu):
    jaws = []
    for name, x, d in (("left", -0.011, 0.003), ("right", 0.111, -0.003)):
        keys = [(0, [0, 0, 0]), (0.1, [d, 0, 0]), (0.3, [d, 0, 0.05])]
        jaws.append({"name": name, "shape": "box", "half_size": [0.01, 0.06, 0.06],
                     "pose": {"position": [x, 0.05, 0.06]},
                     "motion": {"keyframes": [{"t": t, "position": p} for t, p in keys]}})
    return world([block("bar", [0.1, 0.1, 0.1], [0, 0, 0.001], cells=60)], mu, [FLOOR, *jaws])


def slope(law, **params):
    out = world([block("block", [0.1, 0.1, 0.05], [0, 0, 0.001])], gravity=(3.3, 0, -9.2))
    out["contact"] = friction(0.5, law, **params)
    return out


def slit():
    body = block("body", [0.12, 0.06, 0.06], [0, 0, 0.0005], cells=200)
    return world([body], cuts=[{"body": "body", "t": 0.01, "shape": "blade", "mode": "split",
                                "corners": [[0.06, -0.01, 0.02], [0.06, 0.07, 0.02], [0.06, 0.07, 0.08],
                                            [0.06, -0.01, 0.08]]}])


def table(n, host):
    """Rigid boxes on a soft bed, on each other."""
    boxes = [{"name": f"rigid{i}", "shape": "box", "half_size": [0.03, 0.03, 0.02], "mass": 0.2 * 4 ** i,
              "pose": {"position": [0.08 * (i % 2) - 0.04, 0.08 * (i // 2) - 0.04, 0.072]}} for i in range(n)]
    return world([bed()], obstacles=[], rigid={"host": host, "bodies": boxes})


def reduced(model):
    obstacle = {"name": "floor", "shape": "mesh", "mesh": str(ROOT / "tests/stability/suite/floor.obj")}
    return world([block(f"b{i}", [0.1, 0.1, 0.05], [0.004 * i, 0, 0.001 + 0.051 * i], model={"type": model})
                  for i in range(3)], obstacles=[obstacle], materials={"gel": material(1e6)})


def read(path):
    """A scene of the repository, its files by their full path."""
    scene = json.loads(path.read_text())
    for thing in scene.get("bodies", []) + scene.get("obstacles", []) + scene.get("tools", []):
        for owner in (thing, thing.get("surface", {})):
            if isinstance(owner.get("mesh"), str):
                owner["mesh"] = str((path.parent / owner["mesh"]).resolve())
    return scene


def implicit(scene):
    for body in scene["bodies"]:
        body["model"] = {"type": "corotational_fem"}
        body["integrator"] = "implicit_euler"
    return scene


def runs():
    """name, scene, step (None: as it is), s to simulate, distance of the problems that are written"""
    suite = sorted(p for p in (ROOT / "tests/stability/suite").glob("*.json") if ".expect" not in p.name)
    for path in suite:
        name = path.stem
        yield f"{name}", read(path), None, 0.06, 20
        for label, step in (("4ms", 0.004), ("60Hz", 1 / 60)):
            yield f"{name}-implicit-{label}", implicit(read(path)), step, 0.4, 1
    for n in range(3, 11):
        yield f"stack{n}", stack(n), None, 0.1, 10
        yield f"stack{n}-implicit", implicit(stack(n, 1e5 if n % 2 else 1e7)), 1 / 60, 0.4, 1
    for power in range(5):
        yield f"ratio1e{power}", ratio(10 ** power), None, 0.1, 10
        yield f"ratio1e{power}-implicit", implicit(ratio(10 ** power)), 1 / 60, 0.4, 1
    for mu in (0, 0.1, 0.5, 1, 3, 10):
        for angle in (25, 45):
            yield f"groove{angle}-mu{mu}", groove(mu, angle), None, 0.1, 5
            yield f"groove{angle}-mu{mu}-implicit", implicit(groove(mu, angle)), 0.004, 0.2, 1
    for mu in (0.3, 1):
        yield f"pile-mu{mu}", pile(mu), None, 0.2, 20
        yield f"pile-mu{mu}-implicit", implicit(pile(mu)), 0.004, 0.2, 5
    for young in (2e4, 1e5):
        for share in (0.5, 0.9):
            yield f"pad{young:g}-{share}", pad(young, share), None, 0.1, 10
            yield f"pad{young:g}-{share}-implicit", implicit(pad(young, share)), 1 / 60, 0.5, 1
    for mu in (0.3, 1):
        yield f"grip-mu{mu}", grip(mu), None, 0.3, 20
        yield f"grip-mu{mu}-implicit", implicit(grip(mu)), 0.004, 0.3, 5
    for law, params in (("karnopp", {}), ("dahl", {}), ("lugre", {}), ("elastoplastic", {})):
        yield f"slope-{law}", slope(law, **params), None, 0.1, 10
        yield f"slope-{law}-implicit", implicit(slope(law, **params)), 0.004, 0.2, 1
    for mu in (0.2, 0.4):
        yield f"falls-mu{mu}-implicit", implicit(falling(mu)), 1 / 60, 0.3, 10
    yield "slit", slit(), None, 0.1, 5
    yield "slit-implicit", implicit(slit()), 0.004, 0.2, 1
    for host in ("builtin", "ode", "bullet"):
        for n in (1, 4):
            yield f"table{n}-{host}", table(n, host), None, 0.2, 10
            yield f"table{n}-{host}-implicit", implicit(table(n, host)), 0.004, 0.2, 2
    for model in ("modal", "condensed", "shape_matching", "linear_fem"):
        yield f"reduced-{model}", reduced(model), None, 0.2, 10
    for name, time, every in (("torn_dough", 1.2, 20), ("grasp", 1.5, 20), ("orange", 0.8, 20),
                              ("rigid_pinch", 1, 30), ("rigid_on_ball", 0.6, 10), ("ode_seesaw", 0.8, 20),
                              ("ode_gripper", 1, 20), ("reduced_models", 0.5, 5), ("probe_block", 0.4, 5),
                              ("attached", 0.6, 10), ("two_cylinders_coarse", 0.5, 50)):
        yield name, read(ROOT / f"examples/scenes/{name}.json"), None, time, every


def problems(command, folder, name, scene, step, time, every):
    if step:
        scene["time"] = {"duration": time, "step": step}
    scene["output"] = {"every": time}
    path, out = folder / f"{name}.json", folder / name
    path.write_text(json.dumps(scene))
    run = subprocess.run(["timeout", "60", command, "run", path, "--quiet", "--time", str(time), "--out",
                          folder / "out", "--contact-problems", out, "--contact-problems-every", str(every)],
                         capture_output=True, text=True)
    found = [f for f in sorted(out.glob("*.contact")) if f.stat().st_size <= LARGEST] if out.exists() else []
    unsolved = [f for f in found if f.stem.endswith("-unsolved")]
    solved = [f for f in found if f not in unsolved]
    kept = [files[k * len(files) // KEPT] for files in (solved, unsolved) if files for k in range(KEPT)]
    kept = sorted(set(kept))
    print(f"{name}: exit {run.returncode}, {len(found)} problems, {len(unsolved)} unsolved, {len(kept)} kept"
          f"{' ' + run.stderr.strip()[:150] if run.returncode else ''}", flush=True)
    return [(f"{name}-{f.name}", f.read_bytes()) for f in kept]


def main():
    command, target = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    part = sys.argv[3] if len(sys.argv) > 3 else ""
    members = []
    for name, *rest in runs():
        if part not in name:
            continue
        folder = pathlib.Path(tempfile.mkdtemp())
        members += problems(command, folder, name, *rest)
        shutil.rmtree(folder)
    with tarfile.open(target, "w:xz", preset=9, format=tarfile.USTAR_FORMAT) as tar:
        for name, content in sorted(members):
            info = tarfile.TarInfo(f"contact_problems/{name}")
            info.size = len(content)
            tar.addfile(info, io.BytesIO(content))
    print(f"{len(members)} problems, {sum(len(c) for _, c in members)} bytes, {target.stat().st_size} packed")


if __name__ == "__main__":
    main()

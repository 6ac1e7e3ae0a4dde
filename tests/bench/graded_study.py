#!/usr/bin/env python3
"""What a mesh that is fine where it is touched costs and gives, beside one that is fine or coarse everywhere.

A ball of 20 mm goes 3 mm into the middle of the top of a block of 100 mm and rests there. The block is held
at its foot. Meshes are lattices of boxes of six tetrahedra each, with equal spacing, or with spacings that
grow by one factor from the touched place. The force in the end is compared with that of the finest.

usage: graded_study.py DEFORM_COMMAND [--integrator implicit_euler] [--model corotational_fem]
writes a table: mesh, points, cells, least and largest spacing, force, error, processor s
"""
import argparse
import csv
import json
import pathlib
import resource
import subprocess
import tempfile

SIZE, RADIUS, DEPTH = 0.1, 0.02, 0.003
TIME, DURATION, STEP = 0.1, 0.2, 1 / 240
# Kuhn's six tetrahedra of a box: paths from corner 0 to corner 7 along the axes
PATHS = ((1, 3), (1, 5), (2, 3), (2, 6), (4, 5), (4, 6))


def graded(least, growth, length):
    """Intervals over `length` from `least` on, each `growth` times the last, stretched to fit."""
    ways = []
    while sum(ways) < length:
        ways.append(least * growth ** len(ways))
    share = length / sum(ways)
    return [share * way for way in ways]


def lattice(least, growth):
    half = graded(least, growth, SIZE / 2)
    across, down = half[::-1] + half, graded(least, growth, SIZE)
    def places(ways, start):
        at = [start]
        for way in ways:
            at.append(at[-1] + way)
        return at
    return places(across, -SIZE / 2), places(across, -SIZE / 2), places(down[::-1], -SIZE)


def write_mesh(path, x, y, z):
    nx, ny = len(x), len(y)
    def number(i, j, k):
        return 1 + i + nx * (j + ny * k)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(nx * ny * len(z))]
    for k, c in enumerate(z):
        for j, b in enumerate(y):
            for i, a in enumerate(x):
                lines.append(f"{number(i, j, k)} {a!r} {b!r} {c!r}")
    cells = []
    for k in range(len(z) - 1):
        for j in range(ny - 1):
            for i in range(nx - 1):
                corner = [number(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)) for c in range(8)]
                for a, b in PATHS:
                    first = [corner[0], corner[a], corner[b], corner[7]]
                    odd = (a, b) in ((1, 5), (2, 3), (4, 6))
                    cells.append(first if not odd else [first[0], first[2], first[1], first[3]])
    lines += ["$EndNodes", "$Elements", str(len(cells))]
    lines += [f"{i + 1} 4 2 0 0 {' '.join(map(str, c))}" for i, c in enumerate(cells)]
    path.write_text("\n".join([*lines, "$EndElements", ""]))
    return nx * ny * len(z), len(cells)


def scene(mesh, model, integrator):
    def ball(z):
        return [0, 0, z]
    return {
        "format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
        "time": {"duration": DURATION, "step": STEP, "integrator": integrator},
        "materials": {"m": {"density": 1000, "young": 1e5, "poisson": 0.3,
                            "damping": {"mass": 20, "stiffness": 2e-3}}},
        "bodies": [{"name": "block", "mesh": str(mesh), "material": "m", "model": {"type": model},
                    "fix": [{"box": [[-1, -1, -SIZE - 1e-6], [1, 1, -SIZE + 1e-6]]}]}],
        "obstacles": [{"name": "ball", "shape": "sphere", "radius": RADIUS,
                       "motion": {"keyframes": [{"t": 0, "position": ball(RADIUS + 0.001)},
                                                {"t": TIME, "position": ball(RADIUS - DEPTH)}]}}],
        "contact": {"friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.5}}]},
        "output": {"every": DURATION}}


def run(command, folder, name, places, args):
    mesh = folder / f"{name}.msh"
    points, cells = write_mesh(mesh, *places)
    path = folder / f"{name}.json"
    path.write_text(json.dumps(scene(mesh, args.model, args.integrator)))
    out = folder / name
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([command, "run", str(path), "--out", str(out), "--threads", "1"],
                          capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    took = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    with open(out / "contacts.csv", newline="", encoding="utf-8") as file:
        force = float(list(csv.DictReader(file))[-1]["normal_N"])
    ways = [b - a for axis in places for a, b in zip(axis, axis[1:])]
    return points, cells, min(ways), max(ways), force, took


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command")
    parser.add_argument("--model", default="corotational_fem")
    parser.add_argument("--integrator", default="implicit_euler")
    args = parser.parse_args()
    meshes = {"fine": lattice(SIZE / 16, 1), "coarse": lattice(SIZE / 6, 1),
              "graded 1.3": lattice(SIZE / 16, 1.3), "graded 1.6": lattice(SIZE / 16, 1.6)}
    finest = None
    print(f"{'mesh':12s} {'points':>7s} {'cells':>7s} {'least mm':>9s} {'most mm':>8s} {'force N':>9s} "
          f"{'error':>7s} {'s':>8s}")
    with tempfile.TemporaryDirectory() as folder:
        for name, places in meshes.items():
            points, cells, least, most, force, took = run(args.command, pathlib.Path(folder),
                                                          name.replace(" ", "_"), places, args)
            finest = finest or force
            print(f"{name:12s} {points:7d} {cells:7d} {1e3 * least:9.2f} {1e3 * most:8.2f} {force:9.4f} "
                  f"{force / finest - 1:+7.1%} {took:8.1f}", flush=True)


if __name__ == "__main__":
    main()

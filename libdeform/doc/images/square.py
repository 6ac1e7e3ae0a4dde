#!/usr/bin/env python3
"""The square of Zerbato (2010), 6.3: finite elements against augmented springs, square.png and a table.

square.py DEFORM_COMMAND [OUT.png]

A plate of 10 x 10, Young's modulus 100 along x and 500 along y, contraction along x per strain along y 0.09,
shear modulus 100, one edge clamped, a unit force per thickness on the middle of the opposite one, along it
or across it. The truth is the plane-stress field of linear triangles (10 x 10 x 2, diagonals in turn),
assembled here. The models have the same squares in one layer of tetrahedra, free to become thinner:
`corotational_fem` with its five constants, `msm` softer along x with the modulus and slope that fit both
fields best. `deform run` finds the equilibria (static mode).
"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

N, SIDE = 10, 10.0
EX, EY, NU, G = 100.0, 500.0, 0.09, 100.0
CASES = {"along x": (0, 0), "along y": (1, 1)}  # clamped edge's axis, force's component


def node(i, j):
    return i * (N + 1) + j


XY = np.array([[-SIDE / 2 + SIDE * i / N, -SIDE / 2 + SIDE * j / N]
               for i in range(N + 1) for j in range(N + 1)])


def triangles():
    out = []
    for i in range(N):
        for j in range(N):
            a, b, c, d = node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)
            out += [(a, b, c), (a, c, d)] if (i + j) % 2 == 0 else [(a, b, d), (b, c, d)]
    return np.array(out)


TRIANGLES = triangles()


def loaded(axis):
    return node(N, N // 2) if axis == 0 else node(N // 2, N)


def clamped(axis):
    return np.flatnonzero(XY[:, axis] < -SIDE / 2 + 1e-9)


def truth(axis, component):
    """Plane stress, linear triangles."""
    compliance = np.array([[1 / EX, -NU / EY, 0], [-NU / EY, 1 / EY, 0], [0, 0, 1 / G]])
    elastic = np.linalg.inv(compliance)
    stiffness = np.zeros((2 * len(XY), 2 * len(XY)))
    for t in TRIANGLES:
        p = XY[t]
        m = np.column_stack([np.ones(3), p])
        area, grad = np.linalg.det(m) / 2, np.linalg.inv(m)[1:]
        b = np.zeros((3, 6))
        b[0, 0::2], b[1, 1::2], b[2, 0::2], b[2, 1::2] = grad[0], grad[1], grad[1], grad[0]
        dofs = np.ravel([[2 * n, 2 * n + 1] for n in t])
        stiffness[np.ix_(dofs, dofs)] += area * b.T @ elastic @ b
    force = np.zeros(2 * len(XY))
    force[2 * loaded(axis) + component] = 1
    free = np.setdiff1d(np.arange(2 * len(XY)), np.ravel([[2 * n, 2 * n + 1] for n in clamped(axis)]))
    u = np.zeros(2 * len(XY))
    u[free] = np.linalg.solve(stiffness[np.ix_(free, free)], force[free])
    return u.reshape(-1, 2)


def plate(folder):
    """The squares as one layer of prisms of three tetrahedra each, in legacy VTK."""
    count = len(XY)
    points = np.vstack([np.column_stack([XY, np.full(count, z)]) for z in (0.0, 1.0)])
    tets = []
    for t in TRIANGLES:
        a, b, c = sorted(t)  # prisms beside each other then cut their common face alike
        for q in ((a, b, c, c + count), (a, b, b + count, c + count), (a, a + count, b + count, c + count)):
            e = points[list(q[1:])] - points[q[0]]
            tets.append(q if np.linalg.det(e) > 0 else (q[1], q[0], q[2], q[3]))
    with open(folder / "plate.vtk", "w") as file:
        file.write("# vtk DataFile Version 3.0\nplate\nASCII\nDATASET UNSTRUCTURED_GRID\n")
        file.write(f"POINTS {len(points)} double\n")
        np.savetxt(file, points, "%.17g")
        file.write(f"CELLS {len(tets)} {5 * len(tets)}\n")
        np.savetxt(file, np.column_stack([np.full(len(tets), 4), tets]), "%d")
        file.write(f"CELL_TYPES {len(tets)}\n" + "10\n" * len(tets))


def run(command, folder, model, axis, component):
    """Displacements of the nodes in the plane, mean of both faces."""
    count = len(XY)
    with open(folder / "bc.csv", "w") as file:
        file.write("node,fixx,fixy,fixz,fx,fy,fz\n")
        held = set(clamped(axis))
        for n in range(2 * count):
            fix = int(n % count in held)
            force = [0.0, 0.0, 0.0]
            if n % count == loaded(axis):
                force[component] = 0.5
            file.write(f"{n},{fix},{fix},{int(n < count)},{force[0]},{force[1]},{force[2]}\n")
    material, body = model
    (folder / "square.json").write_text(json.dumps({
        "format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
        "time": {"mode": "static", "duration": 1, "step": 1},
        "materials": {"plate": {"density": 1, **material}},
        "bodies": [{"name": "plate", "mesh": "plate.vtk", "material": "plate", "nodal_bc": "bc.csv", **body}],
        "probes": [{"name": str(n), "body": "plate", "point": [*map(float, XY[n % count]), float(n // count)]}
                   for n in range(2 * count)],
        "output": {"every": 1}}))
    subprocess.run([command, "run", str(folder / "square.json"), "--out", str(folder / "out"), "--quiet"],
                   check=True, stdout=subprocess.DEVNULL)
    u = np.zeros((count, 2))
    with open(folder / "out" / "probes.csv", newline="") as file:
        for row in csv.DictReader(file):
            if float(row["t"]) > 0.5:
                n = int(row["probe"]) % count
                u[n] += (np.array([float(row["x"]), float(row["y"])]) - XY[n]) / 2
    return u


def elements():
    return ({"young": EX, "poisson": 0.3},
            {"model": {"type": "corotational_fem"},
             "anisotropy": {"axis": [0, 1, 0], "params": {"young": EY, "poisson": NU, "shear": G}}})


def springs(young, slope):
    return ({"young": young, "poisson": 0.25},
            {"model": {"type": "msm"}, "anisotropy": {"axis": [1, 0, 0], "params": {"slope": slope}}})


def error(u, expected):
    """Of every node, over the largest displacement."""
    return np.linalg.norm(u - expected, axis=1) / np.linalg.norm(expected, axis=1).max()


def fitted(command, folder, fields):
    """Modulus and slope with the least squares over both fields; at such small forces displacements
    go by 1/modulus."""
    best = None
    for slope in np.arange(0.4, 3.01, 0.2):
        u = [run(command, folder, springs(EY, float(slope)), *CASES[case]) for case in CASES]
        a = np.concatenate([(x / np.abs(t).max()).ravel() for x, t in zip(u, fields)])
        b = np.concatenate([(t / np.abs(t).max()).ravel() for t in fields])
        scale = (a @ b) / (a @ a)
        left = np.linalg.norm(scale * a - b)
        if best is None or left < best[0]:
            best = (left, EY / scale, float(slope))
    return best[1:]


def main():
    command = sys.argv[1]
    out = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else pathlib.Path(__file__).with_suffix(".png")
    fields = [truth(*CASES[case]) for case in CASES]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        plate(folder)
        young, slope = fitted(command, folder, fields)
        models = {"finite elements": elements(),
                  f"springs, E {young:.3g}, slope {slope:.2g}": springs(young, slope)}
        results = {m: [run(command, folder, models[m], *CASES[case]) for case in CASES] for m in models}
    figure, axes = plt.subplots(2, 3, figsize=(11, 7.2), constrained_layout=True)
    for row, (case, expected) in enumerate(zip(CASES, fields)):
        size = np.linalg.norm(expected, axis=1)
        print(f"force {case}: largest displacement {size.max():.5f}")
        shown = axes[row, 0].tripcolor(*XY.T, TRIANGLES, size, shading="gouraud", cmap="viridis")
        axes[row, 0].set_title(f"displacement, unit force {case}")
        figure.colorbar(shown, ax=axes[row, 0])
        for column, (model, u) in enumerate(results.items(), 1):
            e = error(u[row], expected)
            at = CASES[case]
            n = loaded(at[0])
            print(f"| {model} | {case} | {100 * np.sqrt(np.mean(e**2)):.1f} | {100 * e.max():.1f} | "
                  f"{u[row][n, at[1]]:.5f} | {expected[n, at[1]]:.5f} |")
            shown = axes[row, column].tripcolor(*XY.T, TRIANGLES, 100 * e, shading="gouraud",
                                                cmap="magma_r", vmin=0, vmax=30)
            axes[row, column].set_title(f"error of {model}, %", fontsize=10)
            figure.colorbar(shown, ax=axes[row, column], extend="max")
    for ax in axes.ravel():
        ax.set_aspect("equal")
        ax.set_axis_off()
    figure.savefig(out, dpi=80)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Writes the meshes of the suite that no generator of the command makes: the stone of an arch, a beam with
slivers, a column of two groups and a flat floor of irregular triangles."""
import math
import random

KUHN = [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)]


def grid(n, place):
    """Points of a grid of n cells and its tetrahedra, six to a cell (Kuhn)."""
    points = [place(i, j, k) for k in range(n[2] + 1) for j in range(n[1] + 1) for i in range(n[0] + 1)]

    def number(at):
        return at[0] + (n[0] + 1) * (at[1] + (n[1] + 1) * at[2])

    cells = []
    for k in range(n[2]):
        for j in range(n[1]):
            for i in range(n[0]):
                for path in KUHN:
                    at, corners = [i, j, k], [number((i, j, k))]
                    for axis in path:
                        at[axis] += 1
                        corners.append(number(at))
                    cells.append((corners, k))
    return points, cells


def write_msh(name, points, cells, groups=None):
    def volume(c):
        a, b, c, d = (points[p] for p in c)
        u, v, w = ([q[k] - a[k] for k in range(3)] for q in (b, c, d))
        return (u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
                u[2] * (v[0] * w[1] - v[1] * w[0]))

    with open(name, "w", encoding="ascii") as out:
        out.write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n")
        if groups:
            out.write(f"$PhysicalNames\n{len(groups)}\n")
            out.writelines(f'3 {i + 1} "{g}"\n' for i, g in enumerate(groups))
            out.write("$EndPhysicalNames\n")
        out.write(f"$Nodes\n{len(points)}\n")
        out.writelines(f"{i + 1} {p[0]:.9g} {p[1]:.9g} {p[2]:.9g}\n" for i, p in enumerate(points))
        out.write(f"$EndNodes\n$Elements\n{len(cells)}\n")
        for i, (c, layer) in enumerate(cells):
            group = 1 + layer * len(groups) // (1 + max(l for _, l in cells)) if groups else 1
            c = c if volume(c) > 0 else [c[0], c[2], c[1], c[3]]
            out.write(f"{i + 1} 4 2 {group} {group} " + " ".join(str(p + 1) for p in c) + "\n")
        out.write("$EndElements\n")


def stone():
    """One of 25 of a half circle, middle radius 1 m, 0.2 m thick and deep; joints of 0.2 mm."""
    half = math.radians(3.6) - 1e-4

    def place(i, j, k):
        angle, r = half * (i - 1), 0.9 + 0.1 * k
        return (r * math.sin(angle), 0.2 * j - 0.1, r * math.cos(angle))

    write_msh("stone.msh", *grid((2, 1, 2), place))


def slivers():
    """A beam 0.2 x 0.1 x 0.1 m whose inner points lie so near to their neighbors' faces that their thinnest
    cells have a fiftieth of the height of the others."""

    def place(i, j, k):
        p = [0.05 * i, 0.05 * j, 0.05 * k]
        if i in (1, 3) and j == 1 and k == 1:
            p[0] += 0.049
        return p

    write_msh("slivers.msh", *grid((4, 2, 2), place))


def column():
    """0.1 x 0.1 x 0.2 m, the groups "lower" and "upper" one above the other."""
    points, cells = grid((2, 2, 4), lambda i, j, k: (0.05 * i, 0.05 * j, 0.05 * k))
    write_msh("column.msh", points, cells, ["lower", "upper"])


def floor():
    """z = 0 over 2 x 1 m: 16 by 8 squares, their inner corners moved, their diagonals without a pattern."""
    random.seed(1)
    with open("floor.obj", "w", encoding="ascii") as out:
        for j in range(9):
            for i in range(17):
                inner = 0 < i < 16 and 0 < j < 8
                x, y = (0.125 * (n + (random.uniform(-0.3, 0.3) if inner else 0)) for n in (i, j))
                out.write(f"v {x - 0.5:.6f} {y - 0.5:.6f} 0\n")
        for j in range(8):
            for i in range(16):
                a = 1 + i + 17 * j
                b, c, d = a + 1, a + 17, a + 18
                faces = ((a, b, d), (a, d, c)) if random.random() < 0.5 else ((a, b, c), (b, d, c))
                out.writelines("f %d %d %d\n" % f for f in faces)


stone()
slivers()
column()
floor()

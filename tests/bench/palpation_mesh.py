#!/usr/bin/env python3
"""The block of palpation_case.py as tetrahedra, half of it (y >= 0), physical groups "gel" and "nodule".

palpation_mesh.py NX NY NZ OUT.msh   (MSH 2.2, text)

Boxes, smaller toward the top and the middle, cut into six tetrahedra each after Kuhn, mirrored from box to
box.
"""
import itertools
import math
import pathlib
import sys

import palpation_case as case

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples" / "data"))
import kuhn  # noqa: E402

PLACES = [[(q + 0.25) / 5 for q in (a, b, c, 4 - a - b - c)]
          for a in range(5) for b in range(5 - a) for c in range(5 - a - b)]


def graded(x):
    """0 to 1: steps that grow, the first about a third of the last."""
    return 0.55 * x + 0.45 * x * x


def volume(corner):
    u, v, w = ([p[k] - corner[0][k] for k in range(3)] for p in corner[1:])
    return (u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0])
            + u[2] * (v[0] * w[1] - v[1] * w[0])) / 6


def share(corner):
    """How much of a cell lies in the ball, by 35 places."""
    if min(sum((a - b) ** 2 for a, b in zip(p, case.BALL)) for p in corner) > 4 * case.RADIUS ** 2:
        return 0
    inside = sum(sum((sum(w * p[k] for w, p in zip(place, corner)) - case.BALL[k]) ** 2 for k in range(3))
                 < case.RADIUS ** 2 for place in PLACES)
    return inside / len(PLACES)


def main():
    n, out = [int(a) for a in sys.argv[1:4]], sys.argv[4]
    points = [(case.SIZE[0] * i / n[0], case.SIZE[1] / 2 * graded(j / n[1]),
               case.SIZE[2] * (1 - graded(1 - k / n[2])))
              for k in range(n[2] + 1) for j in range(n[1] + 1) for i in range(n[0] + 1)]
    cells = []
    for place in itertools.product(*map(range, n)):
        for tet in kuhn.cube([c % 2 for c in place]):
            corners = [[c + a for c, a in zip(place, corner)] for corner in tet]
            cells.append([i + (n[0] + 1) * (j + (n[1] + 1) * k) for i, j, k in corners])
    # as many cells, those that lie in the ball most, as have the volume of its half
    shares = [share([points[p] for p in ids]) for ids in cells]
    group, left = [1] * len(cells), 2 / 3 * math.pi * case.RADIUS ** 3
    for c in sorted(range(len(cells)), key=lambda c: (-shares[c], c)):
        own = volume([points[p] for p in cells[c]])
        left -= own
        if left < -own / 2:
            break
        group[c] = 2
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "2", '3 1 "gel"', '3 2 "nodule"',
             "$EndPhysicalNames", "$Nodes", str(len(points))]
    lines += ["%d %.9g %.9g %.9g" % (i + 1, *p) for i, p in enumerate(points)]
    lines += ["$EndNodes", "$Elements", str(len(cells))]
    lines += ["%d 4 2 %d %d %d %d %d %d" % (c + 1, g, g, *(p + 1 for p in ids))
              for c, (g, ids) in enumerate(zip(group, cells))]
    with open(out, "w") as file:
        file.write("\n".join(lines + ["$EndElements"]) + "\n")


if __name__ == "__main__":
    main()

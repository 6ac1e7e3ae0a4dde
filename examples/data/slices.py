"""Writes orange.msh, cheese.msh and liver.msh (MSH 2.2, text): bodies in flat layers across x, for the
scenes that cut them. A blade opens faces of the mesh, so a cut between two layers is flat.

Run in this folder: python3 slices.py
"""
import itertools
import math

import kuhn


def lattice(counts):
    """Corners of each tetrahedron of a box of cubes, as places in the lattice. The diagonals go outward from
    the middle, so that a corner of the box may be rounded without a flat cell."""
    for place in itertools.product(*(range(n) for n in counts)):
        mirror = [2 * i < n for i, n in zip(place, counts)]
        for tet in kuhn.cube(mirror):
            yield [tuple(i + a for i, a in zip(place, corner)) for corner in tet]


def ball(flat, layers, cap, across):
    """A ball of radius 1: `layers` flat ones from -flat to flat, `cap` at either end; across x so many cubes.
    Gives the counts of the lattice and the place of one of its points."""
    counts = (layers + 2 * cap, *across)
    rim = 0.7 * math.sqrt(1 - flat * flat)   # of the last layer's far side, the rest of which is the sphere

    def place(i, j, k):
        u, v = 2 * j / counts[1] - 1, 2 * k / counts[2] - 1
        y, z = u * math.sqrt(1 - v * v / 2), v * math.sqrt(1 - u * u / 2)   # a square made round
        i -= cap
        side = 1 if 2 * i > layers else -1
        beyond = max(0, abs(2 * i - layers) / 2 - layers / 2) / cap
        if beyond > 0:
            x = flat + beyond * (math.sqrt(1 - rim * rim) - flat)
            radius = math.sqrt(1 - x * x)
            x = flat + beyond * (math.sqrt(1 - rim * rim * (y * y + z * z)) - flat)
        else:
            x = flat * abs(2 * i / layers - 1)
            radius = math.sqrt(1 - x * x)
        return side * x, radius * y, radius * z

    return counts, place


def orange():
    counts, place = ball(0.6, 6, 2, (6, 6))
    return counts, lambda *at: tuple(0.04 * x for x in place(*at))


def cheese():
    return (12, 4, 5), lambda i, j, k: (0.01 * i, 0.0125 * j, 0.012 * k)


def liver():
    """Thick on one side, thin on the other, flat below, with a fissure between its lobes."""
    counts, place = ball(0.75, 10, 1, (6, 4))

    def shape(*at):
        u, v, w = place(*at)
        thick = 0.034 * (1 - 0.55 * u) * (1 - 0.35 * v)      # v < 0 behind, where it is thick
        fissure = math.exp(-((u - 0.15) / 0.16) ** 2)
        y = (0.062 - 0.012 * u) * v - 0.014 * fissure * max(0, v) ** 2
        z = thick * (w if w > 0 else 0.55 * w) + 0.012 * (1 - u * u)
        return 0.1 * u, y, z

    return counts, shape


def write(name, counts, place):
    number = {at: n + 1 for n, at in enumerate(itertools.product(*(range(n + 1) for n in counts)))}
    points = {at: place(*at) for at in number}
    tets = list(lattice(counts))
    for tet in tets:
        a, b, c, d = (points[at] for at in tet)
        e, f, g = ([q - p for p, q in zip(a, x)] for x in (b, c, d))
        volume = sum(e[i] * (f[(i + 1) % 3] * g[(i + 2) % 3] - f[(i + 2) % 3] * g[(i + 1) % 3])
                     for i in range(3))
        assert volume > 0, (name, tet, volume)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(points))]
    lines += ["%d %.7g %.7g %.7g" % (number[at], *(x + 0.0 for x in p)) for at, p in points.items()]
    lines += ["$EndNodes", "$Elements", str(len(tets))]
    lines += ["%d 4 0 %d %d %d %d" % (n + 1, *(number[at] for at in tet)) for n, tet in enumerate(tets)]
    with open(name + ".msh", "w", encoding="ascii") as out:
        out.write("\n".join(lines + ["$EndElements"]) + "\n")


if __name__ == "__main__":
    for body in (orange, cheese, liver):
        write(body.__name__, *body())

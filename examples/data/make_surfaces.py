#!/usr/bin/env python3
"""Makes organ.obj, rabbit.obj and lobes.stl: closed surfaces of our own for scenes that fill them with cells.

A sphere of even triangles is pulled out to a radius that depends on the direction; then each point moves to
the middle of its neighbors and back onto the shape, again and again, until the triangles are even there. Run
in this folder: python3 make_surfaces.py
"""
import math
import struct


def unit(p):
    n = math.sqrt(sum(x * x for x in p))
    return tuple(x / n for x in p)


def dot(p, q):
    return sum(a * b for a, b in zip(p, q))


def icosphere(cuts):
    g = (1 + math.sqrt(5)) / 2
    points = [unit(p) for s in (1, -1) for t in (1, -1) for p in ((0, s, t * g), (s, t * g, 0),
                                                                  (t * g, 0, s))]
    near = [[j for j in range(12) if j != i and dot(points[i], points[j]) > 0.4] for i in range(12)]
    triangles = []
    for i in range(12):
        for j in near[i]:
            for k in near[i]:
                if i < j and i < k and j < k and k in near[j]:
                    a, b, c = points[i], points[j], points[k]
                    volume = dot(a, (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2],
                                     b[0] * c[1] - b[1] * c[0]))
                    triangles.append((i, j, k) if volume > 0 else (i, k, j))
    for _ in range(cuts):
        middle, finer = {}, []

        def mid(i, j):
            key = (min(i, j), max(i, j))
            if key not in middle:
                middle[key] = len(points)
                points.append(unit(tuple(x + y for x, y in zip(points[i], points[j]))))
            return middle[key]

        for a, b, c in triangles:
            x, y, z = mid(a, b), mid(b, c), mid(c, a)
            finer += [(a, x, z), (b, y, x), (c, z, y), (x, y, z)]
        triangles = finer
    return points, triangles


def bump(direction, axis, width):
    """1 along the axis, falling off over `width` radians."""
    angle = math.acos(max(-1.0, min(1.0, dot(direction, unit(axis)))))
    return math.exp(-(angle / width) ** 2)


def organ(d):
    """A lobe, a smaller one beside it, a hollow below and an edge in front, as a liver has them."""
    r = 0.060 * (1 + 0.55 * bump(d, (1, 0, 0.1), 0.8) + 0.25 * bump(d, (-1, 0.4, 0.2), 0.7) - 0.35 *
                 bump(d, (0.2, 0.1, -1), 0.7))
    return r * (1 + 0.05 * math.sin(5 * d[0] + 2 * d[1]) * math.sin(4 * d[1] - 3 * d[2]))


def rabbit(d):
    """A body, a head in front of it, two ears, two paws and a tail."""
    r = 0.050 * (1 + 0.75 * bump(d, (1, 0, 0.75), 0.50))
    r += 0.060 * (bump(d, (0.45, 0.40, 1), 0.17) + bump(d, (0.45, -0.40, 1), 0.17))
    r += 0.018 * (bump(d, (0.8, 0.55, -0.75), 0.25) + bump(d, (0.8, -0.55, -0.75), 0.25))
    return r + 0.012 * bump(d, (-1, 0, 0.15), 0.25) - 0.008 * bump(d, (0, 0, -1), 0.5)


def lobes(d):
    """Two lobes with a notch between them: flat, so that its edge is thin."""
    r = 0.075 * (1 + 0.45 * bump(d, (1, -0.2, 0), 0.9) + 0.30 * bump(d, (-1, 0.5, 0), 0.6))
    r *= 1 - 0.25 * bump(d, (-0.3, -1, 0), 0.5)
    return r / math.sqrt(1 + 5 * d[2] * d[2])


def relaxed(shape, cuts, rounds):
    points, triangles = icosphere(cuts)
    near = [set() for _ in points]
    for a, b, c in triangles:
        near[a] |= {b, c}
        near[b] |= {a, c}
        near[c] |= {a, b}
    near = [sorted(n) for n in near]
    place = lambda d: tuple(shape(d) * x for x in d)
    x = [place(p) for p in points]
    for _ in range(rounds):
        x = [place(unit(tuple(0.5 * x[i][k] + 0.5 * sum(x[j][k] for j in n) / len(n) for k in range(3))))
             for i, n in enumerate(near)]
    return x, triangles


def write(name, x, triangles):
    with open(name, "w", encoding="ascii") as out:
        out.write("# by make_surfaces.py, metres\n")
        out.writelines("v %.6f %.6f %.6f\n" % p for p in x)
        out.writelines("f %d %d %d\n" % (a + 1, b + 1, c + 1) for a, b, c in triangles)


def write_stl(name, x, triangles):
    with open(name, "wb") as out:
        out.write(b"by make_surfaces.py, metres".ljust(80) + struct.pack("<I", len(triangles)))
        for corners in triangles:
            a, b, c = (x[i] for i in corners)
            u, v = ([q - p for p, q in zip(a, other)] for other in (b, c))
            normal = unit((u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]))
            out.write(struct.pack("<12fH", *normal, *a, *b, *c, 0))


if __name__ == "__main__":
    write("organ.obj", *relaxed(organ, 3, 60))
    write("rabbit.obj", *relaxed(rabbit, 3, 150))
    write_stl("lobes.stl", *relaxed(lobes, 3, 100))

#!/usr/bin/env python3
"""Writes terrain.obj (an open height field of irregular triangles: a dale with ridges and boulders) and
basin.obj (a closed, lobed, folded bowl), for the scenes terrain.json and basin.json. Plain arithmetic:
python3 static_surfaces.py"""
import math
import os
import random


def write(name, points, triangles):
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), name)
    with open(path, "w", encoding="ascii") as out:
        out.write("# made by static_surfaces.py\n")
        for p in points:
            out.write("v %.5g %.5g %.5g\n" % tuple(p))
        for t in triangles:
            out.write("f %d %d %d\n" % tuple(i + 1 for i in t))


def terrain(n=30, size=0.9):
    draw = random.Random(7)
    boulders = [(draw.uniform(-0.5, 0.5), draw.uniform(-0.5, 0.5), draw.uniform(0.06, 0.12))
                for _ in range(9)]

    def height(x, y):
        z = (0.35 * (x * x + y * y) + 0.045 * math.sin(9 * x + 2 * y) * math.cos(7 * y - 3 * x) +
             0.05 * abs(math.sin(4 * x - 5 * y)))
        return z + sum(0.7 * max(0.0, r - math.hypot(x - a, y - b)) for a, b, r in boulders)

    points, triangles = [], []
    for j in range(n + 1):
        for i in range(n + 1):
            inner = 0 < i < n and 0 < j < n
            x, y = (size * (2 * (k + (draw.uniform(-0.3, 0.3) if inner else 0)) / n - 1) for k in (i, j))
            points.append((x, y, height(x, y)))
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i
            b, c, d = a + 1, a + n + 1, a + n + 2
            triangles += [(a, b, d), (a, d, c)] if draw.random() < 0.5 else [(a, b, c), (b, d, c)]
    write("terrain.obj", points, triangles)


def basin(around=48, along=14):
    """Inner wall from the middle to the rim, outer wall back; both lobed, the inner one with folds that run
    up it."""
    points, triangles = [(0, 0, 0)], []
    rings = 2 * along
    for ring in range(1, rings):
        inner = ring <= along
        s = ring / along if inner else (rings - ring) / along
        for k in range(around):
            a = 2 * math.pi * (k + 0.5 * (ring % 2)) / around
            lobes = 1 + 0.1 * math.cos(3 * a) + 0.05 * math.cos(5 * a + 1)
            r = (0.46 * s if inner else 0.52 * s) * lobes
            z = 0.34 * s ** 3 if inner else 0.34 * s ** 3 - 0.08 * (1 - s) - 0.02 * (1 if ring > along else 0)
            if inner:
                z += 0.025 * s * (1 - s) * 4 * abs(math.sin(4 * a)) + 0.03 * math.sin(math.pi * s) ** 2
            points.append((r * math.cos(a), r * math.sin(a), z))
    points.append((0, 0, -0.1))
    first = lambda ring: 1 + (ring - 1) * around
    for k in range(around):
        triangles.append((0, first(1) + k, first(1) + (k + 1) % around))
        triangles.append((len(points) - 1, first(rings - 1) + (k + 1) % around, first(rings - 1) + k))
        for ring in range(1, rings - 1):
            a, b = first(ring) + k, first(ring) + (k + 1) % around
            c, d = first(ring + 1) + k, first(ring + 1) + (k + 1) % around
            triangles += [(a, c, b), (b, c, d)] if ring % 2 == 0 else [(a, c, d), (a, d, b)]
    write("basin.obj", points, triangles)


terrain()
basin()

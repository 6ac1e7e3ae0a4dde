"""Tetrahedra for the other entries: made by `deform mesh make` (MSH 2.2, binary), so that every engine works
on the same mesh."""
import struct
import subprocess


def make(command, body, path):
    if body["shape"] == "block":
        shape = ["beam", "--size", *body["size"]]
    elif body["shape"] == "ball":
        shape = ["ball", "--radius", body["radius"]]
    else:
        shape = ["cylinder", "--radius", body["radius"], "--length", body["height"]]
    subprocess.run([command, "mesh", "make", *map(str, shape), "--cells", str(body["cells"]), "--out", path,
                    "--quiet"], check=True)


def read(path):
    """(points [[x, y, z]], tetrahedra [[a, b, c, d]], both from 0)."""
    data = open(path, "rb").read()
    at = data.index(b"$Nodes\n") + 7
    end = data.index(b"\n", at)
    n, at = int(data[at:end]), end + 1
    points = [struct.unpack_from("<3d", data, at + 28 * i + 4) for i in range(n)]
    at = data.index(b"$Elements\n", at + 28 * n) + 10
    end = data.index(b"\n", at)
    n, at, tets = int(data[at:end]), end + 1, []
    while n > 0:
        kind, count, tags = struct.unpack_from("<3i", data, at)
        corners = {1: 2, 2: 3, 4: 4, 15: 1}[kind]
        at += 12
        for _ in range(count):
            row = struct.unpack_from("<%di" % (1 + tags + corners), data, at)
            at += 4 * len(row)
            if kind == 4:
                tets.append([c - 1 for c in row[1 + tags:]])
        n -= count
    return points, tets


def write_text(path, points, tets):
    """Counts, points, tetrahedra from 0, as text."""
    with open(path, "w") as f:
        f.write("%d %d\n" % (len(points), len(tets)))
        f.writelines("%.9g %.9g %.9g\n" % tuple(p) for p in points)
        f.writelines("%d %d %d %d\n" % tuple(t) for t in tets)


def volume(points, tets):
    total = 0.0
    for a, b, c, d in tets:
        u, v, w = ([points[k][i] - points[a][i] for i in range(3)] for k in (b, c, d))
        total += (u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
                  u[2] * (v[0] * w[1] - v[1] * w[0])) / 6
    return abs(total)


def weights(points, tets):
    """Share of the volume that each point has: a quarter of its tetrahedra."""
    out = [0.0] * len(points)
    for t in tets:
        for i in t:
            out[i] += volume(points, [t]) / 4
    total = sum(out)
    return [w / total for w in out]


def turned(points, axis):
    """A body made along z, turned so that z becomes x or y."""
    return [[z, y, -x] if axis == "x" else [x, z, -y] for x, y, z in points]


def shortening(points, uz, height):
    """How much less the means of top and foot of a block lie apart, of displacements in the points' order."""
    top = [u for p, u in zip(points, uz) if p[2] > height - 1e-6]
    foot = [u for p, u in zip(points, uz) if p[2] < 1e-6]
    return sum(foot) / len(foot) - sum(top) / len(top)

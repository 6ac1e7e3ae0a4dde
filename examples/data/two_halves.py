"""Writes two_halves.msh (MSH 2.2, text): a bar 0.5 x 0.1 x 0.1 m, halves along x are the physical groups
"root" and "tip"; and two_halves_young.csv: Young's modulus of each cell, 8e6 Pa in the root and 2e6 Pa in the
tip.

Run in this folder: python3 two_halves.py
"""

NX, NY, NZ = 14, 3, 3
SIZE = (0.5, 0.1, 0.1)
# Kuhn's cut of a cube into six tetrahedra about the diagonal from corner 000 to 111: every permutation of the
# axes is one path along edges.
PATHS = [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)]
ODD = {(0, 2, 1), (1, 0, 2), (2, 1, 0)}


def node(i, j, k):
    return 1 + i + (NX + 1) * (j + (NY + 1) * k)


def cells():
    """Yields (group, corners); mirrored from cube to cube, so that no direction is preferred."""
    for k in range(NZ):
        for j in range(NY):
            for i in range(NX):
                mirror = (i % 2, j % 2, k % 2)
                for path in PATHS:
                    at = [0, 0, 0]
                    corners = [tuple(at)]
                    for axis in path:
                        at[axis] = 1
                        corners.append(tuple(at))
                    ids = [node(*(c + (1 - a if m else a) for c, a, m in zip((i, j, k), corner, mirror)))
                           for corner in corners]
                    if (path in ODD) != (sum(mirror) % 2 == 1):
                        ids[2], ids[3] = ids[3], ids[2]
                    yield (1 if i < NX // 2 else 2), ids


def main():
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "2", '3 1 "root"', '3 2 "tip"',
             "$EndPhysicalNames"]
    points = [(SIZE[0] * i / NX, SIZE[1] * j / NY, SIZE[2] * k / NZ)
              for k in range(NZ + 1) for j in range(NY + 1) for i in range(NX + 1)]
    lines += ["$Nodes", str(len(points))] + ["%d %.9g %.9g %.9g" % (n + 1, *p)
                                             for n, p in enumerate(points)] + ["$EndNodes"]
    tets = list(cells())
    lines += ["$Elements", str(len(tets))] + ["%d 4 2 %d %d %d %d %d %d" % (n + 1, g, g, *t)
                                              for n, (g, t) in enumerate(tets)]
    with open("two_halves.msh", "w") as out:
        out.write("\n".join(lines + ["$EndElements"]) + "\n")
    with open("two_halves_young.csv", "w") as out:
        out.write("value\n" + "".join("8e6\n" if g == 1 else "2e6\n" for g, _ in tets))


if __name__ == "__main__":
    main()

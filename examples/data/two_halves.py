"""Writes two_halves.msh (MSH 2.2, text): a bar 0.5 x 0.1 x 0.1 m, halves along x are the physical groups
"root" and "tip"; and two_halves_young.csv: Young's modulus of each cell, 8e6 Pa in the root and 2e6 Pa in the
tip.

Run in this folder: python3 two_halves.py
"""
import kuhn

NX, NY, NZ = 14, 3, 3
SIZE = (0.5, 0.1, 0.1)


def node(i, j, k):
    return 1 + i + (NX + 1) * (j + (NY + 1) * k)


def cells():
    """Yields (group, corners); mirrored from cube to cube, so that no direction is preferred."""
    for k in range(NZ):
        for j in range(NY):
            for i in range(NX):
                mirror = (i % 2, j % 2, k % 2)
                for corners in kuhn.cube(mirror):
                    yield (1 if i < NX // 2 else 2), [node(i + a, j + b, k + c) for a, b, c in corners]


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

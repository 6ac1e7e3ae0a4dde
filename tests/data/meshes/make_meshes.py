#!/usr/bin/env python3
"""Writes the small meshes beside this file: one body in every dialect that the readers know.

A unit cube of six tetrahedra (three named "low", three "high"), twelve skin triangles in the group "skin", a ninth node that no
tetrahedron uses, standing third in the file, and node numbers with gaps that do not ascend. Run it again after a change here.
"""
import os
import struct

HERE = os.path.dirname(os.path.abspath(__file__))
POINTS = [(0, 0, 0), (1, 0, 0), (5, 5, 5), (0, 1, 0), (1, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1), (1, 1, 1)]
TAGS = [10, 14, 90, 12, 40, 11, 22, 31, 25]
AT = [POINTS.index((x, y, z)) for z in (0, 1) for y in (0, 1) for x in (0, 1)]  # corner x + 2y + 4z
# Kuhn: along each of the six paths of unit steps from corner 0 to corner 7, turned to positive volume.
TETS = [tuple(AT[c] for c in t) for t in
        [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)]]
GROUPS = [1, 1, 1, 2, 2, 2]  # physical numbers of the cells
SKIN = [tuple(AT[c] for c in t) for t in
        [(0, 3, 1), (0, 2, 3), (0, 6, 2), (0, 4, 6), (0, 1, 5), (0, 5, 4), (7, 1, 3), (7, 5, 1), (7, 4, 5), (7, 6, 4), (7, 2, 6), (7, 3, 2)]]
NAMES = '$PhysicalNames\n3\n2 7 "skin"\n3 1 "low"\n3 2 "high end"\n$EndPhysicalNames\n'


def write(name, *parts):
    with open(os.path.join(HERE, name), "wb") as out:
        for part in parts:
            out.write(part.encode() if isinstance(part, str) else part)


def tags(cell):
    return [TAGS[p] for p in cell]


def words(rows):
    return "".join(" ".join(str(v) for v in row) + "\n" for row in rows)


def msh22():
    elements = [(i + 1, 2, 2, 7, 1, *tags(t)) for i, t in enumerate(SKIN)]
    elements += [(i + 101, 4, 2, g, g, *tags(t)) for i, (t, g) in enumerate(zip(TETS, GROUPS))]
    write("cube_msh22_ascii.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", NAMES,
          "$Nodes\n9\n", words((t, *p) for t, p in zip(TAGS, POINTS)), "$EndNodes\n",
          f"$Elements\n{len(elements)}\n", words(elements), "$EndElements\n",
          '$NodeData\n1\n"u"\n1\n0\n3\n0\n1\n1\n10 0.5\n$EndNodeData\n')
    for order, name in (("<", "le"), (">", "be")):
        nodes = b"".join(struct.pack(order + "i3d", t, *p) for t, p in zip(TAGS, POINTS))
        runs = b""
        for kind, rows in ((2, elements[:len(SKIN)]), (4, elements[len(SKIN):])):
            runs += struct.pack(order + "3i", kind, len(rows), 2)
            for row in rows:
                runs += struct.pack(f"{order}{len(row) - 2}i", row[0], *row[3:])
        write(f"cube_msh22_bin_{name}.msh", "$MeshFormat\n2.2 1 8\n", struct.pack(order + "i", 1), "\n$EndMeshFormat\n", NAMES,
              "$Nodes\n9\n", nodes, "\n$EndNodes\n", f"$Elements\n{len(elements)}\n", runs, "\n$EndElements\n")


def msh41_text(parametric):
    skin_nodes, body_nodes = [0, 1, 2], [3, 4, 5, 6, 7, 8]  # two blocks of nodes
    flag = 1 if parametric else 0
    nodes = f"2 9 10 90\n2 4 {flag} 3\n" + words([TAGS[i]] for i in skin_nodes)
    nodes += words((*POINTS[i], *((0.25, 0.75) if parametric else ())) for i in skin_nodes)
    nodes += f"3 5 {flag} 6\n" + words([TAGS[i]] for i in body_nodes)
    nodes += words((*POINTS[i], *((0.1, 0.2, 0.3) if parametric else ())) for i in body_nodes)
    entities = "1 0 1 2\n9 0 0 0 0\n4 0 0 0 1 1 1 1 7 0\n5 0 0 0 1 1 1 1 1 1 4\n6 0 0 0 1 1 1 1 2 1 -4\n"
    elements = f"4 {1 + len(SKIN) + 6} 1 200\n0 9 15 1\n1 {TAGS[0]}\n2 4 2 {len(SKIN)}\n" + words((i + 2, *tags(t)) for i, t in enumerate(SKIN))
    elements += "3 5 4 3\n" + words((i + 101, *tags(t)) for i, t in enumerate(TETS[:3]))
    elements += "3 6 4 3\n" + words((i + 104, *tags(t)) for i, t in enumerate(TETS[3:]))
    write("cube_msh41_parametric.msh" if parametric else "cube_msh41_ascii.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", NAMES,
          "$Entities\n", entities, "$EndEntities\n$Nodes\n", nodes, "$EndNodes\n$Elements\n", elements, "$EndElements\n",
          "$Periodic\n0\n$EndPeriodic\n")


def msh41_binary(order, size, name):
    n = "Q" if size == 8 else "I"

    def pack(kinds, *values):
        return struct.pack(order + kinds, *values)
    entities = pack("4" + n, 0, 0, 1, 2)
    for tag, physical, bounds in ((4, 7, []), (5, 1, [4]), (6, 2, [-4])):
        entities += pack(f"i6d{n}i{n}", tag, 0, 0, 0, 1, 1, 1, 1, physical, len(bounds)) + pack(f"{len(bounds)}i", *bounds)
    nodes = pack("4" + n, 1, 9, 10, 90) + pack("3i" + n, 3, 5, 0, 9) + pack("9" + n, *TAGS)
    nodes += b"".join(pack("3d", *p) for p in POINTS)
    elements = pack("4" + n, 3, len(SKIN) + 6, 1, 200)
    for dim, entity, kind, rows in ((2, 4, 2, SKIN), (3, 5, 4, TETS[:3]), (3, 6, 4, TETS[3:])):
        elements += pack("3i" + n, dim, entity, kind, len(rows))
        elements += b"".join(pack(f"{1 + len(t)}{n}", i + 1, *tags(t)) for i, t in enumerate(rows))
    write(name, f"$MeshFormat\n4.1 1 {size}\n", pack("i", 1), "\n$EndMeshFormat\n", NAMES, "$Entities\n", entities, "\n$EndEntities\n",
          "$Nodes\n", nodes, "\n$EndNodes\n$Elements\n", elements, "\n$EndElements\n")


def vtk():
    cells = [(4, *t) for t in TETS] + [(3, *t) for t in SKIN]
    kinds = [10] * len(TETS) + [5] * len(SKIN)
    size = sum(len(c) for c in cells)
    offsets = [0]
    for c in cells:
        offsets.append(offsets[-1] + len(c) - 1)
    flat = [p for c in cells for p in c[1:]]
    data = f"CELL_DATA {len(cells)}\nSCALARS part int 1\nLOOKUP_TABLE default\n"

    def head(version, form):
        return f"# vtk DataFile Version {version}\nsmall cube, title with \"quotes\"\n{form}\nDATASET UNSTRUCTURED_GRID\n"
    write("cube_vtk20_ascii.vtk", head("2.0", "ASCII"), "POINTS 9 double\n", words(POINTS), f"CELLS {len(cells)} {size}\n", words(cells),
          f"CELL_TYPES {len(cells)}\n", words([k] for k in kinds), data, words([k] for k in kinds))
    field = "FIELD FieldData 3\nTIME 1 1 double\n"
    write("cube_vtk30_field_ascii.vtk", head("3.0", "ASCII"), field, "0.5\nlabel 1 2 string\nfirst%20line\nsecond\npair 2 2 int\n1 2\n3 4\n",
          "POINTS 9 float\n", words(POINTS), "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n",
          f"CELLS {len(cells)} {size}\n", words(cells), f"CELL_TYPES {len(cells)}\n", words([k] for k in kinds))
    old_cells = b"".join(struct.pack(f">{len(c)}i", *c) for c in cells)
    types = struct.pack(f">{len(kinds)}i", *kinds)
    for kind, code in (("double", "d"), ("float", "f")):
        points = b"".join(struct.pack(">3" + code, *p) for p in POINTS)
        write(f"cube_vtk30_bin_{kind}.vtk", head("3.0", "BINARY"), f"POINTS 9 {kind}\n", points, f"\nCELLS {len(cells)} {size}\n", old_cells,
              f"\nCELL_TYPES {len(cells)}\n", types, "\n", data, types, "\n")
    points = b"".join(struct.pack(">3d", *p) for p in POINTS)
    string = b"first line"
    write("cube_vtk30_field_bin.vtk", head("3.0", "BINARY"), field, struct.pack(">d", 0.5), "\nlabel 1 1 string\n",
          bytes([0xC0 | len(string)]), string, "\npair 2 2 int\n", struct.pack(">4i", 1, 2, 3, 4), "\nPOINTS 9 double\n", points,
          f"\nCELLS {len(cells)} {size}\n", old_cells, f"\nCELL_TYPES {len(cells)}\n", types, "\n")
    shape = f"CELLS {len(offsets)} {len(flat)}\n"
    write("cube_vtk51_ascii.vtk", head("5.1", "ASCII"), "POINTS 9 double\n", words(POINTS), "\n", shape,
          "OFFSETS vtktypeint64\n", words([offsets]), "CONNECTIVITY vtktypeint64\n", words([flat]),
          f"CELL_TYPES {len(cells)}\n", words([k] for k in kinds))
    for kind, code in (("vtktypeint64", "q"), ("int", "i")):
        write("cube_vtk51_bin_%s.vtk" % code.replace("q", "64").replace("i", "32"), head("5.1", "BINARY"), "POINTS 9 double\n", points, "\n", shape,
              f"OFFSETS {kind}\n", struct.pack(f">{len(offsets)}{code}", *offsets), f"\nCONNECTIVITY {kind}\n",
              struct.pack(f">{len(flat)}{code}", *flat), f"\nCELL_TYPES {len(cells)}\n", types, "\n")


msh22()
msh41_text(False)
msh41_text(True)
msh41_binary("<", 8, "cube_msh41_bin_le.msh")
msh41_binary(">", 8, "cube_msh41_bin_be.msh")
msh41_binary("<", 4, "cube_msh41_bin_size4.msh")
vtk()

#!/usr/bin/env python3
"""Writes the small meshes beside this file, and the surfaces in ../surfaces: one body in every dialect that
the readers know.

A unit cube of six tetrahedra (three named "low", three "high"), twelve skin triangles in the group "skin", a
ninth node that no tetrahedron uses, standing third in the file, and node numbers with gaps that do not
ascend. The surfaces are the skin alone, as triangles or as the cube's six squares. Run it again after a
change here.
"""
import base64
import os
import struct
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))
POINTS = [(0, 0, 0), (1, 0, 0), (5, 5, 5), (0, 1, 0), (1, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1), (1, 1, 1)]
TAGS = [10, 14, 90, 12, 40, 11, 22, 31, 25]
AT = [POINTS.index((x, y, z)) for z in (0, 1) for y in (0, 1) for x in (0, 1)]  # corner x + 2y + 4z
# Kuhn: along each of the six paths of unit steps from corner 0 to corner 7, turned to positive volume.
TETS = [tuple(AT[c] for c in t) for t in
        [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)]]
GROUPS = [1, 1, 1, 2, 2, 2]  # physical numbers of the cells
SKIN = [tuple(AT[c] for c in t) for t in
        [(0, 3, 1), (0, 2, 3), (0, 6, 2), (0, 4, 6), (0, 1, 5), (0, 5, 4), (7, 1, 3), (7, 5, 1), (7, 4, 5),
         (7, 6, 4), (7, 2, 6), (7, 3, 2)]]
SQUARES = [tuple(AT[c] for c in q) for q in [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3),
                                             (0, 4, 6, 2), (1, 3, 7, 5)]]
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
        write(f"cube_msh22_bin_{name}.msh", "$MeshFormat\n2.2 1 8\n", struct.pack(order + "i", 1),
              "\n$EndMeshFormat\n", NAMES,
              "$Nodes\n9\n", nodes, "\n$EndNodes\n", f"$Elements\n{len(elements)}\n", runs,
              "\n$EndElements\n")


def msh40(name, order=""):
    """In binary where order says so, which gmsh itself did up to 4.1.5; a block of nodes has parameters."""
    def rows(*parts):
        if order:
            return b"".join(struct.pack(order + kinds, *values) for kinds, values in parts) + b"\n"
        return words(values for _, values in parts)
    box = (0, 0, 0, 1, 1, 1)
    entities = rows(("4Q", (1, 0, 1, 2)), ("i6dQ", (9, *6 * (0,), 0)), ("i6dQiQ", (4, *box, 1, 7, 0)),
                    ("i6dQiQi", (5, *box, 1, 1, 1, 4)), ("i6dQiQi", (6, *box, 1, 2, 1, -4)))
    nodes = rows(("2Q", (2, 9)), ("3iQ", (4, 2, 1, 3)),
                 *(("i5d", (TAGS[i], *POINTS[i], 0.25, 0.75)) for i in range(3)),
                 ("3iQ", (5, 3, 0, 6)), *(("i3d", (TAGS[i], *POINTS[i])) for i in range(3, 9)))
    blocks = [("2Q", (4, 1 + len(SKIN) + len(TETS))), ("3iQ", (9, 0, 15, 1)), ("2i", (1, TAGS[0]))]
    for entity, dim, kind, first, cells in ((4, 2, 2, 2, SKIN), (5, 3, 4, 101, TETS[:3]),
                                            (6, 3, 4, 104, TETS[3:])):
        blocks += [("3iQ", (entity, dim, kind, len(cells)))]
        blocks += [(f"{1 + len(t)}i", (first + i, *tags(t))) for i, t in enumerate(cells)]
    write(name, f"$MeshFormat\n4 {1 if order else 0} 8\n",
          struct.pack(order + "i", 1) + b"\n" if order else "", "$EndMeshFormat\n", NAMES, "$Entities\n",
          entities, "$EndEntities\n$Nodes\n", nodes, "$EndNodes\n$Elements\n", rows(*blocks),
          "$EndElements\n")


def msh41_text(parametric):
    skin_nodes, body_nodes = [0, 1, 2], [3, 4, 5, 6, 7, 8]  # two blocks of nodes
    flag = 1 if parametric else 0
    nodes = f"2 9 10 90\n2 4 {flag} 3\n" + words([TAGS[i]] for i in skin_nodes)
    nodes += words((*POINTS[i], *((0.25, 0.75) if parametric else ())) for i in skin_nodes)
    nodes += f"3 5 {flag} 6\n" + words([TAGS[i]] for i in body_nodes)
    nodes += words((*POINTS[i], *((0.1, 0.2, 0.3) if parametric else ())) for i in body_nodes)
    entities = "1 0 1 2\n9 0 0 0 0\n4 0 0 0 1 1 1 1 7 0\n5 0 0 0 1 1 1 1 1 1 4\n6 0 0 0 1 1 1 1 2 1 -4\n"
    elements = (f"4 {1 + len(SKIN) + 6} 1 200\n0 9 15 1\n1 {TAGS[0]}\n2 4 2 {len(SKIN)}\n" +
                words((i + 2, *tags(t)) for i, t in enumerate(SKIN)))
    elements += "3 5 4 3\n" + words((i + 101, *tags(t)) for i, t in enumerate(TETS[:3]))
    elements += "3 6 4 3\n" + words((i + 104, *tags(t)) for i, t in enumerate(TETS[3:]))
    write("cube_msh41_parametric.msh" if parametric else "cube_msh41_ascii.msh",
          "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", NAMES,
          "$Entities\n", entities, "$EndEntities\n$Nodes\n", nodes, "$EndNodes\n$Elements\n", elements,
          "$EndElements\n",
          "$Periodic\n0\n$EndPeriodic\n")


def msh41_binary(order, size, name):
    n = "Q" if size == 8 else "I"

    def pack(kinds, *values):
        return struct.pack(order + kinds, *values)
    entities = pack("4" + n, 0, 0, 1, 2)
    for tag, physical, bounds in ((4, 7, []), (5, 1, [4]), (6, 2, [-4])):
        entities += pack(f"i6d{n}i{n}", tag, 0, 0, 0, 1, 1, 1, 1, physical,
                         len(bounds)) + pack(f"{len(bounds)}i", *bounds)
    nodes = pack("4" + n, 1, 9, 10, 90) + pack("3i" + n, 3, 5, 0, 9) + pack("9" + n, *TAGS)
    nodes += b"".join(pack("3d", *p) for p in POINTS)
    elements = pack("4" + n, 3, len(SKIN) + 6, 1, 200)
    for dim, entity, kind, rows in ((2, 4, 2, SKIN), (3, 5, 4, TETS[:3]), (3, 6, 4, TETS[3:])):
        elements += pack("3i" + n, dim, entity, kind, len(rows))
        elements += b"".join(pack(f"{1 + len(t)}{n}", i + 1, *tags(t)) for i, t in enumerate(rows))
    write(name, f"$MeshFormat\n4.1 1 {size}\n", pack("i", 1), "\n$EndMeshFormat\n", NAMES, "$Entities\n",
          entities, "\n$EndEntities\n",
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
        return (f"# vtk DataFile Version {version}\nsmall cube, title with \"quotes\"\n{form}\n"
                f"DATASET UNSTRUCTURED_GRID\n")
    write("cube_vtk20_ascii.vtk", head("2.0", "ASCII"), "POINTS 9 double\n", words(POINTS),
          f"CELLS {len(cells)} {size}\n", words(cells),
          f"CELL_TYPES {len(cells)}\n", words([k] for k in kinds), data, words([k] for k in kinds))
    field = "FIELD FieldData 3\nTIME 1 1 double\n"
    write("cube_vtk30_field_ascii.vtk", head("3.0", "ASCII"), field,
          "0.5\nlabel 1 2 string\nfirst%20line\nsecond\npair 2 2 int\n1 2\n3 4\n",
          "POINTS 9 float\n", words(POINTS), "METADATA\nINFORMATION 1\n"
                                             "NAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1\n\n",
          f"CELLS {len(cells)} {size}\n", words(cells), f"CELL_TYPES {len(cells)}\n",
          words([k] for k in kinds))
    old_cells = b"".join(struct.pack(f">{len(c)}i", *c) for c in cells)
    types = struct.pack(f">{len(kinds)}i", *kinds)
    for kind, code in (("double", "d"), ("float", "f")):
        points = b"".join(struct.pack(">3" + code, *p) for p in POINTS)
        write(f"cube_vtk30_bin_{kind}.vtk", head("3.0", "BINARY"), f"POINTS 9 {kind}\n", points,
              f"\nCELLS {len(cells)} {size}\n", old_cells,
              f"\nCELL_TYPES {len(cells)}\n", types, "\n", data, types, "\n")
    points = b"".join(struct.pack(">3d", *p) for p in POINTS)
    string = b"first line"
    write("cube_vtk30_field_bin.vtk", head("3.0", "BINARY"), field, struct.pack(">d", 0.5),
          "\nlabel 1 1 string\n",
          bytes([0xC0 | len(string)]), string, "\npair 2 2 int\n", struct.pack(">4i", 1, 2, 3, 4),
          "\nPOINTS 9 double\n", points,
          f"\nCELLS {len(cells)} {size}\n", old_cells, f"\nCELL_TYPES {len(cells)}\n", types, "\n")
    shape = f"CELLS {len(offsets)} {len(flat)}\n"
    write("cube_vtk51_ascii.vtk", head("5.1", "ASCII"), "POINTS 9 double\n", words(POINTS), "\n", shape,
          "OFFSETS vtktypeint64\n", words([offsets]), "CONNECTIVITY vtktypeint64\n", words([flat]),
          f"CELL_TYPES {len(cells)}\n", words([k] for k in kinds))
    for kind, code in (("vtktypeint64", "q"), ("int", "i")):
        write("cube_vtk51_bin_%s.vtk" % code.replace("q", "64").replace("i", "32"), head("5.1", "BINARY"),
              "POINTS 9 double\n", points, "\n", shape,
              f"OFFSETS {kind}\n", struct.pack(f">{len(offsets)}{code}", *offsets),
              f"\nCONNECTIVITY {kind}\n",
              struct.pack(f">{len(flat)}{code}", *flat), f"\nCELL_TYPES {len(cells)}\n", types, "\n")


class Vtu:
    """One XML file; arrays are kept inline or collected behind it."""

    def __init__(self, order="<", header="I", zlib_block=0, place="ascii"):
        self.order, self.header, self.block, self.place = order, header, zlib_block, place
        self.appended = b""

    def packed(self, data):
        """Length and data, or the blocks of zlib with their head, as they stand in the file; base64 encodes
        the head of blocks apart."""
        as_text = self.place in ("b64", "appended_b64")
        if not self.block:
            both = struct.pack(self.order + self.header, len(data)) + data
            return base64.b64encode(both) if as_text else both
        blocks = [data[i:i + self.block] for i in range(0, len(data), self.block)]
        last = len(blocks[-1]) % self.block if blocks else 0
        deflated = [zlib.compress(b) for b in blocks]
        head = struct.pack(f"{self.order}{3 + len(blocks)}{self.header}", len(blocks), self.block, last,
                           *map(len, deflated))
        body = b"".join(deflated)
        return base64.b64encode(head) + base64.b64encode(body) if as_text else head + body

    def array(self, kind, code, name, values, components=1):
        head = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" '
        if self.place == "ascii":
            return f'{head}format="ascii">\n{" ".join(map(str, values))}\n</DataArray>\n'.encode()
        packed = self.packed(struct.pack(f"{self.order}{len(values)}{code}", *values))
        if self.place == "b64":
            return head.encode() + b'format="binary">\n  ' + packed + b"\n</DataArray>\n"
        self.appended += packed
        return f'{head}format="appended" offset="{len(self.appended) - len(packed)}"/>\n'.encode()

    def file(self, name, kind, content):
        order = "LittleEndian" if self.order == "<" else "BigEndian"
        header = ("" if self.header == "I" and self.place == "ascii"
                  else f' header_type="{"UInt32" if self.header == "I" else "UInt64"}"')
        compressor = ' compressor="vtkZLibDataCompressor"' if self.block else ""
        tail = b"</VTKFile>\n"
        if self.place.startswith("appended"):
            encoding = "base64" if self.place == "appended_b64" else "raw"
            tail = (f'<AppendedData encoding="{encoding}">\n  _'.encode() + self.appended +
                    b"\n</AppendedData>\n" + tail)
        write(name, f'<?xml version="1.0"?>\n<!-- small > cube -->\n'
                    f'<VTKFile type="{kind}" version="1.0" byte_order="{order}"{header}{compressor}>\n'
                    f'<{kind}>\n',
              content, f"</{kind}>\n", tail)

    def tets(self, name, point="Float64"):
        cells, kinds, groups = [*TETS, *SKIN], [10] * len(TETS) + [5] * len(SKIN), [*GROUPS, *[7] * len(SKIN)]
        ends = [sum(map(len, cells[:i + 1])) for i in range(len(cells))]
        letters = [c for n in ("skin", "low", "high end") for c in [*n.encode(), 0]]
        content = b"<FieldData>\n" + self.array("Int32", "i", "group_number", [2, 7, 3, 1, 3, 2], 2)
        content += self.array("String", "b", "group_name", letters) + b"</FieldData>\n"
        content += f'<Piece NumberOfPoints="9" NumberOfCells="{len(cells)}">\n<PointData>\n'.encode()
        content += self.array("Float32", "f", "warmth", [0.5] * 9) + b"</PointData>\n<CellData>\n"
        content += self.array("UInt8", "B", "group", groups) + b"</CellData>\n<Points>\n"
        content += self.array(point, "d" if point == "Float64" else "f", "Points",
                              [x for p in POINTS for x in p], 3) + b"</Points>\n<Cells>\n"
        content += self.array("Int64", "q", "connectivity", [p for c in cells for p in c])
        content += self.array("Int32", "i", "offsets",
                              ends) + self.array("UInt8", "B", "types", kinds) + b"</Cells>\n</Piece>\n"
        self.file(name, "UnstructuredGrid", content)

    def skin(self, name):
        content = f'<Piece NumberOfPoints="9" NumberOfPolys="{len(SQUARES)}">\n<Points>\n'.encode()
        content += self.array("Float32", "f", "Points", [x for p in POINTS for x in p],
                              3) + b"</Points>\n<Polys>\n"
        content += self.array("Int32", "i", "connectivity", [p for q in SQUARES for p in q])
        content += self.array("Int32", "i", "offsets",
                              [4 * (i + 1) for i in range(len(SQUARES))]) + b"</Polys>\n</Piece>\n"
        self.file(name, "PolyData", content)


def vtu():
    Vtu().tets("cube_vtu_ascii.vtu", "Float32")
    Vtu(place="b64").tets("cube_vtu_b64.vtu")
    Vtu(">", "Q", place="b64").tets("cube_vtu_b64_be64.vtu", "Float32")
    Vtu("<", "Q", 64, "b64").tets("cube_vtu_b64_zlib64.vtu")
    Vtu(place="appended_raw").tets("cube_vtu_raw.vtu")
    Vtu(">", "Q", place="appended_raw").tets("cube_vtu_raw_be64.vtu")
    Vtu("<", "I", 100, "appended_raw").tets("cube_vtu_raw_zlib.vtu")
    Vtu("<", "Q", place="appended_b64").tets("cube_vtu_appended_b64.vtu", "Float32")
    Vtu(">", "I", 32768, "appended_b64").tets("cube_vtu_appended_b64_zlib_be.vtu")


def medit():
    write("cube_medit.mesh", "# a comment\nMeshVersionFormatted 2\n\nDimension\n3\n\nVertices\n9\n",
          words((*p, 0) for p in POINTS), "\nCorners 2\n1\n2\n",
          f"\nTriangles\n{len(SKIN)}\n", words((*[p + 1 for p in t], 7) for t in SKIN),
          "Edges\n1\n1 2 3 # the third\n",
          f"\nTetrahedra {len(TETS)}\n", words((*[p + 1 for p in t], g) for t, g in zip(TETS, GROUPS)),
          "\nEnd\n")


def commas(rows):
    return "".join(", ".join(str(v) for v in row) + "\n" for row in rows)


def abaqus():
    elements = [(i + 1, *tags(t)) for i, t in enumerate(TETS)]
    write("cube_abaqus.inp", "** a comment\n*Heading\ncube\n*NODE, NSET=all\n",
          commas((t, *p) for t, p in zip(TAGS, POINTS)),
          "*Element, type=S3,\n elset=skin\n", commas((i + 101, *tags(t)) for i, t in enumerate(SKIN)),
          "*ELEMENT, TYPE=C3D4H, ELSET=low\n", commas(elements[:3]), "** comment\n",
          "*ELEMENT, TYPE=C3D4\n", commas(elements[3:]), '*ELSET, ELSET="high end", GENERATE\n4, 6\n',
          "*STEP\n*STATIC\n0.1, 1.\n*END STEP\n")


def tetgen():
    write("cube_tetgen.node", "# a comment\n9 3 1 1\n", words((t, *p, 0.5, 3) for t, p in zip(TAGS, POINTS)))
    write("cube_tetgen.ele", "6 4 1\n", words((i, *tags(t), g) for i, (t, g) in enumerate(zip(TETS, GROUPS))),
          "# end\n")
    write("cube_tetgen.face", "12 1\n", words((i, *tags(t), 7, i, -1) for i, t in enumerate(SKIN)))


def netgen():
    """With the sections of other uses that Netgen writes, and two numbers for the skin."""
    skin = [(1, 7 - i % 2, 1, 0, 3, *[p + 1 for p in t]) for i, t in enumerate(SKIN)]
    cells = [(g, 4, a + 1, c + 1, b + 1, d + 1) for (a, b, c, d), g in zip(TETS, GROUPS)]
    write("cube_netgen.vol", "# Generated by NETGEN v6.2\n\nmesh3d\ndimension\n3\ngeomtype\n0\n\n"
          "# surfnr domin domout tlosurf bcprop\nfacedescriptors\n2\n0 1 0 0 7\n1 1 0 0 6\n\n"
          f"# surfnr bcnr domin domout np p1 p2 p3\nsurfaceelementsgi\n{len(skin)}\n",
          words((*row, 0, 0, 0) for row in skin), f"\n# matnr np p1 p2 p3 p4\nvolumeelements\n{len(cells)}\n",
          words(cells), "\nedgesegmentsgi2\n1\n", words([(1, 0, 1, 2, -1, -1, 0, 0, 1, 0, 1, 1)]),
          "\n\n# X Y Z\npoints\n9\n", *(f"  {x:.16f}  {y:.16f}  {z:.16f}\n" for x, y, z in POINTS),
          "\npointelements\n0\nmaterials\n3\n1 low\n2 high end\n3 none\n\nbcnames\n7\n",
          words((i, "default" if i < 6 else "skin") for i in range(1, 8)),
          "\nface_colours\n1\n 1 0.0 1.0 0.0\nendmesh\n\ncsgsurfaces 1\nplane 6\n0 0 0 0 0 -1\n")


def surfaces():
    here = "../surfaces/cube_"
    back = [[f"{p - 9}/1" for p in q] for q in SQUARES]
    write(here + "obj.obj", "# cube\r\nmtllib none.mtl\r\no box\r\n",
          "".join(f"v\t{x} {y}   {z} 0.5 0.5 0.5\r\n" for x, y, z in POINTS), "vt 0 0\r\nvn 0 0 1\r\n",
          "g low\r\nusemtl red\r\n", "".join("f " + " ".join(f"{p + 1}/1/1" for p in t) + "\r\n"
                                             for t in SKIN[:6]),
          "g high end \r\ns off\r\n", "".join("f " + " \\\r\n  ".join(f"{p - 9}//-1" for p in t) + "\r\n"
                                              for t in SKIN[6:]), "l 1 2\r\n")
    write(here + "obj_quads.obj", words(("v", *p) for p in POINTS), words(("f", *q) for q in back))
    head = ("element vertex 9\nproperty float x\nproperty double y\nproperty float z\nproperty uchar red\n"
            "element face 6\n" \
           "property list uchar int vertex_indices\nproperty short group\nelement edge 1\n"
           "property int vertex1\nproperty list ushort float weights\nend_header\n")
    write(here + "ply_ascii.ply", "ply\nformat ascii 1.0\ncomment small\nobj_info cube\n", head,
          words((*p, 200) for p in POINTS),
          words((4, *q, i // 3) for i, q in enumerate(SQUARES)), "0 2 0.5 nan\n")
    for order, name in (("<", "little"), (">", "big")):
        rows = b"".join(struct.pack(order + "fdfB", *p, 200) for p in POINTS)
        rows += b"".join(struct.pack(order + "B4ih", 4, *q, i // 3)
                         for i, q in enumerate(SQUARES)) + struct.pack(order + "iH2f", 0, 2, 0.5, 0.5)
        write(here + f"ply_{name}.ply", f"ply\nformat binary_{name}_endian 1.0\n", head, rows)
    facets = ["facet normal 0 0 0\nouter loop\n" +
              words(("vertex", *POINTS[p]) for p in t) + "endloop\nendfacet\n" for t in SKIN]
    write(here + "stl_ascii.stl", "solid low\n", *facets[:6], "endsolid low\nsolid high end\n", *facets[6:],
          "endsolid\n")
    write(here + "stl_upper.stl", ("solid\n" + "".join(facets) + "endsolid\n").upper().replace("\n", "\r\n"))
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *[x for p in t for x in POINTS[p]], 0) for t in SKIN)
    write(here + "stl_binary.stl", b"solid but binary".ljust(80), struct.pack("<I", len(SKIN)), rows)
    write(here + "off.off", "OFF\n# comment\n\n9 6 0\n", words(POINTS), words((4, *q) for q in SQUARES))
    write(here + "off_first_line.off", "OFF 9 12 0\n", words(POINTS), words((3, *t, 255, 0, 0) for t in SKIN))
    write(here + "off_color.off", "COFF\n9 6\n", words((*p, 10, 20, 30, 255) for p in POINTS),
          words((4, *q, "# a square") for q in SQUARES))
    write(here + "off_normal.off", "NOFF 9 6 0\n", words((*p, 0, 0, 1) for p in POINTS),
          words((4, *q) for q in SQUARES))
    write(here + "off_bare.off", "9 6 12\n", words(POINTS), words((4, *q) for q in SQUARES))
    write(here + "off_binary.off", "CNOFF BINARY\n", struct.pack(">3i", 9, 6, 0),
          b"".join(struct.pack(">10f", *p, *[1] * 7) for p in POINTS),
          b"".join(struct.pack(">6i", 4, *q, i % 2) + b"\0" * 4 * (i % 2) for i, q in enumerate(SQUARES)))
    vtk_head = "# vtk DataFile Version %s\ncube\nASCII\nDATASET POLYDATA\nPOINTS 9 float\n"
    strip = [AT[c] for c in (4, 5, 6, 7, 2, 3, 0, 1)]  # three of the squares in one band
    write(here + "vtk_polydata.vtk", vtk_head % "3.0", words(POINTS),
          "VERTICES 1 2\n1 0\nLINES 1 4\n3 0 1 4\nPOLYGONS 3 15\n",
          words((4, *SQUARES[i]) for i in (2, 4, 5)), "TRIANGLE_STRIPS 1 9\n", words([(8, *strip)]),
          "POINT_DATA 9\nSCALARS warmth float\nLOOKUP_TABLE default\n", words([range(9)]),
          "CELL_DATA 6\nNORMALS n float\n", words([(0, 0, 1)] * 6),
          "SCALARS material int 1\nLOOKUP_TABLE default\n", words([(0, 0, 1, 2, 2, 1)]))
    write(here + "vtk51_polydata.vtk", vtk_head % "5.1", words(POINTS),
          "VERTICES 2 1\nOFFSETS vtktypeint64\n0 1\nCONNECTIVITY vtktypeint64\n0\n",
          "POLYGONS 7 24\nOFFSETS vtktypeint64\n0 4 8 12 16 20 24\nCONNECTIVITY vtktypeint64\n",
          words(SQUARES))
    Vtu(place="b64").skin(here + "vtp.vtp")
    write(here + "medit.mesh", "MeshVersionFormatted 1\nDimension 3\nVertices\n9\n",
          words((*p, 0) for p in POINTS), "Quadrilaterals\n6\n",
          words((*[p + 1 for p in q], 1 + i // 3) for i, q in enumerate(SQUARES)), "End\n")
    write(here + "msh22.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n9\n",
          words((i + 1, *p) for i, p in enumerate(POINTS)), "$EndNodes\n$Elements\n6\n",
          words((i + 1, 3, 2, 1 + i // 3, 1, *[p + 1 for p in q]) for i, q in enumerate(SQUARES)),
          "$EndElements\n")


msh22()
msh40("cube_msh40_ascii.msh")
msh40("cube_msh40_bin_le.msh", "<")
msh40("cube_msh40_bin_be.msh", ">")
msh41_text(False)
msh41_text(True)
msh41_binary("<", 8, "cube_msh41_bin_le.msh")
msh41_binary(">", 8, "cube_msh41_bin_be.msh")
msh41_binary("<", 4, "cube_msh41_bin_size4.msh")
vtk()
vtu()
medit()
abaqus()
tetgen()
netgen()
surfaces()

"""What the command writes, read by programs of others: meshio, VTK and gmsh. No library of ours is loaded."""
import functools
import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import meshio
import numpy as np

SOURCE = pathlib.Path(os.environ["DEFORM_SOURCE"])
MISSING = [name for name in ("vtk", "gmsh") if importlib.util.find_spec(name) is None]
CELLS, SURFACES = ("msh", "msh2", "vtk", "vtu", "mesh"), ("obj", "ply", "stl", "off", "vtk", "vtu")
CUBE = SOURCE / "tests" / "data" / "meshes" / "cube_msh41_ascii.msh"  # groups of cells and triangles


def deform(*arguments):
    return subprocess.run([os.environ["DEFORM_COMMAND"], *map(str, arguments)], check=True, text=True,
                          capture_output=True).stdout


def mesh(path):
    return json.loads(deform("mesh", "info", "--json", path))


def volume(points, cells, corners):
    """m3 of tetrahedra, or inside of triangles."""
    x = np.asarray(points, float)[np.asarray(cells).reshape(-1, corners)]
    if corners == 4:
        x = x[:, 1:] - x[:, :1]
    return float(np.linalg.det(x).sum() / 6) if len(x) else 0.0


def by_meshio(path):
    """(points, {type: cells}, cell arrays, field data)"""
    read = meshio.read(path, file_format="gmsh" if path.suffix == ".msh2" else None)
    return read.points, read.cells_dict, read.cell_data_dict, read.field_data


def by_vtk(path):
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
    reader = {".vtk": vtk.vtkUnstructuredGridReader, ".vtu": vtk.vtkXMLUnstructuredGridReader,
              ".obj": vtk.vtkOBJReader, ".ply": vtk.vtkPLYReader, ".stl": vtk.vtkSTLReader}[path.suffix]()
    said = []
    for event in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(event, lambda *_: said.append(event))
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    assert not said, f"{path}: {said}"
    cells = {}
    for c in range(grid.GetNumberOfCells()):
        ids = grid.GetCell(c).GetPointIds()
        kind = {3: "triangle", 4: "tetra"}[ids.GetNumberOfIds()]
        cells.setdefault(kind, []).append([ids.GetId(k) for k in range(ids.GetNumberOfIds())])

    def arrays(data):
        return {data.GetArrayName(i): vtk_to_numpy(data.GetArray(i)) for i in range(data.GetNumberOfArrays())}
    return (vtk_to_numpy(grid.GetPoints().GetData()), cells, arrays(grid.GetCellData()),
            arrays(grid.GetFieldData()) | arrays(grid.GetPointData()))


def by_gmsh(path):
    """(points, {type: cells}, {(dimension, number): name of a group})"""
    import gmsh
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.merge(str(path))
        tags, x, _ = gmsh.model.mesh.getNodes()
        place = np.zeros(int(max(tags)) + 1, int)
        place[np.asarray(tags, int)] = np.arange(len(tags))
        cells = {}
        for kind, _, nodes in zip(*gmsh.model.mesh.getElements()):
            corners, name = {2: (3, "triangle"), 4: (4, "tetra"), 15: (1, "point")}[kind]
            cells[name] = place[np.asarray(nodes, int)].reshape(-1, corners)
        groups = {(d, n): gmsh.model.getPhysicalName(d, n) for d, n in gmsh.model.getPhysicalGroups()}
        return np.reshape(x, (-1, 3)), cells, groups
    finally:
        gmsh.finalize()


@functools.cache
def reads(reader, ending):
    """Whether a reader can read what VTK itself writes. gmsh 4.13 reads none of its .vtk; meshio 5.3
    reads its .vtu only by a Python whose base64 ends at the padding, as 3.13.5 of Debian 13 does not."""
    if ending not in ("vtk", "vtu") or MISSING:
        return True
    import vtk
    grid, points = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
    for corner in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)):
        points.InsertNextPoint(corner)
    grid.SetPoints(points)
    grid.InsertNextCell(vtk.VTK_TETRA, 4, range(4))
    if ending == "vtk":
        writer = vtk.vtkUnstructuredGridWriter()
        writer.SetFileVersion(42)   # the last before offsets of cells
        writer.SetFileTypeToBinary()
    else:
        writer = vtk.vtkXMLUnstructuredGridWriter()
        writer.SetCompressorTypeToNone()
        writer.EncodeAppendedDataOff()
    writer.SetInputData(grid)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / f"of_vtk.{ending}"
        writer.SetFileName(str(path))
        writer.Write()
        try:
            return len(reader(path)[0]) == 4
        except Exception as error:
            print(f"{reader.__name__} cannot read VTK's own .{ending} ({error}): it does not read ours")
            return False


@unittest.skipIf(MISSING, f"no {' and '.join(MISSING)} (cmake/deps.txt)")
class Readers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.kept = tempfile.TemporaryDirectory(suffix=" with space")
        cls.folder = pathlib.Path(cls.kept.name)
        deform("mesh", "make", "ball", "--cells", 300, "--out", cls.folder / "plain.msh")
        deform("mesh", "make", "ball", "--cells", 300, "--surface", "--out", cls.folder / "skin.off")
        deform("mesh", "fill", cls.folder / "skin.off", "--cells", 300, "--out", cls.folder / "filled.vtu")
        (cls.folder / "parts.obj").write_text(
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ng one side\nf 1 3 2\nf 1 2 4\ng other\nf 2 3 4\nf 1 4 3\n")

    @classmethod
    def tearDownClass(cls):
        cls.kept.cleanup()

    def written(self, source, ending):
        out = self.folder / f"{source.stem}_out.{ending}"
        deform("mesh", "convert", source, out)
        return out

    def readers(self, path):
        """Which of them read a format; gmsh 4.8 has no VTU, OBJ and OFF, and knows MSH by .msh alone."""
        ending = path.suffix[1:]
        if reads(by_meshio, ending):
            yield "meshio", by_meshio(path)
        if path.suffix in (".vtk", ".vtu", ".obj", ".ply", ".stl"):
            yield "vtk", by_vtk(path)
        if path.suffix == ".msh2":
            path = pathlib.Path(shutil.copy(path, path.with_suffix(".22.msh")))
        if path.suffix in (".msh", ".vtk", ".mesh", ".ply", ".stl") and reads(by_gmsh, ending):
            yield "gmsh", by_gmsh(path)

    def of_vtk(self, ending):
        return [read for read in (by_meshio, by_vtk) if reads(read, ending)]

    def test_cells_in_every_format(self):
        for source in (self.folder / "plain.msh", self.folder / "filled.vtu", CUBE):
            ours = mesh(source)
            for ending in CELLS:
                for name, (points, cells, *_) in self.readers(self.written(source, ending)):
                    with self.subTest(source=source.name, ending=ending, reader=name):
                        tets = cells["tetra"]
                        self.assertEqual((len(points), len(tets)), (ours["points"], ours["tets"]))
                        self.assertAlmostEqual(volume(points, tets, 4) / ours["volume"], 1, delta=1e-12)

    def test_surfaces_in_every_format(self):
        for source in (self.folder / "plain.msh", self.folder / "skin.off", self.folder / "parts.obj"):
            ours = mesh(self.written(source, "off"))
            for ending in SURFACES:
                if source.suffix == ".msh" and ending in CELLS:
                    continue  # cells are written
                for name, (points, cells, *_) in self.readers(self.written(source, ending)):
                    with self.subTest(source=source.name, ending=ending, reader=name):
                        triangles = cells["triangle"]
                        self.assertEqual((len(points), len(triangles)), (ours["points"], ours["triangles"]))
                        self.assertAlmostEqual(volume(points, triangles, 3) / ours["volume"], 1,
                                               delta=1e-5 if name == "vtk" or ending == "stl" else 1e-12)

    def test_groups_and_shares(self):
        named = {(2, 7): "skin", (3, 1): "low", (3, 2): "high end"}
        for ending in ("msh", "msh2", "vtk", "vtu", "mesh"):
            path = self.written(CUBE, ending)
            if not reads(by_meshio, ending):
                continue
            data = by_meshio(path)[2]
            numbers = data[{"mesh": "medit:ref"}.get(ending, "gmsh:physical" if "msh" in ending else "group")]
            self.assertEqual([sorted(numbers[kind]) for kind in ("tetra", "triangle")],
                             [[1] * 3 + [2] * 3, [7] * 12], ending)
        for ending in ("msh", "msh2"):
            path = pathlib.Path(shutil.copy(self.written(CUBE, ending), self.folder / "named.msh"))
            self.assertEqual(by_gmsh(path)[2], named)
            self.assertEqual({tuple(reversed(number)): name for name, number in by_meshio(path)[3].items()},
                             {key: name for key, name in named.items()})
        for ending in ("vtk", "vtu"):
            for read in self.of_vtk(ending):
                field = read(self.written(CUBE, ending))[3]
                names = bytes(np.ravel(field["group_name"])).decode().split("\0")
                numbers = np.reshape(field["group_number"], (-1, 2))
                self.assertEqual(dict(zip(map(tuple, numbers.tolist()), names)), named, ending)
            share = by_vtk(self.written(self.folder / "filled.vtu", ending))[2]["share"]
            if reads(by_meshio, "vtu"):
                ours = by_meshio(self.folder / "filled.vtu")[2]["share"]["tetra"]
                np.testing.assert_array_equal(np.ravel(ours), np.ravel(share))
        for ending in ("obj", "ply"):
            groups = by_meshio(self.written(self.folder / "parts.obj", ending))[2]
            numbers = [set(np.ravel(values["triangle"])) for values in groups.values()]
            self.assertEqual([len(group) for group in numbers], [2], ending)

    def test_states_of_a_run(self):
        scene = {"format": "deform-scene", "version": 1, "time": {"duration": 0.01, "step": 0.005},
                 "gravity": [0, 0, -10],
                 "bodies": [{"name": "ball", "mesh": "skin.off", "fill": {"cells": 200},
                             "model": {"type": "corotational_fem"}},
                            {"name": "two parts", "mesh": str(CUBE), "pose": {"position": [3, 0, 0]}}],
                 "output": {"every": 0.005, "states": True}}
        (self.folder / "scene.json").write_text(json.dumps(scene))
        deform("run", self.folder / "scene.json", "--quiet", "--out", self.folder / "out", "--save-scene",
               self.folder / "saved.json")
        states = sorted((self.folder / "out" / "states").glob("*.vtu"))
        self.assertEqual(len(states), 4 * 3)
        for path in states:
            for read in self.of_vtk("vtu"):
                points, cells, data, _ = read(path)
                kind = "triangle" if "_surface_" in path.name else "tetra"
                self.assertEqual(list(cells), [kind], path.name)
                self.assertGreater(volume(points, cells[kind], 3 if kind == "triangle" else 4), 0)
                self.assertEqual({"energy_density", "stress", "von_mises"} <= set(data),
                                 kind == "tetra" and path.name.startswith("ball"), path.name)
            self.assertEqual(np.shape(by_vtk(path)[3]["u"]), (len(points), 3), path.name)
        saved = list(self.folder.glob("saved*.vtu")) + list(self.folder.glob("saved*/*.vtu"))
        self.assertTrue(saved)
        for path in saved:
            self.assertEqual(len({len(read(path)[0]) for read in self.of_vtk("vtu")}), 1)


class OfMeshio(unittest.TestCase):
    """Volume meshes that meshio writes, read by the command."""

    def test_formats_of_engineers(self):
        if not reads(by_meshio, "vtu"):
            self.skipTest("this meshio cannot read VTK's own .vtu")
        with tempfile.TemporaryDirectory() as folder:
            for make, order, kind, files in (("beam", 1, "tetra", "a.inp a.node a.mesh"),
                                             ("beam", 2, "tetra10", "a.inp"),
                                             ("bricks", 1, "hexahedron", "a.inp a.mesh")):
                source = pathlib.Path(folder) / "a.vtu"
                more = ["--order", order] if make == "beam" else []
                deform("mesh", "make", make, "--cells", 100, *more, "--out", source)
                read = meshio.read(source)
                plain = meshio.Mesh(read.points, [(kind, read.cells_dict[kind])])
                for file in files.split():
                    with self.subTest(kind=kind, file=file):
                        path = pathlib.Path(folder) / file
                        plain.write(path)
                        ours, theirs = mesh(path), mesh(source)
                        for name in ("points", "tets", "surface_triangles", "edges"):
                            self.assertEqual(ours[name], theirs[name])
                        self.assertAlmostEqual(ours["volume"] / theirs["volume"], 1, delta=1e-12)


if __name__ == "__main__":
    unittest.main()

"""Meshes: made, read, filled, written, from arrays, through meshio."""
import pathlib
import tempfile
import unittest

import meshio
import numpy as np

import deform


class Meshes(unittest.TestCase):
    def test_generators_and_files(self):
        for mesh, volume in ((deform.TetMesh.ball(0.1, 2000), 4 / 3 * np.pi * 1e-3),
                             (deform.TetMesh.cylinder(0.1, 0.5, 2000), 0.005 * np.pi),
                             (deform.TetMesh.tube(0.05, 0.1, 0.5, 4000), 0.00375 * np.pi),
                             (deform.TetMesh.beam([1, 0.1, 0.1], 500), 0.01)):
            self.assertAlmostEqual(mesh.volume / volume, 1, delta=0.06)
            with tempfile.TemporaryDirectory(suffix=" with space") as folder:
                for ending in ("msh", "vtk", "vtu", "mesh"):
                    path = pathlib.Path(folder) / f"mesh.{ending}"
                    mesh.write(path)
                    again = deform.TetMesh.read(path)
                    np.testing.assert_array_equal(again.tets, mesh.tets)

    def test_another_number_of_cells_is_told(self):
        ball = deform.TetMesh.ball(0.1, cells=100)
        self.assertIn("160 tetrahedra are made where 100 were asked for", repr(ball))
        self.assertEqual(len(ball.warnings), 1)
        self.assertEqual(deform.TetMesh.ball(0.1, cells=500).warnings, [])

    def test_from_arrays_repairs(self):
        points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [9, 9, 9]]
        mesh = deform.TetMesh.from_arrays(points, [[0, 2, 1, 3]])
        self.assertAlmostEqual(mesh.volume, 1 / 6)
        self.assertEqual((mesh.info.turned, mesh.info.dropped_points), (1, 1))
        self.assertEqual(len(mesh.warnings), 2)
        with self.assertRaisesRegex(deform.ArgumentError, "name point 7"):
            deform.TetMesh.from_arrays(points, [[0, 1, 2, 7]])
        points[3][1] = np.nan
        for kind, cells in ((deform.TetMesh, [[0, 1, 2, 3]]), (deform.TriMesh, [[0, 1, 2]])):
            with self.assertRaisesRegex(deform.ArgumentError, r"points\[3\] is \(0.0, nan, 1.0\)"):
                kind.from_arrays(points, cells)

    def test_from_arrays_warns_of_arrays(self):
        with self.assertLogs("deform", "WARNING") as said:
            deform.TetMesh.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1, 3]])
        self.assertEqual(said.output,
                         ["WARNING:deform:from_arrays: 1 of 1 cells had negative volume and was turned"])

    def test_surface_filled_and_hung(self):
        surface = deform.TriMesh.make("torus", [0.2, 0.06], triangles=1500)
        mesh = deform.TetMesh.fill(surface, cells=800)
        self.assertIsNotNone(mesh.share)
        self.assertAlmostEqual(mesh.volume / surface.volume, 1, delta=1e-9)
        self.assertIn(f"{surface.volume:.6g} m3", repr(mesh))
        self.assertGreater(mesh.info.volume, 1.2 * surface.volume)
        with deform.World(gravity=(0, 0, 0)) as world:
            body = world.add_body(mesh, surface=surface, coupling="mls")
            self.assertEqual(body.nsurfel, surface.info.npoint)
            np.testing.assert_allclose(body.positions, surface.points, atol=1e-9)
            self.assertAlmostEqual(body.measure.mass / (1000 * surface.volume), 1, delta=0.02)

    def test_lattice_under_a_surface(self):
        surface = deform.TriMesh.make("torus", [0.2, 0.06], triangles=1500)
        for mesh in (deform.TetMesh.lattice(surface, cells=60), deform.TetMesh.lattice(surface, size=0.08)):
            self.assertEqual(mesh.inside.shape, (mesh.info.ncell, 27))
            self.assertAlmostEqual(mesh.volume / surface.volume, 1, delta=1e-12)
            with deform.World(gravity=(0, 0, 0)) as world:
                body = world.add_body(mesh, surface=surface)
                np.testing.assert_allclose(body.positions, surface.points, atol=1e-9)
                self.assertAlmostEqual(body.measure.mass / (1000 * surface.volume), 1, delta=1e-12)
        self.assertIsNone(deform.TetMesh.fill(surface, cells=100).inside)
        with self.assertRaisesRegex(deform.ArgumentError, "either a number of cells"):
            deform.TetMesh.lattice(surface)

    def test_surface_where_cells_are_needed_names_fill(self):
        with tempfile.TemporaryDirectory(suffix=" with space") as folder, deform.World() as world:
            file = str(pathlib.Path(folder) / "ball.stl")
            deform.TriMesh.make("ball", [0.1], 200).write(file)
            with self.assertRaisesRegex(deform.Error, r"TetMesh\.fill and surface= .* Python.*"
                                                      r"mesh fill '.*ball\.stl' --out '.*ball\.vtu'"):
                world.add_body(file)

    def test_shares_are_kept_or_missed(self):
        mesh = deform.TetMesh.fill(deform.TriMesh.make("ball", [0.1], 200), cells=300)
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "ball.msh"
            with self.assertLogs("deform", "WARNING") as said:
                mesh.write(file)
            self.assertEqual(len(said.output), 1)
            self.assertRegex(said.output[0], r"ball\.msh does not keep how much.*write \.vtu")
            with self.assertNoLogs("deform", "WARNING"):
                mesh.write(file.with_suffix(".vtu"))
            meshio.write(file.with_suffix(".vtk"), mesh.to_meshio())
            for again in (deform.TetMesh.read(file.with_suffix(".vtu")),
                          deform.TetMesh.read(file.with_suffix(".vtk")),
                          deform.TetMesh.from_meshio(mesh.to_meshio())):
                np.testing.assert_array_equal(again.share, mesh.share)
        with self.assertRaisesRegex(deform.ArgumentError, "share must hold"):
            deform.TetMesh.from_arrays(mesh.points, mesh.tets, mesh.share[:-1])

    def test_through_meshio(self):
        mesh = deform.TetMesh.ball(0.1, 300)
        there = mesh.to_meshio()
        self.assertIsInstance(there, meshio.Mesh)
        back = deform.TetMesh.from_meshio(there)
        np.testing.assert_array_equal(back.tets, mesh.tets)
        np.testing.assert_array_equal(back.points, mesh.points)
        surface = deform.TriMesh.make("ball", [0.1], 200)
        again = deform.TriMesh.from_meshio(surface.to_meshio())
        np.testing.assert_array_equal(again.triangles, surface.triangles)
        with self.assertRaisesRegex(deform.ArgumentError, "no cells of kind 'tetra'; it has triangle"):
            deform.TetMesh.from_meshio(surface.to_meshio())
        with tempfile.TemporaryDirectory() as folder:
            file = str(pathlib.Path(folder) / "ball.su2")  # which meshio reads, and the library does not
            meshio.write(file, there)
            self.assertAlmostEqual(deform.TetMesh.from_meshio(file).volume, mesh.volume)
        with deform.World() as world:
            state = world.add_body(mesh, velocity=(1, 0, 0)).to_meshio()
            np.testing.assert_array_equal(state.point_data["velocity"][:, 0], 1)


if __name__ == "__main__":
    unittest.main()

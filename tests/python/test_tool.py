"""Tools, cuts, and arrays of bodies that have been cut."""
import contextlib
import io
import pathlib
import re
import unittest

import numpy as np

import deform


def cube(world, **options):
    return world.add_body(deform.TetMesh.beam((0.04, 0.04, 0.04), cells=320), name="cube",
                          position=(-0.02, -0.02, -0.02), model="corotational_fem",
                          material={"young": 3e4, "damping_stiffness": 2e-3}, **options)


class Rotation(unittest.TestCase):
    def test_is_a_unit_quaternion_about_the_axis(self):
        np.testing.assert_allclose(deform.rotation((0, 0, 3), 90), (0, 0, 0.5 ** 0.5, 0.5 ** 0.5), atol=1e-15)
        np.testing.assert_allclose(deform.rotation((1, 1, -1), 120), (0.5, 0.5, -0.5, 0.5), atol=1e-15)
        for axis, degrees in (((0, 0, 0), 90), ((0, 0, 1), float("nan")), ((0, 1), 90)):
            with self.assertRaises(deform.ArgumentError):
                deform.rotation(axis, degrees)


class Page(unittest.TestCase):
    """The program of doc/concepts/tools.md."""

    def test_graspers_hand_over(self):
        page = pathlib.Path(__file__).parents[2] / "libdeform/doc/concepts/tools.md"
        program = re.search(r"^```python\n(.*?)^```", page.read_text(), re.M | re.S)[1]
        names = {}
        with contextlib.redirect_stdout(io.StringIO()):
            exec(program, names)
        self.addCleanup(names["world"].close)
        self.assertAlmostEqual(names["cube"].measure.com[2], 0.082, delta=2e-3)
        self.assertEqual(names["first"].force[0].tolist(), [0, 0, 0])


class Scenery(unittest.TestCase):
    def setUp(self):
        self.world = deform.World(gravity=(0, 0, 0))
        self.body = cube(self.world)
        self.addCleanup(self.world.close)

    def plane(self, x):
        return [[x, -1, -1], [x, 1, -1], [x, 1, 1], [x, -1, 1]]


class Shapes(Scenery):
    def test_mesh(self):
        ball = deform.TriMesh.make("ball", [0.01], 100)
        self.world.add_tool("mesh", mesh=ball, position=(0, 0, 1))
        self.assertAlmostEqual(self.world.query_ray((0, 0, 2), (0, 0, -1)).distance, 0.99, delta=1e-3)
        with self.assertRaisesRegex(deform.ArgumentError, "the mesh of a tool is a .* the path"):
            self.world.add_tool("mesh", mesh=7)


class Cuts(Scenery):
    def test_split_doubles_points_and_keeps_mass(self):
        points, cells, mass = self.body.npoint, self.body.ntet, self.body.measure.mass
        done = self.body.cut(corners=self.plane(0.001))
        self.assertEqual((done.parts, done.cells, self.body.ntet), (2, 0, cells))
        self.assertEqual(self.body.npoint, points + done.points)
        self.assertGreater(done.area, 2 * 0.04 * 0.04)
        self.assertAlmostEqual(self.body.measure.mass, mass, delta=1e-15)
        from_points, from_cells = self.body.origins
        self.assertEqual(len(from_points), self.body.npoint)
        self.assertEqual(sorted(set(from_points)), list(range(points)))
        self.assertEqual(sorted(from_cells), list(range(cells)))

    def test_planes_cut_at_once_and_at_their_time(self):
        self.body.plan_cut(2e-3, point=(0, 0, 0.001), normal=(0, 0, 2))
        self.body.plan_cut(3e-3, "box", half_size=(0.01, 0.01, 0.01))
        cells = self.body.ntet
        self.world.step(1e-3)
        self.assertEqual(self.body.cut("plane", point=(0.001, 0, 0), normal=(1, 0, 0)).parts, 2)
        self.world.step(1e-3)
        self.assertGreaterEqual(self.body.remove_cells([]).parts, 4)
        self.assertEqual(self.body.ntet, cells)
        self.body.plan_no_cuts()
        self.world.step(2e-3)
        self.assertEqual(self.body.ntet, cells)

    def test_a_sphere_takes_what_it_meets(self):
        cells = self.body.ntet
        done = self.body.cut("sphere", radius=0.008, position=(0.02, 0.02, 0.02))
        self.assertGreater(done.cells, 0)
        self.assertEqual(self.body.ntet, cells - done.cells)
        with deform.World(gravity=(0, 0, 0)) as other:
            same = cube(other)
            same.cut("ellipsoid", half_size=(0.008, 0.008, 0.008), position=(0.02, 0.02, 0.02))
            np.testing.assert_array_equal(same.tets, self.body.tets)
        self.body.plan_cut(1e-3, "sphere", radius=0.008, position=(-0.02, -0.02, -0.02))
        left = self.body.ntet
        self.world.step(1e-3)
        self.assertLess(self.body.ntet, left)

    def test_faces_open_when_the_delay_is_over(self):
        self.assertEqual((self.body.cut_delay, self.body.cuts_waiting), (0, 0))
        self.body.set_cut_delay(0.01)
        self.assertEqual(self.body.cut_delay, 0.01)
        knife = self.world.add_tool("blade", half_size=(0.0005, 0.1, 0.1), position=(0.001, 0, 0.15))
        knife.set_cuts([self.body])
        points, waited = self.body.npoint, 0
        for k in range(20):
            knife.set_pose((0.001, 0, 0.15 - 0.002 * (k + 1)))
            self.world.step(1e-3)
            waited = max(waited, self.body.cuts_waiting)
            if k < 5:
                self.assertEqual(self.body.npoint, points)
        self.assertGreater(waited, 0)
        for _ in range(40):
            knife.set_pose((0.001, 0, 0.11))
            self.world.step(1e-3)
        self.assertGreater(self.body.npoint, points)
        self.assertEqual(self.body.cuts_waiting, 0)
        with self.assertRaisesRegex(deform.ArgumentError, "cuts cannot wait for -1 s"):
            self.body.set_cut_delay(-1)

    def test_pieces_are_listed(self):
        self.assertEqual(self.body.pieces, [])
        self.body.set_separate()
        self.body.cut("plane", point=(0.001, 0, 0), normal=(1, 0, 0))
        (piece,) = self.body.pieces
        self.assertEqual(piece.name, "cube.1")
        self.assertEqual(piece.pieces, [piece])

    def test_parts_become_bodies(self):
        body, mass = self.body, self.body.measure.mass
        body.cut("plane", point=(0.001, 0, 0), normal=(1, 0, 0))
        self.assertEqual(len(self.world.bodies), 1)
        cells = body.ntet
        self.assertEqual(body.separate().parts, 1)
        self.assertEqual([b.name for b in self.world.bodies], ["cube", "cube.1"])
        self.assertEqual(sum(b.ntet for b in self.world.bodies), cells)
        masses = [float(b.measure.mass) for b in self.world.bodies]
        self.assertAlmostEqual(sum(masses), float(mass), delta=1e-15)
        body.set_separate(least_cells=4, crumbs="remove")
        body.cut("plane", point=(0, 0.001, 0), normal=(0, 1, 0))
        self.assertEqual(len(self.world.bodies), 3)
        body.set_separate(None)
        body.cut("plane", point=(0, 0, 0.001), normal=(0, 0, 1))
        self.assertEqual(len(self.world.bodies), 3)
        for call in (lambda: body.separate(0), lambda: body.separate(1.5),
                     lambda: body.set_separate(crumbs="gone")):
            with self.assertRaises(deform.ArgumentError):
                call()

    def test_a_bar_tears(self):
        bar = self.world.add_body(deform.TetMesh.beam([0.2, 0.04, 0.04], cells=200), name="bar",
                                  position=(0, 1, 0), model="corotational_fem",
                                  material={"young": 2e4, "tear": 0.3, "damping_mass": 20})
        ends = bar.rest_points[:, 0]
        left, right = np.flatnonzero(ends < 1e-6), np.flatnonzero(ends > 0.2 - 1e-6)
        bar.hold(left)
        bar.hold(right)
        bar.move_held(right, [0, 0.5], [[0, 0, 0], [0.15, 0, 0]])
        points = bar.npoint
        for _ in range(500):
            self.world.step(1e-3)
        self.assertGreater(bar.npoint, points)
        self.assertTrue(np.isfinite(bar.points).all())

    def test_arrays_follow_the_cut(self):
        body = self.body
        names = ("positions", "velocities", "normals", "forces", "triangles", "points", "stress",
                 "energy_density")
        before = {name: getattr(body, name) for name in names}
        body.cut("ellipsoid", position=(0.02, 0.02, 0.02), half_size=(0.015, 0.015, 0.015))
        self.assertLess(body.ntet, len(before["stress"]))
        for name, rows in (("positions", body.nsurfel), ("velocities", body.nsurfel),
                           ("normals", body.nsurfel), ("forces", body.nsurfel),
                           ("triangles", body.ntriangle), ("points", body.npoint), ("stress", body.ntet),
                           ("energy_density", body.ntet)):
            self.assertEqual(len(getattr(body, name)), rows, name)
        self.assertLess(body.triangles.max(), body.nsurfel)
        self.assertEqual(len(body.tets), body.ntet)
        self.assertEqual(len(body.rest_points), body.npoint)
        self.world.step(1e-3)
        self.assertTrue(np.isfinite(body.positions).all())
        self.assertEqual(before["points"].shape[1], 3)  # older views stay readable

    def test_cells_by_number_and_all_of_them(self):
        done = self.body.remove_cells([0, 1, 1])
        self.assertEqual(done.cells, 2)
        self.body.remove_cells(range(self.body.ntet))
        self.assertEqual(self.body.ntet, 0)
        with self.assertRaises(deform.StateError):
            self.body.positions

    def test_film_of_a_body_that_is_cut(self):
        film = self.world.film()
        film.add()
        self.body.cut("box", position=(0, 0, 0.02), half_size=(0.01, 0.01, 0.01))
        self.world.step(1e-3)
        film.add()
        self.assertEqual(len(film.frames[-1].triangles["cube"]), self.body.ntriangle)
        self.assertNotEqual(len(film.frames[0].triangles["cube"]), self.body.ntriangle)
        film.picture(0)
        film.picture(-1)
        self.assertIn("iframe", film.html())

    def test_what_is_wrong_is_said(self):
        for call in (lambda: self.body.cut(), lambda: self.body.cut("blad", corners=self.plane(0)),
                     lambda: self.body.cut("box", corners=self.plane(0)),
                     lambda: self.body.cut("plane", point=(0, 0, 0)),
                     lambda: self.body.cut("box", normal=(0, 0, 1), half_size=(1, 1, 1)),
                     lambda: self.body.plan_cut(-1, point=(0, 0, 0), normal=(1, 0, 0)),
                     lambda: self.body.plan_cut(1, point=(0, 0, 0), normal=(0, 0, 0)),
                     lambda: self.body.cut("box", how="split", half_size=(1, 1, 1)),
                     lambda: self.body.remove_cells([99999])):
            with self.assertRaises(deform.ArgumentError):
                call()
        other = self.world.add_body(deform.TetMesh.ball(0.01, cells=100), model="modal", position=(1, 0, 0))
        with self.assertRaisesRegex(deform.UnsupportedError, "msm or corotational_fem"):
            other.cut(corners=self.plane(1))


class Tools(Scenery):
    def move(self, tool, start, end, n):
        start, end = np.asarray(start, float), np.asarray(end, float)
        for i in range(1, n + 1):
            tool.set_pose(start + (end - start) * i / n)
            self.world.step(1e-3)

    def test_a_ball_presses_and_feels_it(self):
        ball = self.world.add_tool("sphere", radius=0.01, position=(0, 0, 0.0305), name="ball")
        before = self.body.measure.momentum.copy()
        self.move(ball, (0, 0, 0.0305), (0, 0, 0.0304), 1)
        self.move(ball, (0, 0, 0.0304), (0, 0, 0.029), 10)
        self.assertGreater(ball.force[0][2], 0)
        self.assertLess(self.body.measure.momentum[2] - before[2], 0)
        np.testing.assert_allclose(ball.position, (0, 0, 0.029))
        np.testing.assert_allclose(ball.feedback[0], ball.force[0])
        self.assertEqual(self.world.tools, [ball])
        self.assertEqual(self.world.find_tool("ball"), ball)
        ball.remove()
        self.assertEqual(self.world.tools, [])

    def test_a_coupled_tool_gives_way(self):
        ball = self.world.add_tool("sphere", radius=0.01, position=(0, 0, 0.0305), stiffness=100,
                                   turn_stiffness=0.1, damping=0.5, turn_damping=1e-3, passive=True)
        self.move(ball, (0, 0, 0.0305), (0, 0, 0.025), 20)
        self.assertGreater(ball.position[2], 0.0251)
        self.assertAlmostEqual(ball.state.device.position[2], 0.025)

    def test_jaws_open_and_grab(self):
        jaws = self.world.add_tool("grasper", half_size=(0.003, 0.006, 0.02), opening=2.0, radius=0.002,
                                   half_length=0.02, position=(0, 0, 0.05), name="jaws")
        self.assertEqual([part.name for part in jaws.parts], ["jaws", "jaws.left", "jaws.right"])
        jaws.set_opening(1.9)
        self.world.step(1e-3)
        self.assertAlmostEqual(jaws.opening, 1.9)
        held = jaws.grab(self.body, reach=0.03)
        self.assertEqual(self.body.attachments, held)
        self.assertTrue(held)

    def test_a_knife_cuts_and_feels_nothing(self):
        knife = self.world.add_tool("blade", half_size=(0.0005, 0.03, 0.02), position=(0.001, 0, 0.05))
        knife.set_cuts([self.body], most=40)
        self.assertEqual(knife.cuts, [self.body])
        self.move(knife, (0.001, 0, 0.05), (0.001, 0, -0.01), 60)
        events = self.world.events
        cuts = events[events["kind"] == 7]
        self.assertGreater(len(cuts), 3)
        self.assertLessEqual(cuts["key"].max(), 40)
        self.assertEqual(self.world.owner(cuts[0]["a"]), self.body)
        self.assertEqual(self.body.remove_cells([]).parts, 2)
        self.assertEqual(abs(knife.force[0]).max(), 0)
        knife.set_cuts([])
        self.assertEqual(knife.cuts, [])

    def test_a_sphere_without_a_radius_has_five_millimeters(self):
        self.world.add_tool("sphere", position=(0, 0, 1))
        hit = self.world.query_ray((0, 0, 2), (0, 0, -1))
        self.assertAlmostEqual(hit.distance, 0.995, places=6)

    def test_what_is_wrong_is_said(self):
        with self.assertRaisesRegex(deform.ArgumentError, "sphere"):
            self.world.add_tool("spere")
        with self.assertRaisesRegex(deform.ArgumentError, "mesh"):
            self.world.add_tool("mesh")
        ball = self.world.add_tool("sphere", radius=0.01, position=(0, 0, 1))
        with self.assertRaisesRegex(deform.ArgumentError, "edge"):
            ball.set_cuts([self.body], how="split")
        with self.assertRaisesRegex(deform.ArgumentError, "jaws"):
            ball.set_opening(1)


if __name__ == "__main__":
    unittest.main()

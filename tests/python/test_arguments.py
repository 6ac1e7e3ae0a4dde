"""A wrong argument is refused with a sentence that says what was expected, before anything has changed."""
import copy
import math
import pathlib
import pickle
import tempfile
import unittest
from unittest import mock

import numpy as np

import deform

SCENE = """{"format": "deform-scene", "version": 1, "time": {"duration": 0.01, "step": 0.002},
 "bodies": [{"name": "ball", "mesh": {"make": "ball", "radius": 0.1, "cells": 100}}]}"""


class Arguments(unittest.TestCase):
    def refused(self, sentence, function):
        with self.assertRaisesRegex(deform.ArgumentError, sentence):
            function()

    def test_world_runs_for_a_time_that_ends_by_steps_that_get_there(self):
        with deform.World() as world:
            for duration in (-1, math.nan, math.inf):
                self.refused("duration of .* s; it must be finite and not negative",
                             lambda duration=duration: world.run(duration))
            for dt in (0, -1e-3, math.nan):
                self.refused("a step of .* s; it must be positive", lambda dt=dt: world.run(0.1, dt=dt))
            self.assertEqual(world.time, 0)

    def test_a_run_of_very_many_stable_steps_is_warned_of(self):
        with deform.World() as world:
            world.add_body(deform.TetMesh.ball(0.1, cells=100), material={"young": 7e10})
            with self.assertLogs("deform", "WARNING") as said, self.assertRaises(KeyboardInterrupt):
                with mock.patch.object(deform.World, "step", side_effect=KeyboardInterrupt):
                    world.run(10)
            self.assertRegex(said.output[0], "run takes .* steps of .* s, the stable step: give dt")
            with self.assertNoLogs("deform", "WARNING"):
                world.run(1e-4)

    def test_points_are_numbers_of_points_and_forces_fit_them(self):
        with deform.World() as world:
            ball = world.add_body(deform.TetMesh.ball(0.1, cells=100), position=(0, 0, 0.2))
            for wrong in ("x", None, [[1, 2]], [-1], [2**32], [0.5], [True, False]):
                self.refused("points must be a list of whole numbers", lambda wrong=wrong: ball.hold(wrong))
            ball.hold([])
            self.refused(r"force has the shape \(2,\); expected \(3,\), or \(1, 3\)",
                         lambda: ball.add_load([0], (1, 2)))

    def test_names_of_files_need_not_be_utf8(self):
        with self.assertRaises(deform.FileError):
            deform.TetMesh.read("/nothing/\udcff.msh")

    def test_misspelled_attribute_is_an_error(self):
        with deform.World() as world:
            ball = world.add_body(deform.TetMesh.ball(0.1, cells=100))
            for thing in (world, ball, world.add_obstacle("plane"), world.add_tool("sphere", radius=0.01)):
                with self.assertRaises(AttributeError):
                    thing.gravty = (0, 0, 0)
                thing.user = "mine"
            self.assertEqual(world.bodies[0].user, "mine")

    def test_things_are_not_given_by_other_kinds(self):
        with deform.World() as world:
            ball = world.add_body(deform.TetMesh.ball(0.1, cells=100), name="ball")
            tool = world.add_tool("sphere", radius=0.01, position=(0, 0, 1))
            for given in ("floor", None, 3):
                self.refused("attach needs a body, an obstacle or a rigid body, not",
                             lambda given=given: ball.attach(given))
                self.refused("a material is made by .*, not",
                             lambda given=given: world.add_obstacle("plane", material=given or "floor"))
            self.refused("grab needs a body, not 'ball'", lambda: tool.grab("ball"))
            for given in ("ball", ["ball"]):
                self.refused("set_cuts needs a list of bodies, not 'ball'",
                             lambda given=given: tool.set_cuts(given))
            self.refused("a side of a rule is .*, not 3", lambda: world.add_friction(ball, 3))
            self.refused("'b' is not a body, obstacle or material of this world; known",
                         lambda: world.add_friction("b", "*"))

    def test_sides_of_rules_are_things_or_names(self):
        with deform.World() as world:
            rubber = world.add_material("rubber")
            ball = world.add_body(deform.TetMesh.ball(0.1, cells=100), name="ball", material=rubber)
            floor = world.add_obstacle("plane", name="floor", material={"friction": 0.2})
            world.add_friction(ball, floor, mu=0.5)
            world.set_friction("ball", floor, mu=0.6)
            world.add_friction(rubber, "*", mu=0.1)
            world.filter_pair(ball, floor, False)
            world.remove_friction(ball, "floor")
            self.refused("needs a name", lambda: world.add_friction(world.add_material(), "*"))

    def test_restitution_throws_a_stiff_body_back(self):
        with deform.World(integrator="implicit_euler") as world:
            ball = world.add_body(deform.TetMesh.ball(0.05, cells=100), material={"young": 1e9},
                                  position=(0, 0, 0.06), velocity=(0, 0, -2))
            floor = world.add_obstacle("plane", name="floor")
            self.refused("restitution is 2; give a number from 0 to 1",
                         lambda: world.add_friction("*", floor, restitution=2))
            world.add_friction("*", floor, mu=0, restitution=0.5)
            for _ in range(3):
                world.step(1 / 60)
            self.assertGreater(ball.measure.velocity[2], 0)

    def test_material_has_entries_that_something_reads(self):
        mesh = deform.TetMesh.ball(0.1, cells=100)
        with deform.World() as world:
            self.refused(r"material '\(unnamed\)': young is -1 Pa; it must be positive",
                         lambda: world.add_body(mesh, material={"young": -1}))
            self.refused("no loaded model has a parameter 'yung'.* did you mean 'young'",
                         lambda: world.add_body(mesh, material={"yung": 1e6}))
            self.refused("load the plugin that has it", lambda: world.add_material("x", qqqqqq=1))
            self.assertEqual(len(world.bodies), 0)
            world.add_body(mesh, material={"young": 1e6, "friction": 0.3, "volume": 0})
            world.add_body(mesh, material={"locking": 1}, model="corotational_fem", position=(0, 0, 1))

    def test_scale_is_of_lengths_and_above_zero(self):
        wide = deform.TetMesh.ball(100, cells=100)
        surface = deform.TriMesh.make("ball", (100,), triangles=200)
        with deform.World() as world:
            for wrong in (0, -1, math.nan):
                self.refused("scale is .*; expected a finite number above 0",
                             lambda wrong=wrong: world.add_body(wide, scale=wrong))
            small = world.add_body(wide, scale=1e-3, position=(0, 0, 1), surface=surface)
            same = world.add_body(deform.TetMesh.ball(0.1, cells=100), position=(0, 0, 2))
            self.assertAlmostEqual(small.measure.mass, same.measure.mass, places=9)
            self.assertLess(abs(small.positions - [0, 0, 1]).max(), 0.1001)
            world.add_obstacle("mesh", mesh=surface, scale=1e-3)
            hit = world.query_ray((0, 0, -1), (0, 0, 1))
            self.assertAlmostEqual(hit.distance, 0.9, places=2)

    def test_masks_hold_points_and_components(self):
        """A mask of points held their x alone before."""
        mesh = deform.TetMesh.beam([0.2, 0.1, 0.1], cells=100)
        low = mesh.points[:, 2] < 1e-9
        each = np.stack([low, low, ~low], axis=1)
        with deform.World() as world:
            by_mask = world.add_body(mesh, fixed=low)
            by_bits = world.add_body(mesh, fixed=np.where(low, 7.0, 0.0), position=(0, 1, 0))
            apart = world.add_body(mesh, fixed=each, position=(0, 2, 0))
            world.run(0.02, dt=1e-3)
            for body in (by_mask, by_bits):
                np.testing.assert_array_equal(body.point_velocities[low], 0)
                self.assertGreater(np.abs(body.point_velocities[~low]).max(), 0)
            np.testing.assert_array_equal(apart.point_velocities[~low, 2], 0)
            self.assertGreater(np.abs(apart.point_velocities[low, 2]).max(), 0)
            for wrong in ([0, 1, 2], np.full(len(low), 8), np.full(len(low), 0.5), "x", each.astype(int)):
                self.refused("fixed has the shape .*True where a point is held",
                             lambda wrong=wrong: world.add_body(mesh, fixed=wrong))
            self.refused("axes is 'xyw'; expected", lambda: by_mask.hold([0], "xyw"))
            self.assertEqual(len(world.bodies), 3)

    def test_values_of_another_kind_are_named(self):
        mesh = deform.TetMesh.ball(0.1, cells=100)
        with deform.World() as world:
            def body(**options):
                world.add_body(mesh, **options)
            for sentence, function in (
                    ("position is '0 0 1'; expected 3 numbers", lambda: body(position="0 0 1")),
                    ("gravity is None; expected 3 numbers", lambda: world.set_gravity(None)),
                    ("young of a material is '1e5'; expected a number",
                     lambda: body(material={"young": "1e5"})),
                    (r"no entry of a material \(damping_mass, .*young\)", lambda: world.add_material(E=1e5)),
                    (r"scale is \(1, 1, 2\); expected a number", lambda: body(scale=(1, 1, 2))),
                    (r"field 'young' has the shape \(7,\); expected \(\d+,\)",
                     lambda: body(fields={"young": np.ones(7)})),
                    ("surface is a deform.TriMesh or the path of its file, not a ndarray",
                     lambda: body(surface=np.zeros((3, 3)))),
                    ("surface is a deform.TriMesh or the path of its file, not a ndarray",
                     lambda: deform.TetMesh.fill(np.zeros((3, 3)))),
                    (r"size is 1; expected a list of numbers in m: \[x, y, z\]",
                     lambda: deform.TetMesh.beam(1)),
                    (r"size is \[1, 1, 1, 1\]; expected", lambda: deform.TetMesh.beam([1, 1, 1, 1])),
                    ("mesh of an obstacle is a deform.TriMesh .*, not a TetMesh",
                     lambda: world.add_obstacle("mesh", mesh=mesh)),
                    ("restore takes the bytes .*, not a str", lambda: world.restore("saved")),
                    ("a scene is given by the path of its file, not by a dict",
                     lambda: deform.run({"a": 1}))):
                self.refused(sentence, function)
            self.assertEqual((len(world.bodies), len(world.obstacles)), (0, 0))

    def test_texts_and_lists_are_no_numbers(self):
        """NumPy and float() read texts, and None as nan."""
        mesh = deform.TetMesh.ball(0.1, cells=100)
        with deform.World() as world:
            body = world.add_body(mesh, name="ball")
            tool = world.add_tool("sphere", radius=0.01, position=(0, 0, 1))
            start = world.hash
            for sentence, function in (
                    ("dt is '1'; expected a number", lambda: world.step("1")),
                    (r"dt is \[0.1, 0.2\]; expected a number", lambda: world.step([0.1, 0.2])),
                    ("dt is None; expected a number", lambda: world.step(None)),
                    ("duration is '1'; expected a number", lambda: world.run("1")),
                    ("dt is '1'; expected a number", lambda: world.run(1, dt="1")),
                    ("max_time is '1'; expected a number", lambda: world.set_budget("1")),
                    ("gravity is .*'0', '0', '-9'.*; expected 3 numbers",
                     lambda: world.set_gravity(["0", "0", "-9"])),
                    (r"gravity is \[None, 0, 0\]; expected 3 numbers",
                     lambda: world.set_gravity([None, 0, 0])),
                    ("radius is '1'; expected a number", lambda: world.add_obstacle("sphere", radius="1")),
                    ("mass is '1'; expected a number", lambda: world.add_rigid("sphere", mass="1")),
                    ("stiffness is '1'; expected a number", lambda: world.add_tool(radius=1, stiffness="1")),
                    ("release is '5'; expected a number",
                     lambda: body.attach(world.add_obstacle(), box=[[-1] * 3, [1] * 3], release="5")),
                    ("reach is '1'; expected a number", lambda: tool.grab(body, reach="1")),
                    ("force is .*; expected 3 numbers", lambda: body.add_load([0], ["0", "0", "1"])),
                    ("velocities is .*; expected an array", lambda: body.set_state(velocities=[["a"] * 3])),
                    ("t is '1'; expected a number",
                     lambda: body.plan_cut("1", point=(0, 0, 0), normal=(0, 0, 1))),
                    ("least_cells is '8'; expected a whole number", lambda: body.set_separate("8")),
                    ("cells is '100'; expected a whole number", lambda: deform.TetMesh.ball(0.1, "100")),
                    ("a size of the mesh is '0.1'; expected", lambda: deform.TetMesh.ball("0.1")),
                    ("threads is '2'; expected a whole number", lambda: deform.World(threads="2")),
                    ("step is '1'; expected a number", lambda: deform.World(step="1")),
                    ("radius is '1'; expected a number", lambda: deform.Shape.sphere("1")),
                    ("name is 3; expected a text", lambda: world.find_body(3)),
                    ("name is None; expected a text", lambda: world.find_tool(None)),
                    ("parameter 'mu' is None; expected a number", lambda: world.add_friction(mu=None)),
                    ("dt is '1'; expected a number", lambda: deform.Law("coulomb")([1], [[0], [0]], "1")),
                    ("vt is .*; expected an array", lambda: deform.Law("coulomb")([1], "fast", 1)),
                    ("mass_scaling is '1'; expected", lambda: world.add_body(mesh, mass_scaling="1")),
                    ("smooth is None; expected", lambda: world.add_body(mesh, smooth=None)),
                    ("restitution is '1'; expected", lambda: world.add_friction(restitution="1")),
                    (r"set is \['/a=1'\]; expected a dict", lambda: deform.Scene("a.json", set=["/a=1"])),
                    ("max_distance is '1'; expected", lambda: world.query_closest((0, 0, 0), "1"))):
                with self.subTest(sentence):
                    self.refused(sentence, function)
                    with self.assertRaises(TypeError):
                        function()
            self.assertEqual(world.hash, start)
            self.assertEqual(world.time, 0)
            world.step(np.float32(1e-3))
            world.step(np.array(1e-3))

    def test_names_are_texts_of_utf8(self):
        """Others were cut at a character 0, or could not be read again."""
        with deform.World() as world:
            world.add_obstacle("plane", name="floor")
            for name in ("a\0b", "a\udcff"):
                for function in (lambda: world.add_obstacle("plane", name=name),
                                 lambda: world.add_friction("floor", name),
                                 lambda: world.find_obstacle(name), lambda: world.add_tool(name=name),
                                 lambda: world.add_rigid(name=name)):
                    self.refused("expected characters of UTF-8", function)
            self.assertEqual([thing.name for thing in world.obstacles], ["floor"])

    def test_whole_numbers_are_whole_and_not_negative(self):
        """ctypes takes a negative number for one of four billions."""
        mesh, surface = deform.TetMesh.ball(0.1, cells=100), deform.TriMesh.make("ball", [0.1], 200)
        with deform.World() as world:
            body = world.add_body(mesh)
            for sentence, function in (
                    ("most is -1; expected a whole number from 0",
                     lambda: body.cut("plane", point=(0, 0, 0), normal=(0, 0, 1), most=-1)),
                    ("most is 1.5; expected a whole number from 0",
                     lambda: body.cut("plane", point=(0, 0, 0), normal=(0, 0, 1), most=1.5)),
                    ("cells is -5; expected a whole number from 0",
                     lambda: world.add_obstacle("voxels", mesh=surface, cells=-5)),
                    ("cells is nan; expected a whole number", lambda: deform.TetMesh.ball(1, math.nan)),
                    ("jitter is -1; expected", lambda: deform.Scene("none.json", jitter=-1)),
                    ("threads is 4294967297; expected", lambda: deform.Context(2**32 + 1)),
                    ("most is -1; expected",
                     lambda: world.query(deform.Shape.sphere(1), (0, 0, 1), most=-1)),
                    ("max_sweeps is -1; expected", lambda: deform.World(max_sweeps=-1)),
                    ("load_steps is 0; expected a whole number from 1", lambda: world.equilibrium(0)),
                    ("collides_with is -1; expected", lambda: body.set_filter(1, -1)),
                    ("load is -1; expected a whole number", lambda: body.remove_load(-1))):
                with self.subTest(sentence):
                    self.refused(sentence, function)

    def test_sizes_that_cannot_be_are_named(self):
        mesh = deform.TetMesh.ball(0.1, cells=100)
        with deform.World() as world:
            body = world.add_body(mesh)
            for sentence, function in (
                    ("radius", lambda: world.add_obstacle("sphere", radius=-1)),
                    ("radius", lambda: world.add_obstacle("sphere", radius=math.nan)),
                    ("half_size", lambda: world.add_obstacle("box", half_size=(1, -1, 1))),
                    ("scale and cells are of the mesh", lambda: world.add_obstacle("box", scale=1e-3)),
                    ("scale and cells are of the mesh", lambda: world.add_obstacle("box", cells=9)),
                    ("mass", lambda: world.add_rigid("sphere", mass=-1)),
                    ("radius", lambda: world.add_tool("sphere", radius=math.nan)),
                    ("radius", lambda: deform.TetMesh.ball(-1)),
                    ("half_size|axes|radius", lambda: body.cut("sphere", radius=-1)),
                    ("half_size|axes|radius", lambda: body.cut("sphere", radius=math.nan)),
                    ("a sphere needs a radius", lambda: body.cut("sphere")),
                    ("a sphere needs a radius, and no other", lambda: body.cut("plane", radius=1)),
                    ("an ellipsoid and a box need half_size", lambda: body.cut("box")),
                    (r"vt has the shape \(3,\); expected \(2, 2\)",
                     lambda: deform.Law("coulomb")([1, 1], [0, 0, 0], 1)),
                    (r"fn has the shape \(1, 2\); expected", lambda: deform.Law("coulomb")([[1, 1]], 0, 1)),
                    ("dt|step", lambda: world.step(math.nan)),
                    ("dt|step", lambda: world.step(-1e-3))):
                with self.subTest(sentence):
                    self.refused(sentence, function)

    def test_surfaces_are_read_from_files(self):
        with tempfile.TemporaryDirectory(suffix=" with space") as name, deform.World() as world:
            file = pathlib.Path(name) / "ball.obj"
            deform.TriMesh.make("ball", [0.1], triangles=200).write(file)
            world.add_obstacle("mesh", mesh=file)
            body = world.add_body(deform.TetMesh.ball(0.1, cells=100), surface=str(file), position=(0, 0, 1))
            self.assertAlmostEqual(world.query_ray((0, 0, -1), (0, 0, 1)).distance, 0.9, places=2)
            self.assertGreater(body.nsurfel, 90)

    def test_worlds_are_saved_and_not_pickled(self):
        mesh = deform.TetMesh.ball(0.1, cells=100)
        self.assertIs(copy.deepcopy(mesh), mesh)
        with deform.World() as world:
            ball = world.add_body(mesh, name="ball")
            for thing, way in ((world, "World.snapshot"), (ball, "World.find_body"), (mesh, "its arrays"),
                               (world.add_material("rubber"), "its entries")):
                with self.assertRaisesRegex(TypeError, f"not pickled or copied; .*{way}"):
                    pickle.dumps(thing)
            for thing in (world, ball):
                with self.assertRaisesRegex(TypeError, "not pickled or copied"):
                    copy.copy(thing)
            saved, start = world.snapshot(), world.hash
            for buffer in (saved, bytearray(saved), memoryview(saved), np.frombuffer(saved, np.uint8)):
                world.step(1e-3)
                world.restore(buffer)
                self.assertEqual(world.hash, start)
            with self.assertRaisesRegex(deform.FormatError, r"3 bytes .* snapshot, .*World\.snapshot\(\)"):
                world.restore(b"abc")
            self.assertEqual(pickle.loads(pickle.dumps(ball.positions)).shape, ball.positions.shape)

    def test_mesh_says_what_makes_one(self):
        points, tets = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]]
        for kind in (deform.TetMesh, deform.TriMesh):
            self.refused(f"made by {kind.__name__}.from_arrays", lambda kind=kind: kind(points, tets))
            self.refused(f"made by {kind.__name__}.from_arrays", kind)
        self.assertEqual(len(deform.TetMesh.from_arrays(points, tets).points), 4)

    def test_run_of_a_scene(self):
        with tempfile.TemporaryDirectory(suffix=" with space") as name:
            scene = pathlib.Path(name) / "drop.json"
            scene.write_text(SCENE)
            self.refused("every is -1 s", lambda: deform.run(scene, every=-1))
            self.refused("duration is nan s", lambda: deform.Scene(scene).run(math.nan))
            run = deform.run(scene)
            self.refused("'bal' is no body of this run; it has ball", lambda: run.positions("bal"))

    def test_picture_is_a_png(self):
        picture = deform.Picture([[[0, 0, 0]]])
        self.refused("a.jpg: pictures are written as .png", lambda: picture.save("a.jpg"))


if __name__ == "__main__":
    unittest.main()

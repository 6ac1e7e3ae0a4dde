"""A wrong argument is refused with a sentence that says what was expected, before anything has changed."""
import math
import pathlib
import tempfile
import unittest

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

    def test_points_are_numbers_of_points_and_forces_fit_them(self):
        with deform.World() as world:
            ball = world.add_body(deform.TetMesh.ball(0.1, cells=100), position=(0, 0, 0.2))
            for wrong in ("x", None, [[1, 2]], [-1], [0.5], [True, False]):
                self.refused("points must be a list of whole numbers", lambda wrong=wrong: ball.hold(wrong))
            ball.hold([])
            self.refused(r"force has the shape \(2,\); expected \(3,\), or \(1, 3\)",
                         lambda: ball.add_load([0], (1, 2)))

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

"""Queries with filters, functions that decide about contacts, sensors, attachments, export."""
import gc
import pathlib
import tempfile
import unittest
import weakref

import numpy as np

import deform


def ball(world, name, position=(0, 0, 0.1001), **options):
    return world.add_body(deform.TetMesh.ball(0.1, cells=200), name=name, position=position, **options)


class Scenery(unittest.TestCase):
    def setUp(self):
        self.world = deform.World()
        self.floor = self.world.add_obstacle("plane", name="floor")
        self.low = ball(self.world, "low", (0, 0, 0.2), category=2)
        self.high = ball(self.world, "high", (0, 0, 0.6), category=4)
        self.stone = self.world.add_rigid("sphere", radius=0.05, position=(1, 0, 0.5), name="stone")
        self.addCleanup(self.world.close)


class Queries(Scenery):
    def test_ray_meets_the_first_and_all_in_order(self):
        hit = self.world.query_ray((0.01, 0.02, 2), (0, 0, -1))
        self.assertEqual(hit.owner, self.high)
        self.assertAlmostEqual(hit.distance, 1.3, delta=0.02)
        self.assertGreater(hit.normal[2], 0.8)
        self.assertFalse(hit.inside)
        np.testing.assert_allclose(hit.point, [0.01, 0.02, 2 - hit.distance])
        hits = self.world.query_ray_all((0.01, 0.02, 2), (0, 0, -1))
        self.assertEqual([h.owner for h in hits], [self.high, self.high, self.low, self.low, self.floor])
        self.assertEqual(sorted(h.distance for h in hits), [h.distance for h in hits])
        self.assertIsInstance(hits[0].triangle, int)
        self.assertIsNone(hits[-1].triangle)
        self.assertIsNone(self.world.query_ray((5, 5, 2), (0, 0, 1)))
        self.assertIsNone(self.world.query_ray((0, 0, 2), (0, 0, -1), max_distance=1))

    def test_more_hits_than_were_made_room_for(self):
        with deform.World() as world:
            for i in range(20):
                world.add_obstacle("sphere", radius=0.1, position=(i, 0, 0))
            self.assertEqual(len(world.query_ray_all((-1, 0.01, 0.02), (1, 0, 0))), 40)
            for i in range(60):
                world.add_obstacle("sphere", radius=0.1, position=(0, i + 1, 0))
            self.assertEqual(len(world.query_overlap(deform.Shape.sphere(100))), 80)
            asked = []
            some = deform.Filter(accept=lambda thing: bool(asked.append(thing)) or len(asked) > 20)
            self.assertEqual(len(world.query_overlap(deform.Shape.sphere(100), some)), 60)
            self.assertEqual(len(asked), 80)  # each once

    def test_filters_choose_kinds_masks_and_things(self):
        down = (0.01, 0.02, 2), (0, 0, -1)
        choose = deform.Filter
        self.assertEqual(self.world.query_ray(*down, filter=choose(collides_with=2)).owner, self.low)
        self.assertEqual(self.world.query_ray(*down, filter=choose("obstacles")).owner, self.floor)
        asked = []
        hits = self.world.query_ray_all(*down, filter=choose(
            ["bodies"], accept=lambda thing: asked.append(thing.name) or thing != self.high))
        self.assertEqual({h.owner for h in hits}, {self.low})
        self.assertEqual(asked, ["low", "high"])
        with self.assertRaisesRegex(deform.ArgumentError, "did you mean 'rigids'"):
            choose("rigid")
        with self.assertRaisesRegex(ZeroDivisionError, "division"):
            self.world.query_ray(*down, filter=choose(accept=lambda thing: 1 / 0))
        with self.assertRaisesRegex(TypeError, "deform.Filter"):
            self.world.query_ray(*down, filter="bodies")

    def test_closest_overlap_and_cast(self):
        shape = deform.Shape
        hits = self.world.query(shape.point((0.01, 0.02, 2)), (0, 0, -2))
        self.assertEqual([hit.owner for hit in hits], [self.high, self.low, self.floor])
        self.assertEqual(hits[2].distance, 2)
        self.assertEqual(self.world.query(shape.sphere(0.1, (1, 0, 0.6)), reach=5)[0].owner, self.stone)
        self.assertEqual(self.world.query(shape.sphere(0.1, (1, 0, 0.6)), reach=5, most=0), [])
        near = self.world.query_closest((1, 0, 0.6))
        self.assertEqual(near.owner, self.stone)
        self.assertAlmostEqual(near.distance, 0.05)
        self.assertIsNone(self.world.query_closest((1, 0, 2), max_distance=0.5))
        for asking, found in ((shape.sphere(0.1, (0, 0, 0.2)), [self.low]),
                              (shape.box((0.01, 0.01, 0.3), (0, 0, 0.45)), [self.low, self.high]),
                              (shape.capsule(0.02, 0.3, (1, 0, 0.5)), [self.stone]),
                              (shape.hull([[-3, 0, -1], [3, 0, -1], [0, 0, 3]]),
                               [self.low, self.high, self.floor, self.stone]),
                              (shape.sphere(0.1, (5, 0, 1)), [])):
            self.assertEqual(self.world.query_overlap(asking), found)
        self.assertEqual(self.world.query_aabb((0.9, -1, 0.3), (1.1, 1, 1)), [self.stone])
        hit = self.world.query_cast(shape.sphere(0.05, (1, 0, 1)), (0, 0, -2))
        self.assertEqual(hit.owner, self.stone)
        self.assertAlmostEqual(hit.distance, 0.4)
        self.assertIsNone(self.world.query_cast(shape.sphere(0.05, (1, 0, 1)), (0, 0, 2)))
        inside = self.world.query_cast(shape.sphere(0.01, (0, 0, 0.6)), (0, 0, 1))
        self.assertTrue(inside.inside)
        self.assertEqual((inside.owner, inside.distance), (self.high, 0))
        top = self.high.query_triangles(shape.box((1, 1, 0.05), (0, 0, 0.7)))
        self.assertTrue(0 < len(top) < self.high.ntriangle)
        self.assertGreater(self.high.positions[self.high.triangles[top]].mean(axis=1)[:, 2].min(), 0.6)
        with self.assertRaisesRegex(TypeError, "deform.Shape"):
            self.world.query_overlap("sphere")
        with self.assertRaisesRegex(deform.ArgumentError, "half_size has 2 numbers; expected 3"):
            shape.box((1, 1))


class OfThisProgram(deform.PythonLaw):
    id = "com.example.here"

    def evaluate(self, x, out):
        pass


class Decisions(unittest.TestCase):
    def test_pairs_that_may_not_touch_pass(self):
        with deform.World() as world:
            world.add_obstacle("plane", name="floor")
            body = ball(world, "ball")
            asked = []
            world.set_may_touch(lambda a, b: asked.append((a.name, b.name)))  # None: they may not
            world.run(0.05, dt=1e-3)
            self.assertEqual(asked, [("ball", "floor")])
            self.assertLess(body.measure.com[2], 0.095)
            world.ask_again(body)
            world.run(0.01, dt=1e-3)
            self.assertEqual(len(asked), 2)
            added = ball(world, "added", (2, 0, 1))
            world.step(1e-3)
            self.assertIn(("ball", "added"), asked)
            self.assertIn(("added", "floor"), asked)
            world.set_may_touch(None)
            self.assertGreater(world.stable_step, 0)
            self.assertEqual(added.name, "added")

    def test_contacts_are_changed_before_the_solve(self):
        with deform.World() as world:
            belt = world.add_obstacle("plane", name="belt")
            body = world.add_body(deform.TetMesh.beam([0.2, 0.2, 0.1], cells=60), position=(0, 0, 0.0501),
                                  name="block", material={"young": 2e5, "damping_stiffness": 0.005})
            seen = set()

            def run(contact):
                seen.add((contact.a, contact.b))
                self.assertAlmostEqual(contact.normal[2], 1, delta=1e-12)
                self.assertEqual(contact.point.shape, (3,))
                self.assertTrue(contact.enabled)
                self.assertEqual(contact.friction_scale, 1)
                contact.surface_velocity = (0.2, 0, 0)

            world.set_pre_solve(run)
            world.run(0.3, dt=1e-3)
            self.assertEqual(seen, {(body, belt)})
            self.assertGreater(body.measure.velocity[0], 0.05)
            world.set_pre_solve(lambda contact: setattr(contact, "enabled", False))
            world.run(0.1, dt=1e-3)
            self.assertLess(body.measure.com[2], 0.04)

    def test_a_contact_is_gone_after_the_call(self):
        kept = []
        with deform.World() as world:
            world.add_obstacle("plane")
            ball(world, "ball", (0, 0, 0.1))
            world.set_pre_solve(kept.append)
            world.step(1e-3)
            for use in (lambda: kept[0].gap, lambda: setattr(kept[0], "enabled", False)):
                with self.assertRaisesRegex(deform.StateError, "only during the call"):
                    use()

    def test_what_a_function_raises_discards_the_step_and_comes_out(self):
        with deform.World() as world:
            world.add_obstacle("plane")
            ball(world, "ball")
            world.run(0.05, dt=1e-3)
            for set_function, fails in ((world.set_pre_solve, lambda contact: 1 / 0),
                                        (world.set_may_touch, lambda a, b: 1 / 0),
                                        (world.set_pre_solve, lambda contact: world.hash)):
                with self.subTest(set_function.__name__):
                    before = world.hash
                    set_function(fails)
                    with self.assertRaises((ZeroDivisionError, deform.BusyError)):
                        world.step(1e-3)
                    self.assertEqual(world.hash, before)
                    set_function(None)
                    world.step(1e-3)

    def test_pieces_and_tools_that_come_later_are_known(self):
        with deform.World() as world:
            world.add_obstacle("plane", name="floor")
            body = ball(world, "ball", (0, 0, 0.11))
            asked, seen = set(), set()
            world.set_may_touch(lambda a, b: asked.add((a.name, b.name)) or True)
            world.set_pre_solve(lambda contact: seen.update((contact.a.name, contact.b.name)))
            world.add_tool("sphere", name="tip", position=(0, 0, 0.215), radius=0.01)
            body.set_separate()
            body.cut("plane", point=(0.001, 0, 0), normal=(1, 0, 0))
            before = world.snapshot()
            world.run(0.05, dt=1e-3)
            self.assertLessEqual({("ball", "tip"), ("ball.1", "floor"), ("ball", "ball.1")}, asked)
            self.assertLessEqual({"ball", "ball.1", "floor", "tip"}, seen)
            world.restore(before)
            world.step(1e-3)

    def test_a_pair_is_asked_about_again_where_the_function_raised(self):
        with deform.World() as world:
            world.add_obstacle("plane", name="floor")
            body = ball(world, "ball")
            answers = []

            def once(a, b):
                answers.append(b.name)
                if len(answers) < 3:
                    raise ZeroDivisionError
                return False

            world.set_may_touch(once)
            with self.assertRaises(ZeroDivisionError):
                world.step(1e-3)
            with self.assertRaises(ZeroDivisionError):
                _ = world.stable_step
            world.run(0.05, dt=1e-3)
            self.assertEqual(len(answers), 3)
            self.assertLess(body.measure.com[2], 0.095)

    def test_a_callback_that_uses_the_world_is_told_so(self):
        with deform.World() as world:
            world.add_obstacle("plane")
            ball(world, "ball")
            world.set_pre_solve(lambda contact: world.step(1e-3))
            with self.assertRaisesRegex(deform.BusyError, "this is a callback of that step"):
                world.run(0.05, dt=1e-3)

    def test_a_world_with_functions_ends_with_its_last_name(self):
        world = deform.World()
        world.set_pre_solve(lambda contact: None)
        gone = weakref.ref(world)
        del world
        gc.collect()
        self.assertIsNone(gone())


class Sensors(unittest.TestCase):
    def test_a_sensor_tells_who_comes_and_goes(self):
        with deform.World() as world:
            gate = world.add_obstacle("box", name="gate", half_size=(1, 1, 0.05), position=(0, 0, 0))
            self.assertFalse(gate.is_sensor)
            gate.set_sensor()
            self.assertTrue(gate.is_sensor)
            body = ball(world, "ball", (0, 0, 0.2))
            world.run(0.2, dt=1e-3)
            self.assertEqual(gate.sensed, [body])
            world.run(0.2, dt=1e-3)
            self.assertEqual(gate.sensed, [])
            self.assertEqual([(e["kind"], world.owner(e["a"]), world.owner(e["b"])) for e in world.events],
                             [(4, gate, body), (5, gate, body)])
            with self.assertRaises(deform.ArgumentError):
                _ = body.sensed
            body.set_sensor()
            self.assertEqual(body.sensed, [])
            body.set_sensor(False)
            self.assertFalse(body.is_sensor)


class Attachments(unittest.TestCase):
    def test_released_by_its_force(self):
        with deform.World() as world:
            hook = world.add_obstacle("box", name="hook", half_size=(0.1, 0.1, 0.02), position=(0, 0, 0.12))
            body = ball(world, "ball", (0, 0, 0))
            weak = body.attach(hook, box=[[-1, -1, 0.08], [1, 1, 1]], release=1.0)
            self.assertEqual(body.attachments, [weak])
            self.assertGreater(body.attachment(weak).nsurfel, 0)
            world.run(0.1, dt=1e-3)
            self.assertEqual(body.attachments, [])
            self.assertIn(3, [e["kind"] for e in world.events])


class Export(unittest.TestCase):
    def test_a_world_written_is_the_same_when_it_is_read(self):
        with tempfile.TemporaryDirectory(prefix="a space ") as folder:
            path = pathlib.Path(folder) / "made.json"
            with deform.World() as world:
                world.add_obstacle("plane", name="floor")
                ball(world, "ball", material={"young": 2e5})
                world.add_friction("ball", "floor", law="lugre")
                self.assertEqual(world.write_scene(path), [])
                first = world.hash
                world.run(0.01, dt=1e-4)
                later = world.hash
                world.write_scene(pathlib.Path(folder) / "later.json", snapshot=True)
                world.set_pre_solve(lambda contact: None)
                with self.assertRaisesRegex(deform.UnsupportedError, "changes contacts before"):
                    world.write_scene(path)
                left_out, = world.write_scene(pathlib.Path(folder) / "part.json", partial=True)
                self.assertIn("changes contacts", left_out)
                world.set_pre_solve(None)
                world.add_friction(law=OfThisProgram)
                self.assertRegex(" ".join(world.write_scene(path.with_name("law.json"))),
                                 "'com.example.here' is registered by this program")
            with deform.Scene(path) as scene:
                self.assertEqual(scene.world.hash, first)
                scene.world.run(0.01, dt=1e-4)
                self.assertEqual(scene.world.hash, later)
            with deform.Scene(pathlib.Path(folder) / "later.json") as scene:
                scene.world.restore((pathlib.Path(folder) / "later_files" / "snapshot.state").read_bytes())
                self.assertEqual(scene.world.hash, later)

    def test_a_scene_that_is_written_keeps_its_probes_and_outputs(self):
        source = pathlib.Path(__file__).parents[2] / "examples" / "scenes" / "gravity_beams.json"
        with tempfile.TemporaryDirectory(prefix="a space ") as folder:
            path = pathlib.Path(folder) / "later.json"
            with deform.Scene(source) as scene:
                scene.world.run(0.002, dt=1e-4)
                self.assertEqual(scene.write_scene(path), [])
                probes, said, duration = scene.probes, scene.value("/output"), scene.settings.duration
            with deform.Scene(path) as later:
                self.assertEqual(later.value("/output"), said)
                self.assertEqual(later.settings.duration, duration)
                self.assertEqual(list(later.probes), list(probes))
                for name, (x, v) in later.probes.items():
                    np.testing.assert_array_equal(x, probes[name][0])
                    np.testing.assert_array_equal(v, probes[name][1])


if __name__ == "__main__":
    unittest.main()

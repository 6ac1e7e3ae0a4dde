"""Worlds from arrays, steps, errors, ends, threads."""
import gc
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
import unittest
from unittest import mock

import numpy as np

import deform


def ball(world, z=0.1001, **options):
    return world.add_body(deform.TetMesh.ball(0.1, cells=300), position=(0, 0, z), **options)


class Building(unittest.TestCase):
    def test_ball_on_floor_carries_its_weight(self):
        with deform.World(integrator="implicit_euler") as world:
            world.add_obstacle("plane", name="floor")
            body = ball(world, name="ball", material={"young": 2e5, "damping_stiffness": 0.005})
            world.add_friction("ball", "floor", law="coulomb", mu=0.4)
            world.run(1.0, dt=1 / 120)
            weight = 9.81 * body.measure.mass
            self.assertAlmostEqual(world.contacts["fn"].sum() / weight, 1, delta=0.02)
            self.assertAlmostEqual(world.pairs["normal"][0] / weight, 1, delta=0.02)
            self.assertEqual(world.owner(world.pairs["a"][0]), body)
            self.assertEqual(world.owner(world.pairs["b"][0]).name, "floor")
            self.assertAlmostEqual(world.time, 1.0)
            self.assertEqual(world.stats.steps, 120)

    def test_stream_has_the_surface(self):
        sys.path.insert(0, str(pathlib.Path(os.environ["DEFORM_SOURCE"]) / "examples"))
        from stream_receiver import Scene  # what others would receive
        with deform.World(integrator="implicit_euler") as world:
            world.add_obstacle("plane", name="floor")
            body = ball(world, name="ball")
            world.run(0.05, dt=0.01)
            seen = Scene()
            seen.read(world.stream(scene=True))
            self.assertTrue(seen.read(world.stream(contacts=True, frame=3, packet=1200)))
            received, = seen.bodies.values()
            self.assertEqual((received.name, seen.frame), ("ball", 3))
            self.assertLess(np.abs(np.reshape(received.x, (-1, 3)) - body.positions).max(), 1e-7)
            self.assertTrue(seen.contacts)
            with self.assertRaisesRegex(deform.ArgumentError, "at least 256"):
                world.stream(packet=10)

    def test_mass_scaling_is_told(self):
        with deform.World() as world:
            self.assertEqual(ball(world, mass_scaling=0.02).mass_scaled, (0, 0))  # no point is light
            with self.assertRaisesRegex(deform.ArgumentError, "mass_scaling"):
                ball(world, z=1, mass_scaling=0.2)

    def test_smooth_is_told(self):
        with deform.World() as world:
            ball(world, smooth=40)
            with self.assertRaisesRegex(deform.ArgumentError, "smooth -1"):
                ball(world, z=1, smooth=-1)

    def test_body_from_arrays(self):
        points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
        with deform.World(gravity=(0, 0, 0)) as world:
            body = world.add_body(points=points, tets=[[0, 1, 2, 3]], position=(0, 0, 2),
                                  velocity=(1, 0, 0), model="corotational_fem", fixed=[0, 0, 0, 7])
            self.assertAlmostEqual(body.measure.rest_volume, 1 / 6)
            np.testing.assert_allclose(body.points, points + [0, 0, 2])
            np.testing.assert_array_equal(body.tets, [[0, 1, 2, 3]])
            world.step(1e-4)
            np.testing.assert_allclose(body.points[3], [0, 0, 3])
            body.set_state(points=body.points + [0, 0, 0.5], velocities=np.zeros((4, 3)))
            np.testing.assert_allclose(body.points[:3, 2], [2.5, 2.5, 2.5])  # what is held stays
            np.testing.assert_allclose(body.points[3], [0, 0, 3])
            np.testing.assert_allclose(body.point_velocities, 0)

    def test_what_messages_name_can_be_set(self):
        with deform.World(energy_watch=0, recovery_speed=0.2, obstacle_speed=1) as world, \
                tempfile.TemporaryDirectory() as folder:
            ball(world)
            path = pathlib.Path(folder) / "world.json"
            world.write_scene(path)
            contact = json.loads(path.read_text())["contact"]
            self.assertEqual((contact["energy_watch"], contact["recovery_speed"]), (False, 0.2))
            world.add_tool("sphere", radius=0.01, position=(0, 0, 1)).set_pose((0, 0, 1.1))
            with self.assertRaisesRegex(deform.ArgumentError, "at most 1 m/s"):
                world.step(0.05)
        with self.assertRaisesRegex(deform.ArgumentError, "energy_watch is -1"):
            deform.World(energy_watch=-1)

    def test_enumerated_parameter_by_name(self):
        with deform.World() as world:
            ball(world, model="corotational_fem", params={"rotation": "qr"})
            with self.assertRaisesRegex(deform.ArgumentError, "did you mean 'qr'"):
                ball(world, model="corotational_fem", params={"rotation": "qrr"})
            bricks = deform.TetMesh.bricks((0.1, 0.1, 0.1), cells=8)
            with self.assertRaisesRegex(deform.ArgumentError, "corotational_fem: parameter energy is for"):
                world.add_body(bricks, params={"energy": "stvk"})  # read as of their default model

    def test_rigid_body_falls_on_soft_one(self):
        with deform.World() as world:
            world.add_obstacle("plane")
            body = ball(world, material={"young": 1e5, "damping_stiffness": 0.002})
            rigid = world.add_rigid("sphere", mass=0.5, radius=0.04, position=(0, 0, 0.3), name="stone")
            world.run(0.25, dt=1e-3)
            self.assertLess(rigid.position[2], 0.26)
            self.assertLess(rigid.velocity[2], 0.5)
            met = {(world.owner(e["a"]), world.owner(e["b"])) for e in world.events}
            self.assertIn((body, rigid), met)

    def test_crate_on_a_floor_is_in_the_reports(self):
        with deform.World() as world:
            floor = world.add_obstacle("plane", name="floor")
            crate = world.add_rigid("box", mass=2, half_size=(0.05, 0.06, 0.04), position=(0, 0, 0.06))
            world.run(0.5, dt=1e-3)
            pair, = world.impulses
            self.assertEqual((world.owner(pair["a"]), world.owner(pair["b"])), (crate, floor))
            self.assertAlmostEqual(pair["impulse"][2], 2 * 9.81e-3, delta=1e-9)
            self.assertAlmostEqual(world.pairs[0]["normal"], 2 * 9.81, delta=1e-6)
            self.assertAlmostEqual(world.contacts["fn"].sum(), 2 * 9.81, delta=1e-6)
            self.assertEqual({world.owner(c["body_a"]) for c in world.contacts}, {crate})
            self.assertEqual([e["kind"] for e in world.events], [1])

    def test_ball_hangs_on_a_hook_and_is_let_go(self):
        with deform.World() as world:
            hook = world.add_obstacle("box", name="hook", half_size=(0.1, 0.1, 0.02), position=(0, 0, 0.12))
            body = ball(world, z=0, name="ball", material={"young": 2e5, "damping_mass": 20})
            held = body.attach(hook, box=[[-1, -1, 0.08], [1, 1, 1]])
            world.run(0.6, dt=1e-3)
            weight = 9.81 * body.measure.mass
            self.assertAlmostEqual(body.attachment(held).force[2] / weight, 1, delta=0.02)
            self.assertEqual(world.find_obstacle("hook"), hook)
            body.detach(held)
            with self.assertRaises(deform.Error):
                body.attachment(held)
            hook.set_filter(0, 0)
            world.run(0.2, dt=1e-3)
            self.assertLess(body.measure.velocity[2], -0.3)  # it falls, against the damping of its mass

    def test_belt_carries_a_ball(self):
        with deform.World() as world:
            belt = world.add_obstacle("plane", name="belt")
            body = ball(world, name="ball", material={"young": 2e5, "damping_stiffness": 0.005})
            world.run(0.2, dt=1e-3)
            belt.set_velocity_surface((0.2, 0, 0))
            belt.set_material(world.add_material("felt"))
            world.run(0.3, dt=1e-3)
            self.assertGreater(body.measure.velocity[0], 0.05)

    def test_hinge_with_a_motor(self):
        with deform.World(gravity=(0, 0, 0)) as world:
            arm, = world.add_rigids([deform.RigidDef("box", mass=2, half_size=(0.5, 0.05, 0.05), name="arm",
                                                     position=(0.5, 0, 0))],
                                    [deform.JointDef("hinge", 0, axis=(0, 0, 1), motor=(1.0, 100.0))])
            world.run(0.5, dt=1e-3)
            angle, rate, _ = arm.joint()
            self.assertAlmostEqual(rate, 1, delta=1e-6)
            inertia = 2 / 3 * (0.5**2 + 0.05**2) + 2 * 0.5**2
            self.assertAlmostEqual(angle, 0.5 - inertia / 200, delta=1e-3)  # less while 100 N m speed it up
            np.testing.assert_allclose(arm.position, [0.5 * np.cos(angle), 0.5 * np.sin(angle), 0], atol=1e-3)
            arm.set_motor(0, 100.0)
            world.run(0.1, dt=1e-3)
            self.assertAlmostEqual(arm.joint()[1], 0, delta=1e-6)
            with self.assertRaisesRegex(deform.ArgumentError, "did you mean 'hinge'"):
                world.add_rigids([deform.RigidDef()], [deform.JointDef("hing", 0)])

    def test_snapshot_restores_into_a_world_built_anew_after_a_body_was_removed(self):
        mesh = deform.TetMesh.ball(0.1, cells=100)
        with deform.World() as world, deform.World() as anew:
            world.add_body(mesh).remove()
            world.add_body(mesh, position=(1, 0, 0), name="one")
            world.add_body(mesh, position=(2, 0, 0))
            world.run(0.1, dt=0.01)
            kept = world.snapshot()
            unnamed, one = anew.add_body(mesh), anew.add_body(mesh, name="one")
            anew.restore(kept)
            self.assertEqual([body.name for body in anew.bodies], ["one", "body3"])
            self.assertEqual((one.name, unnamed.name), ("one", "body3"))
            self.assertAlmostEqual(unnamed.measure.com[0], 2, 6)
            world.run(0.1, dt=0.01)
            anew.run(0.1, dt=0.01)
            self.assertEqual(world.hash, anew.hash)

    def test_snapshot_gives_the_same_bits_again(self):
        with deform.World() as world:
            world.add_obstacle("plane")
            body = ball(world, z=0.12)
            world.run(0.05, dt=1e-3)
            kept = world.snapshot()
            world.run(0.05, dt=1e-3)
            first = world.hash, body.points.copy()
            world.restore(kept)
            world.run(0.05, dt=1e-3)
            self.assertEqual(world.hash, first[0])
            np.testing.assert_array_equal(body.points, first[1])

    def test_loads_holds_rays_and_plan(self):
        with deform.World(gravity=(0, 0, 0)) as world:
            body = ball(world, z=0)
            top = np.flatnonzero(body.points[:, 2] > 0.09)
            body.hold(np.flatnonzero(body.points[:, 2] < -0.09))
            load = body.add_load(top, (0, 0, 0.5))
            world.equilibrium()
            self.assertGreater(body.points[top, 2].mean(), 0.09)
            body.remove_load(load)
            hit = world.query_ray((0, 0, 1), (0, 0, -1))
            self.assertEqual(hit.owner, body)
            self.assertAlmostEqual(hit.distance, 0.9, delta=0.02)
            self.assertIsNone(world.query_ray((0, 0, 1), (0, 0, 1)))
            self.assertEqual(world.explain()["bodies"][0]["points"], body.npoint)
            self.assertIn("coulomb", [t.short_name for t in world.context.types])


class Rest(unittest.TestCase):
    """What of the C interface has no test of its own above."""

    def setUp(self):
        self.world = deform.World(gravity=(0, 0, 0))
        self.addCleanup(self.world.close)

    def test_springs_pull_to_places(self):
        body = ball(self.world)
        points = np.arange(body.npoint)
        fast = body.add_spring(points, (0, 0, 1), 100, 1)
        at = np.array(body.measure.com)
        np.testing.assert_allclose(body.spring_force(fast), 100 * (np.array([0, 0, 1]) - at), atol=1e-9)
        body.set_spring_target(fast, (0, 0, 2))
        self.world.step(1e-3)
        self.assertGreater(body.measure.velocity[2], 0)
        body.remove_spring(fast)
        weighted = body.add_spring([0, 1], [(0, 0, 0), (1, 0, 0)], 10, weights=[1, 0], times=[0, 1])
        way = np.array([self.world.time, 0, 0]) - body.points[0]
        np.testing.assert_allclose(body.spring_force(weighted), 10 * way, atol=1e-9)
        for wrong, sentence in ((lambda: body.add_spring([0], (0, 0, 0), -1), "stiffness"),
                                (lambda: body.add_spring([0], (0, 0, 0), "1"), "stiffness is '1'"),
                                (lambda: body.add_spring([0, 1], (0, 0, 0), 1, weights=[1]), "weights has"),
                                (lambda: body.add_spring([0], [(0, 0, 0)], 1, times=[0, 1]), "times has"),
                                (lambda: body.spring_force(fast), "no spring")):
            with self.subTest(sentence), self.assertRaisesRegex(deform.ArgumentError, sentence):
                wrong()

    def test_overlaps_are_listed_and_taken_apart(self):
        a, b = ball(self.world), self.world.add_body(deform.TetMesh.ball(0.1, 300), position=(0.1, 0, 0))
        with self.assertLogs("deform", "WARNING"):
            (pair,) = self.world.overlaps
        self.assertEqual((pair["a"], pair["b"]), (a.handle, b.handle))
        self.assertGreater(pair["depth"], 0.01)
        self.assertEqual(self.world.untangle(), 0)
        self.assertEqual(len(self.world.find_overlaps()), 0)
        self.assertGreater(np.linalg.norm(b.measure.com - a.measure.com), 0.19)

    def test_gravity_follows_its_keys(self):
        body = ball(self.world)
        self.world.set_gravity_keys([0, 0.1], [(0, 0, 0), (0, 0, -10)])
        self.world.run(0.1, dt=1e-3)
        self.assertAlmostEqual(body.measure.velocity[2], -0.5, delta=0.02)
        self.world.set_gravity_keys([], [])
        with self.assertRaisesRegex(deform.ArgumentError, r"times has the shape \(1,\); expected \(2,\)"):
            self.world.set_gravity_keys([0], [(0, 0, 0), (0, 0, 1)])

    def test_sleep_filters_laws_and_loads_of_pairs(self):
        world = self.world
        world.set_gravity((0, 0, -9.81))
        floor = world.add_obstacle("plane", name="floor")
        body = world.add_body(deform.TetMesh.beam([0.1, 0.1, 0.1], 60), name="cube",
                              material={"young": 1e5, "damping_mass": 20})
        world.add_friction(body, floor, mu=0.3)
        world.hold_begin()
        world.run(1, dt=1e-3)
        force, moment = world.wrench(body, floor)
        self.assertAlmostEqual(force[2], 9.81 * body.measure.mass, delta=0.1)
        np.testing.assert_allclose(world.wrench(floor, body)[0], -force)
        self.assertEqual(moment.shape, (3,))
        law, params = world.law(world.pairs["law"][0])
        self.assertEqual((law, params["mu_C"]), ("org.deform.coulomb", 0.3))
        creep, count = world.hold
        self.assertEqual((count, np.isnan(creep)), (count, count == 0))
        world.set_sleep()
        world.run(2, dt=1e-3)
        self.assertTrue(body.asleep)
        world.set_sleep(False)
        self.assertFalse(body.asleep)
        world.filter_pair(body, floor, False)
        world.run(0.02, dt=1e-3)
        self.assertEqual(len(world.contacts), 0)
        world.remove_filter(body, floor)
        world.run(0.02, dt=1e-3)
        self.assertGreater(len(world.contacts), 0)
        with self.assertRaisesRegex(deform.ArgumentError, "filter"):
            world.remove_filter(body, floor)

    def test_rigid_bodies_by_name_and_what_they_weigh(self):
        box = self.world.add_rigid("box", half_size=(0.1, 0.1, 0.1), mass=2, name="crate", velocity=(1, 0, 0),
                                   material={"friction": 0.3})
        self.world.add_obstacle("sphere", radius=1, position=(9, 0, 0)).set_material({"friction": 0.3})
        self.world.add_tool("sphere", radius=0.01, position=(0, 0, 1))
        self.assertEqual(self.world.rigids, [box])
        self.assertEqual(self.world.find_rigid("crate"), box)
        self.assertAlmostEqual(box.measure.kinetic, 1)
        self.assertEqual(box.measure.mass, 2)
        np.testing.assert_array_equal(box.wrench[0], 0)
        with self.assertRaisesRegex(deform.ArgumentError, "crate"):
            self.world.find_rigid("crat")

    def test_memory_and_time_by_part(self):
        body = ball(self.world)
        self.world.step(1e-3)
        memory = self.world.memory
        self.assertGreater(memory["bodies"], 1000)
        self.assertEqual(memory["total"], sum(v for k, v in memory.items() if k != "total"))
        self.assertGreaterEqual(self.world.profile["model"][1], 1)
        np.testing.assert_array_equal(body.points[body.surface_points], body.positions)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "surface.vtu"
            body.write_surface(path)
            self.assertIn("force", path.read_text(errors="replace"))


class Errors(unittest.TestCase):
    def test_library_sentence_is_the_exception(self):
        with deform.World() as world:
            world.add_obstacle("plane", name="floor")
            for wrong, kind, sentence in (
                    (lambda: world.add_friction("flor", "*"), deform.ArgumentError, "did you mean 'floor'"),
                    (lambda: world.add_friction(law="coulom"), deform.UnsupportedError, 'mean "coulomb"'),
                    (lambda: world.add_friction(mue=1), deform.ArgumentError, 'did you mean "mu_C"'),
                    (lambda: world.add_body("none.msh"), deform.FileError, "none.msh: cannot be opened"),
                    (lambda: world.add_body(points=[[0, 0]], tets=[[0, 1, 2, 3]]), deform.ArgumentError,
                     r"shape \(1, 2\); expected \(n, 3\)"),
                    (lambda: world.add_body(points=np.eye(3), tets=[[0, 1, 2, 2.5]]), deform.ArgumentError,
                     "whole numbers"),
                    (lambda: world.add_body(), deform.ArgumentError, "needs a mesh"),
                    (lambda: world.add_obstacle("spere"), deform.ArgumentError, "did you mean 'sphere'"),
                    (lambda: world.step(-1), deform.ArgumentError, "positive"),
                    (lambda: world.find_body("x"), deform.ArgumentError, "x")):
                with self.subTest(sentence), self.assertRaisesRegex(kind, sentence) as caught:
                    wrong()
                self.assertTrue(caught.exception.status.startswith("DFM_E_"))

    def test_wrong_kinds_say_what_is_expected(self):
        with deform.World() as world:
            mesh = deform.TetMesh.ball(0.1, 300)
            for wrong, sentence in ((lambda: world.add_body(mesh, material="rubber"), "given as a dict"),
                                    (lambda: world.add_body(deform.TriMesh.make("ball", [1])), "TetMesh"),
                                    (lambda: world.add_friction(law=3), "a law is a name"),
                                    (lambda: world.step("soon"), "dt is .soon.; expected a number")):
                with self.subTest(sentence), self.assertRaisesRegex((TypeError, ValueError), sentence):
                    wrong()
            world.step(np.float32(1e-3))

    def test_discarded_step_changes_nothing(self):
        with deform.World(max_substeps=1) as world:
            body = ball(world, material={"young": 1e8})
            before = body.points.copy()
            with self.assertRaises(deform.Discarded) as caught:
                world.step(0.1)
            self.assertIn(deform.Trouble.SUBSTEPS, caught.exception.trouble)
            np.testing.assert_array_equal(body.points, before)

    def test_budget_ends_a_step_early_and_is_lifted(self):
        with deform.World() as world:
            ball(world)
            world.step(1e-2)
            self.assertGreater(world.stats.work, 0)
            for limit in ({"max_work": 1}, {"max_time": 1e-9}):
                world.set_budget(**limit)
                before, shortened = world.time, world.stats.shortened
                self.assertIn(deform.Trouble.BUDGET, world.step(1e-2))
                self.assertGreater(world.time, before)
                self.assertLess(world.time, before + 0.9e-2)
                self.assertEqual(world.stats.shortened, shortened + 1)
            for limit in (0, 2e6, None):
                world.set_budget(max_work=limit)
                self.assertNotIn(deform.Trouble.BUDGET, world.step(1e-2))
            for wrong in ({"max_work": -1}, {"max_work": 2**64}, {"max_time": -1}):
                with self.assertRaisesRegex(deform.ArgumentError, next(iter(wrong))):
                    world.set_budget(**wrong)


class Threads(unittest.TestCase):
    def test_step_releases_the_lock_and_can_be_interrupted(self):
        world = deform.World()
        world.add_obstacle("plane")
        body = world.add_body(deform.TetMesh.ball(0.1, cells=4000), position=(0, 0, 0.11),
                              material={"young": 1e7})
        ended = []

        def work():
            while not ended:
                try:
                    world.step(0.5)  # thousands of sub-steps
                except deform.Discarded as discarded:
                    if deform.Trouble.INTERRUPTED in discarded.trouble:
                        ended.append(discarded.trouble)

        thread = threading.Thread(target=work)
        thread.start()
        refused = 0
        while not refused and thread.is_alive():
            time.sleep(0.001)
            try:
                body.positions
            except deform.BusyError:
                refused += 1
        self.assertEqual(refused, 1)
        world.interrupt()
        thread.join()
        self.assertEqual(len(ended), 1)
        self.assertEqual(body.positions.shape, (body.nsurfel, 3))
        world.close()

    def test_ctrl_c_ends_a_step_at_once(self):
        """Of a fresh process: its main thread steps, and another one sends the signal until it is heard."""
        program = textwrap.dedent("""
            import os, signal, threading, time
            import deform

            def press():
                while world._busy == 0:
                    time.sleep(0.001)
                time.sleep(0.02)
                os.kill(os.getpid(), signal.SIGINT)

            with deform.World(max_substeps=10**9) as world:
                world.add_obstacle("plane")
                world.add_body(deform.TetMesh.ball(0.1, cells=1000), position=(0, 0, 0.11),
                               material={"young": 1e7})
                before = world.hash
                threading.Thread(target=press).start()
                try:
                    world.step(1e4)  # hours
                except KeyboardInterrupt:
                    print("interrupted", world.hash == before)
                world.step(1e-3)
                before = world.snapshot()
                heard = []
                world.step(0.1)
                after = world.hash
                world.restore(before)
                signal.signal(signal.SIGINT, lambda *_: heard.append(1))
                threading.Thread(target=press).start()
                world.step(0.1)
                while not heard:
                    time.sleep(0.001)
                print("went on", world.hash == after)
                world.step(1e-3)
        """)
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.stdout, "interrupted True\nwent on True\n", done.stderr)

    def test_ctrl_c_in_equilibrium_leaves_nothing_behind(self):
        with deform.World() as world:
            def interrupted(*_):
                world._stop = True  # as the thread that hears of the signal does
                raise KeyboardInterrupt

            with mock.patch.object(deform.world.lib, "dfm_world_equilibrium", interrupted):
                with self.assertRaises(KeyboardInterrupt):
                    world.equilibrium()
            self.assertFalse(world._stop)

    def test_a_call_that_changes_a_world_has_it_alone(self):
        seen = []
        with deform.World() as world:
            with mock.patch.object(deform.world.lib, "dfm_world_filter_pair",
                                   lambda *_: seen.append(world._busy) or 0):
                world.filter_pair("*", "*", True)
        self.assertEqual(seen, [threading.get_ident()])

    def test_two_worlds_in_two_threads(self):
        hashes = {}

        def work(number):
            with deform.World() as world:
                world.add_obstacle("plane")
                ball(world, z=0.12)
                world.run(0.1, dt=1e-3)
                hashes[number] = world.hash

        threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        work(4)
        self.assertEqual(len(hashes), 5)
        self.assertEqual(len(set(hashes.values())), 1)

    @unittest.skipUnless(hasattr(os, "fork"), "this system has no fork")
    def test_a_child_of_fork_steps_and_ends(self):
        """The child, as multiprocessing makes it on Linux, has no thread of the pool, and waited for them for
        ever."""
        def made(threads):
            world = deform.World(threads=threads)
            world.add_obstacle("plane")
            world.add_body(deform.TetMesh.ball(0.1, cells=3000), position=(0, 0, 0.1))
            world.step(1e-3)
            return world
        world, alone = made(3), made(1)
        alone.step(1e-3)
        child = os.fork()
        if child == 0:
            signal.alarm(30)
            world.step(1e-3)
            same = world.hash == alone.hash
            del world
            gc.collect()
            os._exit(0 if same else 1)
        self.assertEqual(os.waitpid(child, 0)[1], 0)
        world.step(1e-3)
        self.assertEqual(world.hash, alone.hash)

    def test_threads_of_a_world_do_not_change_its_bits(self):
        hashes = set()
        for threads in (1, 2):
            with deform.World(threads=threads) as world:
                world.add_obstacle("plane")
                ball(world)
                world.run(0.05, dt=1e-3)
                hashes.add(world.hash)
        self.assertEqual(len(hashes), 1)


class Ends(unittest.TestCase):
    def test_closed_world_refuses(self):
        with deform.World() as world:
            body = ball(world)
        self.assertTrue(world.closed)
        world.close()
        for use in (lambda: world.step(1e-3), lambda: body.positions, lambda: world.contacts,
                    lambda: body.measure, lambda: body.set_state(velocities=np.zeros((body.npoint, 3)))):
            with self.assertRaises(deform.HandleError):
                use()

    def test_body_keeps_its_world(self):
        body = ball(deform.World())
        body.world.step(1e-3)
        self.assertEqual(body.points.shape, (body.npoint, 3))


if __name__ == "__main__":
    unittest.main()

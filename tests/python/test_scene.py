"""Scenes and runs: the same bits as the command, values, probes, errors with their place."""
import gc
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np

import deform

SCENES = pathlib.Path(os.environ["DEFORM_SOURCE"]) / "examples" / "scenes"


class Scenes(unittest.TestCase):
    def test_run_has_the_bits_of_the_command(self):
        for name, pointers in (("slope_block", {}), ("slope_block", {"/contact/friction/0/params/mu": 0.49}),
                               ("two_cylinders_coarse", {"/time/step": "auto"}),
                               ("pressed_ring", {"/time/mode": "static", "/time/step": 0.03})):
            with self.subTest(name, **pointers), tempfile.TemporaryDirectory() as folder:
                path = SCENES / f"{name}.json"
                text = [f"{pointer}={json.dumps(value)}" for pointer, value in pointers.items()]
                sets = [word for pointer in text for word in ("--set", pointer)]
                subprocess.run([os.environ["DEFORM_COMMAND"], "run", path, "--out", folder, "--time", "0.06",
                                "--quiet", *sets], check=True)
                summary = json.loads((pathlib.Path(folder) / "summary.json").read_text())
                run = deform.run(path, duration=0.06, set=pointers)
                self.assertEqual(f"{run.hash:016x}", summary["state_hash"])
                self.assertEqual(run.frames[-1].t, summary["simulated_s"])

    def test_scene_by_hand(self):
        with deform.Scene(SCENES / "slope_block.json") as scene:
            self.assertEqual(scene.value("/contact/friction/0/params/mu"), 0.5)
            self.assertGreater(scene.settings.duration, 0)
            seen = []
            run = scene.run(0.02, every=0.005, watch=lambda world: seen.append(world.time))
            self.assertEqual(len(seen), run.steps)
            np.testing.assert_allclose(run.times, [0, 0.005, 0.01, 0.015, 0.02], atol=1e-12)
            body = scene.world.bodies[0]
            self.assertEqual(run.positions(body.name).shape, (5, body.nsurfel, 3))
            np.testing.assert_allclose(run.positions(body.name)[-1], body.positions, atol=1e-7)
        with self.assertRaises(deform.HandleError):
            scene.world.step(1e-3)
        scene.close()

    def test_world_keeps_its_scene(self):
        world = deform.Scene(SCENES / "slope_block.json").world
        gc.collect()
        world.step(1e-3)
        self.assertEqual(world.stats.steps, 1)
        world.close()
        self.assertTrue(world.closed)

    def test_probes(self):
        with deform.Scene(SCENES / "gravity_beams.json") as scene:
            run = scene.run(0.004, every=0.002)
            self.assertEqual(set(scene.probes), {p["name"] for p in scene.value("/probes")})
            for name, (position, velocity) in scene.probes.items():
                np.testing.assert_array_equal(run.probe(name)[-1], position)
                self.assertEqual((run.probe(name).shape, velocity.shape), ((3, 3), (3,)))

    def test_body_that_is_cut_away(self):
        scene = {"format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
                 "time": {"duration": 0.004, "step": 0.001},
                 "bodies": [{"name": name, "mesh": {"make": "ball", "radius": 0.01, "cells": 60},
                             "pose": {"position": [0, y, 0]}} for name, y in (("first", 0), ("second", 1))],
                 "probes": [{"name": name, "body": name, "point": [0, 0, 0]} for name in ("first", "second")],
                 "cuts": [{"body": "first", "t": 0.002, "shape": "sphere", "radius": 0.5}]}
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "cut.json"
            path.write_text(json.dumps(scene))
            run = deform.run(path, every=0.001)
        there = [True, True, False, False, False]
        self.assertEqual([len(frame.positions["first"]) > 0 for frame in run.frames], there)
        self.assertEqual([len(frame.triangles["first"]) > 0 for frame in run.frames], there)
        self.assertEqual(len(run.positions("second")), 5)
        self.assertEqual(np.isnan(run.probe("first")).all(axis=1).tolist(), [not t for t in there])
        np.testing.assert_allclose(run.probe("second"), np.tile([0, 1, 0], (5, 1)), atol=1e-9)
        self.assertEqual(run.picture(-1).rgb.shape[2], 3)

    def test_errors_name_their_place(self):
        with self.assertRaisesRegex(deform.FileError, "nowhere.json"):
            deform.run("nowhere.json")
        with self.assertRaisesRegex(deform.ArgumentError, "/bodies/0/modle"):
            deform.Scene(SCENES / "slope_block.json", set={"/bodies/0/modle": "msm"})
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "with space.json"
            path.write_text("{")
            with self.assertRaisesRegex(deform.FormatError, "with space.json"):
                deform.run(path)


if __name__ == "__main__":
    unittest.main()

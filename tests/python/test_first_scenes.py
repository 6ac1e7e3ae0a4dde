"""The random first scenes of make soak (tests/bench/first_scenes): the library takes them, a seed is one
scene, and what physics says of the simple ones holds."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest

import deform

sys.path.insert(0, str(pathlib.Path(os.environ["DEFORM_SOURCE"]) / "tests/bench/first_scenes"))
import cases
import first_scenes

# a slope that holds, one that slides, a block at rest, a ball that comes back, a strip that is lifted
SIMPLE = {4: "slope", 8: "slope", 13: "slope", 18: "rest", 24: "grasp", 45: "bounce", 60: "bounce"}


class FirstScenes(unittest.TestCase):
    def test_a_seed_is_one_scene(self):
        made = [cases.make(seed) for seed in range(60)]
        again = [cases.make(seed) for seed in range(60)]
        self.assertEqual([scene.doc for _, scene in made], [scene.doc for _, scene in again])
        self.assertGreaterEqual(len({case.partition(":")[0] for case, _ in made}), 15)

    def test_the_library_takes_them(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "scene.json"
            for seed in range(1, 31):
                path.write_text(json.dumps(cases.make(seed)[1].doc))
                with self.subTest(seed=seed), deform.Scene(path) as scene:
                    self.assertGreater(len(scene.world.bodies), 0)

    def test_simple_ones_are_as_physics_says(self):
        options = types.SimpleNamespace(seconds=60, machine="", compiler="", commit="")
        with tempfile.TemporaryDirectory() as folder:
            for seed, case in SIMPLE.items():
                with self.subTest(seed=seed):
                    row = first_scenes.row_of(os.environ["DEFORM_COMMAND"], seed, options,
                                              pathlib.Path(folder))
                    self.assertEqual((row["case"], row["exit"], row["failed"]), (case, 0, ""), row)


if __name__ == "__main__":
    unittest.main()

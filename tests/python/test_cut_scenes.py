"""Scenes in which tools cut, and one that tears. The tools' paths are moved by up to 1 mm: once, ten times
with DEFORM_SOAK (stability.CutScenes has the paths as they are). Mass is kept, parts are counted, nothing is
lost through the table."""
import json
import os
import pathlib
import unittest

import numpy as np

import deform

SCENES = pathlib.Path(os.environ["DEFORM_SOURCE"]) / "examples" / "scenes"
SEEDS = 10 if os.environ.get("DEFORM_SOAK") else 1


def moved(tools, seed):
    """Their keyframes by pointer, each path as a whole elsewhere."""
    random = np.random.default_rng(seed)
    out = {}
    for i, tool in enumerate(tools):
        keys = tool["motion"]["keyframes"]
        by = random.uniform(-1e-3, 1e-3, 3)
        out[f"/tools/{i}/motion/keyframes"] = [{**key, "position": list(by + key["position"])}
                                               for key in keys]
    return out


class CutScenes(unittest.TestCase):
    def pieces(self, name, end, pieces, normal):
        path = SCENES / f"{name}.json"
        tools = json.loads(path.read_text())["tools"]
        for seed in range(1, SEEDS + 1):
            with self.subTest(name, seed=seed), \
                    deform.Scene(path, set=moved(tools, seed)) as scene:
                mass = float(scene.world.bodies[0].measure.mass)
                run = scene.run(duration=end, every=end)
                bodies = scene.world.bodies
                self.assertEqual(len(bodies), pieces)
                self.assertAlmostEqual(sum(float(b.measure.mass) for b in bodies), mass, delta=1e-12)
                for body in bodies:
                    self.assertTrue(np.isfinite(body.points).all())
                    self.assertGreater((body.points @ np.asarray(normal)).min(), -1e-3)
                self.assertFalse(run.trouble & (deform.Trouble.NONFINITE | deform.Trouble.ENERGY))

    def test_orange_falls_into_three_slices(self):
        self.pieces("orange", 0.4, 3, (0, 0, 1))

    def test_cheese_loses_a_slice(self):
        self.pieces("cheese", 0.5, 2, (0.422618, 0, 0.906308))

    def test_liver_loses_a_lobe(self):
        self.pieces("liver", 1.1, 2, (0, 0, 1))

    def test_torn_dough_goes_on_from_a_snapshot_to_the_bit(self):
        path = SCENES / "torn_dough.json"
        with deform.Scene(path) as scene, deform.Scene(path) as other:
            dough = scene.world.find_body("dough")
            mass = float(dough.measure.mass)
            for _ in range(600):
                scene.world.step(1e-3)
            self.assertGreater(len(scene.world.bodies), 1)
            other.world.restore(scene.world.snapshot())
            for _ in range(100):
                scene.world.step(1e-3)
                other.world.step(1e-3)
            self.assertEqual(other.world.hash, scene.world.hash)
            self.assertAlmostEqual(sum(float(b.measure.mass) for b in scene.world.bodies), mass, delta=1e-12)
            np.testing.assert_array_equal(other.world.find_body("dough").triangles, dough.triangles)


if __name__ == "__main__":
    unittest.main()

"""Scenes in which tools cut, and one that tears. The tools' paths are moved by up to 1 mm: three times, ten
times with DEFORM_SOAK. Mass is kept, parts are counted, nothing is lost through the table."""
import json
import os
import pathlib
import unittest

import numpy as np

import deform

BENCH = pathlib.Path(os.environ["DEFORM_SOURCE"]) / "tests" / "bench"
SEEDS = 10 if os.environ.get("DEFORM_SOAK") else 3


def moved(tools, seed):
    """Their keyframes by pointer, each path as a whole elsewhere."""
    random = np.random.default_rng(seed)
    out = {}
    for i, tool in enumerate(tools):
        keys = tool["motion"]["keyframes"]
        by = random.uniform(-1e-3, 1e-3, 3) if seed else np.zeros(3)
        out[f"/tools/{i}/motion/keyframes"] = [{**key, "position": list(by + key["position"])}
                                               for key in keys]
    return out


class CutScenes(unittest.TestCase):
    def pieces(self, name, body, end, cells, pieces, normal):
        path = BENCH / f"{name}.json"
        tools = json.loads(path.read_text())["tools"]
        for seed in range(SEEDS):
            with self.subTest(name, seed=seed), \
                    deform.Scene(path, set={**moved(tools, seed), "/bodies/0/mesh/cells": cells}) as scene:
                cut = scene.world.find_body(body)
                mass = float(cut.measure.mass)
                run = scene.run(duration=end, every=end)
                self.assertTrue(np.isfinite(cut.points).all())
                self.assertAlmostEqual(float(cut.measure.mass), mass, delta=1e-12)
                self.assertGreater((cut.points @ np.asarray(normal)).min(), -1e-3)
                sizes = self.sizes(cut)
                self.assertEqual(sum(size > 0.05 * sum(sizes) for size in sizes), pieces, sizes)
                self.assertFalse(run.trouble & (deform.Trouble.NONFINITE | deform.Trouble.ENERGY))

    @staticmethod
    def sizes(body):
        """Cells of each part that hangs together by points."""
        parent = np.arange(body.npoint)
        tets = body.tets.astype(np.int64)
        changed = True
        while changed:
            least = parent[tets].min(axis=1)
            before = parent.copy()
            np.minimum.at(parent, tets.ravel(), np.repeat(least, 4))
            changed = bool((parent != before).any())
        return np.bincount(parent[tets[:, 0]])[np.unique(parent[tets[:, 0]])].tolist()

    def test_orange_falls_into_three_slices(self):
        self.pieces("orange", "orange", 0.4, 800, 3, (0, 0, 1))

    def test_cheese_loses_a_slice(self):
        self.pieces("cheese", "cheese", 0.5, 600, 2, (0.422618, 0, 0.906308))

    def test_torn_dough_goes_on_from_a_snapshot_to_the_bit(self):
        path = BENCH / "torn_dough.json"
        with deform.Scene(path) as scene, deform.Scene(path) as other:
            dough = scene.world.find_body("dough")
            whole, mass = dough.npoint, float(dough.measure.mass)
            for _ in range(600):
                scene.world.step(1e-3)
            self.assertGreater(dough.npoint, whole)
            other.world.restore(scene.world.snapshot())
            for _ in range(100):
                scene.world.step(1e-3)
                other.world.step(1e-3)
            self.assertEqual(other.world.hash, scene.world.hash)
            self.assertAlmostEqual(float(dough.measure.mass), mass, delta=1e-12)
            np.testing.assert_array_equal(other.world.find_body("dough").triangles, dough.triangles)


if __name__ == "__main__":
    unittest.main()

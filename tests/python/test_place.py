"""add_body(on=...): a body lies on the obstacle, as with the scene key "place"."""
import unittest

import numpy as np

import deform


class Place(unittest.TestCase):
    def lowest(self, direction=(0, 0, 1), start=(0, 0, 0), **obstacle):
        with deform.World() as world:
            on = world.add_obstacle(name="table", **obstacle)
            world.add_obstacle("sphere", radius=1, position=(0, 0, 2))  # is no hindrance
            body = world.add_body(deform.TetMesh.beam([0.2, 0.2, 0.2], cells=60), position=start, on=on)
            return (body.positions @ np.array(direction)).min()

    def test_it_lies_on_top(self):
        gap = 1e-4 * 0.2 * 3**0.5
        box = {"shape": "box", "half_size": (1, 1, 0.4), "position": (0, 0, 0.5)}
        with deform.World() as world:
            table = world.add_obstacle(**box)
            body = world.add_body(deform.TetMesh.beam([0.2, 0.2, 0.2], cells=60), on=table)
            self.assertAlmostEqual(body.positions[:, 2].min(), 0.9 + gap, 7)
            with self.assertRaisesRegex(deform.ArgumentError, "on is an obstacle"):
                world.add_body(deform.TetMesh.beam([0.2, 0.2, 0.2], cells=60), on="table")
            with self.assertRaisesRegex(deform.ArgumentError, "not above or below"):
                world.add_body(deform.TetMesh.beam([0.2, 0.2, 0.2], cells=60), on=table, position=(3, 0, 0))
            wall = world.add_obstacle("plane", normal=(1, 0, 0))
            with self.assertRaisesRegex(deform.ArgumentError, "is a wall"):
                world.add_body(deform.TetMesh.beam([0.2, 0.2, 0.2], cells=60), on=wall)
        self.assertAlmostEqual(self.lowest(**box), 0.9 + gap, 7)
        self.assertAlmostEqual(self.lowest(shape="plane", normal=(0.6, 0, 0.8), direction=(0.6, 0, 0.8)),
                               0.8 * gap, 7)
        self.assertAlmostEqual(self.lowest(shape="sphere", radius=0.3, start=(-0.1, -0.1, 0)), 0.3 + gap, 7)


if __name__ == "__main__":
    unittest.main()

"""Arrays are views: no copy from look to look, read-only, safe whatever becomes of what they show, and those
that are kept keep their values."""
import gc
import tracemalloc
import unittest

import numpy as np

import deform

SURFACE = ("positions", "velocities", "normals", "forces", "triangles")
POINTS = ("points", "point_velocities")
LISTS = ("contacts", "pairs", "impulses")


def dropped():
    world = deform.World(integrator="implicit_euler")
    world.add_obstacle("plane")
    body = world.add_body(deform.TetMesh.ball(0.1, cells=4000), position=(0, 0, 0.1005),
                          material={"damping_stiffness": 0.002}, model="corotational_fem")
    world.run(0.05, dt=1 / 120)
    return world, body


class Views(unittest.TestCase):
    def test_looks_share_memory_and_copy_nothing(self):
        world, body = dropped()
        self.assertGreater(body.positions.nbytes, 8000)
        of_body = SURFACE + POINTS + ("stress", "point_stress", "measure")
        for owner, names in ((body, of_body), (world, LISTS + ("stats",))):
            for name in names:
                with self.subTest(name):
                    address = self.address(getattr(owner, name))
                    self.assertEqual(self.address(getattr(owner, name)), address)
                    for _ in range(3):  # one name in a loop: two pieces of memory in turn
                        view = getattr(owner, name)
                    tracemalloc.start()
                    before = tracemalloc.get_traced_memory()[0]
                    tracemalloc.reset_peak()
                    for _ in range(100):
                        view = getattr(owner, name)
                    peak = tracemalloc.get_traced_memory()[1] - before
                    tracemalloc.stop()
                    self.assertLess(peak, 5000)  # bookkeeping of the test itself; an array is larger
                    if isinstance(view, np.ndarray):
                        self.assertFalse(view.flags.writeable)

    @staticmethod
    def address(view):
        return np.asarray(view).__array_interface__["data"][0]

    def test_view_follows_the_world(self):
        world, body = dropped()
        self.assertIs(world.bodies[0], body)
        kept = body.positions
        world.step(1 / 120)
        self.assertFalse(np.array_equal(body.positions, kept))
        np.testing.assert_array_equal(body.positions, world.bodies[0].positions)
        contacts = world.contacts
        self.assertEqual(len(contacts), world.stats.contacts)
        np.testing.assert_allclose(contacts["fn"].sum(), body.forces[:, 2].sum(), rtol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(body.normals, axis=1), 1)

    def test_what_is_kept_keeps_its_values(self):
        """Lists of looks, differences of two, parts of arrays and members of records."""
        world, body = dropped()
        looks = {"positions": lambda: body.positions, "height": lambda: body.positions[:, 2],
                 "points": lambda: body.points, "stress": lambda: body.stress[0],
                 "point stress": lambda: body.point_stress[0],
                 "contacts": lambda: world.contacts, "fn": lambda: world.contacts["fn"][1:],
                 "row": lambda: world.contacts[0], "measure": lambda: body.measure,
                 "com": lambda: body.measure.com, "stats": lambda: world.stats}
        before, told = body.positions, []
        for _ in range(4):
            now = {name: look() for name, look in looks.items()}
            told.append((now, {name: np.array(view) for name, view in now.items()}))
            world.step(1 / 120)
        for now, copies in told:
            for name, view in now.items():
                np.testing.assert_array_equal(np.asarray(view), copies[name], err_msg=name)
        self.assertGreater(np.abs(body.positions - before).max(), 0)
        self.assertEqual([int(now["stats"].steps) for now, _ in told], [6, 7, 8, 9])

    def test_arrays_outlive_their_world(self):
        world, body = dropped()
        arrays = {name: getattr(body, name) for name in SURFACE + POINTS}
        arrays |= {name: getattr(world, name) for name in LISTS}
        stats, measure = world.stats, body.measure
        copies = {name: array.copy() for name, array in arrays.items()}
        mass, steps = float(measure.mass), int(stats.steps)
        world.close()
        del world, body
        gc.collect()
        garbage = [np.full(100000, np.nan) for _ in range(20)]
        for name, array in arrays.items():
            np.testing.assert_array_equal(array, copies[name], err_msg=name)
        self.assertEqual((float(measure.mass), int(stats.steps)), (mass, steps))
        self.assertEqual(len(garbage), 20)

    def test_arrays_outlive_a_removed_body(self):
        world, body = dropped()
        view = body.positions
        kept = view.copy()
        body.remove()
        world.step(1e-3)
        np.testing.assert_array_equal(view, kept)
        with self.assertRaises(deform.HandleError):
            body.positions
        self.assertEqual(len(world.contacts), 0)

    def test_list_that_grows_leaves_older_views_alone(self):
        with deform.World() as world:
            world.add_obstacle("plane")
            empty = world.contacts
            self.assertEqual(len(empty), 0)
            beam = deform.TetMesh.beam([0.4, 0.4, 0.05], cells=3000)
            world.add_body(beam, position=(0, 0, 1e-4), material={"damping_stiffness": 0.002})
            world.run(0.05, dt=1e-3)
            self.assertGreater(len(world.contacts), 64)
            self.assertGreater(world.contacts["fn"].sum(), 0)

    def test_mesh_arrays_are_the_librarys_memory_and_keep_it(self):
        mesh = deform.TetMesh.ball(0.1, cells=2000)
        points, again = mesh.points, mesh.points
        self.assertEqual(points.ctypes.data, again.ctypes.data)
        kept = points.copy()
        del mesh, again
        gc.collect()
        deform.TetMesh.ball(0.2, cells=2000)
        np.testing.assert_array_equal(points, kept)
        with self.assertRaises(ValueError):
            points[0, 0] = 1


if __name__ == "__main__":
    unittest.main()

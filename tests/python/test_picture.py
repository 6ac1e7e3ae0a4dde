"""Pictures and the view of a run: what is drawn is where it should be, and nothing comes from outside."""
import base64
import html
import html.parser
import json
import os
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile
import unittest
from unittest import mock
import zlib

import numpy as np

import deform
from deform import webgl

EXAMPLES = pathlib.Path(os.environ["DEFORM_SOURCE"]) / "examples"
sys.path.insert(0, str(EXAMPLES))
from stream_receiver import Scene  # noqa: E402

SCENES = EXAMPLES / "scenes"
DROP = {"format": "deform-scene", "version": 1, "time": {"duration": 0.06, "step": 0.002},
        "bodies": [{"name": "ball", "mesh": {"make": "ball", "radius": 0.1, "cells": 300},
                    "pose": {"position": [0, 0, 0.12]}}],
        "obstacles": [{"name": "floor", "shape": "plane"},
                      {"name": "box", "shape": "box", "half_size": [0.05, 0.1, 0.02],
                       "pose": {"position": [0.3, 0, 0.02]}},
                      {"name": "ball2", "shape": "sphere", "radius": 0.05, "pose": {"position": [-0.3, 0, 0]},
                       "motion": {"keyframes": [{"t": 0, "position": [-0.3, 0, 0.1]},
                                           {"t": 1, "position": [-0.3, 0.5, 0.1]}]}}],
        "output": {"color": "speed"}}


def dropped(every=0.02):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "drop.json"
        path.write_text(json.dumps(DROP))
        return deform.run(path, every=every)


def decoded(png):
    """[height,width,3] of a PNG as png_bytes writes it."""
    at, data, size = 8, b"", None
    while at < len(png):
        length, kind = struct.unpack(">I4s", png[at:at + 8])
        body = png[at + 8:at + 8 + length]
        assert struct.unpack(">I", png[at + 8 + length:at + 12 + length])[0] == zlib.crc32(kind + body)
        if kind == b"IHDR":
            size = struct.unpack(">II", body[:8])
        data += body if kind == b"IDAT" else b""
        at += 12 + length
    rows = np.frombuffer(zlib.decompress(data), np.uint8).reshape(size[1], 1 + 3 * size[0])
    return rows[:, 1:].reshape(size[1], size[0], 3)


class Pictures(unittest.TestCase):
    def test_body_is_drawn_where_it_is(self):
        with deform.World() as world:
            world.add_obstacle("plane")
            world.add_body(deform.TetMesh.ball(0.1, 300), position=(0, 0, 0.3))
            camera = {"eye": (0, -2, 0.3), "look_at": (0, 0, 0.3), "size": (160, 120)}
            picture = world.picture(label=False, **camera)
            red, blue = picture.rgb[60, 80].astype(int)[[0, 2]]
            self.assertGreater(red, blue + 40)  # the first body's color, in the middle
            self.assertLess(np.ptp(picture.rgb[5, 5].astype(int)), 30)
            np.testing.assert_array_equal(decoded(picture._repr_png_()), picture.rgb)
            away = world.picture(eye=(0, -2, 0.3), look_at=(3, 0, 0.3), size=(160, 120), label=False)
            self.assertLess(abs(int(away.rgb[60, 80, 2]) - int(away.rgb[60, 80, 0])), 40)
            self.assertEqual(world._repr_png_()[:4], b"\x89PNG")
            for wrong in ({"color": "colour"}, {"eye": (0, 0, 1)}, {"size": (0, 10)}, {"size": (5,)},
                          {"color": "speed", "color_range": 5}):
                with self.assertRaises(deform.ArgumentError):
                    world.picture(**wrong)
            with self.assertRaisesRegex(deform.ArgumentError, "1 to 8192 each are allowed"):
                world.picture(size=(8193, 9))
            camera["size"] = list(camera["size"])
            plain = world.picture(**camera, label=False).rgb
            with self.assertRaises(deform.ArgumentError):  # when its surfaces are added already
                world.picture(**{**camera, "look_at": (0, 0)})
            world.bodies[0].remove()
            empty = world.picture(**camera, label=False).rgb
            world.add_body(deform.TetMesh.ball(0.1, 300), position=(0, 0, 0.3))
            np.testing.assert_array_equal(world.picture(**camera, label=False).rgb, plain)
            self.assertLess(abs(int(empty[60, 80, 2]) - int(empty[60, 80, 0])), 40)
        self.assertIsNone(world._repr_png_())

    def test_a_forked_process_is_told_that_it_cannot_draw(self):
        """It waited for the threads of the parent's driver."""
        code = ("import os, deform; world = deform.World(); world.picture(size=(40, 30))\n"
                "child = os.fork()\n"
                "try: child or world.picture(size=(40, 30))\n"
                "except deform.UnsupportedError: os._exit(7)\n"
                "print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))")
        with subprocess.Popen([sys.executable, "-B", "-c", code], stdout=subprocess.PIPE, text=True,
                              start_new_session=True) as process:
            try:
                self.assertEqual(process.communicate(timeout=60)[0], "7\n")
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                raise

    def test_every_quantity_has_its_colors_and_a_legend(self):
        with deform.World(integrator="implicit_euler") as world:
            world.add_obstacle("plane")
            ball = world.add_body(deform.TetMesh.ball(0.1, 300), position=(0, 0, 0.1005), spin=(0, 0, 3),
                                  model="corotational_fem", material={"damping_stiffness": 0.002})
            look = {"size": (320, 240), "label": False}
            for color in ("displacement", "stress", "contact"):  # at rest: not the glow of rounding
                np.testing.assert_array_equal(deform.picture.body_values(ball, color), 0)
            start = ball.positions.copy()
            world.run(0.1, dt=1 / 120)
            plain = world.picture(**look).rgb
            for color in ("speed", "contact", "displacement", "stress"):
                with self.subTest(color):
                    colored = world.picture(color=color, **look).rgb
                    self.assertTrue((colored != plain).any(axis=2)[180:, 200:].mean() > 0.2)  # the legend
                    other = world.picture(color=color, color_range=(0, 1e9), **look).rgb
                    self.assertFalse(np.array_equal(colored, other))
            moved = np.linalg.norm(ball.positions - start, axis=1)
            np.testing.assert_allclose(deform.picture.body_values(ball, "displacement"), moved)
            stress = deform.picture.body_values(ball, "stress")
            self.assertGreater(stress.min(), 0)
            self.assertLess(stress.max(), np.abs(ball.stress).max() * 3)
            with self.assertRaisesRegex(deform.ArgumentError, "second value must be larger"):
                world.picture(color="speed", color_range=(1, 1))

    def test_stress_is_that_of_the_nearest_point_far_from_the_origin(self):
        random = np.random.default_rng(1)
        points, surfels = 0.1 * random.random((2000, 3)), 0.1 * random.random((500, 3))
        near, far = (deform.picture._nearest(mock.Mock(points=points + away, positions=surfels + away))
                     for away in (0, 1e5))
        np.testing.assert_array_equal(near, far)

    def test_without_its_module_says_what_builds_it(self):
        with mock.patch.multiple(deform.picture, _module=None, _MODULE="libdeform_gone.so"):
            with self.assertRaisesRegex(deform.UnsupportedError, "gone.so, .* is not there: `make wheel`"):
                deform.picture._native()

    def test_displacement_is_from_the_rest_shape_after_a_cut_and_in_a_scene_of_a_moved_world(self):
        with tempfile.TemporaryDirectory() as folder, deform.World() as world:
            bar = world.add_body(deform.TetMesh.beam([0.4, 0.1, 0.1], 100), position=(0, 0, 1), name="bar",
                                 rotation=(0, 0, 0.6, 0.8), model="corotational_fem")
            world.run(0.1, dt=0.01)
            fallen = 1.05 - bar.measure.com[2]
            world.write_scene(f"{folder}/later.json")
            bar.cut("plane", point=bar.measure.com, normal=(0.28, 0.96, 0))
            self.assertGreater(bar.measure.mass, 0)
            later = deform.Scene(f"{folder}/later.json")
            for body in (bar, later.world.bodies[0]):
                shown = deform.picture.body_values(body, "displacement")
                np.testing.assert_allclose(shown, fallen, rtol=1e-6)
                np.testing.assert_allclose(body.displacements[:, 2], -fallen, rtol=1e-6)
            later.close()

    def test_slope_by_gravity_is_a_slope(self):
        up = deform.picture.Upright.of_scene({"keyframes": [{"t": 0, "value": [0, 0, 0]},
                                                           {"t": 1, "value": [3, 0, -4]}]})
        np.testing.assert_allclose(up.at(0), [-0.6, 0, 0.8])
        self.assertFalse(up.tilts)
        self.assertTrue(deform.picture.Upright([0, 1], [[0, 0, -9.8], [1, 0, -9.8]]).tilts)
        np.testing.assert_array_equal(deform.picture.Upright(0, [0, 0, 0]).at(5), [0, 0, 1])
        with deform.World() as world:
            world.add_obstacle("plane")
            world.add_body(deform.TetMesh.ball(0.1, 300), position=(0, 0, 0.1))
            camera = {"eye": (0, -1, 0.4), "look_at": (0, 0, 0.1), "size": (160, 120), "label": False}
            level = world.picture(**camera).rgb
            world.set_gravity((4, 0, -9))
            self.assertFalse(np.array_equal(world.picture(**camera).rgb, level))

    def test_up_is_that_of_a_snapshot(self):
        with deform.World() as world, deform.World(gravity=(0, 9, 0)) as other:
            kept = world.snapshot()
            world.set_gravity((-9, 0, 0))
            world.restore(kept)
            np.testing.assert_array_equal(deform.picture.upright_of(world).at(0), [0, 0, 1])
            table = world.add_obstacle("box", name="table", half_size=(0.5, 0.5, 0.1))
            ball = world.add_body(deform.TetMesh.ball(0.1, 300), on=table, position=(0, 0, 1))
            np.testing.assert_allclose(ball.measure.com, [0, 0, 0.2], atol=3e-3)
            world.set_gravity_keys([0, 1], [(3, 0, -4), (0, 0, -4)])
            keyed = world.snapshot()
            world.set_gravity_keys([], [])
            np.testing.assert_allclose(deform.picture.upright_of(world).at(0), [0, 0, 1])
            world.restore(keyed)
            np.testing.assert_allclose(deform.picture.upright_of(world).at(0), [-0.6, 0, 0.8])
            other.restore(kept)
            np.testing.assert_array_equal(deform.picture.upright_of(other).at(0), [0, 0, 1])
        with deform.World(gravity=(0, 9, 0)) as world:  # no scene may have the name: the last one known
            world.add_body(deform.TetMesh.ball(0.1, 300), name="arm/left")
            world.restore(world.snapshot())
            np.testing.assert_array_equal(deform.picture.upright_of(world).at(0), [0, -1, 0])
            self.assertIsInstance(world.picture(size=(8, 8)), deform.Picture)

    def test_renderers_of_sizes_that_are_not_drawn_any_more_go(self):
        with deform.World() as world:
            native = deform.picture._native()
            with mock.patch.object(native, "deform_picture_destroy",
                                   wraps=native.deform_picture_destroy) as destroy:
                for width in range(20, 25):
                    world.picture(size=(width, 16))
            self.assertGreater(destroy.call_count, 0)
            self.assertEqual(world.picture(size=(20, 16)).rgb.shape, (16, 20, 3))

    def test_short_memory_is_told(self):
        """Of a process that may not have more."""
        said = subprocess.run([sys.executable, "-B", "-c", """
import resource
import deform.picture
def draw(text):
    deform.picture.draw([], [], size=(8, 8), texts=[text], value_range=(0, 1), t=0,
                        upright=deform.picture.Upright(0, [0, 0, -9.8]))
draw("")
line = "x" * 64_000_000
size = 4096 * int(open("/proc/self/statm").read().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (size + 100_000_000,) * 2)  # of its two copies
try:
    draw(line)
except deform.OutOfMemory as error:
    print(error.status, error)
"""], capture_output=True, text=True)
        self.assertEqual(said.stdout, "DFM_E_NOMEM no picture: no memory for a picture of this size\n",
                         said.stderr)

    def test_frames_of_a_run(self):
        run = dropped()
        run.camera = (0, -1, 0.4), (0, 0, 0.1)
        with self.assertRaisesRegex(deform.ArgumentError, "a camera has both eye and look_at"):
            run.picture(look_at=(0, 0, 1))
        run.camera = None
        first, last = run.picture(0, size=(160, 120)), run.picture(-1, size=(160, 120))
        self.assertFalse(np.array_equal(first.rgb, last.rgb))
        with tempfile.TemporaryDirectory(suffix=" with space") as folder:
            path = last.save(pathlib.Path(folder) / "last.png")
            np.testing.assert_array_equal(decoded(path.read_bytes()), last.rgb)
            with self.assertRaisesRegex(deform.FileError, "last.png/x.png: cannot be written"):
                last.save(path / "x.png")


class View(unittest.TestCase):
    def seen(self, run):
        """What a viewer has after each frame."""
        data, scene, at = webgl.packets_of(run), Scene(), 0
        while at < len(data):
            size = int.from_bytes(data[at + 16:at + 20], "little")
            if scene.read(data[at:at + size]):
                yield scene
            at += size

    def test_positions_travel(self):
        run = dropped()
        for frame, scene in zip(run.frames, self.seen(run)):
            self.assertEqual(scene.time, frame.t)
            ball = scene.bodies[1]
            np.testing.assert_allclose(np.reshape(ball.x, (-1, 3)), frame.positions["ball"], atol=2e-6)
            self.assertEqual(ball.triangles, run.triangles["ball"].ravel().tolist())
            self.assertEqual([thing.kind for thing in scene.things.values()], [0, 2, 1])
            for thing, solid in zip(scene.things.values(), frame.obstacles):
                np.testing.assert_allclose(thing.pose, solid.pose, atol=1e-6)
            self.assertEqual(set(scene.present), {1, 2, 3, 4})
        self.assertEqual(scene.things[3].half_size, np.float32([0.05, 0.1, 0.02]).tolist())
        span = run.value_range()
        self.assertEqual(webgl._values("speed", span, np.array([0, span[1]])).tolist(), [1, 255])
        with mock.patch.object(deform.Run, "value_range", return_value=span) as asked:
            webgl.document(run)
        self.assertLess(asked.call_count, len(run.frames))

    def test_cut_body_is_told_again(self):
        with deform.World() as world:
            body = world.add_body(deform.TetMesh.beam((0.2, 0.1, 0.1), 300), name="beam")
            world.add_obstacle("mesh", mesh=deform.TriMesh.make("ball", [0.1], 100), position=(1, 2, 3))
            film = world.film()
            body.cut("plane", point=(0.1, 0, 0), normal=(1, 0, 0))
            film.add()
        before, after = (len(scene.bodies[1].triangles) for scene in self.seen(film))
        self.assertGreater(after, before)
        scene = list(self.seen(film))[-1]
        self.assertEqual(scene.bodies[1].missing, 0)
        np.testing.assert_allclose(np.reshape(scene.bodies[1].x, (-1, 3)), film.frames[1].positions["beam"],
                                   atol=1e-6)
        ball = np.reshape(scene.things[2].base, (-1, 3))
        np.testing.assert_allclose(np.linalg.norm(ball, axis=1), 0.1, rtol=1e-3)

    def test_obstacles_that_come_and_go_are_seen_so(self):
        with deform.World() as world:
            world.add_body(deform.TetMesh.ball(0.1, 300), name="ball")
            floor = world.add_obstacle("plane", name="floor")
            film = world.film()
            world.add_obstacle("sphere", radius=0.1, position=(1, 0, 0))
            world.add_rigid("box", half_size=(0.1, 0.1, 0.1), position=(2, 0, 0.1), mass=1)
            film.add()
            floor.remove()
            world.add_obstacle("sphere", radius=0.2, position=(3, 0, 0))
            film.add()
            there = [[(t.kind, round(t.radius, 6), t.pose[0]) for n, t in scene.things.items()
                      if n in scene.present and not t.missing] for scene in self.seen(film)]
        self.assertEqual(there[0], [(0, 0, 0)])
        self.assertEqual(there[1], [(0, 0, 0), (1, 0.1, 1), (2, 0, 2)])
        self.assertEqual(there[2], [(1, 0.1, 1), (2, 0, 2), (1, 0.2, 3)])

    def test_slope_by_gravity_is_turned_upright(self):
        with deform.World(gravity=(3, 0, -4)) as world:
            world.add_obstacle("plane")
            world.add_body(deform.TetMesh.ball(0.1, 300), position=(0, 0, 0.12), name="ball")
            document = webgl.document(world.film())
        ups = json.loads(re.search(r'"ups":(\[\[.*?\]\])', document).group(1))
        np.testing.assert_allclose(ups, [[-0.6, 0, 0.8]])

    def test_film_of_a_world_stepped_by_hand(self):
        with deform.World() as world:
            world.add_obstacle("plane")
            body = world.add_body(deform.TetMesh.ball(0.1, 300), position=(0, 0, 0.12), name="ball")
            film = world.film(color="contact")
            for _ in range(10):
                world.run(0.01, dt=1e-3)
                film.add()
            np.testing.assert_allclose(film.times, np.arange(11) / 100, atol=1e-9)
            np.testing.assert_allclose(film.positions("ball")[-1], body.positions, atol=1e-7)
            self.assertGreater(film.top(), 0)
            self.assertEqual(film.top(), max(frame.values["ball"].max() for frame in film.frames))
            self.assertEqual((film.steps, film.frames[-1].contacts), (100, int(world.stats.contacts)))
            body.remove()
            with self.assertRaisesRegex(deform.ArgumentError, "body 'ball' is gone"):
                film.add()
        self.assertIn("canvas", webgl.document(film))

    def test_document_stands_alone(self):
        run = deform.run(SCENES / "slope_block.json", duration=0.01)
        document = webgl.document(run)
        self.assertIn("content=\"default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'\"",
                      document)
        frame = run._repr_html_()
        self.assertEqual(html.unescape(re.search(r'srcdoc="([^"]*)"', frame).group(1)), document)
        seen = []
        parser = html.parser.HTMLParser()
        parser.handle_starttag = lambda tag, attributes: seen.append((tag, dict(attributes).get("id")))
        parser.feed(document)
        for part in (("canvas", "view"), ("button", "play"), ("input", "at"), ("div", "legend")):
            self.assertIn(part, seen)
        self.assertEqual(document.count("</script>"), 2)
        self.assertIn('"legend":""', document)
        self.assertIn("speed, m/s: 0 <i", webgl.document(dropped()))


if __name__ == "__main__":
    unittest.main()

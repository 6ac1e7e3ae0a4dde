"""deform.serve: what a viewer sees is the world, and what it asks for happens between two steps."""
import json
import os
import pathlib
import random
import sys
import threading
import time
import unittest
import urllib.request

import numpy as np

import deform
from test_guide import follow

sys.path.insert(0, str(pathlib.Path(os.environ["DEFORM_SOURCE"]) / "examples"))
from stream_receiver import Connection, Scene  # noqa: E402

SERVES = (pathlib.Path(os.environ["DEFORM_BUILD"]) / "lib" / "libdeform_python_serve.so").exists()


class Viewer(threading.Thread):
    """Looks on in a thread; `state` and `scene` are the newest."""

    def __init__(self, url):
        super().__init__(daemon=True)
        self.connection, self.scene, self.states, self.frames = Connection(url, 30), Scene(), [], 0
        self.start()

    def run(self):
        try:
            while True:
                message = self.connection.receive()
                if isinstance(message, bytes):
                    self.frames += self.scene.read(message)
                elif "time" in (state := json.loads(message)):
                    self.states.append(state)
        except (ConnectionError, OSError):
            pass

    @property
    def state(self):
        none = {"message": "", "sliders": [{"value": None}], "pull": None}
        return self.states[-1] if self.states else none

    def close(self):
        self.connection.close()


def block():
    world = deform.World(integrator="implicit_euler")
    world.add_obstacle("plane", name="floor")
    mesh = deform.TetMesh.beam((0.1, 0.1, 0.1), cells=60)
    return world, world.add_body(mesh, name="block", position=(0, 0, 0.001), material={"young": 2e4})


@unittest.skipUnless(SERVES, "this build has no libwebsockets")
class Serve(unittest.TestCase):
    def setUp(self):
        self.world, self.body = block()
        self.addCleanup(self.world.close)
        self.server = deform.Server(self.world, rate=200)
        self.addCleanup(self.server.close)
        self.viewer = Viewer(self.server.url)
        self.addCleanup(self.viewer.close)
        end = time.monotonic() + 20
        while not self.server.viewers and time.monotonic() < end:
            time.sleep(1e-3)

    def go(self, until, most=20):
        """Steps until that holds."""
        end = time.monotonic() + most
        while not until():
            self.assertLess(time.monotonic(), end, "it does not come about")
            self.world.step(2e-3)
            self.server.update()

    def later(self, *requests):
        """Sends them from another thread, while this one waits in update(): each after a state that comes
        after that of the one before and is of a pause."""
        def send():
            known = 0
            for request in requests:
                end = time.monotonic() + 20
                while time.monotonic() < end and (len(self.viewer.states) <= known + 3
                                                  or self.viewer.state["running"]):
                    time.sleep(1e-3)
                known = len(self.viewer.states)
                self.viewer.connection.send(request)
        thread = threading.Thread(target=send)
        thread.start()
        self.addCleanup(thread.join)

    def test_page_and_frames_are_what_the_command_serves(self):
        with urllib.request.urlopen(self.server.url) as page:
            self.assertIn("dfm.stream.1", page.read().decode())
            self.assertIn("frame-ancestors", page.headers["content-security-policy"])
        self.assertIn(self.server.url, self.server._repr_html_())
        self.go(lambda: self.viewer.frames > 3)
        self.server._exchange()
        now = self.world.time
        self.go(lambda: self.viewer.scene.time >= now)
        seen, = self.viewer.scene.bodies.values()
        self.assertEqual((seen.name, seen.missing), ("block", 0))
        self.assertEqual(seen.triangles, self.body.triangles.ravel().tolist())
        self.world.step(2e-3)
        self.server._exchange()
        last = self.world.time
        end = time.monotonic() + 10
        while self.viewer.scene.time < last and time.monotonic() < end:
            time.sleep(0.01)
        np.testing.assert_allclose(np.reshape(seen.x, (-1, 3)), self.body.positions, atol=1e-6)
        self.assertGreater(len(self.viewer.scene.contacts), 0)
        self.assertEqual(self.server.viewers, 1)

    def test_pull_moves_the_body_until_it_is_released(self):
        self.go(lambda: self.world.time > 0.2)
        before = self.body.measure.com[0]
        self.viewer.connection.send({"do": "grab", "from": [0.05, -1, 0.05], "along": [0, 1, 0]})
        self.viewer.connection.send({"do": "pull", "to": [0.15, 0, 0.05]})
        self.go(lambda: self.body.measure.com[0] > before + 0.03)
        self.assertGreater(next(s for s in reversed(self.viewer.states) if "pull" in s)["pull"]["force"], 0)
        self.viewer.connection.send({"do": "release"})
        self.go(lambda: "pull" not in self.viewer.state)

    def test_what_the_program_cuts_is_let_go(self):
        self.go(lambda: self.viewer.frames > 0)
        self.viewer.connection.send({"do": "grab", "from": [0.05, -1, 0.05], "along": [0, 1, 0]})
        self.go(lambda: self.server._pull)
        self.body.remove_cells(range(self.body.ntet - 20))
        self.go(lambda: not self.server._pull)

    def test_slider_and_reset_act_between_steps(self):
        given = []
        self.server.add_slider("gravity", 9.81, 0, 20, lambda g: (given.append(g),
                                                                  self.world.set_gravity((0, 0, -g))))
        self.viewer.connection.send({"do": "slider", "name": "gravity", "value": 1.5})
        self.go(lambda: given == [1.5] and self.viewer.state["sliders"][0]["value"] == 1.5)
        self.viewer.connection.send({"do": "slider", "name": "gravity", "value": 21})
        self.go(lambda: "outside of its range" in self.viewer.state["message"])
        at = self.world.time
        self.viewer.connection.send({"do": "reset"})
        self.go(lambda: self.world.time < at)
        self.go(lambda: given == [1.5, 9.81] and self.viewer.state["sliders"][0]["value"] == 9.81)
        for value, low, high in ((1, 0, np.inf), (np.nan, 0, 1)):
            with self.assertRaisesRegex(deform.ArgumentError, "finite"):
                self.server.add_slider("E", value, low, high, given.append)
        with self.assertRaisesRegex(deform.ArgumentError, "already"):
            self.server.add_slider("gravity", 1, 0, 2, given.append)
        with self.assertRaises(deform.ArgumentError):
            self.server.add_slider("E", 0, 0, 1, given.append, logarithmic=True)

    def test_update_waits_while_it_is_paused(self):
        self.viewer.connection.send({"do": "run", "on": False})
        self.later({"do": "step"}, {"do": "step"}, {"do": "run", "on": True})
        while self.server.running:  # comes with one of the next pictures
            self.world.step(2e-3)
            self.server.update()  # returns after the first step that is asked for
            time.sleep(1e-3)
        at = self.world.time
        self.world.step(2e-3)
        self.server.update()  # and after the second one
        self.assertFalse(self.server.running)
        self.world.step(2e-3)
        self.server.update()
        self.assertTrue(self.server.running)
        self.assertAlmostEqual(self.world.time, at + 4e-3)

    def test_two_steps_at_once_are_two(self):
        self.server.running = False
        before = self.server.viewers
        self.viewer.connection.send({"do": "step"})
        self.viewer.connection.send({"do": "step"})
        self.server.update()
        self.server.update()
        self.assertEqual((before, self.server.running), (1, False))
        self.later({"do": "run", "on": True})
        self.server.update()
        self.assertTrue(self.server.running)

    def test_who_pauses_and_leaves_holds_nothing(self):
        self.server.running = False
        self.viewer.close()
        self.server.update()
        self.assertTrue(self.server.running)

    def test_forked_process_has_no_server(self):
        child = os.fork()
        if not child:
            closed = self.server.closed
            self.server.close()
            os._exit(0 if closed else 1)
        self.assertEqual(os.waitpid(child, 0)[1], 0)
        self.assertFalse(self.server.closed)
        self.go(lambda: self.viewer.frames > 1)

    def test_what_is_no_number_is_null(self):
        self.server._took = float("nan")
        self.go(lambda: self.viewer.states)
        self.assertIsNone(self.viewer.state["step_ms"])

    def test_cut_opens_what_can_be_cut(self):
        before = len(self.body.triangles)
        self.go(lambda: self.viewer.frames > 0)
        x = 0.05
        self.viewer.connection.send({"do": "cut", "blade": [x, -1, -1, x, -1, 1, x, 1, 1, x, 1, -1]})
        self.go(lambda: len(self.body.triangles) > before or len(self.world.bodies) > 1)
        self.go(lambda: all(b.missing == 0 for b in list(self.viewer.scene.bodies.values()))
                and len(self.viewer.scene.present) == len(self.world.bodies) + 1)

    def things(self, viewer):
        scene = viewer.scene
        return {thing.name for number, thing in list(scene.things.items()) if number in scene.present}

    def test_what_is_added_later_is_seen(self):
        self.go(lambda: self.things(self.viewer) == {"floor"})
        ball = self.world.add_obstacle("sphere", name="ball", radius=0.05, position=(1, 0, 0.05))
        self.go(lambda: self.things(self.viewer) == {"floor", "ball"})
        ball.remove()
        self.go(lambda: self.things(self.viewer) == {"floor"})
        self.world.add_rigid("box", name="box", half_size=(0.1, 0.1, 0.1), position=(1, 0, 0.1), mass=1)
        mesh = deform.TetMesh.beam((0.1, 0.1, 0.1), cells=60)
        self.world.add_body(mesh, name="second", position=(-1, 0, 0.001))
        late = Viewer(self.server.url)
        self.addCleanup(late.close)
        for viewer in (self.viewer, late):
            self.go(lambda viewer=viewer: self.things(viewer) == {"floor", "box"}
                    and [b.name for b in list(viewer.scene.bodies.values()) if not b.missing]
                    == ["block", "second"])

    def test_what_is_malformed_is_told(self):
        dice = random.Random(1)
        for text in ([], {}, 7, None, {"do": "grab"}, {"do": "grab", "from": [1, 2, 3], "along": [0, 0, 0]},
                     {"do": "pull", "to": [10**400, 0, 0]}, {"do": "pull", "to": {}}, {"do": []},
                     {"do": "slider", "name": [], "value": {}}, {"do": "cut", "blade": [1e9] * 12}):
            self.viewer.connection.send(text)
        for _ in range(100):
            self.viewer.connection.send_frame(1, bytes(dice.choice(b'{}[]":,do1e9') for _ in range(200)))
        self.viewer.connection.send({"do": "nothing"})
        self.go(lambda: '"nothing"' in self.viewer.state["message"])

    def test_run_goes_with_the_clock(self):
        begun = time.monotonic()
        self.server.run(0.3, dt=2e-3)
        self.assertAlmostEqual(self.world.time, 0.3, delta=1e-9)
        self.assertGreater(time.monotonic() - begun, 0.25)

    def test_guide(self):
        names = follow(pathlib.Path(os.environ["DEFORM_SOURCE"]) / "libdeform/doc/reference/stream.md")[0]
        self.assertTrue(names["server"].closed)

    def test_closed_server_says_so(self):
        self.server.close()
        self.server.close()
        self.assertIn("closed", repr(self.server))
        self.assertTrue(self.server.closed)
        self.assertIsNone(self.server._repr_html_())
        with self.assertRaises(deform.StateError):
            self.server.update()


if __name__ == "__main__":
    unittest.main()

"""Friction laws from Python: those that are loaded, and laws as Python classes, by themselves, in a world,
on the rig and before the validator."""
import gc
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from unittest import mock

import numpy as np

import deform


class Tanh(deform.PythonLaw):
    id = "com.example.tanh"
    source = "regularized Coulomb"
    parameters = [deform.Parameter("mu", "friction coefficient", "1", 0, 10, 0.5),
                  deform.Parameter("v_s", "speed of transition", "m/s", 1e-6, 1, 1e-3)]

    def evaluate(self, x, out):
        speed = np.sqrt(x.vt[0] ** 2 + x.vt[1] ** 2)
        out.limit[:] = x.mu * x.fn
        out.ft[:] = -out.limit * np.tanh(speed / x.v_s) * x.vt / np.where(speed == 0, 1, speed)


def on_cone(z, k, cone):
    held = k * np.sqrt(z[0] ** 2 + z[1] ** 2)
    return np.where(held <= cone, 1.0, cone / held)


class Bristle(deform.PythonLaw):
    """plugins/template_friction in Python."""

    id = "com.example.bristle"
    source = "Simo and Hughes 1998, box 1.4"
    parameters = [deform.Parameter("mu", "friction coefficient", "1", 0, 10, 0.5, runtime=True),
                  deform.Parameter("sigma0", "bristle stiffness per area", "N/m^3", 1e3, 1e12, 1e8)]
    effects = ["stiction", "presliding", "hysteresis"]
    state = ["tangent"]
    needs = ["fn", "vt", "area"]

    def evaluate(self, x, out):
        k, cone = x.sigma0 * x.area, np.where(x.fn < 0, 0.0, x.mu * x.fn)
        t = on_cone(x.state, k, cone) * x.state + x.dt * x.vt
        share = on_cone(t, k, cone)
        out.state[:] = share * t
        out.ft[:] = -k * out.state
        out.limit[:] = cone
        out.mode[:] = np.where(x.fn > 0, np.where(share < 1, 2, 1), 0)
        out.stored[:] = 0.5 * k * (out.state ** 2).sum(axis=0)

    def refuse(self, params):
        return "mu of 7 is not liked" if params["mu"] == 7 else None


class Pushes(Bristle):
    id = "com.example.pushes"
    effects = []

    def evaluate(self, x, out):
        super().evaluate(x, out)
        out.ft *= -1


class Raises(Tanh):
    id = "com.example.raises"

    def evaluate(self, x, out):
        raise RuntimeError("out of ideas")


class Bare(deform.PythonLaw):
    """Without parameters."""

    id = "com.example.bare"

    def evaluate(self, x, out):
        out.limit[:] = 0.5 * x.fn
        out.ft[:] = -out.limit * np.tanh(1e3 * x.vt)


class Refuses(Tanh):
    id = "com.example.refuses_wrongly"

    def refuse(self, params):
        raise LookupError("of refuse")


class Shapes(Tanh):
    id = "com.example.shapes"

    def evaluate(self, x, out):
        out.ft = np.zeros(3)


def slide(law, time=0.2, **params):
    """Velocity of a block on a slope of tan 0.4 after some time, m/s."""
    with deform.World(integrator="implicit_euler") as world:
        world.add_obstacle("plane", name="slope", normal=(-0.4, 0, 1))
        block = world.add_body(deform.TetMesh.beam([0.2, 0.2, 0.1], cells=200), position=(0, 0, 0.06),
                               rotation=(0, -0.189, 0, 0.982), name="block", material={"young": 1e6})
        world.add_friction("block", "slope", law=law, **params)
        world.run(time, dt=1 / 120)
        return float(np.linalg.norm(block.measure.velocity))


class Loaded(unittest.TestCase):
    def test_law_on_its_own(self):
        law = deform.Law("coulomb")
        out = law(fn=[10, 10, 0], vt=[[0.1, 0, 0.1], [0, -0.2, 0]], dt=1e-3, mu=0.3)
        np.testing.assert_allclose(out["ft"], [[-3, 0, 0], [0, 3, 0]], atol=1e-12)
        np.testing.assert_allclose(out["limit"][:2], 3)
        self.assertEqual([p.key for p in law.type.parameters][:2], ["mu_C", "mu_S"])
        with self.assertRaisesRegex(deform.ArgumentError, "did you mean"):
            law(fn=[1], vt=[[0], [0]], dt=1e-3, mue=1)

    def test_state_goes_round(self):
        law, state = deform.Law("lugre"), None
        for _ in range(200):
            out = law(fn=[10.0], vt=[[0.01], [0]], dt=1e-3, state=state, mu=0.5)
            state = out["state"]
        self.assertAlmostEqual(out["ft"][0, 0], -5, delta=0.05)

    def test_rows_of_state_that_are_not_used_are_zero(self):
        law, slip = deform.Law("gms"), np.ones((2, 4)) * 1e-3
        first = law(np.ones(4), slip, 1e-3)
        with mock.patch("numpy.empty", lambda shape, dtype=float: np.full(shape, 77, dtype)):
            again = law(np.ones(4), slip, 1e-3)
        self.assertEqual(again["state"].shape, (law.nstate, 4))
        self.assertTrue((again["state"][-1] == 0).all())
        np.testing.assert_array_equal(again["state"], first["state"])


class InPython(unittest.TestCase):
    def test_batch_by_batch(self):
        rng = np.random.default_rng(1)
        vt, state = rng.normal(size=(2, 50)) * 1e-4, np.zeros((2, 50))
        for _ in range(5):
            out = deform.Law(Bristle)(fn=np.linspace(0, 10, 50), vt=vt, dt=1e-3, state=state, sigma0=1e7)
            np.testing.assert_allclose(np.linalg.norm(out["ft"], axis=0)[out["mode"] == 2],
                                       out["limit"][out["mode"] == 2])
            state = out["state"]
        self.assertEqual(set(out["mode"]), {0, 1, 2})

    def test_block_slides_and_holds_as_with_coulomb(self):
        coulomb = slide("coulomb", mu=0.3)
        for law in (Tanh, Bristle):
            self.assertAlmostEqual(slide(law, mu=0.3), coulomb, delta=0.01 * coulomb)
        gc.collect()
        self.assertLess(slide(Bristle(), mu=0.6, time=0.5), 1e-4)

    def test_class_written_anew_is_another_law(self):
        def written(share):
            class Half(Tanh):
                id = "com.example.half"

                def evaluate(self, x, out):
                    super().evaluate(x, out)
                    out.ft *= share
            return Half

        first, second = written(0.5), written(0.25)
        for law, force in ((first, 5), (second, 2.5), (first, 5)):
            out = deform.Law(law)(fn=[10], vt=[[1], [0]], dt=1e-3, mu=1)
            self.assertAlmostEqual(-out["ft"][0, 0], force)
        self.assertEqual(deform.Law(second).type.id, "com.example.half.2")
        self.assertEqual(deform.Law(first).type.id, "com.example.half")

    def test_short_name_of_two_laws_is_refused(self):
        context = deform.Context()
        names = context.use_law(Tanh), context.use_law(type("Other", (Tanh,), {"id": "org.other.tanh"}))
        self.assertEqual([context.type("friction", name).id for name in names], list(names))
        with self.assertRaisesRegex(deform.ArgumentError, "'tanh' is the short name of .*; give the id"):
            context.type("friction", "tanh")

    def test_threads_give_the_same_bits(self):
        hashes = set()
        for threads in (1, 3):
            with deform.World(threads=threads, integrator="implicit_euler") as world:
                world.add_obstacle("plane")
                for i in range(3):
                    world.add_body(deform.TetMesh.beam([0.4, 0.4, 0.05], cells=500),
                                   position=(0.5 * i, 0, 1e-3), velocity=(0.3, 0, 0))
                world.add_friction(law=Bristle, mu=0.4)
                world.run(0.05, dt=1 / 60)
                self.assertGreater(len(world.contacts), 0)
                hashes.add(world.hash)
        self.assertEqual(len(hashes), 1)

    def test_parameter_changes_while_it_runs(self):
        with deform.World() as world:
            world.add_friction(law=Bristle, mu=0.5)
            world.set_friction("*", "*", mu=0.4)
            with self.assertRaisesRegex(deform.ArgumentError, "mu of 7 is not liked"):
                world.set_friction("*", "*", mu=7)
            with self.assertRaisesRegex(deform.ArgumentError, "sigma"):
                world.add_friction(law=Bristle, sigma=1)

    def test_what_a_law_raises_is_the_cause(self):
        for law, sentence in ((Raises, "out of ideas"), (Shapes, r"shape \(3,\); expected \(2, ")):
            with self.subTest(law.id), self.assertRaises(deform.Diverged) as caught:
                slide(law)
            self.assertRegex(str(caught.exception.__cause__), sentence)
        with self.assertRaises(deform.Error) as caught:
            deform.Law(Raises)(fn=[1], vt=[[0], [0]], dt=1e-3)
        self.assertIsInstance(caught.exception.__cause__, RuntimeError)

    def test_a_law_without_parameters(self):
        limit = deform.Law(Bare)(fn=[2], vt=[[1], [0]], dt=1e-3)["limit"]
        np.testing.assert_array_equal(limit, [1])
        self.assertLess(slide(Bare), 0.1)

    def test_an_error_is_of_the_call_that_met_it(self):
        with deform.World() as world:
            with self.assertRaises(deform.ArgumentError) as caught:
                world.add_friction(law=Refuses)
            self.assertIsInstance(caught.exception.__cause__, LookupError)
            with self.assertRaises(deform.ArgumentError) as caught:
                world.add_friction(law=Bristle, mu=7)
            self.assertIsNone(caught.exception.__cause__)
        with self.assertRaises(deform.Error) as caught:
            deform.Law(Refuses)(fn=[1], vt=[[0], [0]], dt=1e-3)
        self.assertIsInstance(caught.exception.__cause__, LookupError)

    def test_interrupts_end_a_step_in_a_law(self):
        """Also where the signal comes while the library computes, between two calls of the law."""
        def raises(self, x, out):
            raise KeyboardInterrupt

        def hears(self, x, out):
            Bare.evaluate(self, x, out)
            signal.raise_signal(signal.SIGINT)
        for evaluate in (raises, hears):
            law = type("Law", (Bare,), {"id": f"com.example.{evaluate.__name__}", "evaluate": evaluate})
            with self.subTest(evaluate.__name__), self.assertRaises(KeyboardInterrupt):
                slide(law)
        main, slow = threading.get_ident(), threading.Event()

        def waits(self, x, out):
            Bare.evaluate(self, x, out)
            slow.set()
        law = type("Law", (Bare,), {"id": "com.example.waits", "evaluate": waits})
        for _ in range(20):
            slow.clear()
            kill = threading.Thread(target=lambda: slow.wait() and signal.pthread_kill(main, signal.SIGINT))
            kill.start()
            with self.assertRaises(KeyboardInterrupt):
                slide(law, time=30)
            kill.join()

    def test_forces_that_nothing_reads(self):
        """A law that returned its force, or wrote it to another name, was one without friction."""
        def returns(self, x, out):
            return -0.3 * x.fn * x.vt

        def misnames(self, x, out):
            out.force = -0.3 * x.fn * x.vt
        for evaluate, sentence in ((returns, "returned a ndarray, .*write the force into out.ft"),
                                   (misnames, "set out.force, which nothing reads; out has ft, state")):
            law = type("Law", (Bristle,), {"id": f"com.example.{evaluate.__name__}", "evaluate": evaluate})
            with self.subTest(law.id), self.assertRaises(deform.Error) as caught:
                deform.Law(law)(fn=[1], vt=[[0], [0]], dt=1e-3)
            self.assertRegex(str(caught.exception.__cause__), sentence)

    def test_descriptions_that_cannot_be(self):
        for wrong in ({"id": "bristle"}, {"id": "com.example.a", "state": ["vector"]},
                      {"id": "com.example.b", "needs": ["speed"]},
                      {"id": "com.example.d", "parameters": [("mu", 0.3)]},
                      {"id": "com.example.e", "parameters": [deform.Parameter("fn", "", "1", 0, 1, 0)]},
                      {"id": "com.example.f", "parameters": [deform.Parameter("a b", "", "1", 0, 1, 0)]},
                      {"id": "a.g", "parameters": [deform.Parameter("a", "", "1", 0, 1, 0, 1, ("b",))]},
                      {"id": "com.example.c", "parameters": [deform.Parameter("mu", "", "1", 1, 0, 2)]}):
            with self.subTest(wrong), self.assertRaises(deform.Error):
                deform.Law(type("Wrong", (Bristle,), wrong))

    def test_on_the_rig(self):
        rows = deform.friction(Bristle, "sine_velocity", normal=10, mu=0.3, sigma0=1e6)
        self.assertAlmostEqual(rows["F"].max(), 3, delta=1e-9)
        figure = deform.plot_friction("lugre", "displacement_path", normal=10)
        self.assertEqual(len(figure.axes), 1)
        case = {"law": "coulomb", "mass": 1, "params": {"mu": 0.5},
                "input": {"kind": "force_ramps", "rates": [1, 10]}}
        axis, = deform.plot_friction("coulomb", case=case).axes
        self.assertEqual(axis.get_xscale(), "log")
        with self.assertRaisesRegex(deform.ArgumentError, "did you mean 'spring_pull'"):
            deform.friction("lugre", "spring_pul")


    def test_a_normal_force_that_nothing_reads_is_refused(self):
        case = {"law": "coulomb", "params": {"mu": 0.5}, "input": {"kind": "sine_velocity"}}
        for kind, given, words in (("sine_velocity_sine_load", {}, "F0 of its input"),
                                   (None, {"case": case}, "a case holds its own")):
            with self.assertRaisesRegex(deform.ArgumentError, words):
                deform.friction("coulomb", kind, normal=100, **given)
        with self.assertRaisesRegex(deform.ArgumentError, "a case holds its own"):
            deform.friction("coulomb", "force_ramps", case=case)

    def test_what_refuse_raises_in_another_process(self):
        refuses = type("Refuses", (Tanh,), {"id": "com.example.refuses",
                                            "refuse": lambda self, params: params["nu"]})
        with self.assertRaisesRegex(KeyError, "nu"):
            deform.friction(refuses(), "sine_velocity", normal=10)

    def test_other_processes_reach_it_whatever_the_temporary_folder(self):
        with tempfile.TemporaryDirectory(suffix="_" * 90) as folder, mock.patch("tempfile.tempdir", folder):
            rows = deform.friction(Tanh(), "sine_velocity", normal=10)
        self.assertAlmostEqual(rows["F"].max(), 5, delta=1e-9)

    def test_a_process_that_dies_within_a_message(self):
        raised, before = [], set(threading.enumerate())
        with mock.patch("threading.excepthook", raised.append):
            with Tanh().served() as (_, environment):
                for sent in struct.pack("III", 1, 1, 0), struct.pack("III", 1, 1, 0) + bytes(12):
                    with socket.socket(socket.AF_UNIX) as channel:
                        channel.settimeout(20)
                        channel.connect(environment["DEFORM_PYTHON_LAW"])
                        channel.sendall(sent)
                        channel.shutdown(socket.SHUT_WR)
                        while channel.recv(4096):  # until it has been read
                            pass
            for thread in set(threading.enumerate()) - before:
                thread.join()
        self.assertEqual(raised, [])

    def test_a_host_with_a_timer(self):
        """Whose calls it interrupts; in Python none goes on by itself."""
        class Slow(Tanh):
            def evaluate(self, x, out):
                time.sleep(0.05)
                super().evaluate(x, out)

        host = ("import pathlib, signal, sys, deform; law = deform.Law(pathlib.Path(sys.argv[1]))\n"
                "signal.signal(signal.SIGALRM, lambda *_: None)\n"
                "signal.setitimer(signal.ITIMER_REAL, 1e-3, 1e-3)\n"
                "print([law(fn=[2], vt=[[9], [0]], dt=1e-3)['limit'].tolist() for _ in range(2)])")
        with Slow().served() as (file, environment):
            said = subprocess.run([sys.executable, "-B", "-c", host, file], capture_output=True, text=True,
                                  env={**os.environ, **environment})
        self.assertEqual(said.stdout, "[[1.0], [1.0]]\n", said.stderr)


class Validator(unittest.TestCase):
    def test_rules_that_pass(self):
        rules = Bristle().check(only=["V03", "V04", "V05", "V07", "F01", "F02", "F16"])
        self.assertEqual({row["id"]: row["result"] for row in rules},
                         {"V03": "pass", "V04": "pass", "V05": "skip", "V07": "pass", "F01": "pass",
                          "F02": "pass", "F16": "pass"}, str(rules))

    def test_rules_of_a_file_alone_run_nothing(self):
        with mock.patch("subprocess.run", side_effect=AssertionError):
            row, = Bristle().check(only=["V05"])
        self.assertEqual((row["id"], row["result"]), ("V05", "skip"))

    def test_rules_that_are_broken(self):
        rules = Pushes().check(only=["F01", "F03"])
        self.assertEqual([row["result"] for row in rules], ["pass", "fail"], str(rules))
        promised = type("Promised", (Tanh,), {"effects": ["stiction"]})
        row, = promised().check(only=["F06"])
        self.assertEqual(row["result"], "fail")
        self.assertIn("stiction", row["title"])
        with self.assertRaisesRegex(RuntimeError, "out of ideas"):
            Raises().check(only=["F01"])


if __name__ == "__main__":
    unittest.main()

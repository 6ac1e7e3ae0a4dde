"""Fits: known parameters come back within their intervals, what the data cannot tell is said, and the shipped
examples give what their page says. DEFORM_SOAK=1: many more noisy trials."""
import csv
import importlib.util
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

import numpy as np
import scipy.stats

import deform
from deform.study.engine import Failed
from deform.study.fit import Problem, _at_measured
from deform.study.spec import read_study
from deform.study.statistics import Spread
from study_files import COM, MU, SPEED, write_box

EXAMPLES = pathlib.Path(os.environ["DEFORM_SOURCE"]) / "examples" / "studies"
TRUTH = {"mu": 0.42, "v": 0.36}
SIGMA = 1e-4  # m
sys.path.insert(0, str(EXAMPLES))
import make_measured  # noqa: E402


class InAFolder(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.scene = write_box(cls.folder)
        deform.command("run", cls.scene, "--quiet", "--out", cls.folder / "run",
                       "--set", f"{MU}={TRUTH['mu']}", "--set", f"{SPEED}={TRUTH['v']}")
        with open(cls.folder / "run" / "bodies.csv", newline="") as file:
            rows = [row for row in csv.DictReader(file) if row["body"] == "box"]
        cls.t = np.array([float(row["t"]) for row in rows])
        cls.x = np.array([float(row["com_x"]) for row in rows])

    def measured(self, noise=0.0, seed=0, name="measured.csv"):
        path = self.folder / name
        values = self.x + noise * np.random.default_rng(seed).standard_normal(len(self.x))
        path.write_text("t,x\n" + "".join(f"{t!r},{x!r}\n" for t, x in zip(self.t.tolist(), values.tolist())))
        return path

    def study(self, measured, **changes):
        return {"format": "deform-study", "version": 1, "scene": str(self.scene),
                "parameters": {"mu": {"at": MU, "from": 0.1, "to": 1, "start": 0.7, "unit": "1"},
                               "v": {"at": SPEED, "from": 0.05, "to": 1, "scale": "log", "unit": "m/s"}},
                "residuals": [{**COM, "measured": str(measured), "columns": ["t", "x"], "sigma": SIGMA,
                               "unit": "m"}], **changes}


class Recovery(InAFolder):
    def test_without_noise_the_values_come_back(self):
        for method in "least_squares", "differential_evolution":
            found = deform.fit(self.study(self.measured(), optimizer={"method": method, "evaluations": 300}),
                               workers=2)
            for name, true in TRUTH.items():
                self.assertAlmostEqual(found.values[name] / true, 1, delta=5e-3, msg=method)
            self.assertNotIn("converged", str(found))
        if importlib.util.find_spec("cma") is None:  # Debian 12 has no package of it
            with self.assertRaisesRegex(deform.UnsupportedError, "needs the package cma"):
                deform.fit(self.study(self.measured(), optimizer={"method": "cma"}))
        else:
            found = deform.fit(self.study(self.measured(), optimizer={"method": "cma"}), workers=2)
            self.assertAlmostEqual(found.values["mu"] / TRUTH["mu"], 1, delta=5e-3)

    def test_noisy_trials_lie_within_their_intervals(self):
        """Intervals of 95 %, which hold both parameters at once: in 19 of 20 trials they do."""
        trials = 200 if os.environ.get("DEFORM_SOAK") else 10
        within, widths = 0, []
        for seed in range(trials):
            found = deform.fit(self.study(self.measured(SIGMA, seed)), workers=2)
            within += all(low <= TRUTH[name] <= high for name, (low, high) in found.intervals.items())
            widths.append([found.intervals[name][1] - found.intervals[name][0] for name in TRUTH])
        # of 200, 190 are expected, with a deviation of 3
        self.assertGreaterEqual(within, 9 if trials == 10 else 181)
        self.assertLess(within, 200)
        np.testing.assert_allclose(np.mean(widths, axis=0), self.closed_widths(), rtol=0.3)

    def closed_widths(self):
        """Of x = v t - mu g t^2/2 until the box rests."""
        mu, v, g = TRUTH["mu"], TRUTH["v"], 9.81
        t = np.minimum(self.t, v / (mu * g))
        jacobian = np.stack([-g * t ** 2 / 2, t], axis=1)
        deviation = SIGMA * np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
        return 2 * scipy.stats.t.ppf(1 - 0.05 / 4, len(t) - 2) * deviation

    def test_runs_that_fail_are_no_fit(self):
        study = self.study(self.measured(), optimizer={"method": "differential_evolution", "evaluations": 90})
        study["parameters"]["mu"]["from"] = -0.4  # where no scene runs
        found = deform.fit(study, workers=2)
        self.assertAlmostEqual(found.values["mu"] / TRUTH["mu"], 1, delta=5e-3)


class Material(unittest.TestCase):
    """A bar hangs by its end and rings under its weight: the sag gives E, how thin it becomes nu, the decay
    the damping."""
    TRUTH = {"young": 4e5, "nu": 0.31, "damping": 0.004}
    START = {"young": 1e6, "nu": 0.2, "damping": 0.001}

    def test_modulus_poisson_and_damping_come_back(self):
        folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        scene = folder / "bar.json"
        scene.write_text(json.dumps({
            "format": "deform-scene", "version": 1, "gravity": [9.81, 0, 0],
            "time": {"duration": 0.2, "step": 0.002},
            "materials": {"rubber": {
                "density": 1000, "young": self.TRUTH["young"], "poisson": self.TRUTH["nu"],
                "damping": {"stiffness": self.TRUTH["damping"]}}},
            "bodies": [{"name": "bar", "mesh": str(EXAMPLES.parent / "data" / "beam.msh"),
                        "material": "rubber", "model": {"type": "linear_fem"},
                        "fix": [{"box": [[-0.001, -1, -1], [0.001, 1, 1]]}]}],
            "probes": [{"name": "tip", "body": "bar", "point": [0.5, 0.05, 0.05]},
                       {"name": "side", "body": "bar", "point": [0.1, 0.1, 0.05]}],
            "output": {"every": 0.01}}))
        deform.command("run", scene, "--quiet", "--out", folder / "run")
        residuals = []
        for probe, column, sigma in ("tip", "x", 1e-4), ("side", "y", 1e-6):
            with open(folder / "run" / "probes.csv", newline="") as file:
                rows = [f"{row['t']},{row[column]}" for row in csv.DictReader(file) if row["probe"] == probe]
            measured = folder / f"{probe}.csv"
            measured.write_text("\n".join([f"t,{column}", *rows, ""]))
            residuals.append({"name": probe, "table": "probes", "where": {"probe": probe}, "column": column,
                              "sigma": sigma, "measured": str(measured), "columns": ["t", column]})
        at = "/materials/rubber/"
        found = deform.fit({
            "format": "deform-study", "version": 1, "scene": str(scene),
            "parameters": {
                "young": {"at": at + "young", "from": 1e5, "to": 4e6, "scale": "log",
                          "start": self.START["young"]},
                "nu": {"at": at + "poisson", "from": 0.05, "to": 0.45, "start": self.START["nu"]},
                "damping": {"at": at + "damping/stiffness", "from": 2e-4, "to": 2e-2, "scale": "log",
                            "start": self.START["damping"]}},
            "residuals": residuals}, workers=2)
        for name, true in self.TRUTH.items():
            self.assertAlmostEqual(found.values[name] / true, 1, delta=5e-3, msg=name)


class Said(InAFolder):
    def test_what_cannot_be_told_apart(self):
        mass = "/rigid/bodies/0/mass"
        study = self.study(self.measured())
        study["parameters"] = {"mu": study["parameters"]["mu"],
                               "m": {"at": mass, "from": 0.5, "to": 2, "unit": "kg"}}
        study["set"] = {SPEED: TRUTH["v"]}
        said = deform.fit(study, workers=2).notes
        self.assertTrue(any(note.startswith("m cannot be found from these data") for note in said), said)
        self.assertFalse(any("mu" in note for note in said[1:]), said)

    def test_pair_of_which_only_one_combination_acts(self):
        found = deform.fit({
            "scene": str(EXAMPLES / "springs.json"), "optimizer": {"evaluations": 30},
            "parameters": {"young": {"at": "/materials/rubber/young", "from": 3e5, "to": 3e6, "scale": "log"},
                           "density": {"at": "/materials/rubber/density", "from": 500, "to": 2000,
                                       "scale": "log"}},
            "residuals": [{"table": "probes", "where": {"probe": "tip"}, "column": "z", "sigma": 1e-4,
                           "measured": str(EXAMPLES / "springs_measured.csv"), "columns": ["t", "z"]}]},
            workers=2)
        self.assertRegex("\n".join(found.notes), "young and density cannot be told apart by these data")
        # the ranges are as 10 and 4 on their logarithmic scales, and E/rho acts
        self.assertAlmostEqual(found.values["young"] / found.values["density"], 770, delta=8)

    def test_friction_and_bristles_at_one_displacement(self):
        """A pull of 0.2 mm: F = mu N (1 - exp(-sigma0 x / (mu N))), near its end alone and as a whole."""
        case = {"id": "pull", "law": "lugre", "mass": 1, "gravity": 1,
                "params": {"mu": 0.42, "sigma0": 3000, "sigma1": 0, "sigma2": 0},
                "input": {"kind": "sine_velocity", "V": 2e-4 * math.pi, "freq": 1, "T": 0.5, "dt": 0.002},
                "columns": ["t", "x", "F"]}
        rows = deform.friction("lugre", case=case)
        file, rig = self.folder / "pull.csv", self.folder / "pull.json"
        rig.write_text(json.dumps(case))
        study = {"rig": str(rig), "parameters": {
            "mu": {"at": "/params/mu", "from": 0.2, "to": 1, "start": 0.6},
            "sigma0": {"at": "/params/sigma0", "from": 1e3, "to": 1e4, "scale": "log", "start": 2e3,
                       "unit": "N/m"}},
            "residuals": [{"table": "rows", "column": "F", "measured": str(file), "columns": ["t", "F"],
                           "sigma": 0.02}]}
        for begin, told in (0.48, False), (0, True):  # s
            file.write_text("t,F\n" + "".join(
                f"{t!r},{F!r}\n" for t, F in zip(rows["t"].tolist(), rows["F"].tolist()) if t >= begin))
            found = deform.fit(study, workers=2)
            self.assertEqual("mu and sigma0 cannot be told apart by these data" not in str(found.notes), told)

    def test_a_search_that_was_stopped_claims_nothing(self):
        study = self.study(self.measured())
        for start in 0.7, 0.95:
            study["parameters"]["mu"]["start"] = start
            for most in 1, 3, 7:
                found = deform.fit({**study, "optimizer": {"evaluations": most}}, workers=2)
                self.assertEqual(len(found.notes), 2, found.notes)
                self.assertRegex(found.notes[1],
                                 r"the search has not converged: (mu|v) is .* raise \"evaluations\"")
                self.assertLessEqual(found.evaluations, 1 + most + 8)  # the start, the search, two Jacobians

    def test_a_search_that_was_stopped_where_it_ends_has_converged(self):
        study = self.study(self.measured(SIGMA))
        for name, value in deform.fit(study, workers=2).values.items():
            study["parameters"][name]["start"] = value
        found = deform.fit({**study, "optimizer": {"evaluations": 1}}, workers=2)
        self.assertNotIn("converged", str(found))

    def test_a_global_search_that_stopped_at_once_goes_on_from_the_start(self):
        found = deform.fit(self.study(self.measured(), optimizer={"method": "differential_evolution",
                                                                  "evaluations": 1}), workers=2)
        self.assertAlmostEqual(found.values["mu"] / TRUTH["mu"], 1, delta=5e-3)
        self.assertRegex(found.notes[1], 'differential_evolution was stopped by "evaluations" after 1 points')

    def test_a_failing_run_beside_a_bound_is_told(self):
        study = read_study(self.study(self.measured()))
        study.parameters.pop()

        class Here(Problem):
            def find(self, many):
                n = len(study.residuals[0].measured)
                return [Failed("no more") if u[0] > 1e-3 else [np.full(n, u[0])] for u in many]

        for start in 0, 1e-10:
            with self.assertRaisesRegex(deform.Error, "the run at mu = 0.109 failed: no more"):
                Here(study, None, lambda _: None).jacobian(np.array([start]), 0.01)

    def test_rough_derivatives_name_their_parameter(self):
        """Of a speed on a logarithmic scale, by steps of a third and two thirds of it."""
        study = self.study(self.measured(SIGMA), optimizer={"step": 0.3}, set={MU: TRUTH["mu"]})
        study["parameters"].pop("mu")
        self.assertRegex("\n".join(deform.fit(study, workers=2).notes), "derivatives by v change by")

    def test_intervals_by_noise_that_lasts(self):
        """Residuals of a line with a correlation of 0.9 from one to the next."""
        random, n, trials, within = np.random.default_rng(2), 400, 200, 0
        jacobian = np.stack([np.ones(n), np.linspace(0, 1, n)], axis=1)
        for _ in range(trials):
            noise = random.standard_normal(n)
            for i in range(1, n):
                noise[i] = 0.9 * noise[i - 1] + math.sqrt(1 - 0.9 ** 2) * noise[i]
            off = np.linalg.lstsq(jacobian, noise, rcond=None)[0]
            spread = Spread(jacobian, [noise - jacobian @ off], 0.95)
            within += bool(np.all(np.abs(off) <= spread.half))
        self.assertGreater(within / trials, 0.85)

    def test_direction_of_many_parameters(self):
        p = 13
        jacobian = np.vstack([np.eye(p) - 1 / p, np.zeros((7, p))]) * 1e6
        names = [f"p{i}" for i in range(p)]
        said = Spread(jacobian, [np.ones(20)], 0.95).sentences(names)
        self.assertRegex(said[0], "p0, .* and p12 cannot be told apart by these data")

    def test_spread_of_a_linear_problem(self):
        """Against the closed form: y = a + b t with equal noise."""
        t = np.linspace(0, 1, 30)
        jacobian = np.stack([np.ones(30), t], axis=1)
        residuals = 0.3 * np.cos(40 * t)
        residuals -= jacobian @ np.linalg.lstsq(jacobian, residuals, rcond=None)[0]
        spread = Spread(jacobian, [residuals], 0.9)
        s2 = residuals @ residuals / 28
        inverse = np.linalg.inv(jacobian.T @ jacobian)
        np.testing.assert_allclose(spread.deviation, np.sqrt(s2 * np.diag(inverse)), rtol=1e-12)
        np.testing.assert_allclose(spread.correlation[0, 1],
                                   inverse[0, 1] / np.sqrt(inverse[0, 0] * inverse[1, 1]), rtol=1e-12)
        self.assertAlmostEqual(spread.quantile, 2.0484, 4)  # t(0.975, 28): 90 % for two at once
        exact = Spread(np.stack([t, 0 * t], axis=1), [0 * t], 0.9)  # the data that the model itself gave
        np.testing.assert_array_equal(exact.half, [0, np.inf])
        alike = Spread(np.stack([t, t * (1 + 1e-9)], axis=1) * 1e3, [residuals], 0.95)
        self.assertRegex(alike.sentences(["a", "b"])[0], r"a and b cannot be told apart .*a \+1.00, b -1.00")

    def test_a_scene_that_does_not_fit_says_so(self):
        study = self.study(self.measured())
        study["parameters"].pop("v")
        said = "\n".join(deform.fit(study, workers=2).notes)
        self.assertIn("times as large as sigma says", said)

    def test_measured_tables_of_other_programs(self):
        plain = self.measured().read_text()
        for encoded in b"\xef\xbb\xbf" + plain.encode(), b"# 20 \xb5m\n" + plain.encode():
            (self.folder / "other.csv").write_bytes(encoded)
            residual, = read_study(self.study(self.folder / "other.csv")).residuals
            np.testing.assert_array_equal(residual.measured, self.x)
        (self.folder / "other.csv").write_text("a,b\n1,2,3\n")
        with self.assertRaisesRegex(deform.FormatError, 'other.csv has no column "t"; it has a, b'):
            read_study(self.study(self.folder / "other.csv"))
        (self.folder / "other.csv").write_text("x" * 200000)
        with self.assertRaisesRegex(deform.FormatError, "other.csv: is no table: field larger than"):
            read_study(self.study(self.folder / "other.csv"))

    def test_a_study_called_fit_is_not_replaced(self):
        study = self.folder / "named" / "fit.json"
        study.parent.mkdir()
        study.write_text(json.dumps(self.study(self.measured())))
        before = study.read_text()
        with self.assertRaisesRegex(deform.FileError, "another program wrote this file"):
            deform.fit(study, out=study.parent, workers=1)
        self.assertEqual(study.read_text(), before)
        foreign = study.rename(study.with_name("fit.html"))
        study = {**self.study(self.measured()), "parameters": {"mu": {"at": MU, "from": 0.1, "to": 1}},
                 "set": {SPEED: TRUTH["v"]}}
        found = deform.fit(study, out=self.folder / "named", workers=1)
        with self.assertRaisesRegex(deform.FileError, "fit.html: another program wrote this file"):
            found.write()
        foreign.unlink()
        for _ in range(2):  # its own it replaces
            self.assertIn(self.folder / "named" / "fit.json", found.write())
        none = deform.UnsupportedError("no matplotlib", "DFM_E_UNSUPPORTED")
        with unittest.mock.patch.object(type(found), "figure", side_effect=none):
            found.write()
        self.assertFalse((self.folder / "named" / "fit.png").exists())  # of the call before

    def test_wrong_studies(self):
        def refused(sentence, **changes):
            study = {**self.study(self.measured()), **changes}
            with self.assertRaisesRegex(deform.Error, sentence):
                deform.fit(study, workers=1)

        one = self.study(self.measured())["residuals"][0]
        refused('/residuals: expected a list of 1 or more', residuals=[])
        refused('has no column "y"; it has t, x', residuals=[{**one, "columns": ["t", "y"]}])
        refused("/residuals/0/sigma: expected a number above 0", residuals=[{**one, "sigma": 0}])
        refused("lies outside of the range", parameters={"mu": {"at": MU, "from": 0.1, "to": 1, "start": 2}})
        refused("give a larger sigma", residuals=[{**one, "sigma": 1e-300}])
        refused("give a larger sigma", residuals=[{**one, "sigma": 1e-160}])
        residual, = read_study(self.study(self.measured())).residuals
        with self.assertRaisesRegex(Failed, 'several rows of the run have one time; .* by "where"'):
            _at_measured(residual, [[0, 0, 1], [1, 2, 3]])
        mu = {"mu": {"at": MU, "from": 0.1, "to": 1}}
        refused("cma searches in two dimensions", parameters=mu, optimizer={"method": "cma"})
        refused("make the run longer", set={"/time/duration": 0.1})
        refused("the run at mu = .* failed: .*mu",
                parameters={"mu": {"at": MU, "from": -2, "to": -1}})


class Examples(InAFolder):
    def command(self, *arguments):
        done = subprocess.run([os.environ["DEFORM_COMMAND"], *map(str, arguments)], capture_output=True,
                              text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def test_lugre_law_from_its_rig(self):
        said = self.command("fit", EXAMPLES / "lugre_fit.json", "--out", self.folder / "lugre", "--quiet")
        self.assertIn("sigma0", said)
        report = json.loads((self.folder / "lugre" / "fit.json").read_text())
        for row in report["parameters"]:
            true = make_measured.TRUTH[row["parameter"]]
            self.assertTrue(row["low"] <= true <= row["high"], row)
            self.assertLess(row["high"] - row["low"], 0.08 * true, row)
        self.assertIn("data:image/png;base64,", (self.folder / "lugre" / "fit.html").read_text())

    def test_springs_against_finite_elements(self):
        self.command("fit", EXAMPLES / "springs_fit.json", "--out", self.folder / "springs", "--quiet")
        report = json.loads((self.folder / "springs" / "fit.json").read_text())
        self.assertAlmostEqual(report["parameters"][0]["value"] / 1e6, 0.77, delta=0.005)
        self.assertLess(report["scatter"], 0.1)  # of 0.1 mm

    def test_measured_files_are_what_the_script_makes(self):
        subprocess.run([sys.executable, "-B", EXAMPLES / "make_measured.py", self.folder], check=True)
        for name in "springs_measured.csv", "lugre_measured.csv":
            self.assertEqual((self.folder / name).read_text(), (EXAMPLES / name).read_text())


if __name__ == "__main__":
    unittest.main()

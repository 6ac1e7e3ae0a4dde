"""Sweeps: designs, results that stay whatever ends a run, a worker or the sweep, tables, plots, exports."""
import contextlib
import csv
import importlib.util
import io
import json
import math
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import unittest.mock

import numpy as np

import deform
from deform._library import clear_own, refuse_foreign
from deform.study import __main__ as command_line, plots
from deform.study.design import points
from deform.study.engine import Engine, Failed, Results, take
from deform.study.executors import Dask
from deform.study.spec import read_study
from deform.study.sweep import task_of
from deform.study.tables import of_one_kind
from study_files import BOX, MU, SPEED, sweep_study, write_box

COMMAND = os.environ["DEFORM_COMMAND"]


def alive(pid):
    try:
        return bool(pathlib.Path(f"/proc/{pid}/cmdline").read_bytes())
    except OSError:
        return False


def workers_of(pid):
    """Processes of `deform worker` below a process, and the runs that they have forked."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and (entry / "cmdline").read_bytes().endswith(b"\0worker\0"):
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
                found.append((int(entry.name), parent))
        except OSError:
            continue
    own = {child for child, parent in found if parent == pid}
    return sorted(own | {child for child, parent in found if parent in own})


class InAFolder(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.scene, self.out, self.tmp = write_box(self.folder), self.folder / "out", self.folder / "tmp"
        self.tmp.mkdir()
        for patch in (unittest.mock.patch.dict(os.environ, TMPDIR=str(self.tmp)),
                      unittest.mock.patch.object(tempfile, "tempdir", str(self.tmp))):
            patch.start()
            self.addCleanup(patch.stop)
        self.addCleanup(lambda: self.assertEqual(list(self.tmp.glob("*deform-study-*")), []))

    def command(self, *arguments, code=0, **environment):
        done = subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, text=True,
                              cwd=self.folder, env={**os.environ, **environment})
        self.assertEqual(done.returncode, code, done.stderr + done.stdout)
        return done

    def here(self, *arguments, code=0):
        """The same in this process, which has imported what draws."""
        out, err = io.StringIO(), io.StringIO()
        with (unittest.mock.patch("signal.signal"), contextlib.redirect_stdout(out),
              contextlib.redirect_stderr(err),
              unittest.mock.patch.object(sys, "argv", ["deform", *map(str, arguments)])):
            self.assertEqual(command_line.main(), code, err.getvalue() + out.getvalue())
        return subprocess.CompletedProcess(arguments, code, out.getvalue(), err.getvalue())

    def study(self, **changes):
        path = self.folder / "study.json"
        path.write_text(json.dumps(sweep_study(self.scene, **changes)))
        return path


class Designs(InAFolder):
    def points(self, method, **changes):
        return points(read_study(sweep_study(self.scene, design={"method": method, **changes})))

    def test_grid_and_list(self):
        study = sweep_study(self.scene, design={"method": "grid"}, parameters={
            "mu": {"at": MU, "values": [0.1, 0.2]}, "v": {"at": SPEED, "from": 1, "to": 100, "scale": "log",
                                                            "count": 3}})
        grid = points(read_study(study))
        self.assertEqual([p["mu"] for p in grid], [0.1] * 3 + [0.2] * 3)
        for found, wanted in zip((p["v"] for p in grid), (1, 10, 100)):
            self.assertAlmostEqual(found, wanted, 12)
        study["design"]["method"] = "list"
        with self.assertRaisesRegex(deform.FormatError, "equally many: mu 2, v 3"):
            points(read_study(study))
        study["parameters"]["v"]["count"] = 2
        self.assertEqual([p["mu"] for p in points(read_study(study))], [0.1, 0.2])

    def test_samples_fill_their_ranges_and_repeat(self):
        for method in "random", "latin_hypercube", "sobol":
            rows = self.points(method, runs=64, seed=5)
            self.assertEqual(rows, self.points(method, runs=64, seed=5))
            self.assertNotEqual(rows, self.points(method, runs=64, seed=6))
            self.assertTrue(all(0.2 <= p["mu"] <= 0.9 and 0.1 <= p["v"] <= 0.5 for p in rows))
            if method == "random":
                continue
            cells = sorted(int((p["mu"] - 0.2) / 0.7 * 64) for p in rows)
            self.assertEqual(cells, list(range(64)), method)  # one in each of 64 layers
        self.assertEqual(len(self.points("sobol", runs=50)), 50)

    def test_whole_numbers_have_equal_shares(self):
        whole = {"at": MU, "from": 1, "to": 4, "whole": True}
        rows = points(read_study(sweep_study(self.scene, parameters={"n": whole},
                                             design={"method": "sobol", "runs": 64})))
        self.assertEqual([[p["n"] for p in rows].count(n) for n in range(6)], [0, 16, 16, 16, 16, 0])
        rows = points(read_study(sweep_study(self.scene, design={"method": "grid"},
                                             parameters={"n": {**whole, "count": 9}})))
        self.assertEqual([p["n"] for p in rows], [1, 2, 3, 4])

    def test_results_depend_on_the_files_that_a_study_names(self):
        def keys():
            study = read_study(sweep_study(self.scene, set={"/a": "fixed.txt"}, parameters={
                "m": {"at": "/mesh", "values": ["one.txt", "two.txt"]}}))
            return study.keys({"m": name} for name in study.parameters[0].values)

        self.scene.write_text(json.dumps({"about": "x" * 600, "mesh": "of_scene.txt"}))
        for name in "of_scene.txt", "fixed.txt", "one.txt", "two.txt":
            (self.folder / name).write_text(name)
        first = keys()
        (self.folder / "two.txt").write_text("changed")
        second = keys()
        self.assertEqual([a == b for a, b in zip(first, second)], [True, False])
        for name in "of_scene.txt", "fixed.txt":
            (self.folder / name).write_text("changed")
            third = keys()
            self.assertEqual(len({*second, *third}), 4)
            second = third

    def test_results_depend_on_files_that_are_read_with_the_named_one(self):
        self.scene.write_text(json.dumps({"mesh": "a.ele"}))
        study, keys = read_study(sweep_study(self.scene)), set()
        for n, name in enumerate(("a.ele", "a.node", "a.face", "a.node"), 1):
            (self.folder / name).write_text(str(n))
            keys.update(study.keys([{"mu": 0.3, "v": 0.5}]))
            self.assertEqual(len(keys), n)

    def test_each_file_is_read_once_for_all_points(self):
        for name in "a.node", "a.ele":
            (self.folder / name).write_text("")
        study = read_study(sweep_study(self.scene, parameters={
            "m": {"at": "/mesh", "values": ["a.ele", "a.node", "box.json"]}}))
        with unittest.mock.patch("deform.study.spec._of_file", return_value="0") as of_file:
            study.keys([{"m": name} for name in study.parameters[0].values] * 9)
        read = [call.args[0] for call in of_file.call_args_list]
        self.assertEqual(len([path for path in read if str(self.folder) in path]), 3)

    def test_results_depend_on_the_build(self):
        study, point = read_study(sweep_study(self.scene)), {"mu": 0.3, "v": 0.5}
        rebuilt = self.folder / "libdeform.so"
        rebuilt.write_bytes(deform.study.spec.PATH.read_bytes() + b"0")
        before = study.keys([point])
        with unittest.mock.patch("deform.study.spec.PATH", rebuilt):
            self.assertNotEqual(study.keys([point]), before)
        self.assertEqual(study.keys([point]), before)

    def test_values_may_be_numpys(self):
        of_lists, of_arrays = (
            points(read_study(sweep_study(self.scene, parameters={"n": {"at": MU, "values": values}})))
            for values in ([1, 2], np.array([1, 2])))
        self.assertEqual(of_arrays, of_lists)
        with self.assertRaisesRegex(deform.ArgumentError, "is no value of JSON"):
            read_study(sweep_study(self.scene, set={"/a": {1}}))

    def test_wrong_studies_say_where(self):
        for changes, sentence in (
                ({"parameters": {"mu": {"at": MU, "form": 1, "to": 2}}},
                 '/parameters/mu: unknown key "form"'),
                ({"parameters": {"mu": {"at": MU, "from": 2, "to": 1}}}, r'"from" \(2\) must be below'),
                ({"parameters": {"mu": {"at": "mu", "values": [1]}}}, "expected a JSON pointer"),
                ({"parameters": {"mu": {"at": MU, "from": 0, "to": 1, "scale": "log"}}}, "begins above 0"),
                ({"quantities": {"x": {"table": "probs", "column": "x"}}}, "expected one of .*probes"),
                ({"parameters": {"mu": {"at": MU, "values": [1], "whole": True}}},
                 '"values" and "whole" exclude'),
                ({"quantities": {"x": {"summary": "/steps", "take": "max"}}}, '"summary" and "take" exclude'),
                ({"quantities": {"mu": {"summary": "/steps"}}}, "is a parameter already"),
                ({"quantities": {"said": {"summary": "/steps"}}}, '"said" is a column of every sweep'),
                ({"parameters": {"a": {"at": MU, "values": [1]}, "b": {"at": MU, "values": [1]}}},
                 "/parameters/b: .*/mu is set by a already"),
                ({"parameters": {"n": {"at": MU, "from": 0.5, "to": 2, "whole": True}}}, '"whole" range'),
                ({"set": {"/a=1": 2}}, "/set: expected an object"),
                ({"limit_s": -1}, "/limit_s: expected a number above 0"),
                ({"scene": "none.json"}, "none.json: cannot be opened"),
                ({"scene": "a\udcff.json"}, "/scene: the path of this file is not UTF-8"),
                ({"design": {"method": "sobl"}}, "expected one of .*sobol"),
                ({"design": {"method": "random"}}, 'needs "runs"'),
                ({"design": {"method": "grid", "runs": 50}}, '/design: unknown key "runs"'),
                ({"parameters": {"mu": {"at": MU, "from": 1, "to": 2, "count": 3}}}, '"count" is of'),
                ({"optimizer": {"seed": 3}}, '/optimizer: unknown key "seed"'),
                ({"limit_s": 10**400}, "/limit_s: expected a number"),
                ({"limit_s": 1e10}, r"/limit_s: expected a number above 0 and at most 1e\+06"),
                ({"parameters": {"mu": {"at": [], "values": [1]}}}, "expected a JSON pointer"),
                ({"parameters": {"mu": {"at": MU, "from": -1e308, "to": 1e308}}}, "wider than numbers reach"),
                ({"parameters": {"mu": {"at": MU, "from": 1e-300, "to": 1e300, "scale": "log"}}},
                 "wider than numbers reach"),
                ({"optimizer": {"method": "differential_evolution", "seed": 2**32}},
                 "/optimizer/seed: expected a whole number, 0 to 4294967294"),
                ({"format": "deform-scene", "time": {}}, "this is a scene; a study names one"),
                ({"residuals": [{"measured": "m.csv", "sigma": 1, "table": "bodies", "column": "x",
                                 "columns": [["t"], "x"]}]}, "expected two names of columns")):
            with self.assertRaisesRegex(deform.FormatError, sentence):
                points(read_study({**sweep_study(self.scene), **changes}))


    def test_a_key_that_is_given_twice_is_refused(self):
        study = self.study()
        study.write_text(study.read_text().replace('"v": {', '"mu": {'))
        with self.assertRaisesRegex(deform.FormatError, 'the key "mu" is given twice in one object'):
            read_study(study)

    def test_planned_runs_depend_on_the_costs(self):
        costs = self.folder / "costs.json"
        with unittest.mock.patch.dict(os.environ, DEFORM_COSTS=str(costs)):
            plain, planned, pointed = (read_study(sweep_study(self.scene, **changes)) for changes in (
                {}, {"set": {"/accuracy": {"target": 0.1}}},
                {"parameters": {"ms": {"at": "/budget/ms_per_step", "values": [1]}}}))
            found = []
            for text in "1", "2":
                costs.write_text(text)
                point = {"mu": 1, "v": 1, "ms": 1}
                found.append([study.keys([point]) for study in (plain, planned, pointed)])
        self.assertEqual([a == b for a, b in zip(*found)], [True, False, False])


class Runs(InAFolder):
    def test_workers_may_have_any_descriptor(self):
        import resource
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        if hard < 1200:
            self.skipTest("fewer than 1200 files may be open")
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 1200), hard))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        with open(os.devnull) as null:
            held = [os.dup(null.fileno()) for _ in range(1050)]
        self.addCleanup(lambda: [os.close(one) for one in held])
        rows = deform.sweep(sweep_study(self.scene, design={"method": "random", "runs": 1}, limit_s=100),
                            out=self.out, workers=1)
        self.assertEqual(len(rows.done), 1)

    def test_box_slides_as_far_as_its_energy_takes_it(self):
        rows = deform.sweep(sweep_study(self.scene), out=self.out, workers=2)
        self.assertEqual(len(rows.done), 16)
        for row in rows:
            h, way = 0.002, row["v"] ** 2 / (2 * row["mu"] * 9.81)
            if row["v"] < 0.15 * row["mu"] * 9.81:  # comes to rest before the end
                self.assertAlmostEqual(row["slid"], way, delta=row["v"] * h)
            self.assertEqual(row["steps"], 100)
        self.assertIn("16 done, 0 failed", str(rows))

    def test_results_are_those_of_deform_run(self):
        row = deform.sweep(sweep_study(self.scene, design={"method": "sobol", "runs": 1}), out=self.out)[0]
        deform.command("run", self.scene, "--set", f"{MU}={row['mu']!r}", "--set", f"{SPEED}={row['v']!r}",
                       "--out", self.folder / "run", "--quiet")
        with open(self.folder / "run" / "bodies.csv", newline="") as file:
            path = [float(line["com_x"]) for line in csv.DictReader(file) if line["body"] == "box"]
        self.assertEqual(row["slid"], path[-1] - path[0])

    def test_failed_runs_keep_their_sentence_until_retried(self):
        study = sweep_study(self.scene, design={"method": "grid"}, parameters={
            "mu": {"at": MU, "values": [-0.1, 0.5]}})
        rows = deform.sweep(study, out=self.out, workers=1)
        self.assertEqual([row["state"] for row in rows], ["failed", "done"])
        self.assertIn("mu", rows[0]["said"])
        before = (self.out / "runs.jsonl").read_bytes()
        deform.sweep(study, out=self.out)
        self.assertEqual((self.out / "runs.jsonl").read_bytes(), before)
        deform.sweep(study, out=self.out, retry=True)
        self.assertEqual((self.out / "runs.jsonl").read_bytes().count(b"\n"), 3)
        study["quantities"] = {"far": {"table": "probes", "column": "x", "where": {"probe": "tip"}}}
        self.assertIn("no row of probes.csv", deform.sweep(study, out=self.out)[1]["said"])

    def test_results_of_another_scene_are_not_taken(self):
        study = sweep_study(self.scene, design={"method": "sobol", "runs": 2})
        deform.sweep(study, out=self.out)
        self.scene.write_text(json.dumps({**BOX, "gravity": [0, 0, -1.6]}))
        moon = deform.sweep(study, out=self.out)
        self.assertEqual(len((self.out / "runs.jsonl").read_text().splitlines()), 4)
        self.assertEqual(len(moon.done), 2)

    def test_quantities_in_another_order_keep_their_numbers(self):
        study = sweep_study(self.scene, design={"method": "sobol", "runs": 2})
        first = deform.sweep(study, out=self.out)
        study["quantities"] = dict(reversed(study["quantities"].items()))
        for row, turned in zip(first, deform.sweep(study, out=self.out)):
            self.assertEqual((row["slid"], row["steps"]), (turned["slid"], turned["steps"]))

    def test_a_run_that_takes_too_long_is_ended(self):
        study = sweep_study(self.scene, set={"/time/duration": 3000}, limit_s=0.5,
                            design={"method": "sobol", "runs": 1})
        said = deform.sweep(study, out=self.out)[0]["said"]
        self.assertIn("longer than limit_s (0.5 s)", said)

    def test_sentences_name_no_files_that_are_gone(self):
        engine = Engine()
        self.addCleanup(engine.close)
        run = f"{engine.folder}/run"
        for said, kept in (
                (f"a.json: stopped at step 3: no; the last good state is in {run}/states",
                 "a.json: stopped at step 3: no"),
                (f"{run}/bodies.csv: cannot be written: No space left on device",
                 "bodies.csv: cannot be written: No space left on device")):
            answer = {"code": 3, "signal": 0, "said": f"deform: {said}"}
            with unittest.mock.patch.object(engine, "_call", return_value=answer):
                outcome = engine.run(task_of(read_study(sweep_study(self.scene)), {"mu": 0.3, "v": 0.5}))
            self.assertEqual(outcome["said"], kept)

    def test_what_plugins_print_is_no_answer(self):
        engine = Engine()
        self.addCleanup(engine.close)
        engine.run(task_of(read_study(sweep_study(self.scene)), {"mu": 0.3, "v": 0.5}))
        for stream in 0, 1:
            self.assertEqual(os.readlink(f"/proc/{engine.process.pid}/fd/{stream}"), "/dev/null")

    def test_columns_hold_finite_numbers(self):
        (self.folder / "rows.csv").write_text("x\n1\nnan\n")
        with self.assertRaisesRegex(Failed, 'column "x" of rows.csv holds "nan", no number'):
            Results(self.folder, {}).column({"table": "rows", "where": {}}, "x")

    def test_lists_are_counted_from_0(self):
        results = Results(self.folder, {"probes": [1, 2]})
        self.assertEqual(results.read({"summary": "/probes/1"}), 2)
        with self.assertRaisesRegex(Failed, "the summary has no value /probes/-1"):
            results.read({"summary": "/probes/-1"})

    def test_rig(self):
        case = pathlib.Path(os.environ["DEFORM_SOURCE"]) / "examples" / "friction" / "braked_mass.json"
        study = {"rig": str(case), "design": {"method": "grid"},
                 "parameters": {"mu": {"at": "/params/mu", "values": [0.25, 0.5]}},
                 "quantities": {"stop": {"table": "rows", "column": "x", "unit": "m"}}}
        stops = [row["stop"] for row in deform.sweep(study, out=self.out)]
        self.assertAlmostEqual(stops[0], 1 / (2 * 0.25 * 10), delta=1e-3)
        self.assertAlmostEqual(stops[1], 1 / (2 * 0.5 * 10), delta=1e-3)


class Take(unittest.TestCase):
    def test_a_column_as_one_number(self):
        t = [0.1 * i for i in range(41)]
        wave = [3 + 2 * math.sin(2 * math.pi * x / 0.8) for x in t]
        for how, value in (("first", 3), ("last", wave[-1]), ("min", 1), ("max", 5), ("mean", sum(wave) / 41),
                           ("change", wave[-1] - 3), ("peak_to_peak", 4), ("period", 0.8)):
            self.assertAlmostEqual(take(wave, how, t), value, delta=2e-3, msg=how)
        self.assertTrue(math.isnan(take([0.0, 1.0], "period", t)))


class Kills(InAFolder):
    def test_killed_workers_lose_nothing(self):
        """200 runs; a worker or its run is killed after every 20th result."""
        study = sweep_study(self.scene, design={"method": "sobol", "runs": 200})
        choose, killed = random.Random(1), []

        def add(progress, failed):
            progress.done += 1
            while progress.done % 20 == 0:
                killed.append(choose.choice(workers_of(os.getpid()) or [0]))
                try:
                    if killed[-1]:
                        os.kill(killed[-1], choose.choice((signal.SIGKILL, signal.SIGTERM)))
                    break
                except ProcessLookupError:  # it was a run, and has ended
                    killed.pop()

        with unittest.mock.patch("deform.study.progress.Progress.add", add):
            rows = deform.sweep(study, out=self.out, workers=2)
        self.assertGreaterEqual(len([pid for pid in killed if pid]), 8)
        self.assertEqual(rows.failed, [])
        self.assertEqual(len(rows.done), 200)
        self.assertEqual(len({row["slid"] for row in rows}), 200)

    def started(self, study, **changes):
        """A sweep that has processes, and these."""
        sweep = subprocess.Popen([COMMAND, "sweep", study, "--out", self.out, "--quiet", "--workers", "2"],
                                 cwd=self.folder)
        self.addCleanup(sweep.wait)
        self.addCleanup(sweep.kill)
        return sweep

    def wait_until(self, what):
        end = time.monotonic() + 20
        while not what():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.005)

    def test_a_killed_sweep_goes_on(self):
        study = self.study(design={"method": "sobol", "runs": 20}, set={"/time/duration": 8})
        first, file = self.started(study), self.out / "runs.jsonl"
        self.wait_until(lambda: file.exists() and file.read_bytes().count(b"\n") >= 5)
        first.kill()
        first.wait()
        with open(file, "ab") as torn:
            torn.write(b'{"key": "half a li')
        kept = file.read_bytes().count(b"\n")
        said = self.command("sweep", study, "--out", self.out)
        self.assertIn("20 runs: 20 done", said.stdout)
        self.assertIn(f" of {20 - kept} runs, 0 failed, 0 s left", said.stderr)
        lines = [json.loads(line) for line in file.read_text().splitlines()]
        self.assertEqual(len({line["key"] for line in lines}), 20)
        self.assertEqual(len(lines), 20)

    def test_nothing_outlives_a_sweep(self):
        study = self.study(set={"/time/duration": 3000})
        for how in signal.SIGKILL, signal.SIGTERM, signal.SIGINT:
            sweep = self.started(study)
            self.wait_until(lambda: len(workers_of(sweep.pid)) == 4)
            there = workers_of(sweep.pid)
            sweep.send_signal(how)
            self.assertEqual(sweep.wait(20), -9 if how == signal.SIGKILL else 128 + how)
            self.wait_until(lambda: not any(map(alive, there)))
        self.assertEqual(list(self.tmp.glob("*deform-study-*")), [])  # of the first, by the second

    def test_nothing_outlives_an_error(self):
        study = sweep_study(self.scene, design={"method": "sobol", "runs": 128})
        before, errors = set(threading.enumerate()), []  # which keep the frames that they have left
        with unittest.mock.patch("deform.study.progress.Progress.add", side_effect=OSError):
            for _ in range(3):
                try:
                    deform.sweep(study, out=self.out, workers=2)
                except OSError as error:
                    errors.append(error)
        self.assertEqual(len(errors), 3)
        self.assertEqual(workers_of(os.getpid()), [])
        self.assertEqual(set(threading.enumerate()) - before, set())

    def test_what_kills_every_worker_is_a_failed_run(self):
        study = sweep_study(self.scene, set={"/time/duration": 3000}, design={"method": "sobol", "runs": 1})
        ended = threading.Event()

        def kill():
            while not ended.wait(0.01):
                for pid in workers_of(os.getpid()):
                    try:
                        os.kill(pid, signal.SIGKILL)
                    except ProcessLookupError:
                        pass

        killer = threading.Thread(target=kill)
        killer.start()
        try:
            said = deform.sweep(study, out=self.out, workers=1)[0]["said"]
        finally:
            ended.set()
            killer.join()
        self.assertIn("3 times in 3", said)


class Outputs(InAFolder):
    def test_map_of_points_that_repeat_shows_all_runs(self):
        try:
            from matplotlib.collections import PathCollection
        except ImportError:
            self.skipTest("no matplotlib")
        rows = [{"mu": mu, "v": v, "slid": i, "state": "done"}
                for i, (mu, v) in enumerate([(0.1, 1), (0.2, 2), (0.1, 1), (0.2, 2)])]
        parameters = read_study(self.study()).parameters
        shown = plots.maps(plots.Columns(rows, parameters, ["slid"], {})).axes[0].collections[0]
        self.assertIsInstance(shown, PathCollection)
        self.assertEqual(shown.get_array().tolist(), [0, 1, 2, 3])

    def test_files_of_others_stay_as_they_are(self):
        study = self.study(design={"method": "random", "runs": 1})
        for names, options in (
                (("sweep.csv", "sweep.html", "curves.png", "runs.jsonl", "runs/0-9.jsonl"), ()),
                (("runs/0-0.jsonl",), ("--only", "0")), (("Snakefile",), ("--export", "snakemake")),
                (("array.sh",), ("--export", "slurm"))):
            for name in names:
                foreign = self.out / name
                foreign.parent.mkdir(parents=True, exist_ok=True)
                foreign.write_text('{"mine": 1}\n{"mine": 2}')
                said = self.here("sweep", study, "--out", self.out, *options, code=2).stderr
                self.assertIn(f"{foreign}: another program wrote this file", said)
                self.assertEqual(foreign.read_text(), '{"mine": 1}\n{"mine": 2}')
                foreign.unlink()
            for _ in range(2):  # its own it replaces
                self.here("sweep", study, "--out", self.out, *options)

    def test_parquet_of_others_stays_as_it_is(self):
        study = self.study(design={"method": "random", "runs": 1})
        foreign = self.out / "sweep.parquet"
        foreign.parent.mkdir(parents=True, exist_ok=True)
        foreign.write_bytes(b"PAR1 mine PAR1")
        said = self.here("sweep", study, "--out", self.out, "--parquet", code=2).stderr
        self.assertIn(f"{foreign}: another program wrote this file", said)
        self.here("sweep", study, "--out", self.out)  # does not write it
        self.assertEqual(foreign.read_bytes(), b"PAR1 mine PAR1")
        foreign.write_bytes(b"PAR1" + bytes(3 << 20) + b"deform sweep" + bytes(100))
        refuse_foreign(foreign, "deform sweep")
        for data in b"", bytes(1 << 20) + b"mine" + bytes(1 << 20):  # has no mark: not its own
            foreign.write_bytes(data)
            clear_own(self.out, {"sweep.parquet": "deform sweep"}, [])
            self.assertEqual(foreign.read_bytes(), data)
        with self.assertRaises(deform.FileError):
            refuse_foreign(foreign, "deform sweep")
        foreign.unlink()
        foreign.mkdir()  # a partitioned data set
        clear_own(self.out, {"sweep.parquet": "deform sweep"}, [])

    def test_windows_is_refused_before_anything_is_made(self):
        for study in deform.sweep, deform.fit:
            with (unittest.mock.patch("os.name", "nt"),
                  self.assertRaisesRegex(deform.UnsupportedError, "need POSIX")):
                study(self.out / "study.json")
        self.assertFalse(self.out.exists())

    def test_columns_of_one_kind(self):
        self.assertEqual(of_one_kind([1, 0.5, None]), [1, 0.5, None])
        self.assertEqual(of_one_kind(["a", None]), ["a", None])
        self.assertEqual(of_one_kind([0.5, "auto", None]), ["0.5", "auto", None])

    def test_command_writes_tables_and_page(self):
        self.out.mkdir()
        (self.out / "sweep.parquet").write_bytes(b"of an earlier deform sweep")
        (self.out / "runs.jsonl").write_bytes(bytes(300))  # as a loss of power may leave it
        said = self.command("sweep", self.study(), "--out", self.out, "--workers", "2")
        self.assertIn("16 runs: 16 done, 0 failed", said.stdout)
        with open(self.out / "sweep.csv", newline="") as file:
            rows = list(csv.reader(file))
        self.assertEqual(rows[0][:4], ["mu [1]", "v [m/s]", "slid [m]", "steps"])
        self.assertEqual(len(rows), 17)
        page = (self.out / "sweep.html").read_text()
        self.assertEqual(page.count("data:image/png;base64,"), 3)
        self.assertNotIn("http", page)
        for name in "curves", "map", "parallel":
            self.assertEqual((self.out / f"{name}.png").read_bytes()[1:4], b"PNG")
        self.here("sweep", self.study(design={"method": "random", "runs": 1}), "--out", self.out)
        self.assertEqual(sorted(path.name for path in self.out.iterdir()),
                         ["runs.jsonl", "sweep.csv", "sweep.html"])

    def test_parquet_holds_units(self):
        study = self.study(design={"method": "sobol", "runs": 4})
        try:
            import pyarrow.parquet
        except ImportError:  # Debian 12 has no package of it
            said = self.command("sweep", study, "--out", self.out, "--parquet", code=2)
            self.assertRegex(said.stderr, "deform: Parquet needs pyarrow for .*sweep.csv\n$")
            self.assertTrue((self.out / "sweep.csv").exists())
            self.assertTrue((self.out / "sweep.html").exists())
            return
        for _ in range(2):  # its own it replaces
            self.command("sweep", study, "--out", self.out, "--parquet")
        table = pyarrow.parquet.read_table(self.out / "sweep.parquet")
        self.assertEqual(table.schema.field("v").metadata, {b"unit": b"m/s"})
        self.assertEqual(table.num_rows, 4)

    def test_parts_of_an_array_are_gathered(self):
        mu = [0.3 + 0.01 * i for i in range(10)]
        mu[3] = -1
        study = self.study(design={"method": "grid"}, parameters={"mu": {"at": MU, "values": mu}})
        self.command("sweep", study.name, "--out", self.out.name, "--export", "slurm")
        array = self.out / "array.sh"
        self.assertIn("#SBATCH --array=0-9", array.read_text())
        for ignored in (["--only", "3", "--parquet"], ["--export", "slurm", "--retry"],
                        ["--export", "slurm", "--workers", "2"]):
            said = self.here("sweep", study, "--out", self.out, *ignored, code=2)
            self.assertIn("omit one of the two", said.stderr)
        wide = self.folder / "my study.json"
        shutil.copy(study, wide)
        self.here("sweep", wide, "--out", self.folder / "wide", "--export", "slurm")
        self.assertIn("#SBATCH --job-name='my study'\n", (self.folder / "wide" / "array.sh").read_text())
        self.here("sweep", study, "--out", self.out, "--export", "snakemake")
        flow = (self.out / "Snakefile").read_text()
        compile(flow.split("rule")[0], "Snakefile", "exec")
        self.assertIn(f"    input: ['{study}', '{self.scene}']", flow)
        for i in range(0, 10, 3):
            done = subprocess.run(["sh", array], env={**os.environ, "SLURM_ARRAY_TASK_ID": str(i)},
                                  cwd="/", capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
        said = self.here("sweep", study, "--out", self.out, code=1)
        self.assertIn(" of 6 runs, 0 failed", said.stderr)
        self.assertIn("9 done, 1 failed", said.stdout)

    def test_dask(self):
        study = self.study(design={"method": "sobol", "runs": 8})
        if importlib.util.find_spec("distributed") is None:
            said = self.command("sweep", study, "--executor", "dask", code=2)
            self.assertIn("the executor dask needs dask.distributed", said.stderr)
            return
        said = self.command("sweep", study, "--out", self.out, "--executor", "dask", "--workers", "2")
        self.assertIn("8 runs: 8 done, 0 failed", said.stdout)
        with unittest.mock.patch("deform.study.executors.CONNECT", 1.0):
            with self.assertRaisesRegex(deform.ArgumentError, "no Dask scheduler answers at tcp://127"):
                deform.sweep(study, out=self.folder / "other", executor="dask", address="tcp://127.0.0.1:1")
        with Dask(1) as pool, self.assertRaisesRegex(deform.Error, "Dask cannot make runs: KeyError"):
            list(pool.map([{}]))

    def test_a_killed_worker_of_a_cluster_loses_nothing(self):
        """Through the address of a scheduler; the cluster starts another worker."""
        if importlib.util.find_spec("distributed") is None:
            return
        import distributed

        def clear():  # what is killed cannot remove its folder
            for left in self.tmp.glob("*deform-study-*"):
                shutil.rmtree(left)

        self.addCleanup(clear)
        study = sweep_study(self.scene, design={"method": "sobol", "runs": 40})
        killed = []
        with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
            def add(progress, failed):
                progress.done += 1
                if progress.done == 10:
                    killed.append(next(iter(cluster.workers.values())).pid)
                    os.kill(killed[0], signal.SIGKILL)

            with unittest.mock.patch("deform.study.progress.Progress.add", add):
                rows = deform.sweep(study, out=self.out, executor="dask", address=cluster.scheduler_address)
        self.assertEqual(len(killed), 1)
        self.assertEqual((rows.failed, len(rows.done)), ([], 40))
        self.assertEqual(len({row["slid"] for row in rows}), 40)

    def test_options_that_would_be_ignored(self):
        self.assertIn("address is of the executor dask",
                      self.command("sweep", self.study(), "--address", "tcp://127.0.0.1:1", code=2).stderr)
        with self.assertRaisesRegex(deform.ArgumentError, "has its own workers"):
            deform.sweep(sweep_study(self.scene), out=self.out, executor="dask", workers=2,
                         address="tcp://127.0.0.1:1")

    def test_files_with_a_byte_order_mark_and_any_name(self):
        scene = self.folder / "box_bom.json"
        scene.write_bytes(b"\xef\xbb\xbf" + self.scene.read_bytes())
        study = self.folder / "st\udcff.json"
        study.write_text("\ufeff" + json.dumps(sweep_study(scene, design={"method": "random", "runs": 1})))
        self.command("sweep", study, "--out", self.out)
        self.assertTrue((self.out / "sweep.html").exists())

    def test_command_says_what_is_missing(self):
        self.assertEqual(self.command("sweep", self.study(), "--out", self.scene / "out", code=2).stderr,
                         f"deform: {self.scene / 'out'}: Not a directory\n")
        self.assertRegex(self.command("sweep", self.folder / "none.json", code=2).stderr,
                         "^deform: .*none.json: cannot be opened")
        self.assertRegex(self.command("sweep", code=2).stderr, "STUDY.json .*--help")
        full = unittest.mock.Mock(side_effect=OSError(28, "Full"))
        with unittest.mock.patch.multiple(command_line, sweep=full), \
                unittest.mock.patch.multiple(sys, argv=["deform", "sweep", str(self.study())],
                                             stderr=io.StringIO()), \
                unittest.mock.patch("signal.signal"):
            self.assertEqual(command_line.main(), 2)
            self.assertEqual(sys.stderr.getvalue(), "deform: the results cannot be written: Full\n")
        said = self.command("sweep", "x", code=2, DEFORM_PYTHON="/no/python").stderr
        self.assertIn("the Python interpreter /no/python cannot be started", said)
        bare = self.folder / "python"
        bare.write_text(f'#!/bin/sh\nshift\nexec {sys.executable} -I -S "$@"\n')
        bare.chmod(0o755)
        said = self.command("sweep", "x", code=2, DEFORM_PYTHON=str(bare)).stderr
        self.assertRegex(said, "^deform: sweep: .*cannot import the Python package deform .*DEFORM_PYTHON\n$")


if __name__ == "__main__":
    unittest.main()

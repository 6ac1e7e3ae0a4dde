"""`deform contact`: the captured set (make_set.py), export to FCLIB, Siconos' text, damaged files."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

SET = pathlib.Path(os.environ["CONTACT_PROBLEMS"])


def contact(*words, expected=0):
    run = subprocess.run([os.environ["DEFORM_COMMAND"], "contact", "--json", *map(str, words)],
                         capture_output=True, text=True)
    assert run.returncode == expected, run.stderr + run.stdout[-2000:]
    return json.loads(run.stdout), run.stderr


class ContactProblems(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_every_problem_of_the_set_is_solved_in_no_more_steps_than_before(self):
        found, _ = contact(SET)
        self.assertEqual([p["file"] for p in found["problems"] if not p["solved"]], [])
        self.assertGreaterEqual(len(found["problems"]), 500)
        for kind in found["kinds"][:2]:
            with self.subTest(kind["kind"]):
                self.assertGreater(kind["read"], 100)
                for what, (mean, most) in MOST[kind["kind"]].items():
                    self.assertLessEqual(kind[what][0], mean, what)
                    self.assertLessEqual(kind[what][1], most, what)

    def test_exported_problems_come_back_and_have_the_same_size_rank_and_a_solution(self):
        files = [f for f in sorted(SET.glob("*.contact")) if f.name.startswith(("stack3-", "groove45-mu0.5"))]
        captured, _ = contact("--export", self.folder, *files)
        exported, _ = contact(self.folder)
        self.assertGreaterEqual(len(files), 8)
        self.assertEqual(len(exported["problems"]), len(files))
        self.assertTrue({True, False} <= {p["implicit"] for p in captured["problems"]})
        for before, after in zip(captured["problems"], exported["problems"]):
            with self.subTest(before["file"]):
                self.assertEqual(before["contacts"], after["contacts"])
                self.assertEqual(before["rank"], after["rank"])
                self.assertLess(after["error"], 1e-8)

    def test_exports_replace_neither_each_other_nor_problems(self):
        problem = sorted(SET.glob("stack3-*.contact"))[0]
        runs = [self.folder / name for name in ("first", "second")]
        for run in runs:
            run.mkdir()
            shutil.copy(problem, run / "000001.contact")
        found, said = contact("--export", self.folder, *runs, expected=1)
        self.assertEqual(found["refused"], 1)
        self.assertIn(f"{runs[1]}/000001.contact: not exported: ", said)
        self.assertIn(f"is that of {runs[0]}/000001.contact", said)
        exported = self.folder / "000001.hdf5"
        before = exported.read_bytes()
        _, said = contact("--export", self.folder, exported, expected=1)
        self.assertIn("would replace", said)
        self.assertEqual(exported.read_bytes(), before)

    def test_what_holds_no_contacts_is_refused(self):
        (self.folder / "a.dat").write_text("3\n0\n0 0 0 0 0\n")
        (self.folder / "b.dat").write_text("3 1 0 3 3 3 3 0.5 0 0 0 0.5 0 0 0 0.5 -1 3 4 10")
        found, said = contact(self.folder, expected=1)
        self.assertIn("a.dat: there are no contacts to solve", said)
        self.assertEqual([problem["solved"] for problem in found["problems"]], [True])
        (self.folder / "none").mkdir()
        empty = subprocess.run([os.environ["DEFORM_COMMAND"], "contact", "--json", str(self.folder / "none")],
                               capture_output=True, text=True)
        self.assertEqual((empty.returncode, empty.stdout), (2, ""))

    def test_text_of_siconos_is_read_dense_in_blocks_and_global(self):
        # one contact of a mass of 2 that moves at (-1, 3, 4): it sticks at mu 10, and slides at 0.5
        dense = "3 1 0 3 3 3 3 0.5 0 0 0 0.5 0 0 0 0.5 "
        blocks = "3 1 1 3 3 1 1 1 3 3 2 1 0 1 0 0 0.5 0 0 0 0.5 0 0 0 0.5 "
        world = "3 1 0 3 3 3 3 2 0 0 0 2 0 0 0 2 0 3 3 3 3 1 0 0 0 1 0 0 0 1 -2 6 8 0 0 0 "
        motion = "-1 3 4 "
        for name, text in (("dense", dense + motion), ("blocks", blocks + motion), ("GFC3D", world)):
            for mu in ("10", "0.5"):
                (self.folder / f"{name}{mu}.dat").write_text(text + mu + "\n")
        found, _ = contact(self.folder)
        self.assertEqual(len(found["problems"]), 6)
        for p in found["problems"]:
            self.assertEqual((p["contacts"], p["rank"], p["solved"]), (1, 3, True), p["file"])

    def test_damaged_files_are_refused_with_a_sentence_and_the_others_are_solved(self):
        whole = sorted(SET.glob("stack3-*.contact"))[0].read_bytes()
        for k in range(24):
            (self.folder / f"short{k}.contact").write_bytes(whole[:len(whole) * k // 24])
        (self.folder / "longer.contact").write_bytes(whole + b"0")
        (self.folder / "whole.contact").write_bytes(whole)
        (self.folder / "no.hdf5").write_bytes(b"no")
        (self.folder / "no.dat").write_bytes(b"3 1 0 3")
        found, said = contact(self.folder, expected=1)
        self.assertEqual([pathlib.Path(p["file"]).stem for p in found["problems"]], ["whole"])
        self.assertEqual(found["refused"], 27)
        self.assertEqual(len(said.splitlines()), 27)

    def test_what_is_no_file_is_bad_input(self):
        run = subprocess.run([os.environ["DEFORM_COMMAND"], "contact", self.folder], capture_output=True,
                             text=True)
        self.assertEqual(run.returncode, 2)
        self.assertIn("no contact problem", run.stderr)


# Mean and most of a kind.
MOST = {"explicit": {"passes": (3.56, 11), "steps": (5.65, 42), "products": (16.7, 230)},
        "implicit": {"passes": (4.74, 36), "steps": (10.8, 217), "products": (50.3, 1523)}}

if __name__ == "__main__":
    unittest.main()

"""The command from Python: its sentences as exceptions, its tables as rows."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import deform

SCENES = pathlib.Path(os.environ["DEFORM_SOURCE"]) / "examples" / "scenes"


class Command(unittest.TestCase):
    def test_cost_gives_a_table(self):
        with tempfile.TemporaryDirectory(suffix=" with space") as folder:
            scene = json.loads((SCENES / "slope_block.json").read_text())
            scene["time"]["duration"] = 1.0
            scene["bodies"][0]["mesh"] = str(SCENES.parent / "data" / "block.msh")
            short = pathlib.Path(folder) / "short.json"
            short.write_text(json.dumps(scene))
            table = deform.cost(short, budget=40, axes=["time"], out=folder)
            self.assertEqual(json.loads((pathlib.Path(folder) / "cost.json").read_text()), table.report)
        self.assertIn("integrator", table.columns)
        self.assertEqual(len(table.column("error")), len(table))
        self.assertTrue(all(row["state"] == "done" for row in table.front))
        printed, front = str(table).splitlines(), str(table.front).splitlines()
        rows = printed.index(next(line for line in printed if line.startswith("label ")))
        self.assertEqual(len(printed), rows + 1 + len(table))
        reference = table.report["choices"][table.report["reference"]["choice"]]["label"]
        for said in printed[1], front[0]:
            self.assertTrue(said.startswith(f"reference: {reference} ("), said)
            self.assertIn("; its own error ", said)
            self.assertEqual("NOT CONVERGED" in said, not table.report["reference"]["converged"], said)
        self.assertTrue(printed[0].startswith("error of "), printed[0])
        self.assertEqual(table._repr_html_().count("<tr>"), 1 + len(table))

    def test_sentences_are_exceptions(self):
        with self.assertRaisesRegex(deform.ArgumentError, "^none.json: cannot be opened"):
            deform.cost("none.json")
        with self.assertRaisesRegex(deform.ArgumentError, "--axes|axis"):
            deform.cost(SCENES / "slope_block.json", axes=["tyme"], budget=1)
        with self.assertRaisesRegex(deform.Error, "rnu"):
            deform.command("rnu")

    def test_warnings_are_logged(self):
        with self.assertLogs("deform", "WARNING") as said:
            deform.friction("coulomb", mux=1)
        self.assertRegex(said.output[0], "left out: mux")

    def test_explain(self):
        self.assertIn("stable", deform.explain(SCENES / "slope_block.json"))

    def test_console_script_becomes_the_command(self):
        done = subprocess.run([sys.executable, "-B", "-c", "from deform._command import main; main()",
                               "plugin", "list"], capture_output=True, text=True, check=True)
        self.assertIn("org.deform.lugre", done.stdout)

    def test_demo_leaves_what_others_wrote(self):
        for name in ("summary.json", "two_cylinders.png"):
            with tempfile.TemporaryDirectory() as folder:
                file = pathlib.Path(folder) / name
                file.write_text('{"picture": "mine.png"}')
                done = subprocess.run([sys.executable, "-B", "-m", "deform", "demo", folder], text=True,
                                      capture_output=True, check=False)
                self.assertIn(f"{name}: another program wrote this file", done.stderr)
                self.assertEqual([*pathlib.Path(folder).iterdir()], [file])
                self.assertEqual(file.read_text(), '{"picture": "mine.png"}')

    def test_demo_without_a_renderer_is_the_table(self):
        with tempfile.TemporaryDirectory() as folder:
            command, out = pathlib.Path(folder) / "deform.py", pathlib.Path(folder) / "out"
            command.write_text(f"#!{sys.executable}\nimport shutil, subprocess, sys\n"
                               "call = ['-B', '-m', 'deform', *sys.argv[1:], '--time', '0.01']\n"
                               "subprocess.run([sys.executable, *call], check=True)\n"
                               "shutil.rmtree(sys.argv[sys.argv.index('--out') + 1] + '/frames')\n")
            command.chmod(0o755)
            demo = pathlib.Path(deform.__file__).parent / "demo.py"
            done = subprocess.run([sys.executable, "-B", demo, command, SCENES / "two_cylinders.json", out],
                                  text=True, capture_output=True, check=True)
            self.assertRegex(done.stdout, r"(?m)^moved \(m\) +0\.\d+ +0\.\d+$")
            self.assertIn("no picture (see above)", done.stdout)
            self.assertFalse((out / "two_cylinders.png").exists())


if __name__ == "__main__":
    unittest.main()

"""What a type checker sees of the package: annotations in its sources (py.typed), and no stub files beside
them. That every public function has them is asked of the package itself; that they say what they should, of
mypy, where it is installed."""
import inspect
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import typing
import unittest

import deform

# A comment `wrong` marks the lines that mypy must refuse.
PROGRAM = """import numpy as np
import deform

with deform.World(gravity=(0, 0, -1), integrator="implicit_euler") as world:
    mesh = deform.TetMesh.ball(0.1, cells=100)
    ball: deform.Body = world.add_body(mesh, position=[0, 0, 1], material={"young": 2e5})
    points: np.ndarray = ball.positions
    trouble: deform.Trouble = world.step(0.01)
    time: float = world.time
    run: deform.Run = deform.run("scene.json", set={"/gravity": [0, 0, -1]})
    ball.posittions  # wrong
    world.step("soon")  # wrong
    world.add_body(mesh, position=3)  # wrong
    world.add_body(mesh, positoin=(0, 0, 1))  # wrong
    deform.World(integrator=1)  # wrong
    text: str = world.time  # wrong
    deform.run("scene.json", watch=3)  # wrong
"""


def public():
    """(name, function) of all that the package offers, methods included."""
    for name in deform.__all__:
        thing = getattr(deform, name)
        if inspect.isfunction(thing):
            yield name, thing
        elif inspect.isclass(thing) and thing.__module__.startswith("deform"):
            for key, member in vars(thing).items():
                member = getattr(member, "__func__", getattr(member, "fget", member))
                own = inspect.isfunction(member) and member.__module__.startswith("deform")
                if own and (not key.startswith("_") or key in ("__init__", "__enter__")):
                    yield f"{name}.{key}", member


class Typing(unittest.TestCase):
    def test_every_public_function_is_annotated(self):
        seen = 0
        for name, function in public():
            for parameter in inspect.signature(function).parameters.values():
                if parameter.name not in ("self", "cls"):
                    self.assertIsNot(parameter.annotation, parameter.empty, f"{name}: {parameter.name}")
            if not name.endswith("__init__"):
                self.assertIn("return", function.__annotations__, name)
            seen += 1
        self.assertGreater(seen, 150)

    def test_annotations_name_what_is_there(self):
        for name, function in public():
            try:
                typing.get_type_hints(function, localns=vars(deform))  # names of other modules, too
            except NameError as error:
                self.fail(f"{name}: {error}")

    def test_checker_takes_what_is_right_and_refuses_what_is_wrong(self):
        if subprocess.run([sys.executable, "-c", "import mypy"], capture_output=True).returncode:
            self.skipTest("no mypy (cmake/deps.txt)")
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder) / "program.py"
            program.write_text(PROGRAM)
            done = subprocess.run(
                [sys.executable, "-m", "mypy", "--ignore-missing-imports", "--no-site-packages",
                 "--no-error-summary", "--cache-dir", folder, program],
                capture_output=True, text=True, cwd=folder,
                env={**os.environ, "MYPYPATH": str(pathlib.Path(deform.__file__).parents[1])})
        refused = {int(n) for n in re.findall(r"program\.py:(\d+): error", done.stdout)}
        wrong = {i for i, line in enumerate(PROGRAM.split("\n"), 1) if line.endswith("# wrong")}
        self.assertEqual(refused, wrong, done.stdout + done.stderr)
        self.assertNotRegex(done.stdout, r"deform/\w+\.py:\d+: error")  # nor is one in the package itself


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/env python3
"""wheel.py DEFORM WHEELS FOLDER [PYTHON]: the wheel for Windows asks for nothing but what Windows has. PYTHON
is one of Windows (python.exe) that has NumPy: under Wine it imports the wheel's files, runs a scene to the
native command's state, meets an error as an exception, and starts the command that came with it."""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import zipfile

SCENE = pathlib.Path(__file__).resolve().parents[2] / "examples/scenes/two_cylinders.json"
OF_WINDOWS = {"advapi32", "kernel32", "msvcrt", "shell32", "ws2_32"}
PROGRAM = """
import deform, json, sys
with deform.Scene(sys.argv[1]) as scene:
    scene.run(0.02)
    state = f"{scene.world.hash:016x}"
try:
    deform.TetMesh.ball(-1)
    said = ""
except deform.ArgumentError as error:
    said = str(error)
options = "--json", "--quiet", "--time", 0.02, "--out", sys.argv[2]
command = json.loads(deform.command("run", sys.argv[1], *options))
print(json.dumps([state, said, command["state_hash"], deform.template_dir().is_dir()]))
"""


def main():
    command, wheels, folder = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]) / "wheel ü"
    wheel = max(wheels.glob("deform-*-py3-none-win_amd64.whl"), key=lambda path: path.stat().st_mtime)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    with zipfile.ZipFile(wheel) as files:
        files.extractall(folder / "files")
    programs = [path for path in (folder / "files").rglob("*") if path.suffix in (".dll", ".exe")]
    said = subprocess.run(["objdump", "-p", *programs], capture_output=True, text=True, check=True).stdout
    asked = {name.lower() for name in re.findall(r"DLL Name: (\S+)\.dll", said, re.I)}
    assert asked <= OF_WINDOWS | {"libdeform"}, asked
    print(f"{wheel.name}: {len(programs)} programs and libraries, which ask for {', '.join(sorted(asked))}")
    if len(sys.argv) < 5:
        return print("not imported: -DDEFORM_WINDOWS_PYTHON names no python.exe")

    (folder / "files" / "program.py").write_text(PROGRAM)  # its folder is where modules are looked for
    done = subprocess.run(["wine", sys.argv[4], "-X", "utf8", "files/program.py", SCENE, "out ß"], cwd=folder,
                          stdin=subprocess.DEVNULL, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, (done.stdout, done.stderr)
    state, refused, by_command, templates = json.loads(done.stdout)
    native = json.loads(subprocess.run([command, "run", SCENE, "--json", "--quiet", "--time", "0.02", "--out",
                                        folder / "native"], capture_output=True, check=True).stdout)
    assert state == by_command == native["state_hash"], (state, by_command, native["state_hash"])
    assert refused and templates, (refused, templates)
    print(f"the same state {state} by Python and the command of Windows and by the native command")


if __name__ == "__main__":
    main()

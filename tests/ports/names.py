#!/usr/bin/env python3
"""names.py DEFORM.exe FOLDER: the command under Wine in a folder whose name has spaces and letters beyond
ASCII: scene, mesh, results and a saved state are read and written, a second run waits for none, and what the
build lacks is said in one sentence."""
import json
import pathlib
import shutil
import subprocess
import sys

SCENES = pathlib.Path(__file__).resolve().parents[2] / "examples/scenes"


def main():
    command, folder = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]) / "mit Leerzeichen ü 中"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)

    def deform(*words, code=0):
        done = subprocess.run(["wine", command, *words], cwd=folder, capture_output=True, encoding="utf-8")
        assert done.returncode == code, (words, done.returncode, done.stderr)
        return done.stdout if code == 0 else done.stderr

    deform("mesh", "make", "ball", "--radius", "0.1", "--cells", "500", "--out", "Kugel ñ.vtu")
    scene = json.loads((SCENES / "slope_block.json").read_text())
    scene["bodies"][0]["mesh"] = "Kugel ñ.vtu"
    (folder / "Szene ä.json").write_text(json.dumps(scene))
    run = "run", "Szene ä.json", "--json", "--time", "0.05"
    whole = json.loads(deform(*run, "--save", "0.02", "Stand ß.state"))
    rest = json.loads(deform(*run, "--from", "Stand ß.state"))
    assert whole["state_hash"] == rest["state_hash"], "a state goes on to another one"
    assert (folder / "out/Szene ä/summary.json").exists()
    deform("run", "Szene ä.json", "--quiet", "--time", "0.01", "--save-scene", "Kopie é.json")
    deform("run", "Kopie é.json", "--quiet", "--time", "0.02")
    deform("rollback", "Szene ä.json", "--time", "0.01")
    assert "Kugel ñ.vtu" in deform("mesh", "info", "Kugel ñ.vtu")
    assert "fehlt ü.vtu: cannot be opened: No such file" in deform("mesh", "info", "fehlt ü.vtu", code=2)
    for program in ("ccd", "rollback"):
        assert f"deform {program} --help" in deform(program, code=2), program
    for absent in ("sweep", "fit", "cost", "calibrate", "friction", "serve", "view", "contact",
                   "explain --costs", "mesh from-labels", "mesh phantom"):
        assert "the build for Windows has none" in deform(*absent.split(), "x", code=2), absent
    return 0


if __name__ == "__main__":
    sys.exit(main())

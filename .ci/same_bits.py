#!/usr/bin/env python3
"""Runs the same scenes with the commands of several builds and asks for one state hash per scene.

same_bits.py BUILD_DIR...    each holds bin/deform
"""
import json
import pathlib
import subprocess
import sys
import tempfile

# Scenes with simulated seconds: short, since -O0 runs them too, but long enough for contacts to come, stick and slide.
SCENES = {"two_cylinders": 0.05, "ten_bodies": 0.05, "slope_block": 0.05}


def state_hash(build, scene, seconds, folder, threads):
    out = pathlib.Path(folder) / f"{pathlib.Path(build).name}_{scene}_{threads}"
    done = subprocess.run([f"{build}/bin/deform", "run", f"examples/scenes/{scene}.json", "--out", out, "--time", str(seconds),
                           "--threads", str(threads), "--quiet"], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{build}: {scene} ended with exit code {done.returncode}: {done.stderr}")
    summary = json.loads((out / "summary.json").read_text())
    return summary["state_hash"], summary["contacts"]["max"]


def main():
    differ = False
    with tempfile.TemporaryDirectory() as folder:
        for scene, seconds in SCENES.items():
            runs = {(build, threads): state_hash(build, scene, seconds, folder, threads) for build in sys.argv[1:] for threads in (1, 2)}
            for (build, threads), (value, contacts) in runs.items():
                print(f"{scene:16} {build:16} threads {threads}  {value}  contacts {contacts}")
            if len({value for value, _ in runs.values()}) != 1:
                differ = True
                print(f"{scene}: the hashes differ")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())

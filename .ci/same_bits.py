#!/usr/bin/env python3
"""Runs every shipped scene with the commands of several builds, the first one on one thread and the others on
two, and asks for one state hash per scene.

same_bits.py BUILD_DIR...    each holds bin/deform
"""
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import tempfile

# few, since a build with sanitizers runs them too; scenes start near enough for contacts to come, stick and
# slide by then
STEPS = 200


def state_hash(build, scene, folder, threads):
    out = pathlib.Path(folder) / f"{pathlib.Path(build).name}_{scene.stem}_{threads}"
    step = json.loads(scene.read_text())["time"]["step"]
    seconds = STEPS * step if isinstance(step, float) else 0.02
    done = subprocess.run([f"{build}/bin/deform", "run", scene, "--out", out, "--time", str(seconds),
                           "--threads", str(threads), "--quiet"], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{build}: {scene} ended with exit code {done.returncode}: {done.stderr}")
    summary = json.loads((out / "summary.json").read_text())
    return summary["state_hash"], summary["contacts"]["max"]


def main():
    differ, touched = False, False
    with tempfile.TemporaryDirectory() as folder, \
            concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        started = {}
        first, *others = sys.argv[1:]
        kinds = [(first, 1), *((build, 2) for build in others)]
        for scene in sorted(pathlib.Path("examples/scenes").glob("*.json")):
            started[scene] = {(build, threads): pool.submit(state_hash, build, scene, folder, threads)
                              for build, threads in kinds}
        for scene, runs in started.items():
            runs = {key: run.result() for key, run in runs.items()}
            for (build, threads), (value, contacts) in runs.items():
                print(f"{scene.stem:24} {build:16} threads {threads}  {value}  contacts {contacts}")
                touched |= contacts > 0
            if len({value for value, _ in runs.values()}) != 1:
                differ = True
                print(f"{scene.stem}: the hashes differ")
    if not touched:
        print("no scene made a contact within its steps: nothing was compared that matters")
    return 1 if differ or not touched else 0


if __name__ == "__main__":
    sys.exit(main())

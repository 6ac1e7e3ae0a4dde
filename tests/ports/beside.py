#!/usr/bin/env python3
"""beside.py DEFORM OTHER [SCENE ...] [--by "PROGRAM ..."] [--time T] [--runs N]: the shipped scenes by
the command and by its build for another system, which node, qemu or wine runs, each on one thread: steps per
second of both, and whether the state has the same hash at the end. Exit code 1 where one differs."""
import argparse
import json
import pathlib
import shlex
import subprocess
import sys
import tempfile

SCENES = pathlib.Path(__file__).resolve().parents[2] / "examples/scenes"


def run(command, scene, time):
    """The summary of deform run."""
    options = ["--json", "--quiet", "--threads", "1", "--time", str(time)]
    with tempfile.TemporaryDirectory() as out:  # one folder takes one run at a time
        words = [*command, "run", scene, "--out", out, *options]
        done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: {done.stderr}")
    return json.loads(done.stdout)


def host_of(scene):
    return json.loads(scene.read_text()).get("rigid", {}).get("host", "builtin")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("native")
    parser.add_argument("other")
    parser.add_argument("scenes", nargs="*", type=pathlib.Path)
    parser.add_argument("--by", default="", help="what runs the other one")
    parser.add_argument("--time", type=float, default=1.0, help="s, simulated")
    parser.add_argument("--runs", type=int, default=1, help="of each; the fastest counts")
    options = parser.parse_args()
    scenes = options.scenes or [s for s in sorted(SCENES.glob("*.json")) if host_of(s) == "builtin"]
    differ = 0
    print("| scene | steps/s | other | times slower | hash |\n|---|---:|---:|---:|---|")
    for scene in scenes:
        native, other = (min((run(command, scene, options.time) for _ in range(options.runs)),
                            key=lambda summary: summary["wall_s"])
                        for command in ([options.native], [*shlex.split(options.by), options.other]))
        same = native["state_hash"] == other["state_hash"]
        differ += not same
        speed = [r["steps"] / r["wall_s"] for r in (native, other)]
        print(f"| {scene.stem} | {speed[0]:,.0f} | {speed[1]:,.0f} | {speed[0] / speed[1]:.1f} | "
              f"{'same' if same else native['state_hash'] + ', ' + other['state_hash']} |", flush=True)
    return 1 if differ or not scenes else 0


if __name__ == "__main__":
    sys.exit(main())

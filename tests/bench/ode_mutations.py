#!/usr/bin/env python3
"""Scenes with host "ode" with numbers replaced by extremes, each run in a process of its own: exit codes, and
every run that ended otherwise than by 0, 2 or 3. The short version is tests/adapters/ode/mutated_test.cpp.

ode_mutations.py DEFORM [RUNS [FIRST_SEED]]    from the top of the repository
"""
import collections
import concurrent.futures
import json
import pathlib
import random
import subprocess
import sys
import tempfile

EXTREMES = [0, -1, 1e-12, 1e-6, 1e6, 1e9, 1e15, 1e200, -1e15, 1e-200, 1e30, -1e6, 2, 0.5]
SCENES = sorted(pathlib.Path("examples/scenes").glob("ode_*.json"))
LIMIT_S = 60


def numbers(tree, pointer=()):
    """Places of all numbers in a tree."""
    if isinstance(tree, (dict, list)):
        for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
            yield from numbers(value, (*pointer, key))
    elif isinstance(tree, (int, float)) and not isinstance(tree, bool):
        yield pointer


def mutated(scene, seed):
    """A scene with one or two numbers replaced, and which."""
    draw = random.Random(seed)
    tree = json.loads(scene.read_text())
    places = [p for p in numbers(tree) if p[0] not in ("version", "time")]
    changed = []
    for _ in range(draw.choice([1, 1, 1, 2])):
        *way, last = draw.choice(places)
        at = tree
        for key in way:
            at = at[key]
        at[last] = draw.choice(EXTREMES)
        changed.append(f"/{'/'.join(map(str, (*way, last)))}={at[last]}")
    for body in tree.get("bodies", []):
        body["mesh"] = str((scene.parent / body["mesh"]).resolve())
    return tree, changed


def run(deform, scene, seed):
    tree, changed = mutated(scene, seed)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "scene.json")
        path.write_text(json.dumps(tree))
        try:
            done = subprocess.run([deform, "run", path, "--quiet", "--time", "0.03", "--out",
                                   f"{folder}/out"], capture_output=True, text=True,
                                  timeout=LIMIT_S)
            return scene.stem, seed, changed, done.returncode, done.stderr.strip()
        except subprocess.TimeoutExpired:
            return scene.stem, seed, changed, "no end", ""


def main():
    deform, runs, first = (sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 100,
                           int(sys.argv[3]) if len(sys.argv) > 3 else 1)
    codes = collections.Counter()
    with concurrent.futures.ThreadPoolExecutor() as pool:
        jobs = [pool.submit(run, deform, scene, seed) for scene in SCENES
                for seed in range(first, first + runs)]
        for job in jobs:
            scene, seed, changed, code, sentence = job.result()
            codes[code] += 1
            if code not in (0, 2, 3):
                print(scene, seed, *changed, code, sentence[:200])
    print(dict(codes))
    return 1 if any(code not in (0, 2, 3) for code in codes) else 0


if __name__ == "__main__":
    sys.exit(main())

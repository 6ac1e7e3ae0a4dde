#!/usr/bin/env python3
"""What a run of `deform sweep` costs beside its steps, its scene's reading and its tables included: many
short runs on two workers; the least of several rounds.

sweep_overhead.py BUILD_DIR [SOURCE_DIR] [RUNS]    prints milliseconds a run: of the clock, of the processors
"""
import os
import pathlib
import resource
import sys
import tempfile
import time

build = pathlib.Path(sys.argv[1]).resolve()
source = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else pathlib.Path(__file__).parents[2]).resolve()
runs = int(sys.argv[3]) if len(sys.argv) > 3 else 1000
os.environ["DEFORM_LIBRARY"] = str(build / "lib" / "libdeform.so.0")
os.environ["DEFORM_COMMAND"] = str(build / "bin" / "deform")
sys.path[:0] = [str(source / "bindings" / "python"), str(source / "tests" / "python")]

import deform  # noqa: E402
from study_files import sweep_study, write_box  # noqa: E402

WORKERS, ROUNDS = 2, 3


def spent():
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def measure(folder, seed):
    study = sweep_study(write_box(folder), design={"method": "random", "runs": runs, "seed": seed},
                        quantities={"cpu": {"summary": "/cpu_s", "unit": "s"}})
    clock, before = time.monotonic(), spent()
    rows = deform.sweep(study, out=folder / "out", workers=WORKERS)
    steps = sum(row["cpu"] for row in rows)
    return (time.monotonic() - clock - steps / WORKERS) / runs, (spent() - before - steps) / runs


with tempfile.TemporaryDirectory() as scratch:
    found = []
    for seed in range(ROUNDS):
        folder = pathlib.Path(scratch) / str(seed)
        folder.mkdir()
        found.append(measure(folder, seed))
print("clock_ms,processor_ms")
print(",".join(f"{1e3 * min(values):.2f}" for values in zip(*found)))

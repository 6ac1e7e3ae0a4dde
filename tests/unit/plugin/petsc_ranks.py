"""solver_petsc with two ranks of MPI: answers of the solver and of runs are those of one process, and no job
stays when its first process fails."""
import csv
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

MPIRUN, PLUGIN, UNIT, DEFORM = sys.argv[1:]
SCENE = {"format": "deform-scene", "version": 1, "gravity": [0, 0, -9.81],
         "time": {"duration": 0.3, "step": 1 / 60, "integrator": "implicit_euler"},
         "solver": {"tolerance": 1e-9},
         "materials": {"tissue": {"density": 1000, "young": 2e4, "poisson": 0.3}},
         "bodies": [{"name": "block", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.2], "cells": 600},
                     "material": "tissue", "model": {"type": "corotational_fem"},
                     "pose": {"position": [0, 0, 0.03]}}],
         "obstacles": [{"name": "floor", "shape": "plane"}],
         "contact": {"friction": [{"between": ["block", "floor"], "law": "coulomb", "params": {"mu": 0.3}}]},
         "probes": [{"name": "tip", "body": "block", "point": [0.1, 0.1, 0.2]}], "output": {"every": 0.1}}
# OMPI_*: as root, and more ranks than processors
ENVIRONMENT = {**os.environ, "DEFORM_PLUGIN_PATH": str(pathlib.Path(PLUGIN).parent),
               "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OMPI_ALLOW_RUN_AS_ROOT": "1",
               "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1"}
TWO = [MPIRUN, "-n", "2"]


def run(folder, solver, *before, **other):
    """The last place of the probe."""
    scene = folder / "scene.json"
    scene.write_text(json.dumps({**SCENE, "solver": {**SCENE["solver"], "type": solver}, **other}))
    out = folder / "out"
    done = subprocess.run([*before, DEFORM, "run", scene, "--out", out, "--quiet"], env=ENVIRONMENT,
                          capture_output=True, text=True, timeout=120)
    if other:
        return done
    if done.returncode or done.stdout or done.stderr:
        sys.exit(f"{solver} {before}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    with open(out / "probes.csv", newline="") as rows:
        return [float(value) for value in list(csv.reader(rows))[-1][2:5]]


def running():
    """Processes of this test's program for the other ranks."""
    program = str(pathlib.Path(PLUGIN).parent / "deform-petsc-rank")
    return [pid for pid in os.listdir("/proc") if pid.isdigit()
            and pathlib.Path(f"/proc/{pid}/cmdline").exists()
            and pathlib.Path(f"/proc/{pid}/cmdline").read_bytes().decode().startswith(program)]


with tempfile.TemporaryDirectory() as name:
    here = pathlib.Path(name)
    subprocess.run([*TWO, UNIT, "--gtest_filter=*Petsc_Equals*:*Petsc_Matrix*"], env=ENVIRONMENT, check=True,
                   timeout=120)
    own = run(here, "ldlt")
    for solver in ("petsc_gamg", "petsc_hypre", "petsc_mumps"):
        for ranks in ([], TWO):
            place = run(here, solver, *ranks)
            if max(abs(a - b) for a, b in zip(place, own)) > 1e-6:   # m; the block is 0.2 m high
                sys.exit(f"{solver} with {ranks}: {place} instead of {own}")
    failed = run(here, "petsc_gamg", *TWO, bodies=[{"name": "block", "mesh": "missing.msh"}])
    if failed.returncode != 2:
        sys.exit(f"a scene with a mesh that is not there: exit code {failed.returncode}\n{failed.stderr}")
    long = {**SCENE, "solver": {"type": "petsc_gamg"}, "time": {**SCENE["time"], "duration": 1000}}
    (here / "long.json").write_text(json.dumps(long))
    # the first process gets a rank, and becomes a shell that says its own number
    shell = f'[ $PMIX_RANK = 0 ] && echo $$ >"{here}/root"; exec "$0" "$@"'
    job = subprocess.Popen([*TWO, "sh", "-c", shell, DEFORM, "run", here / "long.json", "--out", here / "long",
                            "--quiet"], env=ENVIRONMENT, stderr=subprocess.DEVNULL)
    until = time.monotonic() + 60
    while not running() and time.monotonic() < until:
        time.sleep(0.05)
    time.sleep(1)
    os.kill(int((here / "root").read_text()), signal.SIGKILL)
    if job.wait(60) == 0 or running():
        sys.exit("the other rank stays, or the job says that it was done")
print("one and two ranks agree; no rank stays")

"""solver_petsc, alone and with two ranks of MPI: answers of the solver, of a fall on the floor and of an
equilibrium are those of `ldlt`, and no job stays when its first process fails."""
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
FALL = {"format": "deform-scene", "version": 1, "gravity": [0, 0, -9.81],
        "time": {"duration": 0.15, "step": 1 / 60, "integrator": "implicit_euler"},
        "materials": {"tissue": {"density": 1000, "young": 2e4, "poisson": 0.3}},
        "bodies": [{"name": "block", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.2], "cells": 200},
                    "material": "tissue", "model": {"type": "corotational_fem"},
                    "pose": {"position": [0, 0, 0.03]}}],
        "obstacles": [{"name": "floor", "shape": "plane"}],
        "contact": {"friction": [{"between": ["block", "floor"], "law": "coulomb", "params": {"mu": 0.3}}]},
        "probes": [{"name": "tip", "body": "block", "point": [0.1, 0.1, 0.2]}], "output": {"every": 0.05}}
HELD = {**FALL, "time": {"duration": 1, "step": 0.5, "mode": "static"}, "obstacles": [], "contact": {},
        "bodies": [{**FALL["bodies"][0], "pose": {}, "fix": [{"box": [[-1, -1, -1], [1, 1, 0.001]]}]}]}
# OMPI_*: as root, and more ranks than processors
ENVIRONMENT = {**os.environ, "DEFORM_PLUGIN_PATH": str(pathlib.Path(PLUGIN).parent),
               "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OMPI_ALLOW_RUN_AS_ROOT": "1",
               "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1",
               "OMPI_MCA_btl_vader_single_copy_mechanism": "none"}   # containers warn where they forbid it
TWO = [MPIRUN, "-n", "2"]


def command(folder, scene, solver):
    """Of a run that writes to folder/out."""
    file = folder / "scene.json"
    file.write_text(json.dumps({**scene, "solver": {"type": solver, "tolerance": 1e-9}}))
    return [DEFORM, "run", file, "--out", folder / "out", "--quiet"]


def place(folder, scene, solver, ranks):
    """The last one of the probe."""
    done = subprocess.run(ranks + command(folder, scene, solver), env=ENVIRONMENT, capture_output=True,
                          text=True, timeout=300)
    if done.returncode or done.stdout or done.stderr:
        sys.exit(f"{solver} {ranks}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    with open(folder / "out" / "probes.csv", newline="") as rows:
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
                   timeout=300)
    for scene in (FALL, HELD):
        own = place(here, scene, "ldlt", [])
        for solver in ("petsc_gamg", "petsc_hypre", "petsc_mumps"):
            for ranks in ([], TWO):
                found = place(here, scene, solver, ranks)
                if max(abs(a - b) for a, b in zip(found, own)) > 1e-6:   # m; the block is 0.2 m high
                    sys.exit(f"{solver} with {ranks}: {found} instead of {own}")
    missing = {**FALL, "bodies": [{**FALL["bodies"][0], "mesh": "missing.msh"}]}
    failed = subprocess.run(TWO + command(here, missing, "petsc_gamg"), env=ENVIRONMENT, capture_output=True,
                            timeout=300)
    if failed.returncode != 2:
        sys.exit(f"a scene whose mesh is not there: exit code {failed.returncode}, {failed.stderr}")
    long = {**FALL, "time": {**FALL["time"], "duration": 1000}}
    shell = f'[ $PMIX_RANK = 0 ] && echo $$ >"{here}/root"; exec "$0" "$@"'   # keeps its number
    job = subprocess.Popen([*TWO, "sh", "-c", shell, *command(here, long, "petsc_gamg")], env=ENVIRONMENT,
                           stderr=subprocess.DEVNULL)
    until = time.monotonic() + 300
    while not running() and time.monotonic() < until:
        time.sleep(0.05)
    time.sleep(1)
    try:
        os.kill(int((here / "root").read_text()), signal.SIGKILL)
        if job.wait(300) == 0 or running():
            sys.exit("the other rank stays, or the job says that it was done")
    finally:
        job.kill()
print("one and two ranks agree; no rank stays")

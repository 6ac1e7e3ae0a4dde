#!/usr/bin/env python3
"""`make bench-peers`: deform beside MuJoCo and Bullet on the friction benchmark, then speed at equal error.

  bench_peers.py DEFORM FOLDER

MuJoCo goes into a virtual environment in FOLDER. Rows go to FOLDER/friction_benchmark.csv, tables and the
picture beside them; a run that was stopped goes on. What is missing ends it with one sentence.
"""
import os
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
FRICTION = os.path.join(HERE, os.pardir, "friction")


def stop(why):
    sys.exit("bench-peers: " + why)


def environment(folder):
    """The python of a virtual environment that has MuJoCo, made where there is none."""
    python = os.path.join(folder, "bin", "python")
    known = os.path.exists(python) and subprocess.run([python, "-c", "import mujoco, numpy, matplotlib"],
                                                      capture_output=True).returncode == 0
    if known:
        return python
    if subprocess.run([sys.executable, "-m", "venv", folder], capture_output=True).returncode:
        stop("no virtual environment can be made; install python3-venv")
    pip = [python, "-m", "pip", "install", "--quiet", "mujoco", "numpy", "matplotlib"]
    if subprocess.run(pip).returncode:
        stop("pip does not get mujoco, numpy and matplotlib; is there a network?")
    return python


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    command, folder = (os.path.abspath(path) for path in sys.argv[1:])
    if not os.access(command, os.X_OK):
        stop("%s: no such command; build it with `make demo`" % command)
    if not shutil.which("pkg-config") or subprocess.run(["pkg-config", "--exists", "bullet"]).returncode:
        stop("pkg-config does not find Bullet; install pkg-config and libbullet-dev")
    os.makedirs(folder, exist_ok=True)
    python = environment(os.path.join(folder, "venv"))
    rows = os.path.join(folder, "friction_benchmark.csv")
    one = {**os.environ, "OMP_NUM_THREADS": "1"}
    for engine in ("deform", "bullet", "mujoco"):
        subprocess.run([python, "-B", os.path.join(FRICTION, "run.py"), engine, "--command", command, "--out",
                        rows], check=True, env=one)
    for script, out, more in ((os.path.join(FRICTION, "table.py"), "table.txt", []),
                              (os.path.join(HERE, "speed.py"), "speed.txt",
                               ["--picture", os.path.join(folder, "speed.png")])):
        text = subprocess.run([python, "-B", script, rows, *more], check=True, capture_output=True,
                              text=True).stdout
        with open(os.path.join(folder, out), "w") as f:
            f.write(text)
    print("%s: rows, table.txt, speed.txt, speed.png" % folder)


if __name__ == "__main__":
    main()

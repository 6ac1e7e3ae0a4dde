#!/usr/bin/env python3
"""`make bench-peers`: deform beside MuJoCo, Bullet and Jolt: the friction benchmark and scenes.py.

  bench_peers.py DEFORM FOLDER

MuJoCo goes into a virtual environment in FOLDER, Jolt into its node_modules; without npm Jolt is left out.
Each engine runs in a process of its own, one thread each, side by side as the processors allow. Rows go to
FOLDER/rows, tables and pictures beside; a run that was stopped goes on. What is missing ends it with one
sentence.
"""
import concurrent.futures
import os
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
FRICTION = os.path.join(HERE, os.pardir, "friction")
JOLT = "jolt-physics@1.1.0"  # the version that scenes_jolt.py was written for


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


def has_jolt(folder):
    if os.path.exists(os.path.join(folder, "node_modules", "jolt-physics", "package.json")):
        return True
    if not shutil.which("npm") or not shutil.which("node"):
        print("bench-peers: Jolt is left out; it needs nodejs and npm", flush=True)
        return False
    npm = ["npm", "install", "--silent", "--no-audit", "--no-fund", "--prefix", folder, JOLT]
    if subprocess.run(npm).returncode:
        print("bench-peers: Jolt is left out; npm does not get %s" % JOLT, flush=True)
        return False
    return True


def chain(python, command, folder, engine, environ):
    """All runs of one engine, scenes first."""
    for script, table in ((os.path.join(HERE, "run_scenes.py"), "scenes"),
                          (os.path.join(FRICTION, "run.py"), "friction")):
        if engine == "jolt" and table == "friction":
            continue
        rows = os.path.join(folder, "rows", "%s_%s.csv" % (table, engine))
        with open(os.path.join(folder, "rows", "%s_%s.log" % (table, engine)), "a") as log:
            call = [python, "-B", script, engine, "--command", command, "--out", rows]
            if subprocess.run(call, env=environ, stdout=log, stderr=log).returncode:
                return "%s did not end well; see %s" % (engine, log.name)
        print("bench-peers: %s, %s: done" % (engine, table), flush=True)
    return ""


def joined(folder, table, engines):
    """One file from those of the engines."""
    lines = []
    for engine in engines:
        path = os.path.join(folder, "rows", "%s_%s.csv" % (table, engine))
        if os.path.exists(path):
            with open(path) as f:
                told = f.read().splitlines(keepends=True)
            lines += told if not lines else told[1:]
    out = os.path.join(folder, {"friction": "friction_benchmark.csv", "scenes": "scenes.csv"}[table])
    with open(out, "w") as f:
        f.writelines(lines)
    return out


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    command, folder = (os.path.abspath(path) for path in sys.argv[1:])
    if not os.access(command, os.X_OK):
        stop("%s: no such command; build it with `make demo`" % command)
    if not shutil.which("pkg-config") or subprocess.run(["pkg-config", "--exists", "bullet"]).returncode:
        stop("pkg-config does not find Bullet; install pkg-config and libbullet-dev")
    os.makedirs(os.path.join(folder, "rows"), exist_ok=True)
    python = environment(os.path.join(folder, "venv"))
    engines = ["deform", "mujoco", "bullet"] + (["jolt"] if has_jolt(folder) else [])
    environ = {**os.environ, "OMP_NUM_THREADS": "1", "JOLT": folder}
    workers = min(len(engines), max(1, (os.cpu_count() or 2) - 1))
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        ends = list(pool.map(lambda engine: chain(python, command, folder, engine, environ), engines))
    friction, scenes = (joined(folder, table, engines) for table in ("friction", "scenes"))
    for script, rows, out, more in (
            (os.path.join(FRICTION, "table.py"), friction, "friction.txt", []),
            (os.path.join(HERE, "speed.py"), friction, "speed.txt",
             ["--picture", os.path.join(folder, "speed.png")]),
            (os.path.join(HERE, "fronts.py"), scenes, "scenes.txt",
             ["--picture", os.path.join(folder, "scenes.png")])):
        text = subprocess.run([python, "-B", script, rows, *more], check=True, capture_output=True,
                              text=True).stdout
        with open(os.path.join(folder, out), "w") as f:
            f.write(text)
    print("%s: scenes.txt, scenes.png, friction.txt, speed.txt, speed.png; rows in the .csv" % folder)
    if any(ends):
        stop("; ".join(filter(None, ends)))


if __name__ == "__main__":
    main()

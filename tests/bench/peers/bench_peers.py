#!/usr/bin/env python3
"""`make bench-peers`: deform beside MuJoCo, Bullet and Jolt: the friction benchmark and scenes.py.

  bench_peers.py DEFORM FOLDER [all|quick [JOBS]]

quick: the coarse meshes of the scenes and the sliding block of the friction benchmark, at most 10 s of
processor time for a run; into FOLDER/quick.

MuJoCo goes into a virtual environment in FOLDER, Jolt into its node_modules; without npm Jolt is left out.
Each engine runs in a process of its own, one thread each, JOBS of them side by side. Rows go to
FOLDER/rows, tables and pictures beside; a stopped run continues. A line shows which runs are under way
and how long it will take. What is missing ends it with one sentence.
"""
import argparse
import concurrent.futures
import os
import shutil
import subprocess
import sys
import threading

import progress
import scenes
from scenes import friction_cases

HERE = os.path.dirname(os.path.abspath(__file__))
FRICTION = os.path.join(HERE, os.pardir, "friction")
# the versions that the entries were written for
JOLT, MUJOCO = "jolt-physics@1.1.0", "mujoco==4.0.0"
ENGINES = ["deform", "mujoco", "bullet", "jolt"]
QUICK = {"most": {"scenes": 10, "friction": 10}, "friction": ("slope_slide",)}


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
    print("bench-peers: MuJoCo, numpy and matplotlib go into %s" % folder, flush=True)
    pip = [python, "-m", "pip", "install", "--quiet", MUJOCO, "numpy", "matplotlib"]
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


def chain(python, command, folder, engine, environ, quick):
    """All runs of one engine, scenes first."""
    for script, table in ((os.path.join(HERE, "run_scenes.py"), "scenes"),
                          (os.path.join(FRICTION, "run.py"), "friction")):
        if engine == "jolt" and table == "friction":
            continue
        rows = os.path.join(folder, "rows", "%s_%s.csv" % (table, engine))
        with open(os.path.join(folder, "rows", "%s_%s.log" % (table, engine)), "a") as log:
            call = [python, "-B", script, engine, "--command", command, "--out", rows]
            if quick:
                call += ["--most", str(QUICK["most"][table])]
                call += ["--coarse"] if table == "scenes" else [
                    part for case in QUICK["friction"] for part in ("--only", case)]
            if subprocess.run(call, env=environ, stdout=log, stderr=log).returncode:
                return "%s did not end well; see %s" % (engine, log.name)
    return ""


def plans(engines, quick):
    """{engine: its runs in their order}"""
    whole = {"scenes": scenes.MOST_SECONDS, "friction": friction_cases.MOST_SECONDS}
    most = QUICK["most"] if quick else whole
    chosen = {"scenes": scenes.coarse_cases() if quick else scenes.cases(),
              "friction": [case for case in friction_cases.cases()
                           if not quick or case["name"] in QUICK["friction"]]}
    return {engine: [run for table, cases in chosen.items() if (engine, table) != ("jolt", "friction")
                     for run in progress.plan(table, engine, cases, most[table])] for engine in engines}


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
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", metavar="DEFORM")
    parser.add_argument("folder", metavar="FOLDER")
    parser.add_argument("which", nargs="?", choices=["all", "quick"], default="all")
    parser.add_argument("jobs", nargs="?", type=int, default=os.cpu_count() or 1)
    given = parser.parse_args()
    command, folder = os.path.abspath(given.command), os.path.abspath(given.folder)
    quick = given.which == "quick"
    if not os.access(command, os.X_OK):
        stop("%s: no such command; build it with `make demo`" % command)
    if not shutil.which("pkg-config") or subprocess.run(["pkg-config", "--exists", "bullet"]).returncode:
        stop("pkg-config does not find Bullet; install pkg-config and libbullet-dev")
    os.makedirs(folder, exist_ok=True)
    python = environment(os.path.join(folder, "venv"))
    engines = [engine for engine in ENGINES if engine != "jolt" or has_jolt(folder)]
    environ = {**os.environ, "OMP_NUM_THREADS": "1", "JOLT": folder}
    workers = max(1, min(len(engines), given.jobs))
    folder = os.path.join(folder, "quick") if quick else folder
    os.makedirs(os.path.join(folder, "rows"), exist_ok=True)
    # the longest first: the others fill the rest
    runs = plans(engines, quick)
    engines.sort(key=lambda engine: -sum(run.seconds for run in runs[engine]))
    watch, over = progress.Progress(runs, folder, workers), threading.Event()
    under_way, ended = set(), set()

    def go(engine):
        under_way.add(engine)
        end = chain(python, command, folder, engine, environ, quick)
        under_way.discard(engine)
        ended.add(engine)
        return end

    def tell():
        while not over.wait(2):
            watch.tell(set(under_way), set(ended))

    print("bench-peers: %s (Ctrl-C stops it; the same command continues)" % watch.line(()), flush=True)
    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        ends = list(pool.map(go, engines))
    over.set()
    teller.join()
    engines.sort(key=ENGINES.index)
    friction, scenes = (joined(folder, table, engines) for table in ("friction", "scenes"))
    for script, rows, out, more in (
            (os.path.join(FRICTION, "table.py"), friction, "friction.txt", []),
            (os.path.join(HERE, "speed.py"), friction, "speed.txt",
             ["--picture", os.path.join(folder, "speed.png")]),
            (os.path.join(HERE, "fronts.py"), scenes, "scenes.txt",
             ["--pictures", folder])):
        text = subprocess.run([python, "-B", script, rows, *more], check=True, capture_output=True,
                              text=True).stdout
        with open(os.path.join(folder, out), "w") as f:
            f.write(text)
    print("\n%s: scenes.txt, a picture per scene, friction.txt, speed.txt, speed.png; rows in the .csv" %
          folder)
    if any(ends):
        stop("; ".join(filter(None, ends)))


if __name__ == "__main__":
    main()

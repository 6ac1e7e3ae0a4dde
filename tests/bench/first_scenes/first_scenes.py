#!/usr/bin/env python3
"""Random first scenes (cases.py), run at the defaults and judged; a row each. Rows that the table has are
left alone, so that the run may be stopped and taken up again.

first_scenes.py DEFORM_COMMAND TABLE.csv [--first SEED] [--scenes N] [--seconds S] [--jobs N] [--only TEXT]
                [--machine M --compiler C --commit HASH] [--keep FOLDER]
    N scenes (200) from a seed (1) on; a run that takes more than S seconds of processor time (20) is
    interrupted and judged by what it has. --keep leaves scenes and results in a folder, by seed and case.

failed: the run stopped (exit), is not finite, two surfaces cross, a body's center of mass is below the
floor, faster than anything falls, or takes over a minute of processor time for a second (slow; two minutes
from 2,000 cells on), a block sinks by another amount than its weight, slides or holds against Coulomb's law,
a ball does not come back, a grasper does not lift. noted: what the run itself warns of: contact solves at
their limit of sweeps (from 5 % on), a surface that crosses itself without self contact, a body that its own
weight presses flat or that has half or one and a half times its volume, vibrations that the step drops, and
creep above 1 um/s of contacts that stick. A body that still settles, with bristles that stretch by less and
less, looks like one that creeps: such a scene runs again, four times as long, and creeps if it still does
in the last half of that; else it settles. Exits with 1 if a scene failed.
"""
import argparse
import collections
import concurrent.futures
import csv
import json
import math
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

from cases import G, make

NOTED = ("unconverged", "folds", "volume", "creeps", "settles", "collapses",
         "step too long to bounce")
CREEP, LONGER = 1, 4  # um/s; times the duration
COLUMNS = ("seed", "case", "models", "step", "cells", "exit", "simulated_s", "cpu_s_per_s", "unconverged",
           "crossing", "self_crossing", "creep_um_per_s", "expected", "failed", "noted", "says", "machine",
           "compiler", "commit")


def run(command, path, out, seconds, *more):
    """Exit code and what the run says; interrupted after so many seconds of processor time."""
    with open(path.with_suffix(".err"), "w+") as err:
        words = [command, "run", path, "--out", out, "--quiet", "--check", "--threads", "1", *more]
        child = subprocess.Popen(words,
                                 stdout=subprocess.DEVNULL,
                                 stderr=err)
        interrupted = None
        while child.poll() is None:
            time.sleep(0.02)
            try:
                stat = pathlib.Path(f"/proc/{child.pid}/stat").read_text().rsplit(")", 1)[1].split()
            except (OSError, IndexError):
                continue
            if interrupted is None and sum(map(int, stat[11:13])) > seconds * os.sysconf("SC_CLK_TCK"):
                child.send_signal(signal.SIGINT)
                interrupted = time.monotonic()
            if interrupted is not None and time.monotonic() - interrupted > 120:
                child.kill()
        err.seek(0)
        return child.returncode, " ".join(err.read().split())


def rows_of(out, body):
    with open(out / "bodies.csv") as table:
        return [{key: float(value)
                 for key, value in row.items() if key != "body" and value} for row in csv.DictReader(table)
                if row["body"] == body]


def place(row):
    return [row["com_x"], row["com_y"], row["com_z"]]


def against_physics(scene, out):
    """What the scene's own expectations say of the run."""
    problems = []
    for e in scene.expect:
        rows = rows_of(out, e["body"])
        first, last = rows[0], rows[-1]
        if e["what"] == "sinks":  # less than a free column where friction holds its foot
            e["found"], e["wanted"] = e["height"] / 2 - last["com_z"], e["u"]
            slack = 2e-3 * e["height"]
            if not 0.5 * e["u"] - slack < e["found"] < 1.35 * e["u"] + slack:
                problems.append("sinks wrongly")
        elif e["what"] == "slope":
            a = G * (math.sin(e["angle"]) - e["mu"] * math.cos(e["angle"]))
            e["found"], e["wanted"] = math.dist(place(first), place(last)), max(0, a / 2 * last["t"]**2)
            if abs(e["found"] - e["wanted"]) > 0.005 + 0.1 * e["wanted"]:
                problems.append("slides wrongly")
        elif e["what"] == "bounces":  # of the speed of impact
            e["found"], e["wanted"] = max(row["vel_z"] for row in rows) / e["speed"], 1
            if not 0.25 < e["found"] < 1.02:
                problems.append("rebounds wrongly")
        elif e["what"] == "moves up":
            e["found"], e["wanted"] = last["com_z"] - first["com_z"], e["by"]
            if e["found"] < e["wanted"]:
                problems.append("does not rise")
    return problems


def judge(scene, code, summary, out):
    """Problems of a run, by word."""
    if code not in (0, 130):
        yield f"exit {code}"
    if not summary:
        return
    told = lambda words: any(words in warning for warning in summary["warnings"])
    cells = sum(body.get("cells", 0) for body in summary["bodies"].values())
    if summary["cpu_s"] > (60 if cells < 2000 else 120) * max(summary["simulated_s"], 1e-9):
        yield "slow"
    if not summary["finite"]:
        yield "not finite"
    contact = scene.doc.get("contact", {})
    own = summary["intersections_self_max"] if contact.get("self") else 0
    if summary["intersections_between_max"] + own and contact.get("guard", True):
        yield "crossing"
    elif summary["intersections_self_max"]:
        yield "folds"
    if summary["unconverged_steps"] > 0.05 * summary["substeps"]:
        yield "unconverged"
    law = contact.get("friction", [{}])[0].get("law")
    if (summary["hold"]["creep_max_um_per_s"] or 0) > CREEP and law not in ("dahl", "lugre", "none"):
        yield "creeps"
    if any(not 0.5 < body["volume_ratio"] < 1.5 for body in summary["bodies"].values()):
        yield "volume"
    for name in [b["name"] for b in scene.doc["bodies"] + scene.doc.get("rigid", {}).get("bodies", [])]:
        rows = rows_of(out, name)
        if scene.floor is not None and "gravity" not in scene.doc and rows and \
                min(row["com_z"] for row in rows) < scene.floor:
            yield "collapses" if told("own weight") else "below floor"
        if any(math.hypot(row["vel_x"], row["vel_y"], row["vel_z"]) > 3 * G * row["t"] + 10 for row in rows):
            yield "too fast"
    if code == 0:
        for problem in against_physics(scene, out):
            dropped = problem == "rebounds wrongly" and told("Nyquist")
            yield "step too long to bounce" if dropped else problem


def settles(command, scene, path, options):
    """Whether what sticks creeps no more in the last half of a longer run."""
    out = path.parent / "longer"
    run(command, path, out, LONGER * options.seconds, "--time", str(LONGER * scene.doc["time"]["duration"]))
    if not (out / "summary.json").exists():
        return False
    return (json.loads((out / "summary.json").read_text())["hold"]["creep_max_um_per_s"] or 0) <= CREEP


def short(value):
    return f"{value:.4g}" if isinstance(value, float) else value


def row_of(command, seed, options, folder):
    case, scene = make(seed)
    folder = folder / f"{seed:04d}_{case.replace(':', '_')}"
    folder.mkdir(parents=True, exist_ok=True)
    path, out = folder / "scene.json", folder / "out"
    path.write_text(json.dumps(scene.doc, indent=1))
    code, says = run(command, path, out, options.seconds)
    summary = json.loads((out / "summary.json").read_text()) if (out / "summary.json").exists() else {}
    problems = list(dict.fromkeys(judge(scene, code, summary, out)))
    if "creeps" in problems and settles(command, scene, path, options):
        problems[problems.index("creeps")] = "settles"
    get = summary.get
    share = get("unconverged_steps", 0) / max(1, get("substeps", 1))
    rate = get("cpu_s", 0) / max(get("simulated_s", 0), 1e-9)
    expected = [f"{e['what']} {e.get('found', math.nan):.4g} of {e.get('wanted', math.nan):.4g}"
                for e in scene.expect]
    return {
        "seed": seed,
        "case": case,
        "models": "+".join(sorted({b.get("model", {}).get("type", "msm") for b in scene.doc["bodies"]})),
        "step": short(scene.doc["time"].get("step", "default")),
        "cells": sum(body.get("cells", 0) for body in get("bodies", {}).values()),
        "exit": code,
        "simulated_s": short(get("simulated_s")),
        "cpu_s_per_s": short(rate) if summary else None,
        "unconverged": short(share),
        "crossing": get("intersections_between_max"),
        "self_crossing": get("intersections_self_max"),
        "creep_um_per_s": short(get("hold", {}).get("creep_max_um_per_s")),
        "expected": "; ".join(expected),
        "failed": "; ".join(p for p in problems if p not in NOTED),
        "noted": "; ".join(p for p in problems if p in NOTED),
        "says": says.replace(str(folder) + "/", "")[:400],
        "machine": options.machine,
        "compiler": options.compiler,
        "commit": options.commit
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("command")
    parser.add_argument("table", type=pathlib.Path)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="")
    for about in ("--machine", "--compiler", "--commit"):
        parser.add_argument(about, default="")
    parser.add_argument("--keep", type=pathlib.Path)
    options = parser.parse_args()
    table, seeds = options.table, range(options.first, options.first + options.scenes)
    done = {int(row["seed"]) for row in csv.DictReader(table.open())} if table.exists() else set()
    todo = [seed for seed in seeds if seed not in done and options.only in make(seed)[0]]
    lock = threading.Lock()
    pool = concurrent.futures.ThreadPoolExecutor(options.jobs)
    with tempfile.TemporaryDirectory() as scratch, pool:
        folder = options.keep or pathlib.Path(scratch)
        started = [pool.submit(row_of, options.command, seed, options, folder) for seed in todo]
        for finished in concurrent.futures.as_completed(started):
            row = finished.result()
            with lock:
                new = not table.exists()
                with table.open("a", newline="") as file:
                    writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
                    if new:
                        writer.writeheader()
                    writer.writerow(row)
            noted = f"({row['noted']})" if row["noted"] else ""
            print(row["seed"], row["case"], row["failed"] or "ok", noted, flush=True)
    rows = [row for row in csv.DictReader(table.open()) if int(row["seed"]) in seeds]
    failed = [row for row in rows if row["failed"]]
    reasons = collections.Counter(reason for row in failed for reason in row["failed"].split("; "))
    notes = collections.Counter(note for row in rows for note in row["noted"].split("; ") if note)
    print(f"{len(rows)} first scenes, {len(failed)} failed:", dict(reasons), "noted:", dict(notes))
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()

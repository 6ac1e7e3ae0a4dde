#!/usr/bin/env python3
"""Two tools at 1 kHz: how long steps take, and how a loop of a thread of its own fares beside them.

haptic_study.py BIN_FOLDER [--commit HASH] [--seconds S] [--out FOLDER]

Runs real_time_bench on two_tools.json at 2,170 and at 8,000 points, and example_08_haptic_loop for S seconds
(10). Writes haptic.csv (one row for each run, with the load of the machine) into tests/bench/results and
haptic.png into libdeform/doc/images, or both into --out. For figures of a quiet machine nothing else may run.
"""
import argparse
import csv
import os
import pathlib
import platform
import re
import subprocess
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SCENE = HERE / "two_tools.json"
# name, model, cells, seconds of the scene
RUNS = (("msm, 2,170 points", "msm", 11000, 4.0), ("condensed, 2,170 points", "condensed", 11000, 4.0),
        ("msm, 8,000 points", "msm", 43500, 1.0), ("condensed, 8,000 points", "condensed", 43500, 4.0))
COLORS = ("#2d69b4", "#cd5037", "#3c8c55", "#8c64aa")


def machine():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.machine()


def steps_of(folder, model, cells, seconds, work):
    """Milliseconds of each step, and how many points the body has. The file has a column of units, too."""
    times = pathlib.Path(work) / "times.txt"
    done = subprocess.run([folder / "real_time_bench", SCENE, "--model", model, "--cells", str(cells),
                           "--time", str(seconds), "--times", times], check=True, capture_output=True,
                          text=True)
    points = int(re.search(r"ms: (\d+) points", done.stdout).group(1))
    return [float(line.split()[0]) for line in times.read_text().splitlines()], points


def loop_of(folder, seconds):
    """Rows of the example's histograms: name -> (upper ends in ms, counts, mean, most)."""
    done = subprocess.run([folder / "example_08_haptic_loop", SCENE, "probe", str(seconds)], check=True,
                          capture_output=True, text=True)
    lines = done.stdout.splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("ms, up to"))
    ends = [float(x) for x in lines[head].split()[3:-1]]
    out = {}
    for line in lines[head + 1:head + 4]:
        words, figures = line[:30].strip(), line[30:].split("mean")
        mean, most = re.findall(r"[\d.]+", figures[1])
        out[words] = (ends, [int(x) for x in figures[0].split()], float(mean), float(most))
    return out, lines[head + 4]


def share_above(times):
    """Points of the curve: milliseconds, share of the steps that take longer."""
    ordered = sorted(times)
    n = len(ordered)
    return ordered, [(n - i) / n for i in range(n)]


def draw(runs, loop, where, note):
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2))
    for (name, times), color in zip(runs, COLORS):
        left.plot(*share_above(times), color=color, label=name)
    left.axvline(1, color="#888888", linewidth=1)
    left.set(xscale="log", yscale="log", xlabel="ms", ylabel="share of the steps that take longer")
    left.set_title("a step of 1 ms")
    left.legend(fontsize=8)
    for (name, (ends, counts, _, _)), color in zip(loop.items(), COLORS):
        n = sum(counts)
        right.step(ends, [max(1 - sum(counts[:i + 1]) / n, 0.3 / n) for i in range(len(ends))], where="post",
                   color=color, label=name)
    right.axvline(1, color="#888888", linewidth=1)
    right.set(xscale="log", yscale="log", xlabel="ms", ylabel="share that is more")
    right.set_title("the loop beside it (example 08)")
    right.legend(fontsize=8)
    figure.text(0.01, 0.01, note, fontsize=7, color="#555555")
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    figure.savefig(where, dpi=110)


def write_rows(path, rows):
    """Replaces the rows of this machine and commit, and keeps all others."""
    head = "machine,commit,load,what,points,n,median_ms,p999_ms,most_ms,above_1_ms".split(",")
    kept = []
    if path.exists():
        with open(path, newline="") as file:
            kept = [row for row in list(csv.reader(file))[1:] if row[:2] != rows[0][:2]]
    with open(path, "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerows([head] + kept + rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--commit", default="unknown")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--out", type=pathlib.Path)
    arguments = parser.parse_args()
    rows, runs = [], []
    with tempfile.TemporaryDirectory() as work:
        for name, model, cells, seconds in RUNS:
            load = os.getloadavg()[0]
            times, points = steps_of(arguments.folder, model, cells, seconds, work)
            ordered = sorted(times)
            rows.append([machine(), arguments.commit, f"{load:.1f}", name, points, len(times),
                         f"{ordered[len(times) // 2]:.3f}", f"{ordered[len(times) * 999 // 1000]:.3f}",
                         f"{ordered[-1]:.3f}", sum(t > 1 for t in times)])
            runs.append((name, times))
            print(", ".join(str(x) for x in rows[-1][2:]))
    load = os.getloadavg()[0]
    loop, last = loop_of(arguments.folder, arguments.seconds)
    for name, (_, counts, mean, most) in loop.items():
        rows.append([machine(), arguments.commit, f"{load:.1f}", name, "", sum(counts), f"{mean:.3f}", "",
                     f"{most:.3f}", ""])
        print(", ".join(str(x) for x in rows[-1][2:]))
    print(last)
    results = arguments.out or HERE / "results"
    results.mkdir(parents=True, exist_ok=True)
    write_rows(results / "haptic.csv", rows)
    highest = max(float(row[2]) for row in rows)
    draw(runs, loop, (arguments.out or ROOT / "libdeform/doc/images") / "haptic.png",
         f"{machine()}, commit {arguments.commit}, load of the machine up to {highest:.0f}")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""The figures of the laws' pages, made by `deform friction` from examples/friction: laws_rig.png,
laws_breakaway.png, laws_loops.png, laws_sliding.png, laws_pulled.png.

friction_laws.py DEFORM_COMMAND [FOLDER]
"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ROOT = pathlib.Path(__file__).resolve().parents[3]
CASES = ROOT / "examples/friction"
LAWS = {"coulomb": "#4c4c4c", "karnopp": "#8d6e3a", "dahl": "#2f6db3", "lugre": "#c8553d",
        "elastoplastic": "#3b8f5c", "gms": "#8657a8"}
command = sys.argv[1]


def run(case, law, step="1e-4", change=None):
    """Rows of a case under a law, as columns; `change` takes the case's parsed text."""
    with tempfile.TemporaryDirectory() as folder:
        file = CASES / f"{case}.json"
        if change:
            text = json.loads(file.read_text())
            change(text)
            file = pathlib.Path(folder) / "case.json"
            file.write_text(json.dumps(text))
        rows = pathlib.Path(folder) / "rows.csv"
        subprocess.run([command, "friction", str(file), "--law", law, "--step", step, "--csv", str(rows),
                        "--quiet"], check=True)
        with open(rows, newline="") as table:
            read = list(csv.DictReader(table))
    return {name: np.array([float(row[name]) for row in read]) for name in read[0]}


def rig(out):
    figure, axes = plt.subplots(3, len(LAWS), figsize=(13.5, 6.6), dpi=80, sharex="row", sharey="row")
    for column, (law, color) in enumerate(LAWS.items()):
        below, gross = run("rig_below", law), run("rig", law)
        axes[0, column].plot(below["t"], 1e6 * below["x"], color=color, linewidth=1)
        axes[1, column].plot(gross["t"], gross["v"], color=color, linewidth=1)
        axes[2, column].plot(gross["t"], gross["F"], color=color, linewidth=1)
        axes[0, column].set_title(law, fontsize=10)
        axes[2, column].set_xlabel("time (s)")
    for row, label in enumerate(("below break-away:\ndisplacement (\u00b5m)", "sliding:\nvelocity (m/s)",
                                 "sliding:\nfriction force (N)")):
        axes[row, 0].set_ylabel(label)
        for axis in axes[row]:
            axis.grid(True, alpha=0.25)
    figure.suptitle("1 kg on a plane, bias 0.2 N plus 0.7 N (top) or 3 N (below) at 1 Hz; F_C 1.47 N, F_S "
                    "1.96 N", fontsize=10)
    figure.tight_layout()
    figure.savefig(out / "laws_rig.png")


def breakaway(out):
    rates = [0.5, 1, 2, 5, 10, 20, 50, 100]
    figure, axis = plt.subplots(figsize=(6.2, 4.0), dpi=90)
    for law, color in LAWS.items():
        rows = run("breakaway", law, change=lambda case: case["input"].update(rates=rates))
        line = "s--" if law == "karnopp" else "o-"  # it lies on coulomb
        axis.semilogx(rows["rate"], rows["F_ba"], line, color=color, markersize=4, linewidth=1.2, label=law)
    axis.axhline(1.0, color="#999999", linewidth=0.8, linestyle=":")
    axis.axhline(1.5, color="#999999", linewidth=0.8, linestyle=":")
    axis.text(0.75, 1.008, "F_C", fontsize=8, color="#777777")
    axis.text(60, 1.51, "F_S", fontsize=8, color="#777777")
    axis.set_xlabel("force rate (N/s)")
    axis.set_ylabel("break-away force (N)")
    axis.set_ylim(0.95, 1.6)
    axis.grid(True, alpha=0.25)
    axis.legend(fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 0.13))
    figure.tight_layout()
    figure.savefig(out / "laws_breakaway.png")


def dense(case):
    """200 rows on each straight piece, so that a jump looks like one."""
    corners = case["input"]["path"]
    pieces = [np.linspace(a, b, 201)[1:] for a, b in zip(corners, corners[1:])]
    case["input"]["x"] = [corners[0]] + [float(x) for piece in pieces for x in piece]
    case["input"]["segment"] = [0] + [k for k, piece in enumerate(pieces) for _ in piece]


def loops(out):
    figure, axes = plt.subplots(1, 5, figsize=(13.5, 3.2), dpi=80, sharey=True)
    for axis, law in zip(axes, ("coulomb", "dahl", "lugre", "elastoplastic", "gms")):
        rows = run("loops", law, change=dense)
        axis.plot(1e6 * rows["x"], rows["F"], color=LAWS[law], linewidth=1.1)
        inner = [int(np.argmax(rows["segment"] > k)) - 1 for k in (0, 2)]
        axis.plot(1e6 * rows["x"][inner], rows["F"][inner], "o", color=LAWS[law], markersize=4,
                  fillstyle="none")
        axis.set_title(law, fontsize=10)
        axis.set_xlabel("displacement (\u00b5m)")
        axis.grid(True, alpha=0.25)
    axes[0].set_ylabel("friction force (N)")
    figure.suptitle("A slow path with an inner loop; circles: the same place before and after the loop",
                    fontsize=10)
    figure.tight_layout()
    figure.savefig(out / "laws_loops.png")


def sliding(out):
    figure, axes = plt.subplots(1, len(LAWS), figsize=(13.5, 3.0), dpi=80, sharey=True)
    for axis, (law, color) in zip(axes, LAWS.items()):
        rows = run("sliding_sine", law)
        second = rows["t"] >= 1
        axis.plot(1e3 * rows["v"][second], rows["F"][second], color=color, linewidth=1.1)
        axis.set_title(law, fontsize=10)
        axis.set_xlabel("velocity (mm/s)")
        axis.grid(True, alpha=0.25)
    axes[0].set_ylabel("friction force (N)")
    figure.suptitle("Prescribed slip, 20 mm/s at 1 Hz, second cycle: lag behind the steady curve and "
                    "hysteresis at the reversals", fontsize=10)
    figure.tight_layout()
    figure.savefig(out / "laws_sliding.png")


def pulled(out):
    figure, axes = plt.subplots(1, len(LAWS), figsize=(13.5, 3.0), dpi=80, sharey=True)
    for axis, (law, color) in zip(axes, LAWS.items()):
        rows = run("pulled", law)
        axis.plot(rows["t"], 2 * (0.1 * rows["t"] - rows["x"]), color=color, linewidth=1.1)
        axis.set_title(law, fontsize=10)
        axis.set_xlabel("time (s)")
        axis.grid(True, alpha=0.25)
    axes[0].set_ylabel("spring force (N)")
    figure.suptitle("1 kg pulled at 0.1 m/s by a spring of 2 N/m; F_C 1 N, F_S 1.5 N", fontsize=10)
    figure.tight_layout()
    figure.savefig(out / "laws_pulled.png")


def main():
    out = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else pathlib.Path(__file__).parent
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    for draw in (rig, breakaway, loops, sliding, pulled):
        draw(out)


main()

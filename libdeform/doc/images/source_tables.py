#!/usr/bin/env python3
"""The measurements of Zerbato 2010 beside ours: source_run.png, source_overlaps.png, source_costs.png.

source_tables.py BIN [OUT] [--measure]

BIN: folder of the programs source_tables and law_bench, as `make bench` builds them (build/bench/bin).
OUT: folder of the pictures.

Draws tests/bench/results/source_tables.csv and toi.csv; --measure takes the first of them again.
"""
import csv
import io
import pathlib
import subprocess
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection

ROOT = pathlib.Path(__file__).resolve().parents[3]
RESULTS = ROOT / "tests/bench/results"
# ms, as printed: figure 4.7, section 4.4 (exact time), section 5.3, table 6.2 (without, with)
REBUILD = {"coarse": 4.4, "fine": 14.3}
EXACT = {"coarse": 0.24, "fine": 0.94}
LAWS = {"coulomb": 1.58e-2, "karnopp": 5.73e-4, "dahl": 4e-3, "lugre": 0.115, "elastoplastic": 0.117}
ANISOTROPY = {561: (0.0463, 0.0497), 15092: (0.7042, 0.7564), 16383: (0.8302, 0.9041)}
# the benchmark of each law: levels and Stribeck curve where it has one, in motion
LAW_ROWS = {"coulomb": "coulomb_stribeck_delta_2", "karnopp": "karnopp_stribeck_delta_2",
            "dahl": "dahl_slides", "lugre": "lugre_passive",
            "elastoplastic": "elastoplastic_slides"}
COLORS = {"coarse": "#d98a3d", "fine": "#2f6db3"}


def measure(programs):
    out = RESULTS / "source_tables.csv"
    out.unlink(missing_ok=True)
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True)
    subprocess.run([programs / "source_tables", "--csv", out, "--commit", commit.stdout.strip()], check=True)
    text = subprocess.run([programs / "law_bench", "--benchmark_format=csv", "--benchmark_repetitions=5"],
                          check=True, capture_output=True, text=True).stdout
    with open(out, newline="") as file:
        head = next(csv.DictReader(file))
    rows = list(csv.DictReader(io.StringIO(text[text.index("name,"):])))
    with open(out, "a", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        for law, name in LAW_ROWS.items():
            # processor time of a batch of 1,000 contacts, the least of the repetitions
            least = min(float(r["cpu_time"]) for r in rows if r["name"] == f"law/{name}")
            writer.writerow([head["machine"], head["compiler"], head["commit"], "5.3", law, 0,
                             f"{least / 1e9:.5g}", "ms"])


def read():
    out = {}
    with open(RESULTS / "source_tables.csv", newline="") as file:
        for row in csv.DictReader(file):
            at, value = float(row["at"]), float(row["value"])
            out.setdefault((row["figure"], row["series"]), []).append((at, value))
    return out


def run_picture(rows, path):
    figure, axes = plt.subplots(2, 2, figsize=(11, 6.4), dpi=80)
    for name, color in COLORS.items():
        for what, style in (("built", "-"), ("renewed", "--")):
            line = rows["4.7", f"{name}: tree {what}"]
            axes[0, 0].semilogy(*zip(*line), style, color=color,
                                label=f"{name}: tree {what}")
        axes[0, 0].axhline(REBUILD[name], color=color, lw=0.8, ls=":")
        axes[0, 1].plot(*zip(*rows["4.8", f"{name}: contacts"]), color=color, label=name)
        axes[1, 0].semilogy(*zip(*rows["4.8", f"{name}: detection"]), color=color,
                            label=f"{name}: detection")
        axes[1, 0].semilogy(*zip(*rows["4.8", f"{name}: guard"]), "--", color=color,
                            label=f"{name}: guard (exact times)")
        axes[1, 0].axhline(EXACT[name], color=color, lw=0.8, ls=":")
        axes[1, 1].semilogy(*zip(*rows["4.8", f"{name}: model"]), color=color, label=f"{name}: model")
        solved = rows["4.8", f"{name}: contact and friction"]
        axes[1, 1].semilogy(*zip(*solved), "--", color=color, label=f"{name}: contact and friction")
    for axis, title, label in ((axes[0, 0], "4.7: trees of both surfaces (dotted: printed rebuild)", "ms"),
                               (axes[0, 1], "4.8: contacts", "contacts"),
                               (axes[1, 0], "4.8: detection (dotted: exact times as printed)", "ms per step"),
                               (axes[1, 1], "update: model and contact solve", "ms per step")):
        axis.set_title(title, fontsize=10)
        axis.set_xlabel("time of the run (s)")
        axis.set_ylabel(label)
        axis.grid(True, alpha=0.25)
        axis.legend(fontsize=8, ncols=2 if axis is axes[1, 0] else 1,
                    loc="lower right" if axis in axes[1] else "upper right" if axis is axes[0, 1] else "best")
    figure.tight_layout()
    figure.savefig(path)


def overlaps_picture(programs, path):
    with tempfile.TemporaryDirectory() as folder:
        table = pathlib.Path(folder) / "overlaps.csv"
        subprocess.run([programs / "source_tables", "--only", "overlaps", "--overlaps", table], check=True,
                       stdout=subprocess.DEVNULL)
        rows = list(csv.DictReader(open(table, newline="")))
    names = list(dict.fromkeys(r["finder"] for r in rows))
    figure, axes = plt.subplots(1, len(names), figsize=(13.5, 3.6), dpi=80, sharex=True, sharey=True)
    for axis, name in zip(axes, names):
        # the faces that look at the other body, seen from above: the lower's on top, the upper's from below
        counts = 0
        for body, side, color in (("0", 1, "#e4e4e4"), ("1", -1, "#c9d9ea")):
            faces, hit = [], []
            for r in (r for r in rows if r["finder"] == name and r["body"] == body):
                p = [tuple(float(r[f"{a}{k}"]) for a in "xyz") for k in range(3)]
                (ax, ay, _), (bx, by, _), (cx, cy, _) = p
                up = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
                if r["overlaps"] == "1":
                    hit.append([q[:2] for q in p])
                elif up * side > 0:
                    faces.append([q[:2] for q in p])
            axis.add_collection(PolyCollection(faces, facecolors=color if body == "0" else "none",
                                               edgecolors="#8a8a8a" if body == "0" else "#2f6db3",
                                               linewidths=0.4 if body == "0" else 0.6, zorder=1))
            axis.add_collection(PolyCollection(hit, facecolors="#c8553d" if body == "0" else "#e0a33a",
                                               edgecolors="#5c1f12", linewidths=0.6, alpha=0.8, zorder=2))
            counts += len(hit)
        axis.set_title(f"{name}:\n{counts} triangles overlap", fontsize=10)
        axis.set(xlim=(-0.13, 0.13), ylim=(-0.13, 0.13), aspect="equal", xlabel="x (m)")
    axes[0].set_ylabel("y (m)")
    figure.tight_layout()
    figure.savefig(path)


def bars(axis, names, pairs, colors, labels, label, numbers):
    for k, values in enumerate(zip(*pairs)):
        places = [i + (k - 0.5) * 0.38 for i in range(len(names))]
        drawn = axis.bar(places, values, 0.36, color=colors[k], label=labels[k])
        axis.bar_label(drawn, [numbers(v) for v in values], fontsize=7)
    axis.set_xticks(range(len(names)), names, fontsize=8)
    axis.set_ylabel(label)
    axis.legend(fontsize=8)
    axis.margins(y=0.15)


def costs_picture(rows, path):
    figure, axes = plt.subplots(1, 3, figsize=(13.5, 3.8), dpi=80)
    with open(RESULTS / "toi.csv", newline="") as file:
        roots = {(r["set"], r["finder"]): float(r["evaluations"]) for r in csv.DictReader(file)
                 if r["set"].startswith("roots")}
    finders = {"bisection": "bisection", "regula_falsi_plain": "regula falsi\nas printed",
               "regula_falsi": "regula falsi\nIllinois", "brent": "Brent"}
    bars(axes[0], list(finders.values()),
         [(roots["roots: (4.7) as printed", f], roots["roots: distance to the plane", f]) for f in finders],
         ("#9a9a9a", "#2f6db3"), ("(4.7) as printed", "distance to the plane"), "values per root to 1e-12",
         lambda v: f"{v:.0f}")
    axes[0].set_title("4.10: the finders", fontsize=10)
    laws = [(law, (printed * 1e6, rows["5.3", law][0][1] * 1e6)) for law, printed in LAWS.items()]
    bars(axes[1], [law for law, _ in laws], [pair for _, pair in laws], ("#9a9a9a", "#2f6db3"),
         ("as printed", "here, one of a batch of 1,000"), "ns per contact", lambda v: f"{v:.3g}")
    axes[1].set_yscale("log")
    axes[1].set_title("5.3: one contact's friction", fontsize=10)
    shares = []
    for cells, (without, with_one) in ANISOTROPY.items():
        ours = {kind: rows["6.2", f"{cells} cells: {kind}"][0][1]
                for kind in ("isotropic", "softer along an axis")}
        shares.append((100 * (with_one / without - 1),
                       100 * (ours["softer along an axis"] / ours["isotropic"] - 1)))
    bars(axes[2], [f"{cells} cells" for cells in ANISOTROPY], shares, ("#9a9a9a", "#2f6db3"),
         ("as printed", "here"), "% more time per step", lambda v: f"{v:.1f}")
    axes[2].set_title("6.2: what anisotropy adds (softer along an axis)", fontsize=10)
    figure.tight_layout()
    figure.savefig(path)


def main():
    words = [w for w in sys.argv[1:] if w != "--measure"]
    if not words:
        sys.exit(__doc__)
    programs = pathlib.Path(words[0]).resolve()
    out = pathlib.Path(words[1]) if len(words) > 1 else pathlib.Path(__file__).parent
    for name in ("source_tables", "law_bench"):
        if not (programs / name).exists():
            sys.exit(f"{programs}: there is no {name}; build it with `make bench`")
    if "--measure" in sys.argv:
        measure(programs)
    rows = read()
    run_picture(rows, out / "source_run.png")
    overlaps_picture(programs, out / "source_overlaps.png")
    costs_picture(rows, out / "source_costs.png")


if __name__ == "__main__":
    main()

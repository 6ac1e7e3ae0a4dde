#!/usr/bin/env python3
"""Stick-slip of a soft pad on a belt: belt_stick_slip.png from what `belt_study FOLDER` wrote.

belt_stick_slip.py FOLDER [OUT.png]
"""
import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

# s, a point mass in the same rig (reference set)
RIGID = {"coulomb": 6.512322, "lugre": 6.362720, "elastoplastic": 6.375861}
COLORS = {3e3: "#c8553d", 1e4: "#d9a441", 1e5: "#3b8f5c", 1e6: "#2f6db3"}

folder = pathlib.Path(sys.argv[1])
out = sys.argv[2] if len(sys.argv) > 2 else pathlib.Path(__file__).with_name("belt_stick_slip.png")
trace, share = {}, {}
for row in csv.DictReader(open(folder / "belt_trace.csv")):
    trace.setdefault((row["law"], float(row["young_Pa"])),
                     []).append((float(row["t"]), float(row["force_N"])))
for row in csv.DictReader(open(folder / "belt_stick_slip.csv")):
    share.setdefault(row["law"], []).append((float(row["young_Pa"]), float(row["period_share"]),
                                             float(row["amplitude_share"])))

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 3.6), gridspec_kw={"width_ratios": [2.2, 1]})
for young, color in COLORS.items():
    rows = trace.get(("lugre", young), [])
    left.plot([t for t, _ in rows], [f for _, f in rows], color=color, lw=1, label=f"E = {young:.0e} Pa")
left.axhline(1.507988, color="k", lw=0.6, ls=":")
left.axhline(0.741239, color="k", lw=0.6, ls=":")
left.set(xlabel="t, s", ylabel="spring force, N", title="LuGre (dotted: extremes of a point mass)",
         xlim=(0, 30))
left.legend(fontsize=8, loc="lower right")
for law, rows in share.items():
    right.semilogx([e for e, _, _ in rows], [100 * (p - 1) for _, p, _ in rows], "o-", ms=4, lw=1, label=law)
right.axhline(0, color="k", lw=0.6)
right.set(xlabel="Young's modulus of the pad, Pa", ylabel="period beside a point mass, %",
          title="as the pad stiffens")
right.legend(fontsize=8)
figure.tight_layout()
figure.savefig(out, dpi=110)

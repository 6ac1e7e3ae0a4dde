#!/usr/bin/env python3
"""Performance profile of `deform contact` beside the solvers of Siconos (Dolan and More 2002): for each
solver the share of problems that it has solved within so many times the time of the fastest one.

contact_profile.py DEFORM FOLDER OUT.png [OUT.csv]   FOLDER: of problems, with siconos_results.txt
"""
import csv
import json
import pathlib
import re
import subprocess
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plot

CUT = 38          # characters of a name in Siconos' table
LEAST = 1e-4      # s: its times have four decimals
NAMES = {"NSGS": "Gauss-Seidel", "NSN_AC": "Newton (Alart, Curnier)",
         "NSN_FB": "Newton (Fischer, Burmeister)", "ADMM": "ADMM", "ACLMFP": "fixed point (Acary et al.)"}


def of_siconos(folder):
    """{name, cut: {solver: s, None where it found nothing}}"""
    times = {}
    for line in (folder / "siconos_results.txt").read_text().splitlines():
        solver = next((s for s in NAMES if re.search(rf"\b{s}\b", line)), None)
        if not solver:
            continue
        solved = re.search(r"info=0 .*cpu=([\d.]+)s", line)
        times.setdefault(line[:CUT].strip().split(" ")[0], {})[solver] = float(solved[1]) if solved else None
    return times


def of_deform(command, folder, names):
    paths = [str(path) for name in names for path in folder.glob(name + "*")]
    found = subprocess.run([command, "contact", "--json", *paths], capture_output=True, text=True)
    return {pathlib.Path(p["file"]).name[:CUT]: p["seconds"] if p["solved"] else None
            for p in json.loads(found.stdout)["problems"]}


def main():
    command, folder, picture = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3]
    others = of_siconos(folder)
    rows = {name: {"deform": time, **others[name]}
            for name, time in of_deform(command, folder, others).items()}
    if len(sys.argv) > 4:
        with open(sys.argv[4], "w", newline="") as file:
            out = csv.writer(file)
            out.writerow(["problem", "deform", *NAMES])
            out.writerows([name, *(row.get(s) for s in ("deform", *NAMES))] for name, row in rows.items())
    figure, axes = plot.subplots(figsize=(7, 4.2), dpi=100)
    for solver in ("deform", *NAMES):
        ratios = []
        for row in rows.values():
            times = {s: max(LEAST, t) for s, t in row.items() if t is not None}
            if solver in times:
                ratios.append(times[solver] / min(times.values()))
        ratios.sort()
        shares = [100 * (k + 1) / len(rows) for k in range(len(ratios))]
        axes.step([*ratios, 1e4], [*shares, shares[-1]], where="post", lw=2.5 if solver == "deform" else 1.2,
                  label=NAMES.get(solver, solver))
        print(f"{solver:8} solved {len(ratios)} of {len(rows)}")
    axes.set(xscale="log", xlim=(1, 1e4), ylim=(0, 102), xlabel="time over that of the fastest solver",
             ylabel=f"% of {len(rows)} problems solved to 1e-8")
    axes.legend(loc="lower right", fontsize=8)
    axes.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(picture)


if __name__ == "__main__":
    main()

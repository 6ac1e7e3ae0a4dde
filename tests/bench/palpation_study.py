#!/usr/bin/env python3
"""What a probe feels of a stiff ball, on finer and finer meshes, against palpation_reference.csv: results
and figure.

palpation_study.py DEFORM_COMMAND [FOLDER]   default folder build/palpation

Writes tests/bench/results/palpation.csv and libdeform/doc/images/palpation.png. The finest mesh takes a
minute.
"""
import csv
import json
import pathlib
import resource
import subprocess
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import palpation_case as case

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
CONDENSED = {"type": "condensed", "params": {"modes": 6}}
# boxes along x, half of y, z; model
RUNS = (((16, 4, 5), CONDENSED), ((24, 6, 8), CONDENSED), ((40, 9, 12), CONDENSED))


def felt(command, folder, cells, model, more=()):
    """Force in N at each place, and seconds of processor time."""
    mesh = folder / ("block_%dx%dx%d.msh" % cells)
    subprocess.run([sys.executable, "-B", str(HERE / "palpation_mesh.py"), *map(str, cells), str(mesh)],
                   check=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([command, "run", str(HERE / "palpation.json"), "--quiet", "--out", str(folder / "run"),
                    "--set", "/bodies/0/mesh=" + json.dumps(str(mesh)),
                    "--set", "/bodies/0/model=" + json.dumps(model), *more], check=True)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    rows = list(csv.DictReader(open(folder / "run/bodies.csv")))[2::2]  # after moving on and resting a step
    return [-2 * float(row["force_z"]) for row in rows], seconds


def main():
    command = sys.argv[1]
    folder = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else ROOT / "build/palpation").resolve()
    folder.mkdir(parents=True, exist_ok=True)
    truth = {}
    for row in csv.DictReader(open(ROOT / "tests/data/palpation_reference.csv")):
        truth.setdefault(row["mesh"], []).append(float(row["force_z_N"]))
    coarse, fine = list(truth.values())[-2:]
    apart = max(abs(a / b - 1) for a, b in zip(coarse, fine))
    print("reference: its last two meshes differ by %.2g %%" % (100 * apart))
    x = [1e3 * (p - case.BALL[0]) for p in case.PLACES]
    mirrored = lambda a, sign=1: list(a) + [sign * b for b in reversed(a[:-1])]
    figure, axis = plt.subplots(figsize=(7, 4))
    axis.plot(mirrored(x, -1), mirrored(fine), "k", lw=2, label="reference, 27-node elements")
    with open(HERE / "results/palpation.csv", "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["cells_of_half", "model", "x_m", "force_N", "error"])
        for cells, model in RUNS:
            count = 6 * cells[0] * cells[1] * cells[2]
            force, seconds = felt(command, folder, cells, model)
            for place, f, t in zip(case.PLACES, force, fine):
                out.writerow([count, model["type"], "%.6g" % place, "%.6g" % f, "%.4f" % (f / t - 1)])
            errors = [f / t - 1 for f, t in zip(force, fine)]
            told = count, model["type"], 100 * min(errors), 100 * max(errors), seconds
            print("%d cells, %s: errors %.1f to %.1f %%, %.3g s" % told, flush=True)
            axis.plot(mirrored(x, -1), mirrored(force), "o-", ms=3, lw=1,
                      label=f"{count:,} tetrahedra, {model['type']}")
        soft, _ = felt(command, folder, (16, 4, 5), CONDENSED, ("--set", "/materials/nodule/young=1e4"))
        axis.plot(mirrored(x, -1), mirrored(soft), ":", color="gray",
                  label="without the ball, 1,920 tetrahedra")
    axis.set(xlabel="place of the probe from the middle of the ball, mm", ylabel="force, N",
             ylim=(0, None))
    axis.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(ROOT / "libdeform/doc/images/palpation.png", dpi=110)


if __name__ == "__main__":
    main()

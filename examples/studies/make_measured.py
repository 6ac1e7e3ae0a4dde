#!/usr/bin/env python3
"""Writes what the studies of this folder are fitted to: make_measured.py [FOLDER].

springs_measured.csv: the tip of the beam by finite elements of second order; lugre_measured.csv: the force of
the rig with the parameters TRUTH and noise of 0.02 N. It needs the Python package."""
import csv
import json
import pathlib
import sys
import tempfile

import numpy as np

import deform

HERE = pathlib.Path(__file__).resolve().parent
TRUTH = {"F_C": 1.47, "F_S": 1.96, "v_s": 0.01, "sigma0": 1e4}


def write(path, columns, rows):
    with open(path, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(columns)
        out.writerows([f"{x:.6g}" for x in row] for row in rows)


def lugre(noise=0.02, seed=1):
    case = json.loads((HERE / "lugre.json").read_text())
    case["params"].update(TRUTH)
    rows = deform.friction("lugre", case=case)
    return rows["t"], rows["F"] + noise * np.random.default_rng(seed).standard_normal(len(rows["t"]))


def springs():
    with tempfile.TemporaryDirectory() as folder:
        deform.command("run", HERE / "springs.json", "--quiet", "--out", folder, "--set",
                       '/bodies/0/model={"type": "corotational_fem"}', "--set", "/bodies/0/mesh/order=2")
        with open(pathlib.Path(folder) / "probes.csv", newline="") as file:
            rows = list(csv.DictReader(file))
    return [float(row["t"]) for row in rows], [float(row["z"]) for row in rows]


if __name__ == "__main__":
    to = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE
    write(to / "springs_measured.csv", ["t", "z"], zip(*springs()))
    write(to / "lugre_measured.csv", ["t", "F"], zip(*lugre()))

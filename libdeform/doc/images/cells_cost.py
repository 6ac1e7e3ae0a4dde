#!/usr/bin/env python3
"""cells_cost.png: what the tip of a bar costs with each kind of cells, by `deform cost`.

cells_cost.py DEFORM_COMMAND [OUT.png]
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

SCENE = {
    "format": "deform-scene", "version": 1, "time": {"duration": 0.5, "step": "auto"},
    "materials": {"gel": {"young": 2e5, "poisson": 0.3, "damping": {"mass": 4, "stiffness": 0.001}}},
    "bodies": [{"name": "bar", "material": "gel", "model": {"type": "corotational_fem"},
                "mesh": {"make": "beam", "size": [0.4, 0.08, 0.08], "cells": 600},
                "fix": [{"box": [[-1, -1, -1], [1e-6, 1, 1]]}]}],
    "probes": [{"name": "tip", "body": "bar", "point": [0.4, 0.04, 0.04]}]}
KINDS = (("tetrahedra", "tab:blue", "o"), ("second-order tetrahedra", "tab:orange", "s"),
         ("lattice", "tab:green", "D"))


def kind_of(label):
    return next((kind for kind, _, _ in KINDS[1:] if kind in label), "tetrahedra")


def front(points):
    """Those that nothing cheaper beats."""
    out = []
    for cost, error in sorted(points):
        if not out or error < out[-1][1]:
            out.append((cost, error))
    return out


def main():
    out = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else pathlib.Path(__file__).with_suffix(".png")
    with tempfile.TemporaryDirectory() as folder:
        scene = pathlib.Path(folder, "bar.json")
        scene.write_text(json.dumps(SCENE), encoding="utf-8")
        subprocess.run([sys.argv[1], "cost", scene, "--out", folder, "--axes", "time,mesh,cells",
                        "--budget", "60", "--quiet"], check=True)
        report = json.loads(pathlib.Path(folder, "cost.json").read_text(encoding="utf-8"))
    figure, axes = plt.subplots(figsize=(7, 4.2))
    for kind, color, mark in KINDS:
        points = [(c["cpu_s_per_s"], 100 * c["headline"]) for c in report["choices"]
                  if c["state"] == "done" and c["headline"] and kind_of(c["label"]) == kind]
        axes.scatter(*zip(*points), color=color, marker=mark, s=18, alpha=0.5)
        axes.plot(*zip(*front(points)), color=color, marker=mark, markersize=5, label=kind)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("processor s per simulated s")
    axes.set_ylabel("error of the tip over 0.5 s, %")
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(out, dpi=110)


main()

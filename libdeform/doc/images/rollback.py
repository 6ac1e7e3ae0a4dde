#!/usr/bin/env python3
"""The same throw, bounce and collision by `deform run` and by `deform rollback`: rollback.png and the figures
in it, from the scene rollback_compare.

rollback.py DEFORM_COMMAND [OUT.png]
"""
import csv
import pathlib
import subprocess
import sys
import tempfile

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ROOT = pathlib.Path(__file__).resolve().parents[3]
SCENE = ROOT / "examples/scenes/rollback_compare.json"
COLORS = {"run": "#2f6db3", "rollback": "#c8553d"}
TIMES = (0.1, 0.2, 0.4)  # s, of the frames


def run(command, word, out):
    subprocess.run([command, word, str(SCENE), "--quiet", "--out", str(out), "--frames", "10"], check=True)
    with open(out / "bodies.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    names = list(dict.fromkeys(r["body"] for r in rows))
    series = {n: {k: np.array([float(r[k]) for r in rows if r["body"] == n])
                  for k in ("t", "com_x", "vel_x", "vel_z")} for n in names}
    frames = [plt.imread(out / f"frames/frame_{round(10 * t):06d}.png")[40:700, 60:900] for t in TIMES]
    return series, frames


def main():
    picture = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else pathlib.Path(__file__).with_suffix(".png")
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axes = plt.subplots(3, 3, figsize=(10.2, 8.6), dpi=100,
                                gridspec_kw={"height_ratios": (1, 1, 0.85)})
    with tempfile.TemporaryDirectory() as folder:
        for row, word in enumerate(COLORS):
            series, frames = run(sys.argv[1], word, pathlib.Path(folder) / word)
            for axis, frame, t in zip(axes[row], frames, TIMES):
                axis.imshow(frame)
                axis.axis("off")
                axis.set_title(f"{word}, t = {t} s", color=COLORS[word], fontsize=9)
            style = {"color": COLORS[word], "label": word}
            thrown, ball, flying, struck = (series[n] for n in ("thrown", "bouncing", "flying", "struck"))
            axes[2][0].plot(thrown["t"], thrown["vel_x"], **style)
            axes[2][1].plot(ball["t"], ball["vel_x"], **style)
            axes[2][2].plot(flying["t"], flying["vel_x"] + struck["vel_x"], **style)
            print(f"{word}: block went {thrown['com_x'][-1] - thrown['com_x'][0]:.4f} m; ball leaves at "
                  f"{ball['vel_x'][-1]:.4f} m/s along the floor; "
                  f"flying {flying['vel_x'][-1]:.4f}, struck {struck['vel_x'][-1]:.4f} m/s")
    t = np.linspace(0, 0.5, 201)
    axes[2][0].plot(t, np.maximum(0, 1.2 - 0.3 * 9.81 * t), "k:", lw=1, label="v0 - mu g t")
    axes[2][0].set_title("block thrown along the floor, mu 0.3", fontsize=9)
    axes[2][1].axhline(1, color="k", ls=":", lw=1, label="no friction: stays")
    axes[2][1].set_title("ball bouncing without friction", fontsize=9)
    axes[2][2].axhline(1, color="k", ls=":", lw=1, label="total: stays")
    axes[2][2].set_title("two balls colliding: momentum per mass", fontsize=9)
    for axis in axes[2]:
        axis.set(xlabel="t, s", ylabel="m/s along x", xlim=(0, 0.5))
        axis.legend(frameon=False, fontsize=8)
    figure.tight_layout()
    figure.savefig(picture, bbox_inches="tight")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Step responses of the three dampers against their closed forms: viscoelastic_bars.png from the probes of
the scene of that name.

viscoelastic_bars.py DEFORM_COMMAND [OUT.png]

A rod held at one end, gravity g along it from t = 0, in modes w_n = a_n sqrt(E/rho)/L, a_n = (n - 1/2) pi:
    u(t) = 2 g sum_n (-1)^(n-1)/a_n x_n(t),    (s^2 + d s + w_n^2 e(s)) X_n(s) = 1/s,
d the drag over mass and e(s) the modulus over that of rest: 1 + tau s (voigt), s tau/(1 + s tau) (maxwell), 1
+ r s tau/(1 + s tau) (sls). The poles are roots of a polynomial of degree three at most. E is the one number
taken from the runs: where the voigt bar comes to rest.
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
SCENE = ROOT / "examples/scenes/viscoelastic_bars.json"
LENGTH, MODES = 0.32, 40
KINDS = {"voigt": "Kelvin-Voigt", "maxwell": "Maxwell", "sls": "standard linear solid"}


def polynomials(kind, params, omega2, drag):
    """Velocity of a mode over a step of force, N(s)/D(s), highest power first."""
    if kind == "voigt":
        return [1.0], [1, drag + omega2 * params["damping_stiffness"], omega2]
    tau = params["relaxation_time"]
    # the common factor s of N and D is the flow under a constant force: it leaves a velocity at s = 0
    if kind == "maxwell":
        return [tau, 1], [tau, 1 + drag * tau, drag + omega2 * tau, 0]
    ratio = params["relaxation_ratio"]
    return [tau, 1], [tau, 1 + drag * tau, drag + omega2 * tau * (1 + ratio), omega2]


def closed_form(kind, params, t, modulus, density, drag, gravity):
    total = np.zeros_like(t)
    for n in range(MODES):
        wave = (n + 0.5) * np.pi
        above, below = polynomials(kind, params, (wave / LENGTH) ** 2 * modulus / density, drag)
        for pole in np.roots(below):
            residue = np.polyval(above, pole) / np.polyval(np.polyder(below), pole)
            total += (-1) ** n / wave * np.real(residue * (t if abs(pole) < 1e-9
                                                           else (np.exp(pole * t) - 1) / pole))
    return 2 * gravity * total


def massless(kind, params, t):
    """Over the stretch at rest."""
    if kind == "voigt":
        return 1 - np.exp(-t / params["damping_stiffness"])
    if kind == "maxwell":
        return 1 + t / params["relaxation_time"]
    ratio = params["relaxation_ratio"]
    return 1 - ratio / (1 + ratio) * np.exp(-t / (params["relaxation_time"] * (1 + ratio)))


def main():
    command = sys.argv[1]
    picture = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else pathlib.Path(__file__).with_suffix(".png")
    scene = json.loads(SCENE.read_text())
    gel, gravity = scene["materials"]["gel"], scene["gravity"][0]
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([command, "run", str(SCENE), "--quiet", "--out", out], check=True)
        with open(pathlib.Path(out) / "probes.csv", newline="") as file:
            rows = list(csv.DictReader(file))
    runs = {k: np.array([(float(r["t"]), float(r["x"]) - LENGTH) for r in rows if r["probe"] == k]).T
            for k in KINDS}
    rest = runs["voigt"][1][-1]
    modulus = gel["density"] * gravity * LENGTH**2 / (2 * rest)
    print(f"E = {modulus:.0f} Pa at rest; nominal {gel['young']:.0f} Pa")

    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    figure, axis = plt.subplots(figsize=(7.2, 4.0), dpi=130)
    for (kind, name), color in zip(KINDS.items(), ("#2f6db3", "#c8553d", "#3f8f5b")):
        t, u = runs[kind]
        params = next(b for b in scene["bodies"] if b["name"] == kind)["model"]["params"]
        fine = np.linspace(0, t[-1], 1501)
        arguments = (modulus, gel["density"], gel["damping"]["mass"], gravity)
        error = np.max(np.abs(u - closed_form(kind, params, t, *arguments))) / rest
        print(f"{kind}: largest difference {100 * error:.2f} % of the stretch at rest")
        axis.plot(fine, closed_form(kind, params, fine, *arguments) / rest, color=color, lw=1.3,
                  label=f"{name}, closed form")
        axis.plot(fine, massless(kind, params, fine), color=color, lw=0.8, ls=":")
        axis.plot(t[::2], u[::2] / rest, "o", ms=3.2, mfc="white", mec=color,
                  label=f"{name}, bar of tetrahedra")
    axis.plot([], [], color="0.4", lw=0.8, ls=":", label="without mass")
    axis.set(xlabel="time since gravity began, s", ylabel="stretch over that of the springs at rest",
             xlim=(0, None), ylim=(0, None))
    axis.legend(frameon=False, fontsize=8, loc="upper left")
    figure.tight_layout()
    figure.savefig(picture)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Frames of scenes side by side: attached.png, grasp.png, scenes.png, fill_drop.png, pressed_ring.png,
rigid.png, ode_scenes.png, stability.png, torn_dough.png, orange.png, cheese.png,
liver.png, lattice_drop.png, smooth_rolling.png, surface_organ.png.

scene_frames.py DEFORM_COMMAND [NAME.png...] [--out FOLDER]

Without names all of them; ode_scenes.png simulates 40 s of the gripper.
"""
import argparse
import math
import pathlib
import subprocess
import tempfile

import matplotlib.image
import numpy as np
import PIL.Image

ROOT = pathlib.Path(__file__).resolve().parents[3]
SUITE = "../../tests/stability/suite/"
SLIDES = ("/contact/friction/0/params/mu=0",)
EXPLICIT = ("/time/integrator=symplectic_euler",)
# as tests/stability/suite/hand.expect.json has it moved
FIST = (*EXPLICIT, '/obstacles/1={"name": "fist", "shape": "sphere", "radius": 0.04, "motion": {"keyframes":'
        ' [{"t": 0.3, "position": [-0.3, 0.05, 0.06]}, {"t": 0.45, "position": [0.45, 0.05, 0.06]}]}}')
# the scene's 18 facets crease where its wall folds
FINE_RING = ('/bodies/0/mesh={"make": "tube", "radius": 0.045, "inner": 0.03, "length": 0.06,'
             ' "cells": 4000}',)
SCRAMBLE = ('/bodies/0/start={"scramble": 1}', '/bodies/0/model={"type": "corotational_fem"}',
            "/time/integrator=implicit_euler", "/time/step=0.016666666666666666")
# picture: rows of (label, [(scene, what is set, time in s)]); edge to edge where the label is None
PICTURES = {
    "scenes.png": [
        ("ten bodies: 0, 1, 2 s", [("ten_bodies", (), t) for t in (0, 1, 2)]),
        ("beams; a ball rolls; slides", [("gravity_beams", (), 2), ("ball_incline", (), 1),
                                         ("ball_incline", SLIDES, 1)])],
    "attached.png": [("0, 0.7, 1.1 s", [("attached", (), t) for t in (0, 0.7, 1.1)])],
    "grasp.png": [("0, 0.4, 0.8, 1.6 s", [("grasp", (), t) for t in (0, 0.4, 0.8, 1.6)]),
                  ("2, 2.4, 2.6, 3 s", [("grasp", (), t) for t in (2, 2.4, 2.6, 3)])],
    "torn_dough.png": [("0, 0.4, 0.6 s", [("torn_dough", (), t) for t in (0, 0.4, 0.6)]),
                       ("0.8, 1, 1.2 s", [("torn_dough", (), t) for t in (0.8, 1, 1.2)])],
    "orange.png": [("0, 0.15, 0.25 s", [("orange", (), t) for t in (0, 0.15, 0.25)]),
                   ("0.3, 0.4, 1.2 s", [("orange", (), t) for t in (0.3, 0.4, 1.2)])],
    "liver.png": [("0, 0.3, 0.7 s", [("liver", (), t) for t in (0, 0.3, 0.7)]),
                  ("1, 1.1, 1.4 s", [("liver", (), t) for t in (1, 1.1, 1.4)]),
                  ("1.7, 1.9, 2.2 s", [("liver", (), t) for t in (1.7, 1.9, 2.2)])],
    "cheese.png": [("0.3, 0.5, 0.7 s", [("cheese", (), t) for t in (0.3, 0.5, 0.7)]),
                   ("1.2, 1.4, 1.6 s", [("cheese", (), t) for t in (1.2, 1.4, 1.6)])],
    "fill_drop.png": [("0, 0.4, 1.8 s", [("fill_drop", (), t) for t in (0, 0.4, 1.8)])],
    "bending_cells.png": [(None, [("bending_cells", (), 1.5)])],
    "lattice_drop.png": [("0, 0.2, 1.2 s", [("lattice_drop", (), t) for t in (0, 0.2, 1.2)])],
    "smooth_rolling.png": [(None, [("smooth_rolling", (), t) for t in (0, 0.8, 1.2)])],
    "surface_organ.png": [(None, [("surface_organ", (), t) for t in (0, 0.2, 0.6)])],
    "pressed_ring.png": [(None, [("pressed_ring", FINE_RING, 0.5)])],
    "rigid.png": [("rigid_on_ball", [("rigid_on_ball", (), t) for t in (0, 1, 2)]),
                  ("rigid_on_bed", [("rigid_on_bed", (), t) for t in (0, 0.5, 2)]),
                  ("rigid_pinch", [("rigid_pinch", (), t) for t in (0, 1.5, 3)])],
    "stability.png": [("arch", [(SUITE + "arch", EXPLICIT, t) for t in (0, 0.3)]),
                      ("card house", [(SUITE + "card_house", EXPLICIT, t) for t in (0, 0.3)]),
                      ("hand", [(SUITE + "hand", FIST, t) for t in (0.35, 0.4)]),
                      ("start: scramble", [(SUITE + "start_floor", SCRAMBLE, t) for t in (0, 0.4)])],
    "ode_scenes.png": [(None, [("ode_cart", (), 0.625), ("ode_cart", (), 1.125)]),
                       (None, [("ode_bed", (), 0.25), ("ode_gripper", (), 40)]),
                       (None, [("ode_chain", (), 1.25), ("ode_seesaw", (), 1)])],
}
CAPTIONS = {"rigid.png": ("start", "middle", "end")}   # above the columns


def frames(command, work, wanted):
    """{(scene, what is set, time): file} of the frames wanted; each scene runs once."""
    runs = {}
    for scene, settings, time in wanted:
        runs.setdefault((scene, settings), set()).add(time)
    files = {}
    for (scene, settings), times in runs.items():
        period = max(times)
        for time in times - {0}:
            period = math.gcd(round(1000 * period), round(1000 * time)) / 1000
        out = work / str(len(files))
        file = ROOT / "examples/scenes" / f"{scene}.json"
        subprocess.run([command, "run", str(file), "--quiet", "--out", str(out), "--frames",
                        f"{1 / period:.9g}", "--time", str(max(times)),
                        *(word for setting in settings for word in ("--set", setting))], check=True)
        for time in times:
            files[scene, settings, time] = out / f"frames/frame_{round(time / period):06d}.png"
    return files


def smaller(full, n):
    """Each pixel the mean of n x n."""
    rows, columns = (size // n for size in full.shape[:2])
    return full[:rows * n, :columns * n].reshape(rows, n, columns, n, 3).mean(axis=(1, 3))


def pixels(file):
    return matplotlib.image.imread(file)[..., :3]


def save(picture, out):
    """Writes a picture of 0 to 1 in 128 levels of each color, which are not visible and make it smaller."""
    levels = (127 * np.clip(picture, 0, 1) + 0.5).astype(np.uint8)
    PIL.Image.fromarray(levels * 2 + levels // 64).save(out, optimize=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("command")
    parser.add_argument("names", nargs="*", metavar="NAME.png", choices=[[], *PICTURES])
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path(__file__).parent)
    options = parser.parse_args()
    for name in options.names or PICTURES:
        rows = PICTURES[name]
        with tempfile.TemporaryDirectory() as work:
            files = frames(options.command, pathlib.Path(work), [f for _, row in rows for f in row])
            found = [(label, [str(files[f]) for f in row]) for label, row in rows]
            out = options.out / name
            if found[0][0] is not None:
                words = [word for label, row in found for word in ("--row", label, *row)]
                for caption in CAPTIONS.get(name, ()):
                    words += ["--columns", caption]
                subprocess.run([options.command, "montage", *words, "--out", str(out)], check=True)
                picture = smaller(pixels(out), len(found[0][1]))
            else:
                picture = np.vstack([np.hstack([pixels(file) for file in row]) for _, row in found])
                picture = smaller(picture, len(found[0][1]))
            save(picture, out)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Pictures and tables of the anisotropic scenes: pinched_tube.png, gravity_anisotropy.png.

anisotropy.py DEFORM_COMMAND [OUT_DIR]
"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

import matplotlib
matplotlib.use("Agg")
import matplotlib.image
import matplotlib.pyplot
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
SCENES = ROOT / "examples/scenes"
# One modulus across the axis in all three: where the axis stays as it is (stiffer), Young's modulus is 1 +
# slope^2 times as large.
TUBES = {
    "isotropic": {},
    "softer along its axis": {"/bodies/0/anisotropy/params/slope": 2},
    "stiffer along its axis": {"/bodies/0/anisotropy/params/kind": "stiffer",
                               "/bodies/0/anisotropy/params/slope": 2, "/materials/rubber/young": 5e5},
}
# eye, look_at
VIEWS = {"from above": ([0.22, -0.4, 0.22], [0.01, 0, -0.012]), "from the side": ([0, -0.5, 0], [0, 0, 0])}


def run(command, scene, out, settings=None, frames=None):
    extra = [word for pointer, value in (settings or {}).items()
             for word in ("--set", f"{pointer}={json.dumps(value)}")]
    subprocess.run([command, "run", str(SCENES / f"{scene}.json"), "--quiet", "--out", str(out),
                    *(["--frames", str(frames)] if frames else []), *extra],
                   check=True)


def last(out, name):
    with open(out / "probes.csv", newline="") as file:
        return [[float(r[a]) for a in "xyz"] for r in csv.DictReader(file) if r["probe"] == name][-1]


def tubes(command, work, pictures):
    rows = {view: [] for view in VIEWS}
    print(f"{'tube':24}{'force N':>10}{'center wider mm':>18}{'ends higher mm':>18}{'of center':>12}")
    for n, (name, settings) in enumerate(TUBES.items()):
        for view, (eye, look_at) in VIEWS.items():
            out = work / f"tube_{n}_{view.replace(' ', '_')}"
            run(command, "pinched_tube", out,
                {**settings, "/output/camera/eye": eye, "/output/camera/look_at": look_at}, 2.5)
            rows[view].append(str(sorted((out / "frames").glob("*.png"))[-1]))
        with open(out / "contacts.csv", newline="") as file:
            force = [float(r["normal_N"]) for r in csv.DictReader(file)][-2:]
        wider, higher = last(out, "side")[1] - 0.045, last(out, "end_top")[2] - 0.045
        print(f"{name:24}{sum(force) / 2:10.1f}{1e3 * wider:18.2f}{1e3 * higher:18.2f}{higher / wider:12.3f}")
    words = [word for view, frames in rows.items() for word in ("--row", view, *frames)]
    subprocess.run([command, "montage", *words, "--columns", *TUBES, "--out", str(work / "montage.png")],
                   check=True)
    full = matplotlib.image.imread(work / "montage.png")[..., :3]
    # half the size for the page: the mean of four pixels
    rows, columns = (n // 2 * 2 for n in full.shape[:2])
    half = full[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2, 3).mean(axis=(1, 3))
    matplotlib.image.imsave(pictures / "pinched_tube.png", np.clip(half, 0, 1))


def label(frame, out):
    """Says what stands where: places are shares of the scene's own view, so they follow its size and not its
    camera."""
    picture = matplotlib.image.imread(frame)[..., :3]
    rows, columns = picture.shape[:2]
    figure = matplotlib.pyplot.figure(figsize=(columns / 100, rows / 100), dpi=100)
    figure.figimage(picture)
    words = [(0.12, 0.625, "isotropic"),
             *((x, 0.85, f"softer along {axis}") for x, axis in ((0.375, "x"), (0.625, "y"), (0.87, "z"))),
             *((0.283, y, f"slope {slope}") for y, slope in ((0.765, "0.5"), (0.565, "1"), (0.38, "2")))]
    for x, y, text in words:
        figure.text(x, y, text, ha="right" if text.startswith("slope") else "center", fontsize=12,
                    color="#1c2733")
    figure.savefig(out, dpi=100)


def beams(command, work, pictures):
    sag, pull = work / "sag", work / "pull"
    run(command, "gravity_anisotropy", sag, frames=2)
    run(command, "gravity_anisotropy", pull, {"/gravity": [9.81, 0, 0]})
    label(sorted((sag / "frames").glob("*.png"))[-1], pictures / "gravity_anisotropy.png")
    scene = json.loads((SCENES / "gravity_anisotropy.json").read_text())
    print(f"\n{'bar':12}{'cos^2':>8}{'sag mm':>10}{'ratio':>8}{'stretch mm':>14}{'ratio':>8}")
    first = None
    for body in scene["bodies"]:
        slope = body.get("anisotropy", {"params": {"slope": 0}})["params"]["slope"]
        place = body["pose"]["position"]
        down = place[2] + 0.05 - last(sag, body["name"])[2]
        longer = last(pull, body["name"])[0] - place[0] - 0.32
        first = first or (down, longer)
        print(f"{body['name']:12}{1 / (1 + slope**2):8.2f}{1e3 * down:10.2f}{down / first[0]:8.2f}"
              f"{1e3 * longer:14.3f}{longer / first[1]:8.2f}")


def main():
    pictures = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else pathlib.Path(__file__).parent
    with tempfile.TemporaryDirectory() as work:
        tubes(sys.argv[1], pathlib.Path(work), pictures)
        beams(sys.argv[1], pathlib.Path(work), pictures)


if __name__ == "__main__":
    main()

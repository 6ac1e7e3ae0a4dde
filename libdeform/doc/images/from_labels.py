#!/usr/bin/env python3
"""From voxels to bodies: from_labels.png, of examples/data/abdomen.nrrd.

from_labels.py DEFORM_COMMAND [OUT.png]
"""
import gzip
import json
import pathlib
import subprocess
import sys
import tempfile

import matplotlib
import matplotlib.image
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ROOT = pathlib.Path(__file__).resolve().parents[3]
DATA = ROOT / "examples/data"
COLORS = ["#ffffff", "#f2d9a0", "#b5524a", "#3d2a6b", "#c98b6b", "#d9a58a", "#8d99a6"]  # by label
# without fat, each organ a body of its own, as it lies
ORGANS = {"format": "deform-labels", "version": 1,
          "labels": {"1": {"skip": True}, **{str(i): {"material": "m"} for i in range(2, 6)},
                     "6": {"obstacle": True}},
          "materials": {"m": {"density": 1000, "young": 1e4, "poisson": 0.4}},
          "scene": {"time": {"duration": 0.001, "step": 0.001}, "output": {
              "every": 1, "camera": {"eye": [0.12, -0.36, 0.2], "look_at": [-0.005, 0.02, 0]},
              "color": "body"}}}


def deform(*args):
    subprocess.run([command, *map(str, args), "--quiet"], check=True)


def sections(obj):
    """Where the triangles of an OBJ file cut z = 0: ends of lines in mm, [n,2,2]."""
    points, faces = [], []
    for line in open(obj):
        word = line.split()
        if word[:1] == ["v"]:
            points.append([1e3 * float(x) for x in word[1:]])
        elif word[:1] == ["f"]:
            faces.append([int(x) - 1 for x in word[1:]])
    corner = np.array(points)[np.array(faces)] + [0, 0, 1e-9]
    out = []
    for t in corner[np.abs(np.sign(corner[:, :, 2]).sum(1)) == 1]:
        ends = []
        for p, q in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0])):
            if (p[2] < 0) != (q[2] < 0):
                ends.append((p + (q - p) * p[2] / (p[2] - q[2]))[:2])
        out.append(ends)
    return np.array(out)


def voxels():
    """Labels [z,y,x] of the file, and the edges in mm between which they lie."""
    raw = (DATA / "abdomen.nrrd").read_bytes()
    head, packed = raw.split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines()[2:] if ": " in line)
    size = [int(n) for n in fields["sizes"].split()]
    step = float(fields["space directions"].split(",")[0][1:])
    origin = [float(x) for x in fields["space origin"].strip("()").split(",")]
    extent = [origin[0] - step / 2, origin[0] + (size[0] - 0.5) * step,
              origin[1] - step / 2, origin[1] + (size[1] - 0.5) * step]
    return np.frombuffer(gzip.decompress(packed), np.uint8).reshape(size[::-1]), extent


command = sys.argv[1]
out = sys.argv[2] if len(sys.argv) > 2 else pathlib.Path(__file__).with_name("from_labels.png")
with tempfile.TemporaryDirectory() as folder:
    work = pathlib.Path(folder)
    deform("mesh", "from-labels", DATA / "abdomen.nrrd", "--table", DATA / "abdomen_labels.json",
           "--out", work / "a")
    (work / "organs.json").write_text(json.dumps(ORGANS))
    deform("mesh", "from-labels", DATA / "abdomen.nrrd", "--table", work / "organs.json",
           "--out", work / "b")
    deform("run", work / "a/scene.json", "--frames", 5, "--out", work / "run")
    deform("run", work / "b/scene.json", "--frames", 5, "--out", work / "still")
    label, extent = voxels()
    figure, axes = plt.subplots(1, 3, figsize=(13.5, 3.6))
    axes[0].imshow(label[len(label) // 2], extent=extent, origin="lower", vmin=0, vmax=6,
                   cmap=matplotlib.colors.ListedColormap(COLORS))
    for name in ("fat", "liver", "lesion", "kidney_right", "kidney_left", "spine"):
        lines = sections(work / f"a/surfaces/{name}.obj")
        axes[0].add_collection(matplotlib.collections.LineCollection(lines, colors="k", linewidths=1))
    axes[0].invert_yaxis()  # the front is above, as scans are shown
    axes[0].set(xlabel="x, mm", ylabel="y, mm", title="voxels of 4 mm and the surfaces, z = 0")
    for axis, run, frame, title in ((axes[1], "still", 0, "organs and spine"),
                                    (axes[2], "run", 2, "a probe presses on the skin")):
        axis.imshow(matplotlib.image.imread(work / run / f"frames/frame_{frame:06d}.png"))
        axis.set(title=title)
        axis.axis("off")
    figure.tight_layout()
    figure.savefig(out, dpi=110)

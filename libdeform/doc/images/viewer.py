#!/usr/bin/env python3
"""viewer.png: `deform view` on the two cylinders while the mouse pulls the upper one.
viewer_tool.png: the grasp scene, the grasper in hand.

viewer.py DEFORM_COMMAND [--out FOLDER]

Under `xvfb-run` (Debian's xvfb) where no display is set.
"""
import argparse
import os
import pathlib
import subprocess
import tempfile

import PIL.Image

ROOT = pathlib.Path(__file__).resolve().parents[3]
SCRIPTS = {
    "viewer": ("two_cylinders", """
0    slider pull 0.15
0    key space
0.9  drag 452 252 350 180 0.5 1
1.9  shot viewer.png
"""),
    "viewer_tool": ("grasp", """
0    key space
0.9  key tab
0.95 drag 560 200 680 130 0.5
1.9  shot viewer_tool.png
""")}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("command")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path(__file__).parent)
    arguments = parser.parse_args()
    shown = [] if os.environ.get("DISPLAY") else ["xvfb-run", "-a"]
    with tempfile.TemporaryDirectory() as work:
        for name, (scene, lines) in SCRIPTS.items():
            script = pathlib.Path(work) / "script.txt"
            script.write_text(lines)
            made = pathlib.Path(work) / f"{name}.png"
            subprocess.run([*shown, arguments.command, "view", ROOT / f"examples/scenes/{scene}.json",
                            "--script", script, "--out", work, "--size", "1120x630", "--detail", "full",
                            "--quiet"], check=True)
            PIL.Image.open(made).save(arguments.out / made.name, optimize=True)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""`make demo`, `python -m deform demo [OUT_DIR]`: two cylinders with friction and without, as a table, one
picture with two rows (where the command has the renderer), and summary.json.

demo.py DEFORM_COMMAND SCENE OUT_DIR
"""
from __future__ import annotations

import csv
import json
import math
import pathlib
import subprocess
import sys
from typing import Any

RUNS: dict[str, list[str]] = {
    "with friction": [],
    "without friction": ["--set", '/contact/friction=[{"between": ["*", "*"], "law": "none"}]'],
}
FRAMES_PER_SECOND = 2
# s; the pictures of a row: frictionless, the upper cylinder leaves between the third and the fourth
TIMES = (0, 0.5, 1, 1.5, 5)


def run(*argv: Any) -> None:
    done = subprocess.run([str(a) for a in argv])
    if done.returncode:
        sys.exit(f"demo: {' '.join(map(str, argv))} ended with exit code {done.returncode}; its sentence "
                 f"stands above")


def simulate(command: Any, scene: Any, out: pathlib.Path, label: str,
             options: list[str]) -> dict[str, Any]:
    """Runs the scene and returns what the table and the picture need."""
    folder = out / label.replace(" ", "_")
    print(f"--- {label}", flush=True)
    run(command, "run", scene, "--out", folder, "--frames", FRAMES_PER_SECOND, *options)
    summary = json.loads((folder / "summary.json").read_text())
    with open(folder / "bodies.csv", newline="") as file:
        rows = [r for r in csv.DictReader(file) if r["body"] == "upper"]
    start, end = ([float(row[f"com_{axis}"]) for axis in "xyz"] for row in (rows[0], rows[-1]))
    frames = sorted((folder / "frames").glob("*.png"))
    if 0 < len(frames) <= round(TIMES[-1] * FRAMES_PER_SECOND):
        sys.exit(f"demo: {folder}/frames holds {len(frames)} pictures; the scene is shorter than {TIMES[-1]} "
                 f"s")
    return {
        "upper": {"start": start, "end": end, "moved_m": math.dist(start, end)},
        "contacts": summary["contacts"], "creep_um_per_s": summary["hold"]["creep_max_um_per_s"],
        "intersections_max": summary["intersections_max"], "steps": summary["steps"],
        "simulated_s": summary["simulated_s"],
        "steps_per_second": 1000 / summary["ms_per_step"]["median"], "state_hash": summary["state_hash"],
        "pictures": [str(frames[round(t * FRAMES_PER_SECOND)]) for t in TIMES if frames],
    }


def table(runs: dict[str, dict[str, Any]]) -> None:
    def place(point: Any) -> str:
        return "({:.3f} {:.3f} {:.3f})".format(*point)

    rows = [("upper cylinder starts at (m)", lambda r: place(r["upper"]["start"])),
            ("upper cylinder ends at (m)", lambda r: place(r["upper"]["end"])),
            ("moved (m)", lambda r: f"{r['upper']['moved_m']:.3f}"),
            ("contacts, mean and most", lambda r: f"{r['contacts']['mean']:.0f}, {r['contacts']['max']}"),
            ("creep of holding contacts (um/s)", lambda r: "none hold" if r["creep_um_per_s"] is None
             else f"{r['creep_um_per_s']:.3g}"),
            ("crossing triangle pairs", lambda r: str(r["intersections_max"])),
            ("steps per second, median", lambda r: f"{r['steps_per_second']:.0f}")]
    print()
    print(f"{'':34}" + "".join(f"{label:>24}" for label in runs))
    for name, cell in rows:
        print(f"{name:34}" + "".join(f"{cell(r):>24}" for r in runs.values()))


def demo(command: Any, scene: Any, out: pathlib.Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    picture, summary = out / "two_cylinders.png", out / "summary.json"
    own = summary.exists() and b'two_cylinders.png"' in summary.read_bytes()
    for file in (summary, picture):
        if file.exists() and not own:
            sys.exit(f"demo: {file}: another program wrote this file, and it stays as it is; give another "
                     f"folder, or move the file")
    runs = {label: simulate(command, scene, out, label, options) for label, options in RUNS.items()}
    partial = out / "summary.json.part"
    told = {"scene": str(scene), "picture": str(picture), "runs": runs}
    partial.write_text(json.dumps(told, indent=2) + "\n")
    partial.replace(summary)
    drawn = all(r["pictures"] for r in runs.values())
    if drawn:
        rows = (part for label, r in runs.items() for part in ("--row", label, *r["pictures"]))
        run(command, "montage", *rows, "--out", picture)
    table(runs)
    print(f"\n{f'picture {picture}' if drawn else 'no picture (see above)'}, figures {summary}")


if __name__ == "__main__":
    demo(sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]))

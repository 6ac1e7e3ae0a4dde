#!/usr/bin/env python3
"""What a cut costs: a block, held below, is cut by one tool of each shape; processor time of the thread.

cut_cost.py OUT.csv [--commit ID] [--compiler NAME] [--cells N...]    appends rows
cut_cost.py OUT.csv --page PAGE                                       writes the page from the rows

Columns: plain_ms, a step before the cut, median; cut_ms, a step that cuts, median and largest; extra_us, time
of all steps from the first cut to the last beyond as many plain ones, by opened face or removed cell.
"""
import argparse
import csv
import json
import os
import pathlib
import platform
import tempfile
import time

import numpy as np

import deform

TOP = 0.05
TOOLS = {
    "sphere": {"radius": 0.008},
    "capsule": {"radius": 0.006, "half_length": 0.02},
    "box": {"half_size": [0.008, 0.008, 0.008]},
    "ellipsoid": {"half_size": [0.012, 0.008, 0.008]},
    "blade": {"half_size": [0.0005, 0.07, 0.02]},
    "scissors": {"half_size": [0.002, 0.006, 0.02]},
}
REACH = {"sphere": 0.008, "capsule": 0.026, "box": 0.008, "ellipsoid": 0.008, "blade": 0.02}
STEPS, PLAIN = 150, 20


def scene(shape, cells, model):
    tool = {"name": "tool", "shape": shape, "cuts": ["block"], **TOOLS[shape]}
    if shape == "scissors":   # stand in the block, open, and close
        tool["pose"] = {"position": [0, 0, TOP + 0.01]}
        tool["opening_deg"] = {"keyframes": [{"t": 1e-3 * PLAIN, "value": 60},
                                             {"t": 1e-3 * (STEPS - 30), "value": 0}]}
    else:
        at = TOP + REACH[shape]
        tool["motion"] = {"keyframes": [{"t": 1e-3 * PLAIN, "position": [0.001, 0.001, at + 0.001]},
                                        {"t": 1e-3 * (STEPS - 30), "position": [0.001, 0.001, at - 0.03]}]}
    return {"format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
            "time": {"duration": 1e-3 * STEPS, "step": 1e-3},
            "materials": {"tissue": {"density": 1060, "young": 5e3, "poisson": 0.4,
                                     "damping": {"mass": 2, "stiffness": 0.002}}},
            "bodies": [{"name": "block", "mesh": {"make": "beam", "size": [0.12, 0.12, TOP], "cells": cells},
                        "material": "tissue", "model": {"type": model},
                        "pose": {"position": [-0.06, -0.06, 0]},
                        "fix": [{"box": [[-1, -1, -1], [1, 1, 1e-4]]}]}],
            "tools": [tool]}


def measure(shape, cells, model):
    with tempfile.TemporaryDirectory() as work:
        path = pathlib.Path(work) / "scene.json"
        path.write_text(json.dumps(scene(shape, cells, model)))
        seconds, cut = [], []
        with deform.Scene(path) as opened:
            world, block = opened.world, opened.world.find_body("block")
            points, tets = block.npoint, len(block.tets)
            for _ in range(STEPS):
                begin = time.thread_time()
                world.step(1e-3)
                seconds.append(time.thread_time() - begin)
                events = world.events
                cut.append(int(events["key"][events["kind"] == 7].sum()))
    seconds, cut = 1e3 * np.array(seconds), np.array(cut)
    plain = float(np.median(seconds[3:PLAIN]))
    at = np.flatnonzero(cut)
    span = seconds[at[0]:at[-1] + 2]
    return {"model": model, "shape": shape, "what": "faces" if shape in ("blade", "scissors") else "cells",
            "points": points, "cells": tets, "cut": int(cut.sum()), "steps_that_cut": len(at),
            "plain_ms": round(plain, 3), "cut_ms": round(float(np.median(seconds[at])), 3),
            "cut_most_ms": round(float(seconds[at].max()), 3),
            "extra_us": round(1e3 * float(span.sum() - len(span) * plain) / int(cut.sum()), 1)}


PAGE = """# What a cut costs

A block of the model `msm`, 0.12 x 0.12 x 0.05 m, 5 kPa, is held below; steps take 1 ms. One tool of each
shape moves 3 cm down into it (scissors close in it). `tests/bench/cut_cost.py` measures and writes this page;
the rows are in `tests/bench/results/cut_cost.csv`. {machine}, {compiler}, commit {commit}, **load of the
machine {load}**: only factors of the processor times are significant, not percents. Median time of a step
that cuts, and of one without a cut:

| tool | {head} |
|---|{rule}
{rows}

**The time of a cut depends on the size of the body, hardly on its own; scissors, which cut twice, take
twice as long**:
{per_cell:.1f} us per cell of the whole body, since a cut rebuilds the body
([cutting]({concepts}/cutting.md#cost)). Cut much in few steps, or use few cells. A cut fits into a step of
1 ms only in a body of less than about {room:.0f} cells.

Zerbato (2010, tables 7.1 and 7.2) gives 0.7 to 0.9 ms for a step on a graphics card with 40,000 to 113,000
cells. A cut there sets bits of a mask of springs, without a new surface, and leaves the volume terms of cut
cells ([corrections](zerbato.md)).
"""


def page(out, file):
    with out.open() as rows:
        rows = list(csv.DictReader(rows))
    rows = [row for row in rows if row["commit"] == rows[-1]["commit"]]
    sizes = sorted({int(r["cells"]) for r in rows})
    named = {"no cut": ("plain_ms", lambda r: True)}
    for shape in dict.fromkeys(r["shape"] for r in rows):
        named[shape] = ("cut_ms", lambda r, shape=shape: r["shape"] == shape)
    lines = []
    for name, (column, chosen) in named.items():
        times = [np.median([float(r[column]) for r in rows if int(r["cells"]) == n and chosen(r)])
                 for n in sizes]
        lines.append(f"| {name} | " + " | ".join(f"{time:.2g} ms" for time in times) + " |")
    per_cell = float(np.median([1e3 * float(r["cut_ms"]) / int(r["cells"]) for r in rows]))
    file.write_text(PAGE.format(rows="\n".join(lines), per_cell=per_cell, room=1e3 / per_cell,
                                head=" | ".join(f"{n:,} cells" for n in sizes), rule="---|" * len(sizes),
                                concepts="../concepts", load=max(int(r["load"]) for r in rows),
                                **{key: rows[-1][key] for key in ("machine", "compiler", "commit")}))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--commit", default="unknown")
    parser.add_argument("--compiler", default="unknown")
    parser.add_argument("--machine", default=platform.machine())
    parser.add_argument("--cells", type=int, nargs="+", default=[2000, 11000, 39740])
    parser.add_argument("--page", type=pathlib.Path)
    options = parser.parse_args()
    if options.page:
        page(options.out, options.page)
        return
    for cells in options.cells:
        for shape in TOOLS:
            row = {"machine": options.machine, "compiler": options.compiler, "commit": options.commit,
                   "load": round(os.getloadavg()[0]), **measure(shape, cells, "msm")}
            new = not options.out.exists()
            with options.out.open("a") as out:
                if new:
                    out.write(",".join(row) + "\n")
                out.write(",".join(str(value) for value in row.values()) + "\n")
            print(row, flush=True)


if __name__ == "__main__":
    main()

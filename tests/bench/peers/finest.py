#!/usr/bin/env python3
"""The two answers of scenes.py that only a finer run can give: `dip` and `rise`, on finer and finer meshes.

  finest.py [--command build/release/bin/deform] [CELLS...]

deform, corotational finite elements, tr_bdf2 at 2 ms.
"""
import argparse
import os
import tempfile

import scenes
import scenes_deform
import run  # of the friction benchmark


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--command", default=os.path.join(run.ROOT, "build", "release", "bin", "deform"))
    parser.add_argument("cells", type=int, nargs="*", default=[2000, 8000, 32000])
    given = parser.parse_args()
    scenes.MOST_SECONDS = 3600
    with tempfile.TemporaryDirectory() as work:
        entry = scenes_deform.Entry(run.command_of(given.command), work)
        entry.settings = {"finest": {**scenes_deform.FEM, "step": 2e-3, "integrator": "tr_bdf2"}}
        for name, quantity in (("pair", "dip"), ("gripper", "rise")):
            case = next(c for c in scenes.cases() if c["name"] == name)
            # the dip is told before the slide begins
            if name == "pair":
                case = {**case, "span": [0.29, 0.3]}
            for cells in given.cells:
                finer = {**case, "body": {**case["body"], "cells": cells}}
                values, cost = entry.run(finer, "finest")
                print("%s, %d cells: %s %.6g, %.3g s per s" % (name, cells, quantity, values[quantity], cost),
                      flush=True)


if __name__ == "__main__":
    main()

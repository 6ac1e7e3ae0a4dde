#!/usr/bin/env python3
"""Twenty toys that are heaped (toys.json) in steps of 1/60 s: CPU milliseconds per frame of the process, by
model. Run it alone on the machine, with PYTHONPATH=bindings/python.

toys.py [MODEL ...] [--frames N]    MODEL[:INTEGRATOR]; default: all that explicit_time.md has
"""
import argparse
import json
import pathlib
import tempfile
import time

import deform

SCENE = pathlib.Path(__file__).with_name("toys.json")
MODELS = ["msm", "shape_matching", "modal", "corotational_fem:implicit_euler"]


def frames(model, integrator, count):
    scene = json.loads(SCENE.read_text())
    for body in scene["bodies"]:
        body["model"] = {"type": model}
    if integrator:
        scene["time"]["integrator"] = integrator
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "toys.json"
        path.write_text(json.dumps(scene))
        world = deform.Scene(path).world
    out = []
    for _ in range(count):
        began = time.process_time()
        world.step(scene["time"]["step"])
        out.append(1e3 * (time.process_time() - began))
    return sorted(out)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="*", default=MODELS)
    parser.add_argument("--frames", type=int, default=180)
    arguments = parser.parse_args()
    for name in arguments.models:
        model, _, integrator = name.partition(":")
        took = frames(model, integrator, arguments.frames)
        at = [took[min(int(share * len(took)), len(took) - 1)] for share in (0.5, 0.99)]
        print(f"{name}: mean {sum(took) / len(took):.1f}, median {at[0]:.1f}, 99th percentile {at[1]:.1f} ms")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Random undamped bodies that fall while the host varies its steps: how many runs the energy watch stops.

varied_steps_study.py [--runs N] [--first SEED] [--cost]

Needs the Python package, or PYTHONPATH=bindings/python and DEFORM_LIBRARY=build/release/lib/libdeform.so.
Prints each run that stops or gains more than 2 %, and at the end their number
(doc/decisions/energy_watch.md). --cost: instead, sub-steps and processor time of a beam that falls
for 1 s under frames that differ by a share, over those under equal frames.
"""
import argparse
import random
import time

import deform

SIMULATED = 2.0   # s
HOSTS = {         # lengths of steps, s
    "60 Hz": lambda r: (0.9 + 0.2 * r.random()) / 60,
    "240 Hz": lambda r: (0.7 + 0.6 * r.random()) / 240,
    "2 kHz": lambda r: (0.7 + 0.6 * r.random()) / 2000,
    "late at times": lambda r: r.choice([1 / 144] * 20 + [0.1]),
    "two": lambda r: r.choice([1 / 60] * 3 + [1 / 30]),
    "any of five": lambda r: r.choice([1e-4, 8e-3, 16e-3, 33e-3, 0.1]),
    "any": lambda r: 10 ** r.uniform(-5, -1.5),
}


def body(world, r, number, model, young):
    mesh = r.choice([lambda: deform.TetMesh.beam([0.1, 0.1, 0.1], cells=r.choice([60, 200, 500])),
                     lambda: deform.TetMesh.ball(radius=0.06, cells=200),
                     lambda: deform.TetMesh.beam([0.25, 0.05, 0.05], cells=150)])()
    return world.add_body(mesh, position=(r.uniform(-0.02, 0.02), 0, 0.1 + 0.15 * number + r.uniform(0, 0.3)),
                          rotation=(0, 0.3 * number, 0, 1), model=model, material={"young": young},
                          velocity=(r.uniform(-1, 1), 0, r.uniform(-2, 0)),
                          spin=(r.uniform(-5, 5), r.uniform(-5, 5), 0))


def energy(bodies):
    return sum(float(m.kinetic + m.elastic + 9.81 * m.mass * m.com[2]) for m in (b.measure for b in bodies))


def run(seed):
    """Says what went wrong; empty: nothing."""
    r = random.Random(seed)
    model, young = r.choice(["msm", "corotational_fem", "meshless"]), 10 ** r.uniform(4, 5.7)
    host = r.choice(list(HOSTS))
    with deform.World() as world:
        world.add_obstacle("plane", name="floor")
        bodies = [body(world, r, i, model, young) for i in range(r.choice([1, 1, 2]))]
        start = most = energy(bodies)
        where = f"{seed}: {len(bodies)} of {model}, {young:.3g} Pa, host '{host}'"
        while world.time < SIMULATED:
            try:
                world.step(HOSTS[host](r))
            except deform.Error as error:
                return f"{where}, stopped at {world.time:.3f} s: {error}"
            most = max(most, energy(bodies))
    return f"{where}, gained {most / start - 1:.1%}" if most > 1.02 * start else ""


def fall(young, frame, share):
    """Sub-steps and s of processor time, the least of three runs."""
    least = float("inf")
    for _ in range(3):
        r = random.Random(1)
        with deform.World() as world:
            world.add_obstacle("plane", name="floor")
            world.add_body(deform.TetMesh.beam([0.3, 0.1, 0.1], cells=200), position=(0, 0, 0.2),
                           model="corotational_fem", material={"young": young})
            began = time.process_time()
            while world.time < 1:
                world.step(frame * (1 + share * r.uniform(-1, 1)))
            least, substeps = min(least, time.process_time() - began), int(world.stats.substeps)
    return substeps, least


def print_costs():
    for young in (1e4, 1e5, 1e6):
        for rate in (60, 240):
            equal = fall(young, 1 / rate, 0)
            for share in (0.01, 0.1, 0.3):
                now = fall(young, 1 / rate, share)
                print(f"{young:.0e} Pa, {rate} Hz, {share:.0%}: {now[0] / equal[0]:.2f} times the sub-steps, "
                      f"{now[1] / equal[1]:.2f} times the time")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=60)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cost", action="store_true")
    options = parser.parse_args()
    if options.cost:
        return print_costs()
    bad = [what for what in map(run, range(options.first, options.first + options.runs)) if what]
    print(*bad, f"{len(bad)} of {options.runs} runs stopped or gained energy", sep="\n")


main()

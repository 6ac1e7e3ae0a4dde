"""The scenes of the comparison beside the friction benchmark: what is set up, what the answer is.

A case is told in SI units, in the form of friction/cases.py, once for each mesh. An answer is (expected,
lowest, highest). Where it comes from:

  sag, period   `beam`: finite elements of 27 nodes on their finest mesh, by reference.py (no engine in it)
  kept          `beam`: exp(-b w^2 t / 2), damping proportional to stiffness, closed form
  creep         0, exactly: below the limit Coulomb's law holds
  shortening    `stack`: finite elements of 27 nodes, the blocks as one (they stick), by reference.py
  drag          `pair`: mu, exactly: a bar of circular section bends alike both ways
  dip           `pair`: the finest run of deform
  rise          `gripper`: the finest run of deform; with rigid jaws and a rigid ball it would be 1
"""
import math
import os
import sys

FRICTION = os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "friction")
sys.path.insert(0, FRICTION)
import cases as friction_cases  # noqa: E402
import mesh_file  # noqa: E402

G = friction_cases.G
MOST_SECONDS = 30  # of processor time, for one run
band, CREEP, GEL = friction_cases.band, friction_cases.CREEP, friction_cases.GEL

SWAY = (0.0, 0.0, 100.0)  # um/s: the stack still sways at 2 Hz, by some um
BEAM = {"young": 2e6, "poisson": 0.25, "density": 1000.0, "damping_stiffness": 2e-4}
SOFT = {"young": 1e5, "poisson": 0.25, "density": 1000.0, "damping_stiffness": 4e-3}
BAR = {"young": 2e5, "poisson": 0.25, "density": 1000.0, "damping_stiffness": 4e-3}

BEAM_SIZE = [0.2, 0.04, 0.04]
# by reference.py
BEAM_SAG, BEAM_PERIOD, STACK_SHORTENING = 7.55e-3, 0.14165, 1.043e-3
# by finest.py
PAIR_DIP, GRIPPER_RISE = 1.58e-3, 0.975


def cases():
    out = []

    def add(name, cells, answer, **set_up):
        out.append({"name": name, "cells": cells, "law": "coulomb", "step": 1e-3, **set_up, "answer": answer})

    w = 2 * math.pi / BEAM_PERIOD
    kept = math.exp(-BEAM["damping_stiffness"] * w * w / 2 * 4 * BEAM_PERIOD)
    for cells in (400, 3000):
        body = {"shape": "block", "size": BEAM_SIZE, "cells": cells, "material": BEAM}
        add("beam", cells, {"sag": band(BEAM_SAG, 0.1), "period": band(BEAM_PERIOD, 0.05),
                            "kept": band(kept, 0.05)}, body=body, mu=0.5, span=[0.15, 0.85])
    for cells in (400, 3000):
        body = {"shape": "block", "size": [0.1, 0.1, 0.05], "cells": cells, "material": GEL}
        add("slope_hold", cells, {"creep_um_per_s": CREEP}, body=body, mu=0.5, share=0.9,
            angle=math.atan(0.45), tilt=1.0, span=[2.0, 4.0])
    for cells in (600, 4000):
        body = {"shape": "disc", "radius": 0.02, "height": 0.16, "cells": cells, "material": BAR}
        add("pair", cells, {"dip": band(PAIR_DIP, 0.1), "drag": band(0.3, 0.05)}, body=body, mu=0.3,
            depth=0.008, press=0.2, slide=[0.3, 0.8], travel=0.02, span=[0.7, 0.8])
    for cells in (400, 3000):
        body = {"shape": "block", "size": [0.1, 0.1, 0.05], "cells": cells, "material": SOFT}
        add("stack", cells, {"shortening": band(STACK_SHORTENING, 0.05), "creep_um_per_s": SWAY}, body=body,
            mu=0.5, count=3, angle=math.atan(0.25), tilt=0.6, span=[1.6, 2.4])
    for cells in (500, 3000):
        body = {"shape": "ball", "radius": 0.05, "cells": cells, "material": SOFT}
        add("gripper", cells, {"rise": band(GRIPPER_RISE, 0.01), "creep_um_per_s": CREEP}, body=body, mu=0.5,
            depth=0.006, close=0.3, lift=[0.4, 0.8], height=0.05, span=[1.2, 1.8])
    return out


def coarse_cases():
    """The first mesh of each scene."""
    first = {}
    for case in cases():
        first.setdefault(case["name"], case)
    return list(first.values())


def oscillation(time, z):
    """sag, period and what is kept of the amplitude in 4 periods of z = c + exp(-d t) (a cos w t + b sin w
    t), fitted; a motion that does not cross its mean has no period."""
    import numpy
    t, z = numpy.array(time), numpy.array(z)
    c = z.mean()
    up = [i for i in range(len(z) - 1) if z[i] < c <= z[i + 1]]
    if len(up) < 3:
        return {"sag": -float(z[-len(z) // 4:].mean()), "period": math.inf, "kept": math.inf}
    at = [t[i] + (c - z[i]) / (z[i + 1] - z[i]) * (t[i + 1] - t[i]) for i in up]
    w, d, t0 = 2 * math.pi * (len(at) - 1) / (at[-1] - at[0]), 0.0, t[0]

    def fit(w, d):
        e = numpy.exp(-d * (t - t0))
        columns = numpy.stack([numpy.ones_like(t), e * numpy.cos(w * t), e * numpy.sin(w * t)], 1)
        x = numpy.linalg.lstsq(columns, z, rcond=None)[0]
        return x, columns @ x - z

    for _ in range(40):
        try:
            x, r = fit(w, d)
            hw, hd = 1e-6 * w, 1e-6 * w
            jacobian = numpy.stack([(fit(w + hw, d)[1] - r) / hw, (fit(w, d + hd)[1] - r) / hd], 1)
            change = numpy.linalg.lstsq(jacobian, -r, rcond=None)[0]
        except numpy.linalg.LinAlgError:
            raise RuntimeError("unstable: not a damped oscillation")
        w, d = w + change[0], d + change[1]
        if abs(change).max() < 1e-9 * w:
            break
    period = 2 * math.pi / w
    return {"sag": -float(x[0]), "period": float(period), "kept": float(math.exp(-d * 4 * BEAM_PERIOD))}


def slope_of(time, x):
    """Straight-line fit: its slope."""
    n = len(time)
    mt, mx = sum(time) / n, sum(x) / n
    return (sum((a - mt) * (b - mx) for a, b in zip(time, x)) / sum((a - mt) ** 2 for a in time))


def dip_and_drag(case, rows):
    """Of `pair`, from rows (time, x, z) of the lower bar's center: how far it is pressed down before the
    slide begins, and how far dragged over how far pressed down while it lasts."""
    first = rows[0]
    still = [r for r in rows if r[0] <= case["slide"][0] + 1e-9][-1]
    sliding = [r for r in rows if r[0] >= case["span"][0] - 1e-9]
    return {"dip": first[2] - still[2],
            "drag": sum(r[1] - first[1] for r in sliding) / sum(first[2] - r[2] for r in sliding)}


def rise(case, rows):
    """Of `gripper`, from rows (time, z): how far the ball has risen over how far the jaws have."""
    before = [r[1] for r in rows if r[0] <= case["lift"][0] + 1e-9][-1]
    after = [r[1] for r in rows if r[0] >= case["span"][0] - 1e-9]
    return {"rise": (sum(after) / len(after) - before) / case["height"]}


def creep(case, rows):
    """From rows (time, place): how fast it moved over the span."""
    inside = [r for r in rows if r[0] >= case["span"][0] - 1e-9]
    return {"creep_um_per_s": 1e6 * abs(inside[-1][1] - inside[0][1]) / (inside[-1][0] - inside[0][0])}


def measured(case, rows, points, moved):
    """What a case asks for, from rows (time, place...) of every step and the displacements z of all points at
    the end, body after body."""
    if not all(math.isfinite(x) and abs(x) < 10 for row in rows for x in row):
        raise RuntimeError("unstable")
    if case["name"] == "beam":
        inside = [r for r in rows if r[0] >= case["span"][0]]
        return oscillation([r[0] for r in inside], [r[1] for r in inside])
    if case["name"] == "pair":
        return dip_and_drag(case, rows)
    if case["name"] == "gripper":
        return {**rise(case, rows), **creep(case, rows)}
    if case["name"] == "stack":
        n, height = len(points), case["body"]["size"][2]
        total = sum(mesh_file.shortening(points, moved[i * n:(i + 1) * n], height)
                    for i in range(case["count"]))
        return {"shortening": float(total), **creep(case, rows)}
    return creep(case, rows)


def told(case, points, text):
    """The same from what another program printed: lines `row TIME PLACE...`, `moved Z`, `used SECONDS`; with
    the processor time of a simulated second."""
    rows, moved, used = [], [], 0.0
    for line in text.splitlines():
        key, *numbers = line.split()
        if key == "row":
            rows.append([float(x) for x in numbers])
        elif key == "moved":
            moved.append(float(numbers[0]))
        elif key == "used":
            used = float(numbers[0])
    return measured(case, rows, points, moved), used / case["span"][1]


def ramp(t, begin, end):
    return min(1.0, max(0.0, (t - begin) / (end - begin)))


def smooth(t, begin, end):
    s = ramp(t, begin, end)
    return s * s * (3 - 2 * s)

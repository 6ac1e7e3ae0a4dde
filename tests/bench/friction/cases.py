"""The friction benchmark: what is set up, what the answer is, and how far from it still passes.

Every case is a deformable body on rigid ones, small enough for any engine with tetrahedra or springs. A case
is told in SI units; `answer` maps a measured quantity to (expected, lowest, highest). The answers are closed
forms, quadratures or a rigid body's ordinary differential equation, never the output of an engine. `python3
cases.py` prints all of it as JSON, for entries in other languages.

`law` is what the case needs of a friction law: "coulomb" one coefficient, "static_kinetic" mu_S > mu_C,
"dahl" an elastic bristle that slides.
"""
import json
import math

G = 9.81
GEL = {"young": 1e6, "poisson": 0.25, "density": 1000.0, "damping_stiffness": 1e-3}
CREEP = (0.0, 0.0, 1.0)  # um/s: a hold that holds
MOST_SECONDS = 300  # of processor time, for one case


class TooSlow(RuntimeError):
    """Raised by an entry that has used its time up, or foresees that twice the time would not be enough
    (`used`: what it had used then): a result like any other."""

    def __init__(self, done, end, most=None, used=None):
        most = MOST_SECONDS if most is None else most
        begun = "too slow: > %d s" % most if used is None else "too slow: %.3g s, at most %d," % (used, most)
        super().__init__("%s for %.3g of %.3g s" % (begun, done, end))


def check_time(done, end, used, most):
    """For the steps of an entry: ends a run that is too slow, or after half the time has a quarter of the way
    or less behind it."""
    if used > most:
        raise TooSlow(done, end, most)
    if used > most / 2 and done < end / 4:
        raise TooSlow(done, end, most, used)


def band(value, share):
    return (value, value * (1 - share), value * (1 + share))


def ramp_answer(mu, rate, distance):
    """tan(angle) at which a rigid block has slid `distance` on a plane that tilts at `rate` rad/s: x'' = g
    (sin a - mu cos a) past atan(mu)."""
    h, angle, v, x = 1e-5, math.atan(mu), 0.0, 0.0
    while x < distance:
        v += h * G * (math.sin(angle) - mu * math.cos(angle))
        x += h * v
        angle += h * rate
    return math.tan(angle)


def disc_force(s):
    """|F| / (mu N) of a disc of even pressure that slides at v and spins at w, s = v / (w R): the mean of
    cos(slip, v) over the disc."""
    rings, spokes, total = 400, 400, 0.0
    for i in range(rings):
        r = (i + 0.5) / rings
        for k in range(spokes):
            a = 2 * math.pi * (k + 0.5) / spokes
            x, y = s - r * math.sin(a), r * math.cos(a)
            total += r * x / math.hypot(x, y)
    return total * 2 / (rings * spokes)


def stick_slip_period(m, k, f_static, f_kinetic, speed):
    """Mass on a belt, held by a spring, plain Coulomb with two levels: stick 2 dF/(k V), slip 2/w [pi -
    atan(dF w/(k V))]."""
    w, jump = math.sqrt(k / m), f_static - f_kinetic
    return 2 * jump / (k * speed) + 2 / w * (math.pi - math.atan(jump * w / (k * speed)))


def dahl_loop(limit, stiffness, amplitude):
    """Work of one symmetric cycle of +-amplitude and the peak force: F_A = F_C tanh(s A / F_C), W = 4 (F_C A
    - F_C F_A / s)."""
    peak = limit * math.tanh(stiffness * amplitude / limit)
    return 4 * limit * (amplitude - peak / stiffness), peak


def cases():
    out = []

    def add(name, law, answer, **set_up):
        out.append({"name": name, "law": law, **set_up, "answer": answer})

    block = {"shape": "block", "size": [0.1, 0.1, 0.05], "cells": 400, "material": GEL}
    rate = math.radians(5)
    for mu in (0.2, 0.5, 0.8):
        add("slope_ramp", "coulomb", {"slip_tan": band(ramp_answer(mu, rate, 1e-3), 0.02)}, body=block, mu=mu,
            rate=rate, distance=1e-3,
            settle=0.5, step=1e-3)
    for mu in (0.2, 0.5):
        angle = math.atan(mu + 0.2)
        add("slope_slide", "coulomb", {"acceleration": band(G * (math.sin(angle) - mu * math.cos(angle)),
                                                            0.02)}, body=block, mu=mu, angle=angle,
            span=[0.2, 0.7], step=1e-3)
    for share in (0.5, 0.9, 0.99):
        add("slope_hold", "coulomb", {"creep_um_per_s": CREEP}, body=block, mu=0.5,
            angle=math.atan(0.5 * share), share=share, tilt=1.0, span=[2.0, 4.0],
            step=1e-3)
    ball = {"shape": "ball", "radius": 0.05, "cells": 2000,
            "material": {"young": 1e5, "poisson": 0.25, "density": 1000.0, "damping_stiffness": 4e-3}}
    for mu in (0.5, 1.0):
        add("pinch_hold", "coulomb", {"creep_um_per_s": CREEP, "lift_share": band(1.0, 0.01)}, body=ball,
            mu=mu, depth=0.006, close=0.3, load=0.6,
            span=[1.6, 2.6], step=5e-4)
    disc = {"shape": "disc", "radius": 0.05, "height": 0.02, "cells": 3000,
            "material": {"young": 2e5, "poisson": 0.25, "density": 1000.0, "damping_stiffness": 2e-3}}
    for s in (0.0, 0.5, 1.0, 2.0):
        # mu N R 2/3 of a disc of even pressure that only spins
        answer = {"torque_share": band(2 / 3, 0.05)} if s == 0 else {"force_share": band(disc_force(s), 0.05)}
        add("rotating_pad", "coulomb", answer, body=disc, mu=0.5, ratio=s, speed=0.05, spin=1.0, depth=4e-4,
            press=0.2, span=[0.7, 1.1], step=5e-4)
    add("vibration_drift", "coulomb", {"creep_um_per_s": CREEP}, body=block, mu=0.5, angle=math.atan(0.25),
        tilt=1.0, frequency=50.0,
        acceleration=0.2 * 0.5 * G * math.cos(math.atan(0.25)), span=[2.0, 6.0], step=5e-4)
    slab = {"shape": "block", "size": [0.05, 0.05, 0.02], "cells": 400,
            "material": {"young": 2e6, "poisson": 0.25, "density": 1000.0, "damping_stiffness": 2e-4}}
    mass, mu_s, mu_c, k, speed = 0.05, 0.6, 0.4, 50.0, 0.05
    period = stick_slip_period(mass, k, mu_s * mass * G, mu_c * mass * G, speed)
    add("belt_stick_slip", "static_kinetic", {"period": band(period, 0.05)}, body=slab, mu_S=mu_s, mu_C=mu_c,
        v_s=1e-3, stiffness=k,
        speed=speed, span=[1.0, 3.0],
        step=2e-4)
    # Pressed at its top and moved to and fro, all of it but its foot held sideways: what tilts would make the
    # pressure uneven, and a bristle law is
    # concave in the pressure. The bristles (s0 A) are 100 times softer than the shear of the lowest cells.
    pad = {**slab, "cells": 3000}
    limit, stiffness, amplitude = 2.0, 1000.0, 0.003
    work, peak = dahl_loop(limit, stiffness, amplitude)
    add("presliding_loop", "dahl", {"work_per_cycle": band(work, 0.05), "peak_force": band(peak, 0.05)},
        body=pad, mu=0.5, normal=limit / 0.5,
        sigma0=stiffness / (0.05 * 0.05), amplitude=amplitude, frequency=0.5, press=0.5, span=[2.5, 4.5],
        step=5e-4)
    return out


if __name__ == "__main__":
    print(json.dumps(cases(), indent=1))

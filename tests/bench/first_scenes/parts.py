"""Parts of first scenes: materials, models, meshes and friction as a beginner chooses them."""
import math
import pathlib

G = 9.81
DATA = pathlib.Path(__file__).resolve().parents[3] / "examples/data"
# Of tetrahedra, or closed surfaces: lowest and highest corner, by the files themselves.
FILES = {
    "bar.msh": [[0.0, 0.0, 0.0], [0.32, 0.1, 0.1]], "ball.msh": [[-0.1, -0.1, -0.1], [0.1, 0.1, 0.1]],
    "beam.msh": [[0.0, 0.0, 0.0], [0.5, 0.1, 0.1]], "block.msh": [[0.0, 0.0, 0.0], [0.1, 0.1, 0.1]],
    "cylinder_thick.msh": [[-0.2, -0.197, 0.0], [0.2, 0.197, 1.6]], "ring.msh": [[-0.045, -0.04432, 0.0],
                                                                                 [0.045, 0.04432, 0.06]],
    "rabbit.obj": [[-0.06047, -0.04992,
                    -0.04392], [0.07422, 0.04992,
                                0.1016]], "organ.obj": [[-0.07366, -0.05894, -0.04621],
                                                        [0.0941, 0.06017,
                                                         0.06151]], "orange.msh": [[-0.04, -0.04, -0.04],
                                                                                   [0.04, 0.04, 0.04]],
    "wheel.msh": [[-0.15, -0.1492, 0.0], [0.1467, 0.1492, 0.12]], "liver.msh": [[-0.1, -0.06308, -0.01293],
                                                                                [0.1, 0.06267, 0.05053]],
    "basin.obj": [[-0.4518, -0.5062, -0.1], [0.5479, 0.4842, 0.34]], "terrain.obj": [[-0.9, -0.9, -0.03103],
                                                                                     [0.9, 0.9, 0.6246]]
}

OPEN = ("basin.obj", "terrain.obj")  # obstacles only


def pick(rng, *choices):
    return rng.choice(choices)


# Name, Young's modulus in Pa, density in kg/m3. A beginner's first body does not always bear its own weight.
MATERIALS = [("jelly", 1e3, 1000), ("jelly", 3e3, 1000), ("gel", 1e4, 1000), ("gel", 2e4, 1000),
             ("foam", 3e4, 100), ("foam", 5e4, 300), ("tissue", 3e4, 1050), ("tissue", 1e4, 1050),
             ("muscle", 1e5, 1060), ("soft", 1e5, 1000), ("soft", 1e5, 1000), ("soft", 2e5, 1000),
             (None, 1e5, 1000), (None, 1e5, 1000), ("sponge", 1e5, 200), ("rubber", 5e5, 1100),
             ("rubber", 1e6, 1100), ("rubber", 5e6, 1200), ("wood", 1e8, 700), ("stone", 1e7, 2500),
             ("steel", 1e6, 7800)]


def material(rng, soft=None):
    name, young, density = rng.choice(MATERIALS)
    if name is None:
        return None, None
    if soft is True and young > 2e5:
        young = 5e4
    if soft is False and young < 1e5:
        young = 1e6
    m = {"density": density, "young": young}
    if rng.random() < 0.8:
        m["poisson"] = pick(rng, 0.25, 0.3, 0.3, 0.35, 0.4, 0.45, 0.49)
    d = pick(rng, None, None, {"stiffness": 1e-4}, {"stiffness": 1e-3}, {"stiffness": 2e-3},
             {"stiffness": 5e-3}, {"mass": 0.5}, {"mass": 2.0}, {"mass": 1.0, "stiffness": 1e-3},
             {"mass": 0.5, "stiffness": 0.003})
    if d:
        m["damping"] = dict(d)
    if rng.random() < 0.2:
        m["friction"] = pick(rng, 0, 0.2, 0.8, 1.0)
    return name, m


def model(rng):
    t = rng.choices(
        ["msm", "corotational_fem", "linear_fem", "modal", "condensed", "shape_matching", "meshless"],
        [6, 5, 1, 1, 1, 1.5, 1.5])[0]
    if t == "msm" and rng.random() < 0.6:
        return None
    m = {"type": t}
    if t == "corotational_fem" and rng.random() < 0.15:
        m["params"] = pick(rng, {"energy": "neo_hookean"}, {"locking": "nodal"}, {"energy": "stvk"},
                           {"yield": 2000})
    if t == "shape_matching" and rng.random() < 0.5:
        m["params"] = pick(rng, {"mode": "quadratic"}, {"stiffness": 0.9}, {"clusters": 4}, {"mode": "rigid"})
    return m


class Scene:

    def __init__(self, rng, duration=None):
        self.rng = rng
        self.doc = {
            "format": "deform-scene", "version": 1, "time": {"duration": duration or pick(rng, 0.5, 1, 1, 2)},
            "materials": {}, "bodies": [], "obstacles": []}
        step = pick(rng, None, None, "auto", 1e-3, 1e-3, 1 / 60, 1 / 240, 5e-4, 1e-2)
        if step:
            self.doc["time"]["step"] = step
        self.expect = []
        self.floor = None
        self.own = None
        self.same_model = None

    def shape(self, kind=None, size=None, cells=None):
        """Mesh, and the lowest and highest corner of its box."""
        rng = self.rng
        kind = kind or rng.choice(["beam"] * 4 + ["ball"] * 4 + ["cylinder"] * 2 + ["tube"] * 2 +
                                  ["sheet", "plate", "file"])
        s = size or pick(rng, 0.05, 0.1, 0.1, 0.1, 0.2, 0.2, 0.3)
        cells = cells or pick(rng, 100, 200, 300, 400, 500, 500, 800, 1000, 1000, 2000, 3000, 5000)
        if kind == "beam":
            e = [
                round(s * pick(rng, 0.5, 1, 1, 1, 2, 3), 4),
                round(s * pick(rng, 0.5, 1, 1), 4),
                round(s * pick(rng, 0.3, 0.5, 1, 1), 4)
            ]
            return {"make": "beam", "size": e, "cells": cells}, [0, 0, 0], e
        if kind == "cube":
            return {"make": "beam", "size": [s, s, s], "cells": cells}, [0, 0, 0], [s] * 3
        if kind in ("sheet", "plate"):
            e = [s * 2, s * 2, round(s * (0.05 if kind == "sheet" else 0.2), 4)]
            return {"make": "beam", "size": e, "cells": cells}, [0, 0, 0], e
        if kind == "ball":
            return {"make": "ball", "radius": s / 2, "cells": cells}, [-s / 2] * 3, [s / 2] * 3
        if kind == "cylinder":
            l = s * pick(rng, 0.5, 1, 2)
            mesh = {"make": "cylinder", "radius": s / 2, "length": l, "cells": cells}
            return mesh, [-s / 2, -s / 2, 0], [s / 2, s / 2, l]
        if kind == "tube":
            l = s * pick(rng, 0.5, 1, 2)
            inner = round(s / 2 * pick(rng, 0.5, 0.7, 0.8), 4)
            mesh = {"make": "tube", "radius": s / 2, "inner": inner, "length": l, "cells": cells}
            return mesh, [-s / 2, -s / 2, 0], [s / 2, s / 2, l]
        path, (low, high) = rng.choice([f for f in FILES.items() if f[0] not in OPEN])
        k = float(f"{s / max(h - l for l, h in zip(low, high)) * 1.5:.3g}")
        return {"file": str(DATA / path), "scale": k}, [k * x for x in low], [k * x for x in high]

    def add_material(self, name, m):
        n, i = name, 1
        while n in self.doc["materials"] and self.doc["materials"][n] != m:
            i += 1
            n = f"{name}{i}"
        self.doc["materials"][n] = m
        return n

    def body(self, name, kind=None, size=None, at=(0, 0), bottom=None, soft=None, mat=None, mod="any",
             cells=None, turn=True):
        """The body's box stands with its center above `at`, lowest point at `bottom`."""
        rng = self.rng
        mesh, low, high = self.shape(kind, size, cells)
        b = {"name": name}
        rot = None
        if "file" in mesh:
            b["mesh"] = mesh["file"]
            scale = mesh["scale"]
        else:
            b["mesh"], scale = mesh, None
        if mat is None:
            if self.own is not None and (soft is None) and rng.random() < 0.7:
                mat = self.own
            else:
                n, m = material(rng, soft)
                mat = self.own = self.add_material(n, m) if m else ""
        if mat:
            b["material"] = mat
        if mod == "any":
            if not self.same_model or rng.random() < 0.25:
                self.same_model = [model(rng)]
            mo = self.same_model[0]
        else:
            mo = mod
        if mo:
            b["model"] = mo
        c = [(l + h) / 2 for l, h in zip(low, high)]
        half = [(h - l) / 2 for l, h in zip(low, high)]
        pos = [at[0] - c[0], at[1] - c[1], bottom - low[2]]
        if turn and rng.random() < 0.25:
            axis, angle = pick(rng, ([0, 1, 0], 90), ([1, 0, 0], 90), ([0, 0, 1], 45), ([1, 0, 0], 30),
                               ([1, 1, 0], 20), ([0, 1, 0], 45))
            rot = {"axis": axis, "angle_deg": angle}
            corners = [
                rotate(axis, angle, [x, y, z]) for x in (low[0], high[0]) for y in (low[1], high[1])
                for z in (low[2], high[2])
            ]
            lo = [min(p[i] for p in corners) for i in range(3)]
            hi = [max(p[i] for p in corners) for i in range(3)]
            pos = [at[0] - (lo[0] + hi[0]) / 2, at[1] - (lo[1] + hi[1]) / 2, bottom - lo[2]]
            half = [(h - l) / 2 for l, h in zip(lo, hi)]
        b["pose"] = {"position": [round(p, 5) for p in pos]}
        if scale:
            b["pose"]["scale"] = scale
        if rot:
            b["pose"]["rotation"] = rot
        self.doc["bodies"].append(b)
        return b, {"half": half, "bottom": bottom, "top": bottom + 2 * half[2], "low": low, "high": high}

    def plane(self, **keys):
        self.doc["obstacles"].append({"name": "floor", "shape": "plane", **keys})
        if not keys:
            self.floor = 0.0

    def friction(self):
        rng = self.rng
        r = rng.random()
        if r < 0.35:
            return
        law = rng.choices(["coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms", "none"],
                          [8, 1, 1, 1, 1.5, 1, 1])[0]
        mu = pick(rng, 0.1, 0.3, 0.5, 0.5, 0.8, 1.0)
        params = {} if law == "none" else {"mu": mu}
        self.doc["contact"] = {"friction": [{"between": ["*", "*"], "law": law, "params": params}]}

    def rigid(self, name, bottom, at=(0, 0), big=0.05):
        rng = self.rng
        shape = pick(rng, "sphere", "box", "capsule", "box")
        r = big * pick(rng, 0.5, 1)
        density = pick(rng, 500, 1000, 2700, 7800)
        e = {"name": name, "shape": shape}
        if shape == "sphere":
            e["radius"] = r
            top, v = r, 4 / 3 * math.pi * r**3
        elif shape == "box":
            e["half_size"] = [r, round(r * pick(rng, 0.5, 1), 4), round(r * pick(rng, 0.5, 1), 4)]
            top, v = e["half_size"][2], 8 * math.prod(e["half_size"])
        else:
            e["radius"], e["half_length"] = r / 2, r
            top, v = 1.5 * r, math.pi * r * r / 4 * 2 * r
        e["mass"] = float(f"{density * v:.2g}") if rng.random() < 0.7 else pick(rng, 0.1, 0.5, 1.0)
        e["pose"] = {"position": [at[0], at[1], round(bottom + top, 5)]}
        self.doc.setdefault("rigid", {"host": "builtin", "bodies": []})["bodies"].append(e)
        return e, bottom + 2 * top


def rotate(axis, angle, p):
    n = math.sqrt(sum(a * a for a in axis))
    u, t = [a / n for a in axis], math.radians(angle)
    c, s = math.cos(t), math.sin(t)
    d = sum(a * b for a, b in zip(u, p))
    x = [u[1] * p[2] - u[2] * p[1], u[2] * p[0] - u[0] * p[2], u[0] * p[1] - u[1] * p[0]]
    return [p[i] * c + x[i] * s + u[i] * d * (1 - c) for i in range(3)]

"""First scenes: what a person writes in his first ten minutes, after the README and the tutorial. make(seed)
is a scene, and what physics says of it; a seed gives the same scene on every machine."""
import math
import random

from parts import DATA, FILES, G, Scene, pick, rotate


def drop(rng):
    """Some bodies fall on a floor, one above another or side by side."""
    s = Scene(rng)
    s.plane()
    z = pick(rng, 0.001, 0.01, 0.1, 0.2, 0.5)
    n = pick(rng, 1, 1, 2, 2, 3, 4, 6)
    for i in range(n):
        _, info = s.body(f"body{i + 1}", at=(round(rng.uniform(-0.02, 0.02), 3), 0), bottom=round(z, 4))
        z = info["top"] + pick(rng, 0.002, 0.01, 0.05)
    s.friction()
    return s


def side_by_side(rng):
    s = Scene(rng)
    s.plane()
    x = 0
    for i in range(pick(rng, 2, 3, 4)):
        _, info = s.body(f"body{i + 1}", at=(0, 0), bottom=pick(rng, 0.001, 0.05, 0.2))
        b = s.doc["bodies"][-1]
        b["pose"]["position"][0] = round(b["pose"]["position"][0] + x + info["half"][0], 5)
        x += 2 * info["half"][0] + 0.01
        if i == 0 and rng.random() < 0.5:
            b["velocity"] = [pick(rng, 0.5, 1, 3), 0, 0]
    s.friction()
    return s


def rest(rng):
    """A damped block put on a floor sinks by its static compression."""
    s = Scene(rng, pick(rng, 1, 2))
    s.plane()
    size = pick(rng, 0.05, 0.1, 0.2)
    young = pick(rng, 1e4, 3e4, 1e5, 1e6)
    rho = pick(rng, 500, 1000, 1000, 2000)
    h = size
    name = s.add_material(
        "rubber",
        {"density": rho, "young": young, "poisson": 0.3, "damping": {"mass": 5.0, "stiffness": 0.003}})
    mo = pick(rng, None, None, {"type": "corotational_fem"}, {"type": "corotational_fem"},
              {"type": "meshless"})
    b, info = s.body("block",
                     "cube",
                     size,
                     bottom=0.0005,
                     mat=name,
                     mod=mo,
                     cells=pick(rng, 200, 400, 1000, 2000),
                     turn=False)
    strain = rho * G * h / young
    if strain < 0.3:
        s.expect.append({"what": "sinks", "body": "block", "height": h, "u": rho * G * h * h / (3 * young)})
    s.friction()
    return s


def slope(rng):
    """A stiff block on an inclined plane: slides or holds as Coulomb says."""
    s = Scene(rng, 1)
    angle = pick(rng, 10, 20, 30)
    mu = pick(rng, 0.1, 0.3, 0.5, 0.8)
    t = math.radians(angle)
    name = s.add_material(
        "rubber", {
            "density": 1000, "young": pick(rng, 1e5, 1e6, 5e6), "poisson": 0.3,
            "damping": {"mass": 0.0, "stiffness": 0.002}
        })
    b, info = s.body("block",
                     "beam",
                     0.1,
                     bottom=0.0002,
                     mat=name,
                     turn=False,
                     mod=pick(rng, None, {"type": "corotational_fem"}, {"type": "shape_matching"},
                              {"type": "linear_fem"}, {"type": "modal"}))
    b["mesh"]["size"] = [0.2, 0.1, 0.05]
    b["pose"]["position"] = [-0.1, -0.05, 0.0002]
    if rng.random() < 0.5:
        s.plane()
        s.doc["gravity"] = [round(G * math.sin(t), 4), 0, round(-G * math.cos(t), 4)]
    else:
        s.plane(normal=[round(math.sin(t), 6), 0, round(math.cos(t), 6)])
        b["pose"] = {
            "position": [round(v, 6) for v in rotate([0, 1, 0], angle, [-0.1, -0.05, 0.0002])],
            "rotation": {"axis": [0, 1, 0], "angle_deg": angle}
        }
    law = pick(rng, "coulomb", "coulomb", "coulomb", "karnopp", "elastoplastic", "gms", "lugre", "dahl")
    s.doc["contact"] = {"friction": [{"between": ["block", "floor"], "law": law, "params": {"mu": mu}}]}
    s.expect.append({"what": "slope", "body": "block", "angle": t, "mu": mu, "law": law})
    return s


def bounce(rng):
    s = Scene(rng, 1)
    s.plane()
    r = pick(rng, 0.05, 0.1)
    young = pick(rng, 3e4, 1e5, 5e5, 1e6, 5e6)
    name = s.add_material(
        "rubber", {
            "density": 1000, "young": young, **({"poisson": 0.4} if rng.random() < 0.5 else {}),
            **({"damping": {"stiffness": 1e-4}} if rng.random() < 0.3 else {})
        })
    h = pick(rng, 0.1, 0.2, 0.5)
    b, info = s.body("ball",
                     "ball",
                     2 * r,
                     bottom=h,
                     mat=name,
                     mod=pick(rng, None, {"type": "corotational_fem"}, {"type": "meshless"},
                              {"type": "modal"}, {"type": "condensed"}, {"type": "linear_fem"}),
                     turn=False)
    s.expect.append(
        {"what": "bounces", "body": "ball", "height": h, "speed": math.sqrt(2 * G * h), "young": young})
    s.friction()
    return s


def cantilever(rng):
    s = Scene(rng)
    L = pick(rng, 0.2, 0.3, 0.5)
    w = pick(rng, 0.03, 0.05)
    b, info = s.body("beam", "beam", 0.1, bottom=0.3, turn=False)
    b["mesh"]["size"] = [L, w, w]
    b["pose"]["position"] = [0, 0, 0.3]
    b["fix"] = [{"box": [[-0.001, -1, -1], [0.001, 1, 1]]}]
    if rng.random() < 0.4:
        s.body("ball", "ball", 0.05, at=(L * 0.8, w / 2), bottom=0.3 + w + pick(rng, 0.01, 0.1))
    if rng.random() < 0.3:
        s.plane()
    if rng.random() < 0.2:
        b["forces"] = [{
            "box": [[L - 0.001, -1, -1], [L + 0.001, 1, 1]], "total": [0, 0, -pick(rng, 0.1, 1.0)]
        }]
    if rng.random() < 0.2:
        b["fix"].append({
            "box": [[L - 0.001, -1, -1], [L + 0.001, 1, 1]], "motion": {
                "keyframes": [{"t": 0, "position": [0, 0, 0]}, {
                    "t": 0.5, "position": [0, 0, 0], "rotation": {"axis": [1, 0, 0], "angle_deg": 90}
                }]
            }
        })
    return s


def rigid_on_soft(rng):
    s = Scene(rng)
    s.plane()
    bed, info = s.body("bed", pick(rng, "beam", "cube", "plate", "cylinder"), 0.2, bottom=0.001, turn=False)
    if rng.random() < 0.5:
        z0 = info["low"][2]
        bed["fix"] = [{"box": [[-1, -1, z0 - 0.001], [1, 1, z0 + 0.001]]}]
        bed["pose"]["position"][2] -= 0.001
    z = info["top"] + pick(rng, 0.002, 0.02, 0.1)
    for i in range(pick(rng, 1, 1, 2, 3)):
        e, z = s.rigid(f"box{i + 1}", round(z, 4), big=pick(rng, 0.03, 0.05, 0.08))
        z += 0.01
    s.friction()
    return s


def soft_on_rigid(rng):
    s = Scene(rng)
    s.plane()
    e, z = s.rigid("under", 0.0005, big=pick(rng, 0.05, 0.1))
    s.body("top",
           pick(rng, "ball", "beam", "plate", "cylinder", "tube"),
           0.1,
           bottom=round(z + pick(rng, 0.001, 0.01, 0.1), 4))
    s.friction()
    return s


def on_obstacle(rng):
    s = Scene(rng)
    if rng.random() < 0.6:
        s.plane()
    kind = pick(rng, "sphere", "box", "capsule", "mesh", "voxels")
    o = {"name": "thing", "shape": kind, "pose": {"position": [0, 0, 0.1]}}
    top = 0.15
    if kind == "sphere":
        o["radius"] = 0.05
    elif kind == "box":
        o["half_size"] = [0.05, 0.05, 0.05]
        if rng.random() < 0.5:
            o["pose"]["rotation"] = {"axis": [0, 1, 0], "angle_deg": pick(rng, 20, 45)}
            top = 0.1 + 0.0708
    elif kind == "capsule":
        o["radius"], o["half_length"] = 0.05, 0.1
        o["pose"]["rotation"] = {"axis": [1, 0, 0], "angle_deg": 90}
    elif kind == "mesh":
        o["mesh"] = pick(rng, "basin.obj", "terrain.obj", "rabbit.obj")
    else:
        o["mesh"] = pick(rng, "organ.obj", "rabbit.obj")
    if "mesh" in o:
        path = DATA / o["mesh"]
        low, high = FILES[o["mesh"]]
        k = 0.3 / max(h - l for l, h in zip(low, high))
        o["mesh"] = str(path)
        o["pose"] = {
            "position": [
                round(-k * (low[0] + high[0]) / 2, 4),
                round(-k * (low[1] + high[1]) / 2, 4),
                round(0.05 - k * low[2], 4)
            ], "scale": round(k, 4)
        }
        top = 0.05 + k * (high[2] - low[2])
    s.doc["obstacles"].append(o)
    s.body("body",
           None,
           pick(rng, 0.05, 0.1, 0.2),
           at=(0.005, 0),
           bottom=round(top + pick(rng, 0.005, 0.05, 0.2), 4))
    if rng.random() < 0.4:
        s.doc["bodies"][-1]["velocity"] = [0, 0, -pick(rng, 1, 3, 5)]
    s.friction()
    return s


def press(rng):
    """A plate or a ball that moves by keyframes presses a body against the floor."""
    s = Scene(rng, 1)
    s.plane()
    b, info = s.body("body",
                     pick(rng, "beam", "cube", "ball", "cylinder", "tube"),
                     0.1,
                     bottom=0.0005,
                     turn=False)
    H = info["top"]
    depth = pick(rng, 0.1, 0.2, 0.3) * H
    shape = pick(rng, "box", "sphere", "capsule", "plane")
    o = {"name": "press", "shape": shape}
    if shape == "box":
        o["half_size"] = [0.2, 0.2, 0.02]
        z0 = H + 0.025
    elif shape == "sphere":
        o["radius"] = 0.03
        z0 = H + 0.035
    elif shape == "capsule":
        o["radius"], o["half_length"] = 0.02, 0.1
        z0 = H + 0.025
    else:
        o["normal"] = [0, 0, -1]
        z0 = H + 0.005
    o["pose"] = {"position": [0, 0, round(z0, 5)]}
    if shape == "capsule":
        o["pose"]["rotation"] = {"axis": [1, 0, 0], "angle_deg": 90}
    keys = [{"t": 0, "position": [0, 0, round(z0, 5)]},
            {"t": pick(rng, 0.2, 0.5), "position": [0, 0, round(z0 - 0.005 - depth, 5)]}]
    if rng.random() < 0.5:
        keys.append(
            {"t": 0.9, "position": [pick(rng, 0, 0.05), 0,
                                    round(z0 - (0.005 + depth) * pick(rng, 0, 1), 5)]})
    o["motion"] = {"keyframes": keys}
    s.doc["obstacles"].append(o)
    s.friction()
    return s


def belt(rng):
    s = Scene(rng)
    s.doc["obstacles"].append(
        {"name": "belt", "shape": "plane", "velocity_surface": [pick(rng, 0.1, 0.5, 1), 0, 0]})
    s.floor = 0.0
    s.body("body", bottom=0.001)
    s.friction()
    return s


def push(rng):
    """A box obstacle pushes a body over the floor."""
    s = Scene(rng)
    s.plane()
    b, info = s.body("body", bottom=0.0005, turn=False)
    x0 = -info["half"][0] - 0.03
    s.doc["obstacles"].append({
        "name": "pusher", "shape": "box", "half_size": [0.02, 0.1, 0.1],
        "pose": {"position": [round(x0, 4), 0, 0.11]}, "motion": {
            "keyframes": [{"t": 0, "position": [round(x0, 4), 0, 0.11]},
                          {"t": 1, "position": [round(x0 + pick(rng, 0.1, 0.3), 4), 0, 0.11]}]
        }
    })
    s.friction()
    return s


def probe(rng):
    s = Scene(rng, 1)
    s.plane()
    b, info = s.body("tissue",
                     pick(rng, "beam", "cube", "ball", "plate", "cylinder"),
                     pick(rng, 0.05, 0.1),
                     bottom=0.0,
                     soft=True,
                     turn=False)
    b["fix"] = [{
        "box": [[-1, -1, info["low"][2] - 0.001],
                [1, 1, info["low"][2] + 0.1 * (info["high"][2] - info["low"][2])]]
    }]
    r = pick(rng, 0.005, 0.01)
    H = info["top"]
    d = H * pick(rng, 0.1, 0.2, 0.3)
    t = {
        "name": "probe", "shape": pick(rng, "sphere", "capsule", "ellipsoid"),
        "pose": {"position": [0, 0, round(H + 0.05, 4)]}
    }
    e = 0
    if t["shape"] == "sphere":
        t["radius"] = r
        e = r
    elif t["shape"] == "capsule":
        t["radius"], t["half_length"] = r, 0.03
        e = r + 0.03
    else:
        t["half_size"] = [r, r, 2 * r]
        e = 2 * r
    z1 = round(H + e - d, 4)
    t["motion"] = {
        "keyframes": [{"t": 0, "position": [0, 0, round(H + 0.05, 4)]}, {"t": 0.5, "position": [0, 0, z1]},
                      {"t": 0.7, "position": [0, 0, z1]}, {"t": 1, "position": [0, 0,
                                                                                round(H + 0.05, 4)]}]
    }
    if rng.random() < 0.3:
        t["coupling"] = {"stiffness": 500, "turn_stiffness": 1, "damping": 1}
    s.doc["tools"] = [t]
    s.friction()
    return s


def grasp(rng):
    s = Scene(rng, 2)
    s.plane()
    w = pick(rng, 0.016, 0.02)
    mat = s.add_material(
        "tissue", {
            "density": 1000, "young": pick(rng, 1e4, 3e4, 1e5), "poisson": pick(rng, 0.3, 0.4),
            **({"damping": {"stiffness": pick(rng, 1e-3, 3e-3)}} if rng.random() < 0.7 else {})
        })
    b, info = s.body("strip",
                     "beam",
                     0.1,
                     bottom=0.0005,
                     mat=mat,
                     turn=False,
                     cells=pick(rng, 100, 200, 300, 500, 1000))
    b["mesh"]["size"] = [w, 0.02, 0.06]
    b["pose"]["position"] = [-w / 2, -0.01, 0.0005]
    s.doc["tools"] = [{
        "name": "grasper", "shape": "grasper", "half_size": [0.003, 0.006, 0.02], "radius": 0.003,
        "half_length": 0.04, "pose": {"position": [0, 0, 0.105]}, "motion": {
            "keyframes": [{"t": 0, "position": [0, 0, 0.105]}, {"t": 0.4, "position": [0, 0, 0.085]},
                          {"t": 0.8, "position": [0, 0, 0.085]}, {"t": 1.6, "position": [0, 0, 0.125]}]
        }, "opening_deg": {
            "keyframes": [{"t": 0, "value": 60}, {"t": 0.4, "value": 60},
                          {"t": 0.8, "value": pick(rng, 10, 12, 15)}]
        }
    }]
    mu = pick(rng, 0.4, 0.6, 0.8)
    s.doc["contact"] = {"friction": [{"between": ["strip", "*"], "law": "coulomb", "params": {"mu": mu}}]}
    s.expect.append({"what": "moves up", "body": "strip", "by": 0.005})
    return s


def blade(rng):
    s = Scene(rng, 1)
    s.plane()
    b, info = s.body("tissue",
                     "beam",
                     0.1,
                     bottom=0.0005,
                     soft=True,
                     turn=False,
                     mod=pick(rng, None, {"type": "corotational_fem"}),
                     cells=pick(rng, 200, 500, 1000))
    b["mesh"]["size"] = [0.1, 0.04, 0.03]
    b["pose"]["position"] = [-0.05, -0.02, 0.0005]
    if rng.random() < 0.5:
        b["fix"] = [{"box": [[-0.001, -1, -1], [0.001, 1, 1]]}, {"box": [[0.099, -1, -1], [0.101, 1, 1]]}]
    if rng.random() < 0.5:
        b["separate"] = {}
    if rng.random() < 0.4 and "material" in b:
        s.doc["materials"][b["material"]]["fracture_energy"] = pick(rng, 50, 200)
    z1 = pick(rng, 0.02, 0.05)
    s.doc["tools"] = [{
        "name": "knife", "shape": "blade", "half_size": [0.0005, 0.03, 0.02],
        "pose": {"position": [0, 0, 0.07]}, "cuts": ["tissue"], "motion": {
            "keyframes": [{"t": 0, "position": [0, 0, 0.07]}, {"t": 0.6, "position": [0, 0, z1]},
                          {"t": 1, "position": [0, 0, 0.07]}]
        }
    }]
    s.friction()
    return s


def planned_cut(rng):
    s = Scene(rng, 1)
    s.plane()
    b, info = s.body("dough",
                     pick(rng, "beam", "ball", "cylinder"),
                     0.1,
                     bottom=pick(rng, 0.001, 0.1),
                     turn=False,
                     mod=pick(rng, None, {"type": "corotational_fem"}))
    if rng.random() < 0.6:
        b["separate"] = pick(rng, {}, {"least_cells": 8, "crumbs": "remove"})
    s.doc["cuts"] = [{
        "body": "dough", "t": pick(rng, 0.1, 0.3), "shape": "plane",
        "point": [0, 0, round((info["top"] - info["bottom"]) / 2,
                              4)], "normal": pick(rng, [1, 0, 0], [0, 0, 1], [1, 1, 0])
    }]
    s.friction()
    return s


def attached(rng):
    s = Scene(rng)
    s.plane()
    L = 0.2
    b, info = s.body("rope", "beam", 0.1, bottom=0.3, turn=False)
    b["mesh"]["size"] = [L, 0.03, 0.03]
    b["pose"]["position"] = [0, -0.015, 0.3]
    end = {"box": [[-1, -1, -1], [0.001, 1, 1]]}
    far = {"box": [[L - 0.001, -1, -1], [1, 1, 1]]}
    s.doc["obstacles"].append({
        "name": "hook", "shape": "box", "half_size": [0.02, 0.02, 0.02],
        "pose": {"position": [-0.0205, 0, 0.315]}
    })
    if rng.random() < 0.4:
        s.doc["obstacles"][-1]["motion"] = {
            "keyframes": [{"t": 0, "position": [-0.0205, 0, 0.315]},
                          {"t": 1, "position": [-0.0205, 0, pick(rng, 0.45, 0.2)]}]
        }
    b["attach"] = [{"to": "hook", **end}]
    if rng.random() < 0.6:
        s.doc["rigid"] = {
            "host": "builtin", "bodies": [{
                "name": "weight", "shape": "box", "half_size": [0.02, 0.02, 0.02],
                "mass": pick(rng, 0.02, 0.1, 0.5), "pose": {"position": [L + 0.0205, 0, 0.315]}
            }]
        }
        b["attach"].append({"to": "weight", **far})
    return s


def jointed(rng):
    """A motor paddle or a pendulum hits a soft body."""
    s = Scene(rng)
    s.plane()
    b, info = s.body("body", pick(rng, "ball", "cube", "cylinder"), 0.1, bottom=0.001, turn=False)
    x = -info["half"][0] - 0.04
    j = {"type": "hinge", "anchor": [round(x, 4), 0, 0.3], "axis": [0, 1, 0]}
    e = {
        "name": "paddle", "shape": "box", "half_size": [0.01, 0.05, 0.12], "mass": pick(rng, 0.2, 0.5, 1.0),
        "pose": {"position": [round(x, 4), 0, 0.18]}, "joints": [j]
    }
    if rng.random() < 0.6:
        j["motor"] = {"velocity": pick(rng, -2, -5), "max": pick(rng, 1, 5)}
    else:
        e["spin"] = [0, pick(rng, -3, -6), 0]
    s.doc["rigid"] = {"host": "builtin", "bodies": [e]}
    s.friction()
    return s


def tear(rng):
    s = Scene(rng, 1.2)
    s.plane()
    mat = s.add_material(
        "dough", {
            "density": 1000, "young": pick(rng, 1e4, 3e4, 1e5), "tear": pick(rng, 0.2, 0.35, 0.5),
            **({"damping": {"stiffness": 0.003}} if rng.random() < 0.6 else {})
        })
    b, _ = s.body("dough",
                  "beam",
                  0.1,
                  bottom=0.2,
                  mat=mat,
                  mod=pick(rng, None, {"type": "corotational_fem"}),
                  turn=False,
                  cells=pick(rng, 200, 500, 1000))
    b["mesh"]["size"] = [0.2, 0.05, 0.04]
    b["pose"]["position"] = [-0.1, -0.025, 0.2]
    b["fix"] = [{"box": [[-0.001, -1, -1], [0.001, 1, 1]]}, {
        "box": [[0.199, -1, -1], [0.201, 1, 1]], "motion": {
            "keyframes": [{"t": 0, "position": [0, 0, 0]}, {"t": 1, "position": [pick(rng, 0.1, 0.2), 0, 0]}]
        }
    }]
    if rng.random() < 0.6:
        b["separate"] = {"least_cells": 8}
    return s


def roll(rng):
    s = Scene(rng)
    a = math.radians(pick(rng, 5, 10, 20))
    s.plane()
    s.doc["gravity"] = [round(G * math.sin(a), 4), 0, round(-G * math.cos(a), 4)]
    s.body("ball", pick(rng, "ball", "ball", "cylinder", "tube", "file"), bottom=0.0005, turn=False)
    b = s.doc["bodies"][0]
    if isinstance(b["mesh"], dict) and b["mesh"]["make"] in ("cylinder", "tube"):
        r = b["mesh"]["radius"]
        b["pose"] = {"position": [0, 0, r + 0.0005], "rotation": {"axis": [1, 0, 0], "angle_deg": 90}}
    s.friction()
    return s


def switches(rng):
    """Effects that a person tries: self contact, sleep, a change of model, accuracy, a limit of time."""
    s = pick(rng, drop, rigid_on_soft, press, side_by_side)(rng)
    c = s.doc.setdefault("contact", {})
    what = pick(rng, "self", "self_auto", "sleep", "switch", "implicit", "tr", "guard",
                "accuracy", "budget", "effects", "wind", "spin")
    if what == "self":
        c["self"] = True
    elif what == "self_auto":
        c["self"] = "auto"
    elif what == "sleep":
        c["sleep"] = True
    elif what == "switch":
        s.doc["bodies"][0]["model"] = {"type": "msm"}
        s.doc["bodies"][0]["switch"] = pick(rng, [{"t": 0.3, "type": "corotational_fem"}],
                                            {"far": "modal", "touching": "corotational_fem"})
    elif what == "implicit":
        s.doc["time"]["integrator"] = "implicit_euler"
        s.doc["time"]["step"] = pick(rng, 1 / 60, 0.01, 0.002)
    elif what == "tr":
        s.doc["time"]["integrator"] = "tr_bdf2"
        s.doc["time"]["step"] = pick(rng, 1 / 60, 0.01, 0.002)
    elif what == "guard":
        c["guard"] = False
    elif what == "accuracy":
        s.doc["time"].pop("step", None)
        s.doc["accuracy"] = {"target": 0.1, "quantity": "com"}
    elif what == "budget":
        s.doc["time"].pop("step", None)
        s.doc["budget"] = {"ms_per_step": 2}
    elif what == "effects":
        s.doc["effects"] = ["friction", "stiction", "guard"]
    elif what == "spin":
        s.doc["bodies"][0]["spin"] = [0, pick(rng, 5, 20), 0]
    elif what == "wind":
        s.doc["gravity"] = {"keyframes": [{"t": 0, "value": [0, 0, -9.81]}, {"t": 0.5, "value": [5, 0, -8]}]}
    s.tried = what
    return s


CASES = {
    drop: 22, side_by_side: 8, rest: 8, slope: 10, bounce: 10, cantilever: 8, rigid_on_soft: 12,
    soft_on_rigid: 6, on_obstacle: 14, press: 10, belt: 4, push: 5, probe: 8, grasp: 6, blade: 8,
    planned_cut: 8, attached: 6, jointed: 5, tear: 4, roll: 5, switches: 14
}


def make(seed):
    rng = random.Random(seed)
    case = rng.choices(list(CASES), list(CASES.values()))[0]
    s = case(rng)
    if not s.doc["obstacles"]:
        del s.doc["obstacles"]
    return case.__name__ + (":" + s.tried if hasattr(s, "tried") else ""), s

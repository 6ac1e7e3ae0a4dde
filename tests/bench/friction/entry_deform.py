"""The benchmark's cases as scenes of `deform run`. One function per case: scene in, measured quantities out.

Laws: every case runs with every law that has its effect; coulomb and karnopp run the presliding loop too, to
show what a law without bristles answers. `defaults` is a scene that names neither model nor step: what a
newcomer gets.
"""
import csv
import json
import math
import os
import resource
import subprocess

import cases
import mesh_file

G = 9.81
DEFAULTS = "defaults"
LAWS = {"coulomb": ["coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms", DEFAULTS],
        "static_kinetic": ["coulomb", "karnopp", "lugre", "elastoplastic", "gms", DEFAULTS],
        "dahl": ["dahl", "lugre", "elastoplastic", "gms", "coulomb", "karnopp", DEFAULTS]}
# bristles that give a thousandth of a millimeter at the limit of 1 kPa
STIFF = {"dahl": {"sigma0": 1e9}, "lugre": {"sigma0": 1e9, "sigma1": 1e5},
         "elastoplastic": {"sigma0": 1e9, "sigma1": 1e5},
         "gms": {"k": [4e8, 3e8, 2e8, 1e8], "nu": [0.2, 0.3, 0.3, 0.2], "C": 1e7}}
# for search.py: what a scene with the law coulomb leaves open; None: left open
MODELS = ("corotational_fem", "linear_fem", "modal", "condensed")
SEARCH = {"model": [None, *({"type": name} for name in MODELS)],
          "step": [None, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3, 1 / 60],
          "integrator": [None, "implicit_euler", "tr_bdf2", "symplectic_euler"],
          "lattice": [None, *({"cells": n} for n in (1, 2, 3, 4, 5, 6, 8, 16, 32))]}
# hexahedra under the surface where MuJoCo begins with cells of a grid, at its own longest step
BEGIN = [*({"model": {"type": name}} for name in MODELS),
         *({"model": {"type": "corotational_fem"}, "integrator": "tr_bdf2", "step": 4e-3,
            "lattice": {"cells": n}} for n in (1, 4))]
GAP = 2e-5  # m, start distance: settles without an impact


def limited(call, most):
    """Runs a call for at most so many seconds of processor time: (what it ended with, seconds used). Without
    RLIMIT_CPU: under one the kernel counts the time of a process in ticks of 4 ms."""
    begun = resource.getrusage(resource.RUSAGE_CHILDREN)
    with subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        out = None
        while out is None:
            try:
                out = child.communicate(timeout=0.5)
            except subprocess.TimeoutExpired:
                with open("/proc/%d/stat" % child.pid) as f:
                    ticks = f.read().rpartition(")")[2].split()[11:13]
                if sum(map(int, ticks)) > most * os.sysconf("SC_CLK_TCK"):
                    child.kill()
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = ended.ru_utime + ended.ru_stime - begun.ru_utime - begun.ru_stime
    return subprocess.CompletedProcess(call, child.returncode, *out), used


class Entry:
    name, settings, SEARCH, BEGIN = "deform", {}, SEARCH, BEGIN

    def __init__(self, command, work):
        self.command, self.work = command, work
        self.meshes = {}
        version = subprocess.run([command, "--version"], capture_output=True, text=True).stdout.split()
        self.version = version[-1] if version else "unknown"

    def configurations(self, case):
        return LAWS[case["law"]]

    @staticmethod
    def possible(given):
        """Models that take hexahedra."""
        return "lattice" not in given or given.get("model", {}).get("type") in MODELS[:2]

    def lacks(self, case):
        return {"dahl": "no law with a static level"} if case["law"] == "static_kinetic" else {}

    def mesh(self, body):
        key = json.dumps(body, sort_keys=True)
        if key not in self.meshes:
            path = os.path.join(self.work, "mesh_%d.msh" % len(self.meshes))
            mesh_file.make(self.command, body, path)
            self.meshes[key] = path
        return self.meshes[key]

    def lay(self, scene, path, lattice):
        """Puts a lattice under the surface of the mesh of all bodies."""
        surface = os.path.splitext(path)[0] + ".obj"
        if not os.path.exists(surface):
            subprocess.run([self.command, "mesh", "convert", path, surface, "--quiet"], check=True)
        for body in scene["bodies"]:
            body.update(mesh=surface, lattice=lattice)
        return surface

    def run(self, case, law):
        given = self.settings.get(law)  # of what search.py tries or has found
        scene, measure = getattr(self, "scene_" + case["name"])(case, law if given is None else DEFAULTS)
        for key in ("step", "integrator"):
            if given and key in given:
                scene["time"][key] = given[key]
        for body in scene["bodies"]:
            body.update({"model": given["model"]} if given and "model" in given else {})
        if given and "lattice" in given:
            self.lay(scene, self.mesh(case["body"]), given["lattice"])
        folder = os.path.join(self.work, "run")
        path = os.path.join(self.work, "scene.json")
        with open(path, "w") as f:
            json.dump(scene, f)
        most = cases.MOST_SECONDS
        done, used = limited([self.command, "run", path, "--out", folder, "--quiet"], most)
        if used > most:
            raise cases.TooSlow(0, scene["time"]["duration"])
        if done.returncode:
            raise RuntimeError((done.stderr or done.stdout).strip().splitlines()[-1])
        with open(os.path.join(folder, "summary.json")) as f:
            summary = json.load(f)
        return measure(Tables(folder)), used / summary["simulated_s"]

    # What all scenes share. `low`: lowest point of the mesh in its own frame.
    def base(self, case, law, duration, every, gravity):
        m = case["body"]["material"]
        plain = law == DEFAULTS
        law = "coulomb" if plain else law
        params = ({"mu_S": case["mu_S"], "mu_C": case["mu_C"], "v_s": case["v_s"]} if "mu_S" in case
                  else {"mu_C" if law == "dahl" else "mu": case["mu"]})
        params.update(self.bristles(case, law) if "sigma0" in case else STIFF.get(law, {}))
        time = {"duration": duration} if plain else {"duration": duration, "step": case["step"]}
        model = {} if plain else {"model": {"type": "msm"}}
        return {"format": "deform-scene", "version": 1, "gravity": gravity,
                "time": time,
                "materials": {"gel": {"density": m["density"], "young": m["young"], "poisson": m["poisson"],
                                      "damping": {"mass": 0, "stiffness": m["damping_stiffness"]}}},
                "bodies": [{"name": "soft", "mesh": self.mesh(case["body"]), "material": "gel",
                            **model}],
                "contact": {"friction": [{"between": ["*", "*"], "law": law, "params": params}]},
                "output": {"every": every}}

    @staticmethod
    def bristles(case, law):
        """What brings a law to the case's bristles, which are Dahl's."""
        if law == "dahl":
            return {"sigma0": case["sigma0"]}
        if law in ("lugre", "elastoplastic"):  # lugre without micro-damping is Dahl's law
            return {"sigma0": case["sigma0"], "sigma1": 0}
        if law != "gms":
            return {}
        # Springs that slip obey Masing's rule, Dahl's bristle does not: with the first loading b(u) =
        # (1 + p) (1 - exp(-2 u)) / 2, u = sigma0 x / limit, p = tanh(a) at the amplitude a, their loop is
        # Dahl's closed loop. Chords of b up to a: the elements' stiffnesses are the differences of their
        # slopes; the last one does not slip and has what is left of the limit.
        n = 12
        limit = case["mu"] * case["normal"]
        area = case["body"]["size"][0] * case["body"]["size"][1]
        last = case["sigma0"] * area * case["amplitude"] / limit
        u = [last * (i + 1) / n for i in range(n)]
        b = [0.0] + [(1 + math.tanh(last)) * (1 - math.exp(-2 * x)) / 2 for x in u]
        slopes = [(y - x) * n / last for x, y in zip(b, b[1:])]
        k = [x - y for x, y in zip(slopes, slopes[1:])] + slopes[-1:]
        nu = [a * x for a, x in zip(k[:-1], u)]
        return {"k": [case["sigma0"] * a for a in k], "nu": [*nu, 1 - sum(nu)], "C": 1e7}

    def floor(self, scene, **more):
        scene["obstacles"] = [{"name": "floor", "shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1],
                               **more}]
        scene["bodies"][0]["pose"] = {"position": [0, 0, GAP]}
        return scene

    @staticmethod
    def tilting(start, end, angle, pieces=60):
        """Gravity that turns from straight down to `angle` between two times, evenly: keyframes."""
        keys = [{"t": 0, "value": [0, 0, -G]}] if start > 0 else []
        for i in range(pieces + 1):
            a = angle * i / pieces
            keys.append({"t": start + (end - start) * i / pieces,
                         "value": [G * math.sin(a), 0, -G * math.cos(a)]})
        return {"keyframes": keys}

    def scene_slope_ramp(self, case, law):
        last = math.atan(1.2 * case["mu"])
        end = case["settle"] + last / case["rate"]
        scene = self.floor(self.base(case, law, end, 0.01, self.tilting(case["settle"], end, last)))

        def measure(t):
            time, x = t.body("com_x")
            start = [value for s, value in zip(time, x) if s <= case["settle"]][-1]
            for i in range(1, len(time)):
                if x[i] - start >= case["distance"]:
                    share = (case["distance"] - (x[i - 1] - start)) / (x[i] - x[i - 1])
                    at = time[i - 1] + share * (time[i] - time[i - 1])
                    return {"slip_tan": math.tan(case["rate"] * (at - case["settle"]))}
            return {"slip_tan": math.inf}

        return scene, measure

    def scene_slope_slide(self, case, law):
        a = case["angle"]
        scene = self.floor(self.base(case, law, case["span"][1], 0.01,
                                     [G * math.sin(a), 0, -G * math.cos(a)]))

        def measure(t):
            time, v = t.body("vel_x")
            inside = [(s, u) for s, u in zip(time, v) if case["span"][0] - 1e-9 <= s]
            return {"acceleration": (inside[-1][1] - inside[0][1]) / (inside[-1][0] - inside[0][0])}

        return scene, measure

    def creep(self, case, axis):
        def measure(t):
            time, x = t.body("com_" + axis)
            inside = [(s, u) for s, u in zip(time, x)
                      if case["span"][0] - 1e-9 <= s <= case["span"][1] + 1e-9]
            return {"creep_um_per_s": 1e6 *
                    abs(inside[-1][1] - inside[0][1]) / (inside[-1][0] - inside[0][0])}

        return measure

    def scene_slope_hold(self, case, law):
        scene = self.floor(self.base(case, law, case["span"][1], 0.02,
                                     self.tilting(0.2, case["tilt"], case["angle"])))
        return scene, self.creep(case, "x")

    def scene_vibration_drift(self, case, law):
        scene = self.floor(self.base(case, law, case["span"][1], 0.02,
                                     self.tilting(0.2, case["tilt"], case["angle"])))
        w = 2 * math.pi * case["frequency"]
        scene["obstacles"][0] = {"name": "floor", "shape": "box", "half_size": [0.5, 0.5, 0.05],
                                 "pose": {"position": [0, 0, -0.05]},
                                 "motion": {"keyframes": [{"t": 0, "position": [0, 0, -0.05]}],
                                            "sine": {"amplitude": [case["acceleration"] / w ** 2, 0, 0],
                                                     "frequency": case["frequency"]}}}
        return scene, self.creep(case, "x")

    def scene_pinch_hold(self, case, law):
        r, half = case["body"]["radius"], 0.01
        gravity = {"keyframes": [{"t": 0, "value": [0, 0, 0]}, {"t": case["close"], "value": [0, 0, 0]},
                                 {"t": case["load"], "value": [0, 0, -G]}]}
        scene = self.base(case, law, case["span"][1], 0.02, gravity)
        scene["obstacles"] = []
        for name, side in (("left", -1), ("right", 1)):
            at = [side * (r + half + GAP), 0, 0]
            shut = [side * (r + half - case["depth"]), 0, 0]
            scene["obstacles"].append({"name": name, "shape": "box", "half_size": [half, 0.06, 0.06],
                                       "motion": {"keyframes": [{"t": 0, "position": at},
                                                                {"t": 0.8 * case["close"],
                                                                 "position": shut}]}})

        def measure(t):
            out = self.creep(case, "z")(t)
            time, f = t.body("force_z")
            carried = [u for s, u in zip(time, f) if s >= case["span"][0]]
            weight = case["body"]["material"]["density"] * t.first("volume") * G
            out["lift_share"] = sum(carried) / len(carried) / weight
            return out

        return scene, measure

    def pressed_top(self, scene, height, **motion):
        big = [[-1, -1, height - 1e-6], [1, 1, height + 1e-6]]
        scene["bodies"][0]["fix"] = [{"box": big, "motion": motion}]

    def scene_rotating_pad(self, case, law):
        """The pad's top goes down and stays; the plate below turns about z, and slides along x in the
        combined cases."""
        height, s, end = case["body"]["height"], case["ratio"], case["span"][1]
        spin = case["spin"] if s == 0 else case["speed"] / (s * case["body"]["radius"])
        speed = case["speed"] if s > 0 else 0.0
        scene = self.floor(self.base(case, law, end, 0.01, [0, 0, 0]))
        self.pressed_top(scene, height, keyframes=[{"t": 0, "position": [0, 0, 0]},
                                                   {"t": case["press"],
                                                    "position": [0, 0, -case["depth"] - GAP]}])
        # The plate moves from the first moment on; its axis passes the pad's in the middle of the measured
        # span.
        middle, keys, pieces = 0.5 * (case["span"][0] + end), [], 60
        for i in range(pieces + 1):
            t = end * i / pieces
            keys.append({"t": t, "position": [speed * (t - middle), 0, -0.05],
                         "rotation": {"axis": [0, 0, 1], "angle_deg": math.degrees(spin * t) % 360}})
        scene["obstacles"][0] = {"name": "floor", "shape": "box", "half_size": [0.5, 0.5, 0.05],
                                 "motion": {"keyframes": keys}}

        def measure(t):
            rows = [r for r in t.contacts() if case["span"][0] - 1e-9 <= float(r["t"]) <= end + 1e-9]
            mean = lambda key: sum(float(r[key]) for r in rows) / len(rows)
            if s == 0:
                largest = case["mu"] * mean("normal_N") * case["body"]["radius"]
                return {"torque_share": mean("moment_Nm") / largest}
            return {"force_share": mean("friction_N") / (case["mu"] * mean("normal_N"))}

        return scene, measure

    def scene_belt_stick_slip(self, case, law):
        scene = self.floor(self.base(case, law, case["span"][1], 0.002, [0, 0, -G]),
                           velocity_surface=[case["speed"], 0, 0])
        middle = [s / 2 for s in case["body"]["size"]]
        scene["bodies"][0]["springs"] = [{"box": [[-1, -1, -1], [1, 1, 1]], "to": middle,
                                          "stiffness": case["stiffness"]}]

        def measure(t):
            time, x = t.body("com_x")
            inside = [(s, u) for s, u in zip(time, x) if s >= case["span"][0]]
            mean = 0.5 * (max(u for _, u in inside) + min(u for _, u in inside))
            ups = []
            for (s0, u0), (s1, u1) in zip(inside, inside[1:]):
                if u0 < mean <= u1:
                    ups.append(s0 + (mean - u0) / (u1 - u0) * (s1 - s0))
            return {"period": (ups[-1] - ups[0]) / (len(ups) - 1) if len(ups) > 1 else math.inf}

        return scene, measure

    def scene_presliding_loop(self, case, law):
        height = case["body"]["size"][2]
        scene = self.floor(self.base(case, law, case["span"][1], 0.005, [0, 0, 0]))
        top = [[-1, -1, height - 1e-6], [1, 1, height + 1e-6]]
        above = [[-1, -1, 1e-6], [1, 1, 1]]
        scene["bodies"][0]["fix"] = [{"box": above, "axes": "xy",
                                      "motion": {"sine": {"amplitude": [case["amplitude"], 0, 0],
                                                          "frequency": case["frequency"]}}}]
        scene["bodies"][0]["forces"] = [{"box": top, "total": [0, 0, -case["normal"]],
                                         "keyframes": [{"t": 0, "scale": 0},
                                                       {"t": case["press"], "scale": 1}]}]

        def measure(t):
            time, f = t.body("force_x")
            position = lambda s: case["amplitude"] * math.sin(2 * math.pi * case["frequency"] * s)
            rows = [(s, u) for s, u in zip(time, f) if case["span"][0] - 1e-9 <= s <= case["span"][1] + 1e-9]
            # the force of a row is the mean over the interval that ends there
            work = sum(-u1 * (position(s1) - position(s0)) for (s0, _), (s1, u1) in zip(rows, rows[1:]))
            return {"work_per_cycle": work * (1 / case["frequency"]) / (rows[-1][0] - rows[0][0]),
                    "peak_force": max(abs(u) for _, u in rows)}

        return scene, measure


class Tables:
    """What `deform run` wrote."""

    def __init__(self, folder):
        self.folder = folder
        with open(os.path.join(folder, "summary.json")) as f:
            self.summary = json.load(f)

    def rows(self, name):
        with open(os.path.join(self.folder, name)) as f:
            return list(csv.DictReader(f))

    def body(self, column):
        rows = [r for r in self.rows("bodies.csv") if r["body"] == "soft"]
        return [float(r["t"]) for r in rows], [float(r[column]) for r in rows]

    def first(self, column):
        return self.body(column)[1][0]

    def contacts(self):
        return self.rows("contacts.csv")

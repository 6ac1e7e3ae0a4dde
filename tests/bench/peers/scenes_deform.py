"""deform on the scenes of scenes.py. The processor time is that of the steps alone (`cpu_s` of summary.json).

  defaults           neither model nor step is named: what a newcomer gets
  defaults 1 ms      the same at the step that all engines are given
  fem                corotational finite elements, the rest left open
  fem 1 ms           the same at the common step
  fem tr_bdf2 4 ms   implicit, second order, at MuJoCo's and Bullet's own longest step
  lattice 4 ms       the same with about five hexahedra under the surface of the mesh
"""
import csv
import json
import math
import os
import subprocess

import mesh_file
import scenes
import entry_deform  # of the friction benchmark

FEM = {"model": {"type": "corotational_fem"}}
SETTINGS = {"defaults": {}, "defaults 1 ms": {"step": 1e-3}, "fem": FEM, "fem 1 ms": {**FEM, "step": 1e-3},
            "fem tr_bdf2 4 ms": {**FEM, "step": 4e-3, "integrator": "tr_bdf2"},
            "lattice 4 ms": {**FEM, "step": 4e-3, "integrator": "tr_bdf2", "lattice": {"cells": 5}}}
GAP = 2e-5  # m, start distance: settles without an impact


class Entry:
    name, settings, SEARCH, BEGIN = "deform", SETTINGS, entry_deform.SEARCH, entry_deform.BEGIN
    lattice, lay, possible = None, entry_deform.Entry.lay, staticmethod(entry_deform.Entry.possible)

    def __init__(self, command, work):
        self.command, self.work, self.meshes = command, work, {}
        told = subprocess.run([command, "--version"], capture_output=True, text=True).stdout
        self.version = told.split()[-1]

    def configurations(self, _):
        return list(self.settings)

    def mesh(self, body):
        key = json.dumps(body, sort_keys=True)
        if key not in self.meshes:
            path = os.path.join(self.work, "mesh_%d.msh" % len(self.meshes))
            mesh_file.make(self.command, body, path)
            self.meshes[key] = path
        return self.meshes[key]

    def run(self, case, configuration):
        scene = getattr(self, "scene_" + case["name"])(case)
        given = self.settings[configuration]
        self.lattice = given.get("lattice")
        if "step" in given:
            scene["time"]["step"] = given["step"]
        if "integrator" in given:
            scene["time"]["integrator"] = given["integrator"]
        m = case["body"]["material"]
        scene.update(format="deform-scene", version=1, materials={"gel": {
            "density": m["density"], "young": m["young"], "poisson": m["poisson"],
            "damping": {"mass": 0, "stiffness": m["damping_stiffness"]}}})
        scene.setdefault("contact", {})["friction"] = [{"between": ["*", "*"], "law": "coulomb",
                                                        "params": {"mu": case["mu"]}}]
        for body in scene["bodies"]:
            body.update(mesh=self.mesh(case["body"]), material="gel", **({"model": given["model"]} if "model"
                                                                         in given else {}))
        self.surface = self.lay(scene, self.mesh(case["body"]), self.lattice) if self.lattice else None
        path, folder = os.path.join(self.work, "scene.json"), os.path.join(self.work, "run")
        with open(path, "w") as f:
            json.dump(scene, f)
        most = scenes.MOST_SECONDS
        done, used = entry_deform.limited([self.command, "run", path, "--out", folder, "--quiet"], most)
        if used > most:
            raise scenes.friction_cases.TooSlow(0, scene["time"]["duration"], most)
        if done.returncode:
            raise RuntimeError((done.stderr or done.stdout).strip().splitlines()[-1])
        with open(os.path.join(folder, "summary.json")) as f:
            summary = json.load(f)
        values = getattr(self, "measure_" + case["name"])(case, folder)
        return values, summary["cpu_s"] / summary["simulated_s"]

    @staticmethod
    def rows(folder, name, key=None):
        with open(os.path.join(folder, name)) as f:
            return [r for r in csv.DictReader(f) if key is None or r["body"] == key]

    @staticmethod
    def tilting(start, end, angle, pieces=60):
        """Gravity that turns from straight down to `angle` between two times, evenly."""
        keys = [{"t": 0, "value": [0, 0, -scenes.G]}]
        for i in range(pieces + 1):
            a = angle * i / pieces
            keys.append({"t": start + (end - start) * i / pieces,
                         "value": [scenes.G * math.sin(a), 0, -scenes.G * math.cos(a)]})
        return {"keyframes": keys}

    FLOOR = [{"name": "floor", "shape": "plane"}]

    def scene_beam(self, case):
        size = case["body"]["size"]
        return {"gravity": [0, 0, -scenes.G], "time": {"duration": case["span"][1]},
                "bodies": [{"name": "soft", "fix": [{"box": [[-1e-6, -1, -1], [1e-6, 1, 1]]}]}],
                "probes": [{"name": "tip", "body": "soft", "point": [size[0], size[1] / 2, size[2] / 2]}],
                "output": {"every": 0.002, "contacts": False}}

    def measure_beam(self, case, folder):
        rows = [(float(r["t"]), float(r["z"])) for r in self.rows(folder, "probes.csv")]
        inside = [r for r in rows if r[0] >= case["span"][0]]
        return scenes.oscillation([r[0] for r in inside], [r[1] - rows[0][1] for r in inside])

    def scene_slope_hold(self, case):
        return {"gravity": self.tilting(0.2, case["tilt"], case["angle"]),
                "time": {"duration": case["span"][1]}, "obstacles": self.FLOOR,
                "bodies": [{"name": "soft", "pose": {"position": [0, 0, GAP]}}],
                "output": {"every": 0.02}}

    def creep(self, case, folder, body, axis):
        rows = [(float(r["t"]), float(r["com_" + axis])) for r in self.rows(folder, "bodies.csv", body)]
        inside = [r for r in rows if case["span"][0] - 1e-9 <= r[0]]
        return {"creep_um_per_s": 1e6 * abs(inside[-1][1] - inside[0][1]) / (inside[-1][0] - inside[0][0])}

    def measure_slope_hold(self, case, folder):
        return self.creep(case, folder, "soft", "x")

    def scene_pair(self, case):
        half, r = case["body"]["height"] / 2, case["body"]["radius"]
        ends = lambda: [{"box": [[-1, -1, -1e-6], [1, 1, 1e-6]]},
                        {"box": [[-1, -1, 2 * half - 1e-6], [1, 1, 2 * half + 1e-6]]}]
        upper, down = ends(), -case["depth"]
        for end in upper:
            end["motion"] = {"keyframes": [{"t": 0, "position": [0, 0, 0]},
                                           {"t": case["press"], "position": [0, 0, down]},
                                           {"t": case["slide"][0], "position": [0, 0, down]},
                                           {"t": case["slide"][1], "position": [case["travel"], 0, down]}]}
        return {"gravity": [0, 0, 0], "time": {"duration": case["span"][1]}, "output": {"every": 0.01},
                "bodies": [{"name": "lower", "fix": ends(), "pose": {
                    "position": [0, -half, 0], "rotation": {"axis": [1, 0, 0], "angle_deg": -90}}},
                           {"name": "upper", "fix": upper, "pose": {
                               "position": [-half, 0, 2 * r + GAP],
                               "rotation": {"axis": [0, 1, 0], "angle_deg": 90}}}]}

    def measure_pair(self, case, folder):
        rows = self.rows(folder, "bodies.csv", "lower")
        return scenes.dip_and_drag(case, [[float(r[k]) for k in ("t", "com_x", "com_z")] for r in rows])

    def scene_stack(self, case):
        size = case["body"]["size"]
        return {"gravity": self.tilting(0.2, case["tilt"], case["angle"]),
                "time": {"duration": case["span"][1]}, "obstacles": self.FLOOR,
                "output": {"every": 0.02, "nodes": True},
                "bodies": [{"name": "block%d" % i, "pose": {"position": [0, 0, i * (size[2] + GAP) + GAP]}}
                           for i in range(case["count"])]}

    def measure_stack(self, case, folder):
        points, _ = self.points(case["body"])
        height, total = case["body"]["size"][2], 0.0
        for i in range(case["count"]):
            u = self.rows(folder, os.path.join("nodes", "block%d.csv" % i))
            total += mesh_file.shortening(points, [float(r["uz"]) for r in u], height)
        return {"shortening": total, **self.creep(case, folder, "block%d" % (case["count"] - 1), "x")}

    def points(self, body):
        if self.lattice:
            with open(self.surface) as f:
                return [[float(x) for x in line.split()[1:4]] for line in f if line.startswith("v ")], None
        path = os.path.join(self.work, "points.msh2")
        mesh_file.make(self.command, body, path)
        return mesh_file.read(path)

    def scene_gripper(self, case):
        r, half = case["body"]["radius"], 0.01
        scene = {"gravity": [0, 0, -scenes.G], "time": {"duration": case["span"][1]},
                 "output": {"every": 0.02},
                 "bodies": [{"name": "soft", "pose": {"position": [0, 0, r + GAP]}}],
                 "obstacles": [dict(self.FLOOR[0])]}
        for name, side in (("left", -1), ("right", 1)):
            open_, shut = side * (r + half + GAP), side * (r + half - case["depth"])
            keys = [{"t": 0, "position": [open_, 0, r]}, {"t": case["close"], "position": [shut, 0, r]}]
            for i in range(41):
                t = case["lift"][0] + (case["lift"][1] - case["lift"][0]) * i / 40
                z = r + case["height"] * scenes.smooth(t, *case["lift"])
                keys.append({"t": t, "position": [shut, 0, z]})
            scene["obstacles"].append({"name": name, "shape": "box", "half_size": [half, 0.06, 0.03],
                                       "motion": {"keyframes": keys}})
        return scene

    def measure_gripper(self, case, folder):
        rows = [(float(r["t"]), float(r["com_z"])) for r in self.rows(folder, "bodies.csv", "soft")]
        return {**scenes.rise(case, rows), **self.creep(case, folder, "soft", "z")}

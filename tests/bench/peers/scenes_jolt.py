"""Jolt (npm jolt-physics, WebAssembly under node) on the scenes of scenes.py: jolt_scenes.mjs.

Its soft bodies are points, bars (edge constraints) and volumes, solved by position with compliance; there is
no Young's modulus. A bar for each edge of the same tetrahedra has the stiffness E V / l^2 (V: volume of the
tetrahedra that share the edge) times `scale`, for which the sag of the coarse beam is that of the finite
elements' limit; it depends on step and iterations and is found anew for every setting, on the coarse beam
alone. Soft bodies do not touch each other: no pair, no stack.

  default        its step, 1/60 s, 5 iterations, its drag
  default 1 ms   the same at the step that all engines are given
  tuned 4 ms     30 iterations, no drag
  tuned 1 ms     the same at the common step
"""
import json
import os
import resource
import shutil
import subprocess

import mesh_file
import scenes

SETTINGS = {"default": {"step": 1 / 60}, "default 1 ms": {},
            "tuned 4 ms": {"step": 4e-3, "iterations": 30, "damping": 0.0},
            "tuned 1 ms": {"iterations": 30, "damping": 0.0}}


class Entry:
    name, settings = "jolt", SETTINGS

    def __init__(self, command, work):
        self.command, self.work, self.meshes, self.scales = command, work, {}, {}
        self.folder = os.environ.get("JOLT", work)
        package = os.path.join(self.folder, "node_modules", "jolt-physics", "package.json")
        if not shutil.which("node") or not os.path.exists(package):
            raise SystemExit("jolt: install nodejs and npm, then `npm install --prefix FOLDER jolt-physics` "
                             "and set JOLT=FOLDER")
        with open(package) as f:
            self.version = json.load(f)["version"]

    def configurations(self, case):
        return list(self.settings) if case["name"] not in ("pair", "stack") else []

    def why_not(self, _):
        return "its soft bodies do not touch each other"

    def mesh(self, body):
        key = str(sorted(body.items(), key=str))
        if key not in self.meshes:
            path = os.path.join(self.work, "mesh_%d" % len(self.meshes))
            mesh_file.make(self.command, body, path + ".msh2")
            points, tets = mesh_file.read(path + ".msh2")
            mesh_file.write_text(path, points, tets)
            self.meshes[key] = (path, points)
        return self.meshes[key]

    def run(self, case, configuration):
        if configuration not in self.scales:
            self.scales[configuration] = self.calibrated(configuration)
        return self.once(case, configuration, self.scales[configuration])

    def calibrated(self, configuration):
        """The bars' factor at which the coarse beam sags as the finite elements' limit; what does not get
        there in six corrections stays as far as it got."""
        coarse = next(c for c in scenes.cases() if c["name"] == "beam")
        scale = 1.0
        for _ in range(6):
            values, _ = self.once(coarse, configuration, scale)
            scale = min(1e4, max(1e-4, scale * values["sag"] / scenes.BEAM_SAG))
        return scale

    def once(self, case, configuration, scale):
        path, points = self.mesh(case["body"])
        body, m = case["body"], case["body"]["material"]
        ball = case["name"] == "gripper"
        given = {"step": case["step"], "end": case["span"][1], "mu": case["mu"], "density": m["density"],
                 "young": m["young"], "scale": scale, "volume": 0, "rigid": 0, "damping": -1.0,
                 "lift": body["radius"] + 1e-4 if ball else 1e-4 if case["name"] == "slope_hold" else 0.0,
                 "radius": body.get("radius", 0.0), "rise": case.get("height", 0.0)}
        if "size" in body:
            given["length"], given["height"] = body["size"][0], body["size"][2]
        for key in ("angle", "tilt", "depth", "close"):
            given[key] = case.get(key, 0.0)
        given["lift_begin"], given["lift_end"] = case.get("lift", (0, 1))
        given.update(self.settings[configuration])
        source = os.path.join(os.path.dirname(os.path.abspath(__file__)), "jolt_scenes.mjs")
        most = scenes.MOST_SECONDS
        done = subprocess.run(["node", source, self.folder, case["name"], path,
                               *("%s=%.9g" % pair for pair in given.items())], capture_output=True, text=True,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (most, most + 5)))
        if done.returncode:
            raise RuntimeError((done.stderr.strip().splitlines() or ["ended with %d" % done.returncode])[-1])
        return scenes.told(case, points, done.stdout)

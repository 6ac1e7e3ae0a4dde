"""Bullet's deformable world (Debian libbullet-dev) on the scenes of scenes.py: bullet_scenes.cpp, compiled
when asked for, on the same tetrahedra.

  default           as the world is constructed, at the step of its demonstrations: explicit, 10 iterations,
                    1/240 s
  default 1 ms      the same at the step that all engines are given
  explicit 1 ms     100 iterations, as in its demonstrations; `matched`
  explicit 0.5 ms   the same at half the step
  implicit 1 ms     the implicit integrator, 100 iterations; `matched`
  implicit 4 ms     the same at the step of its demonstrations

`matched`: its neo-Hookean law counts 3/4 of mu at small strain; with moduli that make up for it E and nu are
the scene's. `default` takes E and nu as Bullet's own interface turns them into moduli.
"""
import os
import resource
import subprocess

import entry_bullet
import scenes

BEST = {"iterations": 100, "erp": 0.06, "matched": 1}
PLAIN = {"implicit": 0, "iterations": 10, "erp": 0.06, "matched": 0}
SETTINGS = {"default": {**PLAIN, "step": 1 / 240}, "default 1 ms": PLAIN,
            "explicit 1 ms": {**BEST, "implicit": 0},
            "explicit 0.5 ms": {**BEST, "implicit": 0, "step": 5e-4},
            "implicit 1 ms": {**BEST, "implicit": 1},
            "implicit 4 ms": {**BEST, "implicit": 1, "step": 1 / 240}}
# `compensate`: the step is taken off the damping, because a backward Euler step damps as much; `repulsion`:
# of soft bodies that touch each other
SEARCH = {**entry_bullet.SEARCH, "step": [2.5e-4, 5e-4, 1e-3, 2e-3, 1 / 240, 1 / 120], "matched": [0, 1],
          "compensate": [None, 1], "repulsion": [None, 10, 1e3, 1e5]}
FREE = ("implicit", "step", "iterations", "matched", "compensate")  # what counts where nothing touches


class Entry(entry_bullet.Entry):
    settings, SEARCH = SETTINGS, SEARCH
    source = os.path.join(os.path.dirname(os.path.abspath(__file__)), "bullet_scenes.cpp")

    def configurations(self, _):
        return list(self.settings)

    def space(self, case):
        return {key: SEARCH[key] for key in FREE} if case["name"] == "beam" else SEARCH

    def run(self, case, configuration):
        path, volume = self.mesh(case["body"])
        body, m = case["body"], case["body"]["material"]
        given = {"step": case["step"], "mu": case["mu"], "mass": m["density"] * volume, "young": m["young"],
                 "poisson": m["poisson"], "damping": m["damping_stiffness"], "end": case["span"][1],
                 "count": case.get("count", 1), "most": scenes.MOST_SECONDS}
        for key in ("angle", "tilt", "depth", "press", "travel", "close"):
            given[key] = case.get(key, 0.0)
        given["radius"] = body.get("radius", 0.0)
        given["length"] = body["size"][0] if "size" in body else 0.0
        given["height"] = body["size"][2] if "size" in body else body.get("height", 0.0)
        given["rise"] = case.get("height", 0.0)
        given["slide_begin"], given["slide_end"] = case.get("slide", (0, 1))
        given["lift_begin"], given["lift_end"] = case.get("lift", (0, 1))
        given.update(self.settings[configuration])
        # from a wall, or another soft body
        given["touch"] = given.get("margin", entry_bullet.MARGIN) * (2 if case["name"] == "pair" else 1)
        if given.pop("compensate", 0):
            given["damping"] = max(0.0, given["damping"] - given["step"])
        most = scenes.MOST_SECONDS
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        arguments = ["%s=%.9g" % pair for pair in given.items()]
        done = subprocess.run([self.program, case["name"], path, *arguments],
                              capture_output=True, text=True,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (most, most + 5)))
        used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        self.check_time(done, used, case["span"][1], most)
        if done.returncode:
            raise RuntimeError(done.stderr.strip().splitlines()[-1] if done.stderr.strip()
                               else "ended with %d" % done.returncode)
        return scenes.told(case, self.points, done.stdout)

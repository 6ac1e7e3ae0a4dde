"""Bullet's deformable world (Debian libbullet-dev) as an entry: bullet_entry.cpp, compiled when asked for, on
the same tetrahedra.

Its explicit integrator with its implicit damping, and its implicit one. Contacts of nodes only (its default,
and that of its demonstrations): with contacts of faces (SDF_RDF) the implicit world does not move at all,
without friction neither. It tells no contact forces: what carries the ball follows from its momentum, what
the floor does to the turning pad from what holds the pad's top. It has one coefficient of friction and no
bristles.

  default    as the world is constructed: explicit, 10 iterations, erp 0.06
  explicit   100 iterations, as in its demonstrations, which are what it has for a manual of this part
  implicit   the same with the implicit integrator
  ... 4 ms   with steps of 1/240 s, as in its demonstrations

`found by search`: what search.py found for the case.
"""
import os
import resource
import subprocess

import cases
import mesh_file

SETTINGS = {"default": {"implicit": 0, "iterations": 10, "erp": 0.06},
            "explicit": {"implicit": 0, "iterations": 100, "erp": 0.06},
            "implicit": {"implicit": 1, "iterations": 100, "erp": 0.06},
            "explicit 4 ms": {"implicit": 0, "iterations": 100, "erp": 0.06, "step": 1 / 240},
            "implicit 4 ms": {"implicit": 1, "iterations": 100, "erp": 0.06, "step": 1 / 240}}
MARGIN = 1e-3  # m, bullet_world.h: a soft body stands off by it
HOPELESS = 3  # bullet_world.h, kHopeless
# `reduction`: at what speed an overlap may be pushed out, cm/s; `chr`: hardness of contacts with rigid
# bodies; `face`: contacts of faces too; None: as it comes
SEARCH = {"implicit": [0, 1], "step": [2.5e-4, 5e-4, 1e-3, 2e-3, 1 / 240], "iterations": [10, 30, 100, 300],
          "erp": [0.06, 0.02, 0.2, 0.5], "reduction": [None, 1, 10, 100], "cfm": [None, 0, 0.1],
          "split": [None, 0], "chr": [None, 0.5], "margin": [None, 2e-4, 5e-4], "face": [None, 1]}


class Entry:
    name, settings, SEARCH = "bullet", SETTINGS, SEARCH
    source = os.path.join(os.path.dirname(os.path.abspath(__file__)), "bullet_entry.cpp")

    def __init__(self, command, work):
        self.command, self.work, self.meshes = command, work, {}
        try:
            flags = subprocess.run(["pkg-config", "--cflags", "--libs", "bullet"], capture_output=True,
                                   text=True)
        except FileNotFoundError:
            raise SystemExit("bullet: there is no pkg-config, which tells where Bullet is; install "
                             "pkg-config and libbullet-dev")
        if flags.returncode:
            raise SystemExit("bullet: pkg-config does not find it; install libbullet-dev")
        self.version = subprocess.run(["pkg-config", "--modversion", "bullet"], capture_output=True,
                                      text=True).stdout.strip()
        self.program = os.path.join(work, "bullet_entry")
        subprocess.run(["c++", "-O2", "-std=c++17", self.source, "-o", self.program, *flags.stdout.split()],
                       check=True)

    def configurations(self, case):
        return list(self.settings) if case["law"] == "coulomb" else []

    def why_not(self, case):
        return "no law with " + case["law"]

    def mesh(self, body):
        """Its file for the program and its volume; `points` are those of the last that was asked for."""
        key = str(sorted(body.items(), key=str))
        if key not in self.meshes:
            path = os.path.join(self.work, "mesh_%d" % len(self.meshes))
            mesh_file.make(self.command, body, path + ".msh2")
            points, tets = mesh_file.read(path + ".msh2")
            mesh_file.write_text(path, points, tets)
            self.meshes[key] = (path, mesh_file.volume(points, tets), points)
        path, volume, self.points = self.meshes[key]
        return path, volume

    @staticmethod
    def check_time(done, used, end, most):
        """Of a program that has ended: was it stopped, or did it stop itself, because of its time?"""
        last = [line for line in done.stderr.splitlines() if line.startswith("at ")]
        at = float(last[-1][3:]) if last else 0
        if done.returncode == HOPELESS:
            raise cases.TooSlow(at, end, most, used)
        if done.returncode and used > most - 2:
            raise cases.TooSlow(at, end, most)

    def run(self, case, configuration):
        path, volume = self.mesh(case["body"])
        m = case["body"]["material"]
        given = {k: v for k, v in case.items() if isinstance(v, float)}
        given.update(mass=m["density"] * volume, young=m["young"], poisson=m["poisson"],
                     damping=m["damping_stiffness"], begin=case.get("span", [0, 0])[0],
                     end=case.get("span", [0, 0])[1], radius=case["body"].get("radius", 0.0),
                     height=case["body"].get("height", 0.0))
        given.update(self.settings[configuration])
        given.update(touch=given.get("margin", MARGIN), most=cases.MOST_SECONDS)
        most = cases.MOST_SECONDS
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        arguments = ["%s=%.9g" % pair for pair in given.items()]
        done = subprocess.run([self.program, case["name"], path, *arguments], capture_output=True, text=True,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (most, most + 5)))
        used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        self.check_time(done, used, given["end"] or case["settle"], most)
        if done.returncode:
            raise RuntimeError(done.stderr.strip().splitlines()[-1] if done.stderr.strip()
                               else "ended with %d" % done.returncode)
        values = dict(line.split("=") for line in done.stdout.split())
        values = {k: float(v) for k, v in values.items()}
        return values, used / values.pop("simulated")

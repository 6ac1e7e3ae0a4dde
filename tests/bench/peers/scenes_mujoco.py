"""MuJoCo (pip install mujoco numpy) on the scenes of scenes.py: the same tetrahedra as three-dimensional
flexes, integrator `discrete`, which its manual asks for where a flex is elastic. Bodies that are driven hang
on joints whose position and velocity are prescribed in every step.

  default          all else as it comes: pyramidal cones, impratio 1, its own step of 2 ms
  default 1 ms     the same at the step that all engines are given
  hard 1 ms        impratio 1000, contacts as stiff as the step allows, exact diagonal
  hard 4 ms        the same at the longest step that its manual names
  ipc 4 ms         the same with its intersection-free mode of contacts between flexes
"""
import math
import time

import scenes
import entry_mujoco
import mesh_file

HARD = entry_mujoco.SETTINGS["hard"]
SETTINGS = {"default": {"step": 2e-3}, "default 1 ms": {},
            "hard 1 ms": HARD, "hard 4 ms": {**HARD, "step": 4e-3}}
SETTINGS["ipc 4 ms"] = {**SETTINGS["hard 4 ms"], "ipc": "enable"}
# `compensate`: the step is taken off the damping, because this integrator damps as much
SEARCH = {**entry_mujoco.SEARCH, "step": [1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3],
          "compensate": [None, 1],
          "cellcount": [None, "2 1 1", "4 1 1", "4 2 2", "1 1 2", "1 1 4", "2 2 4"]}
# what counts where nothing touches
FREE = ("step", "compensate", "dof", "cellcount", "iterations", "tolerance")
LIFT = 1.2e-4  # m: a flex's radius and a little
RADIUS = 1e-4


class Entry(entry_mujoco.Entry):
    settings, SEARCH = SETTINGS, SEARCH

    def space(self, case):
        return {key: SEARCH[key] for key in FREE} if case["name"] == "beam" else SEARCH

    def steps(self, model, data, end, before=None):
        self.most = scenes.MOST_SECONDS
        yield from super().steps(model, data, end, before)

    def run(self, case, configuration):
        case = {**case, "step": self.settings[configuration].get("step", case["step"])}
        self.case, self.given = case, self.settings[configuration]
        model, before, measure = getattr(self, "scene_" + case["name"])(case)
        data = self.mj.MjData(model)
        if "tilt" in case:
            before = lambda t: self.tilt(model, case["angle"] * scenes.ramp(t, 0.2, case["tilt"]))
        started, rows = time.process_time(), []
        self.begun = started
        for t in self.steps(model, data, case["span"][1], before and (lambda t: before(t, data)
                                                                      if before.__code__.co_argcount == 2
                                                                      else before(t))):
            rows.append((t, *measure(data)))
        used = time.process_time() - started
        moved = self.positions(data)[:, 2] - self.first[:, 2]
        return scenes.measured(case, rows, self.mesh(case["body"])[0], moved), used / case["span"][1]

    def flex(self, name, points, tets, pos, held=lambda p: False, axes=(0, 1, 2)):
        """A flex of `points` moved by `pos`; `held(point)`: is it held? `axes`: what of the body's own axes
        has become x, y and z."""
        m, given, case = self.case["body"]["material"], self.given, self.case
        mass = m["density"] * mesh_file.volume(points, tets)
        damping = max(0.0, m["damping_stiffness"] - (case["step"] if "compensate" in given else 0))
        touch = entry_mujoco.contact_of(case, given)
        given = entry_mujoco.turned(given, axes)
        pin = " ".join(str(i) for i, p in enumerate(entry_mujoco.movers(points, given)) if held(p))
        pin = '<pin id="%s"/>' % pin if pin else ""
        return ('<flexcomp name="%s" type="direct" dim="3" mass="%.9g" radius="%g"%s pos="%.9g %.9g %.9g" '
                'point="%s" element="%s"><elasticity young="%g" poisson="%g" damping="%g"/>'
                '<edge equality="false"/>'
                '<contact selfcollide="none" condim="3" %s/>%s</flexcomp>') % (
            name, mass, RADIUS, entry_mujoco.grid_of(given), *pos,
            " ".join("%.9g" % x for p in points for x in p),
            " ".join(str(i) for t in tets for i in t), m["young"], m["poisson"], damping, touch, pin)

    def world(self, content, gravity):
        given, case = self.given, self.case
        option = " ".join('%s="%s"' % (key, given[key]) for key in entry_mujoco.OPTION_KEYS if key in given)
        touch = entry_mujoco.contact_of(case, given)
        xml = ('<mujoco><size memory="2G"/><option timestep="%g" integrator="discrete" gravity="0 0 %g" %s>'
               '<flag diagexact="%s" ipc="%s"/></option><default><geom %s/></default>'
               '<worldbody>%s</worldbody></mujoco>') % (
            case["step"], -gravity, option, given.get("diagexact", "disable"), given.get("ipc", "disable"),
            touch, content)
        try:
            model = self.mj.MjModel.from_xml_string(xml)
        except ValueError as error:
            raise RuntimeError(str(error).splitlines()[0])
        self.first = self.positions(self.at_start(model))
        return model

    def at_start(self, model):
        data = self.mj.MjData(model)
        self.mj.mj_forward(model, data)
        return data

    @staticmethod
    def positions(data):
        return data.flexvert_xpos.copy()

    def weights(self, points, tets):
        import numpy
        return numpy.array(mesh_file.weights(points, tets))

    FLOOR = entry_mujoco.Entry.FLOOR

    def scene_beam(self, case):
        points, tets = self.mesh(case["body"])
        size = case["body"]["size"]
        tip = min(range(len(points)), key=lambda i: sum((a - b) ** 2 for a, b in zip(
            points[i], (size[0], size[1] / 2, size[2] / 2))))
        model = self.world(self.flex("soft", points, tets, (0, 0, 0), lambda p: p[0] < 1e-6), scenes.G)
        return model, None, lambda data: (float(data.flexvert_xpos[tip, 2] - self.first[tip, 2]),)

    def center_of(self, weight, begin):
        return lambda data: weight @ data.flexvert_xpos[begin:begin + len(weight)]

    def scene_slope_hold(self, case):
        points, tets = self.mesh(case["body"])
        model = self.world(self.FLOOR + self.flex("soft", points, tets, (0, 0, LIFT)), scenes.G)
        center = self.center_of(self.weights(points, tets), 0)
        return model, None, lambda data: (float(center(data)[0]),)

    def scene_stack(self, case):
        points, tets = self.mesh(case["body"])
        height, n = case["body"]["size"][2], len(points)
        content = self.FLOOR + "".join(
            self.flex("block%d" % i, points, tets, (0, 0, LIFT + i * (height + 2 * LIFT)))
            for i in range(case["count"]))
        center = self.center_of(self.weights(points, tets), (case["count"] - 1) * n)
        return self.world(content, scenes.G), None, lambda data: (float(center(data)[0]),)

    DRIVEN = ('<body name="%s" pos="%.9g %.9g %.9g" gravcomp="1"><joint name="%s_x" type="slide" '
              'axis="1 0 0"/><joint name="%s_z" type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="%g" '
              'diaginertia="1 1 1"/>%s</body>')

    def driven(self, name, at, mass, content):
        """Heavy, so that a contact does not count on its giving way; one that holds a flex at most so heavy
        that the flex's solve still converges."""
        return self.DRIVEN % (name, *at, name, name, mass, content)

    def drive(self, data, model, name, place, step):
        """Prescribes x and z of a driven body: `place(t)`; the velocity is that of the coming step."""
        for axis, now, next_ in zip("xz", place(data.time), place(data.time + step)):
            j = self.mj.mj_name2id(model, self.mj.mjtObj.mjOBJ_JOINT, name + "_" + axis)
            self.prescribe(data, model.jnt_qposadr[j], now, (next_ - now) / step)

    def scene_pair(self, case):
        points, tets = self.mesh(case["body"])
        half, r = case["body"]["height"] / 2, case["body"]["radius"]
        held = lambda axis: lambda p: p[axis] < 1e-6 or p[axis] > 2 * half - 1e-6
        lower, upper = mesh_file.turned(points, "y"), mesh_file.turned(points, "x")
        content = self.flex("lower", lower, tets, (0, -half, 0), held(1), (0, 2, 1)) + self.driven(
            "press", (-half, 0, 2 * r + 2 * LIFT), 1e3,
            self.flex("upper", upper, tets, (0, 0, 0), held(0), (2, 1, 0)))
        model = self.world(content, 0)
        down = case["depth"] + 2 * LIFT - 2 * RADIUS
        place = lambda t: (case["travel"] * scenes.ramp(t, *case["slide"]),
                           -down * scenes.ramp(t, 0, case["press"]))
        center = self.center_of(self.weights(points, tets), 0)

        def measure(data):
            x, _, z = center(data)
            return float(x), float(z)

        return model, lambda t, data: self.drive(data, model, "press", place, case["step"]), measure

    def scene_gripper(self, case):
        points, tets = self.mesh(case["body"])
        r, half = case["body"]["radius"], 0.01
        jaw = '<geom type="box" size="%g 0.06 0.03"/>' % half
        apart = r + half + LIFT
        content = (self.FLOOR + self.flex("soft", points, tets, (0, 0, r + LIFT)) + self.driven(
            "left", (-apart, 0, r + LIFT), 1e6, jaw) + self.driven("right", (apart, 0, r + LIFT), 1e6, jaw))
        model = self.world(content, scenes.G)
        shut = case["depth"] + LIFT - RADIUS

        def before(_, data):
            for name, side in (("left", 1), ("right", -1)):
                self.drive(data, model, name, lambda t: (
                    side * shut * scenes.ramp(t, 0, case["close"]),
                    case["height"] * scenes.smooth(t, *case["lift"])), case["step"])

        center = self.center_of(self.weights(points, tets), 0)
        return model, before, lambda data: (float(center(data)[2]),)

"""MuJoCo (pip install mujoco numpy) as an entry: the same tetrahedra as a three-dimensional flex.

It has one coefficient of friction and no bristles: the other cases are told as not run. Moving walls are
bodies on joints whose position and velocity are prescribed in every step (a mocap body would have no velocity
in contact). Its manual ("Tuning models: Deformables", "Preventing slip") asks for the integrator `discrete`
where a flex is elastic, with steps of 1 to 4 ms; its no-slip iterations are not available with a flex. So:

  default       that integrator, all else as it comes: pyramidal cones, impratio 1
  recommended   elliptic cones and impratio 10, the manual's figure for manipulation
  hard          what made the pinch creep least here: impratio 1000, contacts as stiff as the step allows
                (solref of two steps, its own clamp) and the exact diagonal (diagexact), without which
                vertices of a few milligrams get contacts that the ball pushes in by 4 of its 6 mm
  hard 4 ms     the same at the longest step that the manual names

`found by search`: what search.py found for the case.
"""
import itertools
import math
import os
import time

import cases
import mesh_file

G = 9.81
# `solref` in steps: the time constant of a contact; `step` in s, without it the case's own
SETTINGS = {"default": {}, "recommended": {"cone": "elliptic", "impratio": 10},
            "hard": {"cone": "elliptic", "impratio": 1000, "diagexact": "enable", "solref": 2}}
SETTINGS["hard 4 ms"] = {**SETTINGS["hard"], "step": 4e-3}
# None: as it comes; `dof`, `cellcount`: the points of a grid of so many cells round the body move instead of
# its own
SEARCH = {"step": [5e-4, 1e-3, 2e-3, 4e-3], "cone": [None, "elliptic"],
          "impratio": [None, 10, 100, 1000, 1e4],
          "solref": [None, 2, 3, 5, 10], "solimp": [None, "0.95 0.99 1e-4", "0.99 0.99 1e-5",
                                                    "0.9999 0.9999 1e-5"],
          "diagexact": [None, "enable"], "solver": [None, "CG"], "iterations": [None, 20, 300],
          "tolerance": [None, 1e-5, 1e-10], "dof": [None, "trilinear", "quadratic"], "margin": [None, 1e-4],
          "cellcount": [None, "2 2 1", "2 2 2", "4 4 1"], "ipc": [None, "enable"]}
BEGIN = [*({**SETTINGS["hard 4 ms"], "dof": dof, "tolerance": tolerance}
           for dof in ("trilinear", "quadratic") for tolerance in (1e-5, 1e-8)),
         {**SETTINGS["hard 4 ms"], "dof": "trilinear", "tolerance": 1e-5, "ipc": "enable"}]
OPTION_KEYS = ("cone", "impratio", "tolerance", "iterations", "solver")
# nothing in them is faster, and at the cases' own step they take four times as long
LEAST_STEP = {"pinch_hold": 2e-3, "rotating_pad": 2e-3}


def contact_of(case, given):
    """What geoms and flexes have in common; `solref` in steps."""
    touch = 'friction="%g 0.005 0.0001"' % case["mu"]
    if "solref" in given:
        touch += ' solref="%g 1"' % (given["solref"] * case["step"])
    return touch + "".join(' %s="%s"' % (key, given[key]) for key in ("solimp", "margin") if key in given)


def movers(points, given):
    """The points that move: those of the mesh, or with `dof` those of a grid round it, x slowest."""
    if "dof" not in given:
        return points
    order, axes = 2 if given["dof"] == "quadratic" else 1, []
    for axis, cells in enumerate(int(n) for n in given.get("cellcount", "1 1 1").split()):
        low, high = min(p[axis] for p in points), max(p[axis] for p in points)
        axes.append([low + (high - low) * i / (order * cells) for i in range(order * cells + 1)])
    return list(itertools.product(*axes))


def grid_of(given):
    """The same for a flex."""
    keys = [key for key in ("dof", "cellcount") if key in given and "dof" in given]
    return "".join(' %s="%s"' % (key, given[key]) for key in keys)


def turned(given, axes):
    """Settings for a body whose own axes `axes` have become x, y and z."""
    cells = given.get("cellcount", "1 1 1").split()
    return {**given, "cellcount": " ".join(cells[axis] for axis in axes)}


class Entry:
    name, settings, SEARCH, BEGIN = "mujoco", SETTINGS, SEARCH, BEGIN

    def __init__(self, command, work):
        import mujoco
        import numpy  # noqa: F401  told here if it is not there, not in the middle of a case
        self.mj, self.version = mujoco, mujoco.__version__
        self.command, self.work, self.meshes = os.path.abspath(command), work, {}
        os.chdir(work)  # where it writes its log

    def configurations(self, case):
        return list(self.settings) if case["law"] == "coulomb" else []

    def mesh(self, body):
        key = str(sorted(body.items(), key=str))
        if key not in self.meshes:
            path = os.path.join(self.work, "mesh_%d.msh2" % len(self.meshes))
            mesh_file.make(self.command, body, path)
            self.meshes[key] = mesh_file.read(path)
        return self.meshes[key]

    def run(self, case, configuration):
        step = max(case["step"], LEAST_STEP.get(case["name"], 0.0))
        case = {**case, "step": self.settings[configuration].get("step", step)}
        started = time.process_time()
        values, simulated = getattr(self, "run_" + case["name"])(case, configuration)
        return values, (time.process_time() - started) / simulated

    def model(self, case, configuration, walls="", holder="", pin="", lift=0.0):
        """The soft body over z = lift, in `holder` (a body that carries pinned points) if given; friction of
        a contact is the larger of both sides."""
        points, tets = self.mesh(case["body"])
        m = case["body"]["material"]
        mass = m["density"] * mesh_file.volume(points, tets)
        given = self.settings[configuration]
        flex = ('<flexcomp name="soft" type="direct" dim="3" mass="%.9g" radius="1e-4" pos="0 0 %g"%s '
                'point="%s" element="%s">' % (
            mass, lift, grid_of(given), " ".join("%.9g" % x for p in points for x in p),
            " ".join(str(i) for t in tets for i in t)))
        flex += ('<elasticity young="%g" poisson="%g" damping="%g"/><edge equality="false"/>' %
                 (m["young"], m["poisson"], m["damping_stiffness"]))
        option = " ".join('%s="%s"' % (key, given[key]) for key in OPTION_KEYS if key in given)
        touch = contact_of(case, given)
        flex += '<contact selfcollide="none" condim="3" %s/>%s</flexcomp>' % (touch, pin)
        xml = ('<mujoco><size memory="1G"/><option timestep="%g" integrator="discrete" %s><flag '
               'diagexact="%s" ipc="%s"/></option>'
               '<default><geom %s/></default><worldbody>%s%s</worldbody></mujoco>') % (
            case["step"], option, given.get("diagexact", "disable"), given.get("ipc", "disable"), touch,
            walls, holder % flex if holder else flex)
        try:
            model = self.mj.MjModel.from_xml_string(xml)
        except ValueError as error:
            raise RuntimeError(str(error).splitlines()[0])
        self.mass, self.begun, self.most = mass, time.process_time(), cases.MOST_SECONDS
        return model, self.mj.MjData(model)

    def steps(self, model, data, end, before=None):
        """Steps to `end`; `before(t)` prescribes what moves. Yields the time after each step."""
        for i in range(int(round(end / model.opt.timestep))):
            if before:
                before((i + 1) * model.opt.timestep)
            self.mj.mj_step(model, data)
            if data.time < (i + 0.5) * model.opt.timestep:  # it begins anew where a value is not finite
                raise RuntimeError("unstable at %g s" % ((i + 1) * model.opt.timestep))
            cases.check_time(data.time, end, time.process_time() - self.begun, self.most)
            yield data.time

    FLOOR = '<geom name="floor" type="plane" size="2 2 1"/>'
    LIFT = 1.2e-4  # the flex's radius and a little

    def center(self, data, axis):
        return float(data.flexvert_xpos[:, axis].mean())

    @staticmethod
    def tilt(model, angle):
        model.opt.gravity[:] = [G * math.sin(angle), 0, -G * math.cos(angle)]

    def run_slope_ramp(self, case, configuration):
        model, data = self.model(case, configuration, self.FLOOR, lift=self.LIFT)
        end = case["settle"] + math.atan(1.2 * case["mu"]) / case["rate"]
        start, angle = None, lambda t: max(0.0, case["rate"] * (t - case["settle"]))
        for t in self.steps(model, data, end, lambda t: self.tilt(model, angle(t))):
            if start is None and t >= case["settle"]:
                start = self.center(data, 0)
            if start is not None and self.center(data, 0) - start >= case["distance"]:
                return {"slip_tan": math.tan(angle(t))}, t
        return {"slip_tan": math.inf}, end

    def run_slope_slide(self, case, configuration):
        model, data = self.model(case, configuration, self.FLOOR, lift=self.LIFT)
        self.tilt(model, case["angle"])
        x = []
        for t in self.steps(model, data, case["span"][1]):
            x.append((t, self.center(data, 0)))
        # mean speeds of the first and the last tenth of the span
        inside = [r for r in x if r[0] >= case["span"][0]]
        n = len(inside) // 10
        speed = lambda r: (r[-1][1] - r[0][1]) / (r[-1][0] - r[0][0])
        middle = lambda r: 0.5 * (r[-1][0] + r[0][0])
        first, last = inside[:n], inside[-n:]
        return ({"acceleration": (speed(last) - speed(first)) / (middle(last) - middle(first))},
                case["span"][1])

    def creep(self, model, data, case, axis, before):
        at = []
        for t in self.steps(model, data, case["span"][1], before):
            if t >= case["span"][0] - 1e-9:
                at.append((t, self.center(data, axis)))
        return 1e6 * abs(at[-1][1] - at[0][1]) / (at[-1][0] - at[0][0])

    def run_slope_hold(self, case, configuration):
        model, data = self.model(case, configuration, self.FLOOR, lift=self.LIFT)
        share = lambda t: min(1.0, max(0.0, (t - 0.2) / (case["tilt"] - 0.2)))
        return {"creep_um_per_s": self.creep(model, data, case, 0,
                                             lambda t: self.tilt(model,
                                                                 case["angle"] * share(t)))}, case["span"][1]

    @staticmethod
    def prescribe(data, joint, position, velocity):
        data.qpos[joint], data.qvel[joint] = position, velocity

    def run_vibration_drift(self, case, configuration):
        plate = ('<body pos="0 0 -0.05" gravcomp="1"><joint name="shake" type="slide" axis="1 0 0"/><geom '
                 'type="box" size="0.5 0.5 0.05" mass="1e6"/></body>')
        model, data = self.model(case, configuration, plate, lift=self.LIFT)
        joint = model.jnt_qposadr[self.mj.mj_name2id(model, self.mj.mjtObj.mjOBJ_JOINT, "shake")]
        w = 2 * math.pi * case["frequency"]
        a = case["acceleration"] / w ** 2
        share = lambda t: min(1.0, max(0.0, (t - 0.2) / (case["tilt"] - 0.2)))

        def before(t):
            self.tilt(model, case["angle"] * share(t))
            self.prescribe(data, joint, a * math.sin(w * data.time), a * w * math.cos(w * data.time))

        return {"creep_um_per_s": self.creep(model, data, case, 0, before)}, case["span"][1]

    def wall_force(self, model, data, geoms):
        """Total contact force of the flex on geoms, N, and its moment about the z axis through the origin, N
        m."""
        import numpy
        force, moment, f6 = numpy.zeros(3), 0.0, numpy.zeros(6)
        for i in range(data.ncon):
            c = data.contact[i]
            geom = c.geom[0] if c.geom[0] >= 0 else c.geom[1]
            if geom not in geoms:
                continue
            self.mj.mj_contactForce(model, data, i, f6)
            frame = numpy.array(c.frame).reshape(3, 3)
            f = frame.T @ f6[:3]  # on the second side, from the first
            f = f if c.geom[1] >= 0 else -f
            force += f
            moment += c.pos[0] * f[1] - c.pos[1] * f[0]
        return force, moment

    def run_pinch_hold(self, case, configuration):
        r, half = case["body"]["radius"], 0.01
        walls = ""
        for name, side in (("left", -1), ("right", 1)):
            walls += ('<body pos="%g 0 0" gravcomp="1"><joint name="%s" type="slide" axis="1 0 0"/><geom '
                      'type="box" size="%g 0.06 0.06" mass="1e6"/></body>' % (
                side * (r + half + 1.2e-4), name, half))
        model, data = self.model(case, configuration, walls)
        model.opt.gravity[:] = 0
        joints = [model.jnt_qposadr[self.mj.mj_name2id(model, self.mj.mjtObj.mjOBJ_JOINT, n)]
                  for n in ("left", "right")]
        close = 0.8 * case["close"]

        def before(t):
            travel = (case["depth"] + 1.2e-4) * min(1.0, data.time / close)
            speed = (case["depth"] + 1.2e-4) / close if data.time < close else 0.0
            self.prescribe(data, joints[0], travel, speed)
            self.prescribe(data, joints[1], -travel, -speed)
            model.opt.gravity[2] = -G * min(1.0,
                                            max(0.0, (t - case["close"]) / (case["load"] - case["close"])))

        at, lift, count = [], 0.0, 0
        for t in self.steps(model, data, case["span"][1], before):
            if t >= case["span"][0] - 1e-9:
                at.append((t, self.center(data, 2)))
                lift, count = lift - self.wall_force(model, data, range(model.ngeom))[0][2], count + 1
        creep = 1e6 * abs(at[-1][1] - at[0][1]) / (at[-1][0] - at[0][0])
        return {"creep_um_per_s": creep, "lift_share": lift / count / (self.mass * G)}, case["span"][1]

    def run_rotating_pad(self, case, configuration):
        height, s, end = case["body"]["height"], case["ratio"], case["span"][1]
        points, _ = self.mesh(case["body"])
        moving = movers(points, self.settings[configuration])
        top = " ".join(str(i) for i, p in enumerate(moving) if p[2] > height - 1e-6)
        plate = ('<body name="plate" pos="0 0 -0.05"><joint name="slide" type="slide" axis="1 0 0"/><joint '
                 'name="turn" type="hinge" axis="0 0 1"/>'
                 '<geom name="plate" type="box" size="0.5 0.5 0.05" mass="1e6"/></body>')
        press = ('<body name="press" pos="0 0 0"><joint name="press" type="slide" axis="0 0 1"/><inertial '
                 'pos="0 0 0" mass="1e6" diaginertia="1 1 1"/>%s</body>')
        model, data = self.model(case, configuration, plate, press, '<pin id="%s"/>' % top, lift=self.LIFT)
        model.opt.gravity[:] = 0
        joint = {n: model.jnt_qposadr[self.mj.mj_name2id(model, self.mj.mjtObj.mjOBJ_JOINT, n)]
                 for n in ("slide", "turn", "press")}
        spin = case["spin"] if s == 0 else case["speed"] / (s * case["body"]["radius"])
        speed, middle, down = (case["speed"] if s > 0
                               else 0.0), 0.5 * (case["span"][0] + end), case["depth"] + self.LIFT - 1e-4

        def before(_):
            t = data.time
            self.prescribe(data, joint["slide"], speed * (t - middle), speed)
            self.prescribe(data, joint["turn"], spin * t, spin)
            self.prescribe(data, joint["press"], -down * min(1.0, t / case["press"]), -down / case["press"]
                           if t < case["press"] else 0.0)

        normal = force = torque = 0.0
        for t in self.steps(model, data, end, before):
            if t >= case["span"][0] - 1e-9:
                f, m = self.wall_force(model, data, range(model.ngeom))
                normal, force, torque = normal - f[2], force + math.hypot(f[0], f[1]), torque + abs(m)
        if s == 0:
            return {"torque_share": torque / (case["mu"] * normal * case["body"]["radius"])}, end
        return {"force_share": force / (case["mu"] * normal)}, end

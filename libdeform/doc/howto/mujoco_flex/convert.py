#!/usr/bin/env python3
"""Writes a deform scene from an MJCF file with soft bodies (flexcomp, dim="3"): convert.py IN.xml OUT.json

Converted: flexes of type grid and direct with their material, pins and friction; planes, spheres, boxes and
capsules, which are obstacles in the world and rigid bodies below a free joint. What has no counterpart is
printed; what would change the scene if it were passed over ends the conversion with a sentence.
"""
import csv
import itertools
import json
import math
import pathlib
import sys
import xml.etree.ElementTree as xml

# Attributes without a counterpart, and why; those of drawing are passed over in silence.
WHY = {"solref": "contacts are not springs", "solimp": "contacts are not springs", "solmix": "as solref",
       "margin": "no force at a distance; contact.offset is the rest distance", "gap": "as margin",
       "radius": "surfaces have no thickness; contact.offset is the rest distance",
       "activelayers": "the surface touches, and the guard keeps it from being crossed",
       "cone": "the cone is a circular one", "impratio": "what sticks does not creep",
       "iterations": "the solve ends at a tolerance", "tolerance": "contact.tolerance",
       "noslip_iterations": "what sticks does not creep", "solver": "one contact solve", "jacobian": "-",
       "integrator": "time.integrator auto", "edge": "the elasticity is that of the cells",
       "yield": "model corotational_fem has yield, as a stress"}
DRAWN = {"rgba", "material", "group", "flatskin", "texcoord", "inertiabox", "name", "class"}
ROLLING = "contact has no torsional or rolling friction"


def numbers(text):
    return [float(word) for word in text.split()]


def turn(q, v):
    """A vector turned by the quaternion w, x, y, z."""
    w, x, y, z = q
    t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])]
    return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2],
            v[2] + w * t[2] + x * t[1] - y * t[0]]


def times(p, q):
    return [p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
            p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
            p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
            p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]]


def pose_of(position, q):
    """As a scene writes it."""
    sine = math.hypot(*q[1:])
    pose = {"position": position}
    if sine > 1e-12:
        pose["rotation"] = {"axis": [x / sine for x in q[1:]],
                            "angle_deg": math.degrees(2 * math.atan2(sine, q[0]))}
    return pose


class Taken:
    """Attributes of an element; attributes that are not read are reported at the end."""

    def __init__(self, element, of, report):
        self.left = dict(element.attrib) if element is not None else {}
        self.of, self.report = of, report

    def take(self, key, default=None):
        return self.left.pop(key, default)

    def numbers(self, key, default):
        return numbers(self.take(key, default))

    def pose(self, parent):
        for key in ("euler", "axisangle", "xyaxes", "zaxis", "fromto"):
            if key in self.left:
                sys.exit(f"{self.of}: {key} is not converted; give pos and quat")
        position, q = self.numbers("pos", "0 0 0"), self.numbers("quat", "1 0 0 0")
        length = sum(x * x for x in q) ** 0.5
        q = [x / length for x in q]
        moved = [a + b for a, b in zip(parent[0], turn(parent[1], position))]
        return moved, times(parent[1], q)

    def end(self):
        for key, value in self.left.items():
            if key not in DRAWN:
                self.report(f'{self.of} {key}="{value}": {WHY.get(key, "no counterpart")}')


def grid(count, spacing):
    """Points and cells of flexcomp type grid: z runs fastest, six cells in each box."""
    nx, ny, nz = count
    points = [[(i - (n - 1) / 2) * s for i, n, s in zip(at, count, spacing)]
              for at in itertools.product(range(nx), range(ny), range(nz))]
    cells = []
    for i, j, k in itertools.product(range(nx - 1), range(ny - 1), range(nz - 1)):
        corner = [((i + c // 4) * ny + j + c // 2 % 2) * nz + k + c % 2 for c in range(8)]
        cells += [[corner[int(c)] for c in cell] for cell in "0243 0413 4263 4673 4513 4753".split()]
    return points, cells


def volume(points, cells):
    """Of all cells, which are turned so that each is positive."""
    total = 0
    for cell in cells:
        a, b, c, d = (points[n] for n in cell)
        u, v, w = ([p[i] - a[i] for i in range(3)] for p in (b, c, d))
        six = (u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
               u[2] * (v[0] * w[1] - v[1] * w[0]))
        if six < 0:
            cell[2:] = cell[:1:-1]
        total += abs(six) / 6
    return total


def pins(flex, name, count, n):
    """Numbers of the points that <pin> holds."""
    held = set()
    for pin in flex.findall("pin"):
        held |= {int(x) for x in numbers(pin.get("id", ""))}
        ends = [int(x) for x in numbers(pin.get("range", ""))]
        for first, last in zip(ends[::2], ends[1::2]):
            held |= set(range(first, last + 1))
        if (pin.get("grid") or pin.get("gridrange")) and count is None:
            sys.exit(f"flexcomp {name}: grid and gridrange need type grid")
        at = [int(x) for x in numbers(pin.get("grid", ""))]
        boxes = [(at[i:i + 3], at[i:i + 3]) for i in range(0, len(at), 3)]
        at = [int(x) for x in numbers(pin.get("gridrange", ""))]
        boxes += [(at[i:i + 3], at[i + 3:i + 6]) for i in range(0, len(at), 6)]
        for low, high in boxes:
            held |= {(i * count[1] + j) * count[2] + k for i, j, k in itertools.product(
                *(range(a, b + 1) for a, b in zip(low, high)))}
    if held and not 0 <= min(held) <= max(held) < n:
        sys.exit(f"flexcomp {name}: a pin names no point; there are {n}")
    return sorted(held)


class Scene:
    def __init__(self, out):
        self.out, self.messages, self.touching, self.self_contact = out, [], [], False
        self.scene = {"format": "deform-scene", "version": 1, "gravity": [0, 0, -9.81],
                      "time": {"duration": 2, "step": 0.002}, "materials": {}, "bodies": [],
                      "obstacles": [], "probes": []}

    def report(self, message):
        self.messages.append(message)

    def contact(self, taken, name):
        """What decides about pairs."""
        friction = taken.numbers("friction", "1 0.005 0.0001")
        condim = int(taken.take("condim", "3"))
        if condim > 3:
            self.report(f"{taken.of} condim={condim}: {ROLLING}")
        self.touching.append((name, friction[0], condim, int(taken.take("priority", "0")),
                              int(taken.take("contype", "1")), int(taken.take("conaffinity", "1"))))

    def option(self, root):
        option = Taken(root.find("option"), "option", self.report)
        self.scene["gravity"] = option.numbers("gravity", "0 0 -9.81")
        self.scene["time"]["step"] = float(option.take("timestep", "0.002"))
        option.end()
        for tag in ("default", "include", "asset", "equality", "contact", "tendon", "actuator", "deformable"):
            if root.find(tag) is not None:
                self.report(f"<{tag}>: not read; write what it sets where it is used")

    def flex(self, element, parent):
        name = element.get("name")
        flex = Taken(element, f"flexcomp {name}", self.report)
        kind, dim = flex.take("type", "grid"), int(flex.take("dim", "2"))
        if flex.take("dof", "full") != "full" or dim != 3 or kind not in ("grid", "direct"):
            sys.exit(f'flexcomp {name}: type="{kind}" dim="{dim}" is not converted. A gmsh file is the '
                     '"mesh" of a scene as it is; a surface is filled ("fill"); balls and beams are '
                     'made ("make"); cloth and ropes are not there: bodies have a volume')
        count, scale = None, flex.numbers("scale", "1 1 1")
        if kind == "grid":
            count = [int(x) for x in flex.numbers("count", "10 10 10")]
            points, cells = grid(count, flex.numbers("spacing", "0.02 0.02 0.02"))
        else:
            at, ids = flex.numbers("point", ""), [int(x) for x in flex.numbers("element", "")]
            points = [[x * s for x, s in zip(at[i:i + 3], scale)] for i in range(0, len(at), 3)]
            cells = [ids[i:i + 4] for i in range(0, len(ids), 4)]
        position, q = flex.pose(parent)
        elastic = Taken(element.find("elasticity"), flex.of, self.report)
        young = float(elastic.take("young", "0"))
        if young <= 0:
            sys.exit(f"flexcomp {name}: no young; edges alone have no counterpart: give the modulus (Pa)")
        self.scene["materials"][name] = {
            "density": float(flex.take("mass", "1")) / volume(points, cells), "young": young,
            "poisson": float(elastic.take("poisson", "0")),
            "damping": {"mass": 0, "stiffness": float(elastic.take("damping", "0"))}}
        mesh = self.out.with_name(f"{self.out.stem}_{name}.mesh")
        lines = ["MeshVersionFormatted 2", "Dimension 3", f"Vertices {len(points)}"]
        lines += [" ".join(f"{x:.9g}" for x in p) + " 0" for p in points] + [f"Tetrahedra {len(cells)}"]
        lines += [" ".join(str(c + 1) for c in cell) + " 0" for cell in cells] + ["End", ""]
        mesh.write_text("\n".join(lines))
        body = {"name": name, "mesh": mesh.name, "material": name, "model": {"type": "corotational_fem"},
                "pose": pose_of(position, q)}
        held = pins(element, name, count, len(points))
        if held:
            table = mesh.with_suffix(".csv")
            with table.open("w", newline="") as file:
                rows = csv.writer(file)
                rows.writerow("node fixx fixy fixz fx fy fz".split())
                rows.writerows([n, 1, 1, 1, 0, 0, 0] for n in held)
            body["nodal_bc"] = table.name
        self.scene["bodies"].append(body)
        touch = Taken(element.find("contact"), flex.of, self.report)
        self.self_contact |= touch.take("selfcollide", "auto") != "none"
        self.contact(touch, name)
        for edge in element.findall("edge"):
            self.report(f"{flex.of} <edge>: {WHY['edge']}")
        for taken in (flex, elastic, touch):
            taken.end()

    def geom(self, element, parent, free):
        name = element.get("name", f"geom{len(self.touching)}")
        geom = Taken(element, f"geom {name}", self.report)
        kind, size = geom.take("type", "sphere"), geom.numbers("size", "0 0 0")
        position, q = geom.pose(parent)
        shape = {"name": name, "shape": kind}
        if kind == "plane":
            shape |= {"point": position, "normal": turn(q, [0, 0, 1])}
        elif kind in ("sphere", "box", "capsule"):
            shape |= {"sphere": {"radius": size[0]}, "box": {"half_size": size},
                      "capsule": {"radius": size[0], "half_length": size[-1]}}[kind]
            shape["pose"] = pose_of(position, q)
        else:
            sys.exit(f'geom {name}: type="{kind}" is not converted; an obstacle of shape mesh takes a file')
        if free:
            if "mass" not in geom.left or kind == "plane":
                sys.exit(f"geom {name}: a body that moves freely needs a mass, and is no plane")
            shape["mass"] = float(geom.take("mass"))
            self.scene.setdefault("rigid", {"bodies": []})["bodies"].append(shape)
        else:
            self.scene["obstacles"].append(shape)
        self.contact(geom, name)
        geom.end()

    def body(self, element, parent, free=False):
        for child in element:
            if child.tag == "flexcomp":
                self.flex(child, parent)
            elif child.tag == "geom":
                self.geom(child, parent, free)
            elif child.tag == "body":
                joints = [j.get("type", "hinge") for j in child.findall("joint")]
                if any(kind != "free" for kind in joints):
                    sys.exit(f"body {child.get('name')}: joints are written into rigid.bodies by hand")
                place = Taken(child, f"body {child.get('name')}", self.report).pose(parent)
                self.body(child, place, bool(joints) or child.find("freejoint") is not None)

    def pairs(self):
        """One rule for each pair that may touch: the larger coefficient, as MuJoCo takes it."""
        rules, filters = [], []
        soft = {body["name"] for body in self.scene["bodies"]}
        for a, b in itertools.combinations_with_replacement(self.touching, 2):
            if (a is b and not self.self_contact) or not {a[0], b[0]} & soft:
                continue
            if not (a[4] & b[5] or b[4] & a[5]):
                filters.append({"between": [a[0], b[0]], "collide": False})
                continue
            first = a if a[3] > b[3] else b if b[3] > a[3] else (None, max(a[1], b[1]), max(a[2], b[2]))
            law = {"law": "coulomb", "params": {"mu": first[1]}} if first[2] > 1 else {"law": "none"}
            rules.append({"between": [a[0], b[0]], **law})
        self.scene["contact"] = {"self": self.self_contact, "friction": rules}
        if filters:
            self.scene["contact"]["filter"] = filters


def main():
    source, out = map(pathlib.Path, sys.argv[1:3])
    root = xml.parse(source).getroot()
    scene = Scene(out)
    scene.option(root)
    scene.body(root.find("worldbody"), ([0, 0, 0], [1, 0, 0, 0]))
    scene.pairs()
    out.write_text(json.dumps(scene.scene, indent=1) + "\n")
    for message in scene.messages:
        print("not converted:", message)
    print(f"{out}: {len(scene.scene['bodies'])} bodies, {len(scene.scene['obstacles'])} obstacles")


if __name__ == "__main__":
    main()

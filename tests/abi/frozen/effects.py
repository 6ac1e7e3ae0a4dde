#!/usr/bin/env python3
"""Instructions of each effect on and off, on the frozen scenes: what an effect costs, and that off means off.

effects.py PROGRAM PLUGIN_DIR

PROGRAM takes a few steps of each scene under callgrind (frozen.py: what is counted). For each effect that a
scene can have there are three: with it, with a list of effects that leaves it out, and one whose parameters
never called for it. Checked: off by the list costs what never having had it costs, to 0.1 %, and gives the
same state to the bit. What each effect costs is printed.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

from frozen import TOLERANCE, counted

HERE = pathlib.Path(__file__).resolve().parent
STEPS = 4
LAW = {"mu_C": 0.3, "mu_S": 0.5, "sigma2": 200}
LUGRE = {**LAW, "sigma0": 1e7}
SPRINGS = {"volume": 1, "damping_stiffness": 1e-4, "anisotropy_slope": 0.5, "damper": "sls"}
CELLS = {"damping_stiffness": 1e-3, "anisotropy_young": 2e5}
PLASTIC = {"anisotropy_young": "auto", "yield": 0.05}


def pairs(definition, law, params):
    definition["contact"]["friction"] = [{"between": ["*", "*"], "law": law, "params": params}]


def params(definition, body, values):
    definition["bodies"][body]["model"]["params"] = {**definition["bodies"][body]["model"].get("params", {}),
                                                     **values}


def each(*bodies, **values):
    return lambda d: [params(d, body, values) for body in bodies]


def key(name, value):
    return lambda d: d["contact"].update({name: value})


def law(name, **values):
    return lambda d: pairs(d, name, values)


RUBS = {"friction": law("none"), "stribeck": law("coulomb", **{**LAW, "mu_S": 0.3}),
        "viscous": law("coulomb", **{**LAW, "sigma2": 0}), "guard": key("guard", False),
        "self_contact": key("self", False)}
# By scene: step in s, the scene with everything, and what takes an effect out by the scene's own parameters.
SCENES = {
    "slide_msm": (0.001,
                  [lambda d: d["bodies"][0]["pose"].update(position=[0, 0, 0.00005]),
                   lambda d: d["bodies"][1]["pose"].update(position=[0.03, 0.01, 0.10012]),
                   each(0, 1, **SPRINGS), law("coulomb", **LAW), key("self", True)],
                  {**RUBS, "volume": each(0, 1, volume=0), "anisotropy": each(0, 1, anisotropy_slope=0),
                   "deform.relaxation": each(0, 1, damper="voigt"),
                   "damping": each(0, 1, damping_stiffness=0)}),
    "drop_modal": (0.002,
                   [lambda d: d["bodies"][0]["pose"].update(position=[0, 0, 0.00005]),
                    lambda d: d["bodies"][1]["pose"].update(position=[0, 0.3, 0.00005]),
                    each(0, damping_mass=1), each(1, damping_mass=1, plastic_creep=1, plastic_yield=0),
                    law("coulomb", **LAW), key("self", True)],
                   {**RUBS, "plasticity": each(1, plastic_creep=0),
                    "damping": lambda d: (params(d, 0, {"damping_mass": 0, "damping_stiffness": 0}),
                                          params(d, 1, {"damping_mass": 0, "damping_ratio": 0}))}),
    "swing_corotational": (0.016666666666666666,
                           [lambda d: d.update(contact={}), each(0, **CELLS), key("self", True)],
                           {"damping": each(0, damping_stiffness=0),
                            "anisotropy": each(0, anisotropy_young="auto"),
                            "self_contact": key("self", False), "guard": key("guard", False)}),
}
# What excludes another effect: the scene with it, without it, and the effects that it excludes.
LAWS = {"memory": (law("lugre", **LUGRE), law("coulomb", **LAW), ("stiction",)),
        "stiction": (law("karnopp", **LAW), law("coulomb", **LAW), ("stiction",))}
OTHERS = {"slide_msm": LAWS, "drop_modal": LAWS,
          "swing_corotational": {"deform.plasticity": (each(0, **PLASTIC), each(0, **{**PLASTIC, "yield": 0}),
                                                       ("anisotropy",))}}
ALWAYS = {"slide_msm": ["stiction"], "drop_modal": ["stiction"], "swing_corotational": []}


def plain(scene):
    definition = json.loads((HERE / f"{scene}.json").read_text())
    for body in definition["bodies"]:
        body["mesh"] = str(HERE / body["mesh"])
    for change in SCENES[scene][1]:
        change(definition)
    return definition


def variants(scene):
    """(effect, "on" | "off" | "never", scene definition)."""
    effects = list(SCENES[scene][2]) + ALWAYS[scene]

    def listed(*changes, without=()):
        out = plain(scene)
        for change in changes:
            change(out)
        out["effects"] = [e for e in effects if e not in without]
        return out

    def never(*changes):
        out = plain(scene)
        for change in changes:
            change(out)
        return out

    yield "", "on", plain(scene)
    for effect, out in SCENES[scene][2].items():
        gone = (effect,)
        if effect == "friction":
            gone = ("friction", "stribeck", "viscous", "stiction")
        yield effect, "off", listed(without=gone)
        yield effect, "never", never(out)
    for effect, (on, off, excluded) in OTHERS[scene].items():
        yield effect, "on", never(on)
        yield effect, "off", listed(on, without=excluded)
        yield effect, "never", never(off)


def measure(program, plugins, scene):
    """{(effect, state): (instructions, hash)}"""
    names, out = [], {}
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for effect, state, definition in variants(scene):
            names.append((effect, state))
            files.append(f"{folder}/{len(files)}.json")
            pathlib.Path(files[-1]).write_text(json.dumps(definition))
        line = ["valgrind", "--tool=callgrind", "--toggle-collect=dfm_world_step", "--dump-after=frozen_mark",
                f"--callgrind-out-file={folder}/out", program, plugins,
                repr(SCENES[scene][0]), str(STEPS), *files]
        done = subprocess.run(line, env={**os.environ, "DEFORM_SIMD": "sse2"}, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"effects.py: {scene}: {done.stderr}")
        hashes = done.stdout.split()
        for i, name in enumerate(names):
            text = pathlib.Path(f"{folder}/out.{i + 1}").read_text()
            out[name] = (counted(text), hashes[i])
    return out


def check(scene, found):
    """What is wrong, as sentences."""
    wrong = []
    for effect, state in found:
        if state != "off":
            continue
        on = found.get((effect, "on"), found["", "on"])
        off, never = found[effect, "off"], found[effect, "never"]
        change = off[0] / never[0] - 1
        print(f"{scene}: {effect}: on {on[0]}, off {off[0]} ({100 * (on[0] / off[0] - 1):+.2f} %), never "
              f"{100 * change:+.4f} %")
        if abs(change) > TOLERANCE:
            wrong.append(f"{scene}: {effect} off by the list takes {100 * change:+.3f} % more instructions "
                         "than a scene that never had it")
        if off[1] != never[1]:
            wrong.append(f"{scene}: {effect} off by the list leaves another state than a scene that never "
                         "had it")
    return wrong


def main():
    program, plugins = sys.argv[1:]
    wrong = [sentence for scene in SCENES for sentence in check(scene, measure(program, plugins, scene))]
    for sentence in wrong:
        print(sentence, file=sys.stderr)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()

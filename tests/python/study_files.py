"""Files of the studies that tests make: a rigid box that slides to rest on a floor, cheap to run."""
import json
import pathlib

BOX = {
    "format": "deform-scene", "version": 1, "gravity": [0, 0, -9.81],
    "time": {"duration": 0.2, "step": 0.002}, "bodies": [],
    "obstacles": [{"name": "floor", "shape": "plane", "point": [0, 0, 0], "normal": [0, 0, 1]}],
    "rigid": {"host": "builtin", "bodies": [
        {"name": "box", "shape": "box", "half_size": [0.05, 0.05, 0.01], "mass": 1,
         "pose": {"position": [0, 0, 0.01]}, "velocity": [0.5, 0, 0]}]},
    "contact": {"friction": [{"between": ["*", "*"], "law": "coulomb", "params": {"mu": 0.3}}]},
    "output": {"every": 0.02}}
MU, SPEED = "/contact/friction/0/params/mu", "/rigid/bodies/0/velocity/0"
COM = {"table": "bodies", "where": {"body": "box"}, "column": "com_x"}


def write_box(folder):
    path = pathlib.Path(folder) / "box.json"
    path.write_text(json.dumps(BOX))
    return path


def sweep_study(scene, **changes):
    return {"format": "deform-study", "version": 1, "scene": str(scene),
            "design": {"method": "sobol", "runs": 16, "seed": 3},
            "parameters": {"mu": {"at": MU, "from": 0.2, "to": 0.9, "unit": "1"},
                           "v": {"at": SPEED, "from": 0.1, "to": 0.5, "unit": "m/s", "scale": "log"}},
            "quantities": {"slid": {**COM, "take": "change", "unit": "m"}, "steps": {"summary": "/steps"}},
            **changes}

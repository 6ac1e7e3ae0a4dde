#!/usr/bin/env python3
"""What each shipped scene leaves at several steps, by one command, or by two of which the second is newer.

scene_table.py RESULTS COMMAND [COMMAND] [--scenes NAME ...] [--steps S ...] [--time S]

Each scene runs with each step, and each integrator that fits, one after the other by both commands, so that
their times may be compared. A row has: what stopped it, sub-steps, unconverged ones, creep of what rests
(um/s), energy gained (J), crossing triangle pairs, processor time (s).
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = ROOT / "examples/scenes"
INTEGRATORS = ("auto", "symplectic_euler", "implicit_euler")
COLUMNS = ("stopped_s", "substeps", "unconverged", "creep_um_s", "gain_J", "crossing", "cpu_s")


def variants(scene, integrator):
    """The --set arguments that give all bodies this integrator."""
    if integrator == "auto":
        return []
    return [word for i in range(len(scene.get("bodies", [])))
            for word in ("--set", f"/bodies/{i}/integrator={integrator}")]


def run(command, path, step, time, changes):
    with tempfile.TemporaryDirectory() as out:
        done = subprocess.run([command, "run", path, "--quiet", "--out", out, "--threads", "1", "--time",
                               str(time), "--set", f"/time/step={step}", *changes], capture_output=True,
                              text=True)
        summary = pathlib.Path(out) / "summary.json"
        if not summary.exists():
            return {"stopped_s": "refused: " + (done.stderr.strip().splitlines() or [""])[-1][:80]}
        found = json.loads(summary.read_text())
    stopped = found["stopped"]
    return {"stopped_s": stopped["t"] if stopped else "", "substeps": found["substeps"],
            "unconverged": found["unconverged_steps"], "creep_um_s": found["hold"]["creep_max_um_per_s"],
            "gain_J": found["energy"]["gain_J"], "crossing": found["intersections_max"],
            "cpu_s": round(found["cpu_s"], 3)}


def machine():
    names = [line.split(":", 1)[1].strip() for line in open("/proc/cpuinfo", encoding="utf-8")
             if line.startswith("model name")]
    return names[0] if names else "unknown"


def number(value):
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results")
    parser.add_argument("command", nargs="+")
    parser.add_argument("--scenes", nargs="*", default=sorted(p.stem for p in SCENES.glob("*.json")))
    parser.add_argument("--steps", nargs="*", type=float, default=[0.001, 0.004, 1 / 60])
    parser.add_argument("--time", type=float, default=1.0)
    options = parser.parse_args()
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True,
                            text=True)
    with open(options.results, "w", encoding="utf-8") as out:
        out.write(f"# {machine()}, commit {commit.stdout.strip()}, "
                  f"{options.time:g} s of each scene, {len(options.command)} commands\n")
        out.write("scene,step,integrator,command," + ",".join(COLUMNS) + "\n")
        for name in options.scenes:
            path = str(SCENES / f"{name}.json")
            scene = json.loads(pathlib.Path(path).read_text())
            for step in options.steps:
                for integrator in INTEGRATORS:
                    for k, command in enumerate(options.command):
                        row = run(command, path, step, options.time, variants(scene, integrator))
                        values = ",".join(number(row.get(c)).replace(",", ";") for c in COLUMNS)
                        out.write(f"{name},{step:.4g},{integrator},{k},{values}\n")
                        out.flush()
                        print(name, f"{step:.4g}", integrator, k, values, file=sys.stderr)


if __name__ == "__main__":
    main()

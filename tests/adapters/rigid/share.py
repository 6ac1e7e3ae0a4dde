#!/usr/bin/env python3
"""What the adapters of Bullet and ODE cost: at most 5 % of a step with 100 rigid bodies, 10 of them on a soft
one.

share.py bullet64|ode PROGRAM

PROGRAM is load.cpp. Callgrind counts the instructions of its steps after dfm_world_rigids. The adapter's are
all of a step but those of the soft bodies (dfm_world_step without the calls of the adapter's host) and those
of the engine's own stages, each once per step: a stage that the adapter runs a second time counts as the
adapter's.
"""
import collections
import pathlib
import re
import subprocess
import sys
import tempfile

MOST = 0.05
STEP = {"bullet64": "dfm_bullet_detail::Adapter::before_tick(", "ode": "dfm_ode_detail::Adapter::step("}
HOST = re.compile(r"dfm_rigid_detail::\(anonymous namespace\)::(predict|respond|push|commit)\(void\*")
STAGES = {
    "bullet64": re.compile(r"^bt.*::(predictUnconstraintMotion|createPredictiveContacts"
                           r"|performDiscreteCollisionDetection|calculateSimulationIslands|solveConstraints"
                           r"|integrateTransforms|updateActions|updateActivationState)\("),
    "ode": re.compile(r"^(dSpaceCollide|dWorldStep|dJointGroupEmpty)$")}
COUNT = {"bullet64": 7, "ode": 3}  # at least as many of them are called



def calls(path):
    """{(caller, callee): [times, instructions]} of a callgrind output."""
    names, out = {}, collections.defaultdict(lambda: [0, 0])
    caller = callee = times = None
    for line in path.read_text().splitlines():
        found = re.match(r"(c?fn)=\((\d+)\)(?: (.*))?$", line)
        if found:
            if found[3]:
                names[found[2]] = found[3]
            if found[1] == "fn":
                caller = names[found[2]]
            else:
                callee = names[found[2]]
        elif line.startswith("calls="):
            times = int(line[6:].split()[0])
        elif times is not None and re.match(r"[+\-*\d]", line):
            of = out[caller, callee]
            of[0] += times
            of[1] += int(line.split()[-1])
            times = None
    return out


def main():
    engine, program = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "part"
        done = subprocess.run(["valgrind", "--tool=callgrind", "--dump-before=dfm_world_rigids",
                               f"--callgrind-out-file={out}", program], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"share.py: {program} ended with {done.returncode}: {done.stderr[-2000:]}")
        found = calls(out)  # the last part: what came after the mark
    ticks, whole = map(sum, zip(*(v for (_, to), v in found.items() if to.startswith(STEP[engine]))))
    stepped = sum(v[1] for (_, to), v in found.items() if to == "dfm_world_step")
    asked = sum(v[1] for (_, to), v in found.items() if HOST.match(to))
    stages = collections.defaultdict(lambda: [0, 0])
    for (caller, to), (times, cost) in found.items():
        if STAGES[engine].match(to) and caller.startswith(f"dfm_{engine.rstrip('64')}_detail::"):
            stages[to][0] += times
            stages[to][1] += cost
    if ticks < 20 or not asked or len(stages) < COUNT[engine]:
        sys.exit(f"share.py: {ticks} ticks, {asked} instructions in the host, stages {sorted(stages)}: the "
                 "names that this script looks for have changed")
    own = sum(cost * min(1, ticks / times) for times, cost in stages.values())
    share = (whole - stepped + asked - own) / whole
    print(f"{ticks} ticks of {whole / ticks:,.0f} instructions: {engine} {100 * own / whole:.1f} %, "
          f"soft bodies {100 * (stepped - asked) / whole:.1f} %, adapter {100 * share:.2f} %, "
          f"{share * whole / ticks / 100:,.0f} for each of 100 bodies")
    if share > MOST:
        sys.exit(f"share.py: the adapter takes {100 * share:.2f} % of a step, more than {100 * MOST:.0f} %")


if __name__ == "__main__":
    main()

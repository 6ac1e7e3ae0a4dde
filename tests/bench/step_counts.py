#!/usr/bin/env python3
"""How even the steps of a scene are, by instructions: a busy machine changes none of them.

step_counts.py DEFORM_COMMAND SCENE [--skip N] [--set /json/pointer=value ...]

Callgrind counts the instructions of each dfm_world_step, one thread. Printed: median, 99th percentile, the
largest, and which functions the largest has more instructions in than a step at the median. Steps before
--skip (bodies that settle) are left out. Exit 1 where the 99.9th percentile is above 1.5 times the median.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

WITHIN = 1.5


def by_function(path):
    """Instructions of each function itself, of one part of a callgrind output."""
    names, costs, name, after_call = {}, {}, None, False
    for line in path.read_text().splitlines():
        found = re.match(r"(c?fn)=\((\d+)\)(?: (.*))?$", line)
        if found:
            if found[3]:
                names[found[2]] = found[3]
            if found[1] == "fn":
                name = found[2]
        elif line.startswith("calls="):
            after_call = True
        elif re.match(r"[+\-*\d]", line):
            numbers = line.split()
            if not after_call and len(numbers) > 1:
                costs[name] = costs.get(name, 0) + int(numbers[-1])
            after_call = False
    return names, costs


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("command")
    parser.add_argument("scene")
    parser.add_argument("--skip", type=int, default=0)
    parser.add_argument("--set", nargs="*", default=[])
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "part"
        changes = [word for value in options.set for word in ("--set", value)]
        done = subprocess.run(["valgrind", "--tool=callgrind", "--toggle-collect=dfm_world_step",
                               "--dump-after=dfm_world_step", f"--callgrind-out-file={out}", options.command,
                               "run", options.scene, "--out", str(pathlib.Path(folder) / "run"), "--quiet",
                               "--threads", "1", *changes], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"step_counts.py: {done.stderr}")
        parts, names = [], {}
        for path in sorted(pathlib.Path(folder).glob("part.*"), key=lambda p: int(p.suffix[1:])):
            own, costs = by_function(path)
            names.update(own)
            if costs:
                parts.append(costs)
    parts = parts[options.skip:]
    order = sorted(range(len(parts)), key=lambda n: sum(parts[n].values()))
    counts = [sum(parts[n].values()) for n in order]

    def share(q):
        return counts[min(len(counts) - 1, int(q * len(counts)))]

    median, worst = parts[order[len(order) // 2]], parts[order[-1]]
    print(f"{len(counts)} steps: median {share(0.5):,} instructions, 99 % {share(0.99):,} "
          f"({share(0.99) / share(0.5):.3f}), 99.9 % {share(0.999):,} ({share(0.999) / share(0.5):.3f}), "
          f"most {counts[-1]:,} ({counts[-1] / share(0.5):.3f}, step {options.skip + order[-1]})")
    more = sorted(((cost - median.get(name, 0), name) for name, cost in worst.items()), reverse=True)
    for cost, name in more[:8]:
        print(f"  {cost:+12,}  {names.get(name, name)[:110]}")
    return 0 if share(0.999) <= WITHIN * share(0.5) else 1


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""examples.py NATIVE_BIN OTHER_BIN FOLDER [--by "PROGRAM ..."]: the C examples of a build for another system
print what the native ones do, seconds aside."""
import argparse
import pathlib
import shlex
import subprocess
import sys

# the others print seconds
SAME = ["01_hello", "02_pull", "03_surface", "04_rigid_host", "07_draw"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("native", type=pathlib.Path)
    parser.add_argument("other", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--by", default="")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)

    def output(command):
        done = subprocess.run(command, cwd=options.folder, stdout=subprocess.PIPE, check=True)
        return done.stdout.replace(b"\r\n", b"\n")

    differ = []
    for name in SAME:
        other = next(options.other.resolve().glob(f"example_{name}*"))
        native = options.native.resolve() / f"example_{name}"
        if output([native]) != output([*shlex.split(options.by), other]):
            differ.append(name)
    print("differ:", *differ) if differ else print("the same output:", *SAME)
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())

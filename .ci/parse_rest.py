#!/usr/bin/env python3
"""Parses, with its own compiler and flags, each file of a configured build that another build has not
compiled by itself. Warnings are errors where the build says so. Files below tests/ are left out.

parse_rest.py CONFIGURED_BUILD COMPILED_BUILD
"""
import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys


def compile_commands(build):
    return json.loads((pathlib.Path(build) / "compile_commands.json").read_text())


def compiled(entry):
    words = shlex.split(entry["command"])
    return (pathlib.Path(entry["directory"]) / words[words.index("-o") + 1]).exists()


def parse(entry):
    words = shlex.split(entry["command"])
    if "-o" in words:
        at = words.index("-o")
        del words[at:at + 2]
    done = subprocess.run([*words, "-fsyntax-only"], cwd=entry["directory"], capture_output=True, text=True)
    return done.returncode, done.stderr


def main():
    configured, other = sys.argv[1:]
    seen = {entry["file"] for entry in compile_commands(other) if compiled(entry)}
    tests = str(pathlib.Path(__file__).resolve().parent.parent / "tests")
    rest = []
    for entry in compile_commands(configured):
        if entry["file"] not in seen and not entry["file"].startswith((tests, entry["directory"])):
            rest.append(entry)
    if not rest:
        sys.exit(f"{configured} has no file that {other} has not compiled: name a build with more parts")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(parse, rest))
    for _, text in results:
        sys.stderr.write(text)
    print(f"{len(rest)} files more were parsed by {shlex.split(rest[0]['command'])[0]}")
    sys.exit(any(code for code, _ in results))


main()

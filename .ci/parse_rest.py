#!/usr/bin/env python3
"""Parses, with its own compiler and flags, each file of a configured build that another build has not
compiled. Warnings are errors where the build says so. Files below tests/ are left out: gcc compiles them.

parse_rest.py CONFIGURED_BUILD COMPILED_BUILD
"""
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys


def compile_commands(build):
    return json.loads((pathlib.Path(build) / "compile_commands.json").read_text())


def sources(entry):
    """The file that a command has compiled, or those that it has compiled together."""
    words = shlex.split(entry["command"])
    if not (pathlib.Path(entry["directory"]) / words[words.index("-o") + 1]).exists():
        return []
    path = pathlib.Path(entry["file"])
    if path.parent.name != "Unity":
        return [entry["file"]]
    return re.findall(r'^#include "(.+)"', path.read_text(), re.M)


def parse(entry):
    words = shlex.split(entry["command"])
    while "-include-pch" in words:   # headers that this build has not precompiled
        at = words.index("-include-pch") - 1
        del words[at:at + 4]
    if "-o" in words:
        at = words.index("-o")
        del words[at:at + 2]
    done = subprocess.run([*words, "-fsyntax-only"], cwd=entry["directory"], capture_output=True, text=True)
    return done.returncode, done.stderr


def main():
    configured, compiled = sys.argv[1:]
    seen = {file for entry in compile_commands(compiled) for file in sources(entry)}
    tests = str(pathlib.Path(__file__).resolve().parent.parent / "tests")
    rest = []
    for entry in compile_commands(configured):
        if entry["file"] not in seen and not entry["file"].startswith((tests, entry["directory"])):
            rest.append(entry)
    if not rest:
        sys.exit(f"{configured} has no file that {compiled} has not compiled: name a build with more parts")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(parse, rest))
    for _, text in results:
        sys.stderr.write(text)
    print(f"{len(rest)} files more were parsed by {shlex.split(rest[0]['command'])[0]}")
    sys.exit(any(code for code, _ in results))


main()

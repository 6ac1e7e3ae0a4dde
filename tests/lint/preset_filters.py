#!/usr/bin/env python3
"""Each alternative of the name patterns in the test presets must match a test of this build: after a rename
a pattern that excludes a test of minutes would run it again, and one that includes a test would lose it, and
nobody would be told.

preset_filters.py BUILD_DIR SOURCE_DIR CTEST
Exit code 77 (skipped) where tests are not built yet: their names are known when they are.
"""
import json
import pathlib
import re
import subprocess
import sys


def alternatives(pattern, start=0):
    """Of the pattern, or of the group that begins at `start`: a list of (begin, end)."""
    found, begin, depth, i = [], start, 0, start
    while i < len(pattern):
        c = pattern[i]
        if c == "\\":
            i += 1
        elif c == "[":
            i = pattern.index("]", i + 2)
        elif c == "(":
            depth += 1
        elif c == ")":
            if depth == 0:
                break
            depth -= 1
        elif c == "|" and depth == 0:
            found.append((begin, i))
            begin = i + 1
        i += 1
    return [*found, (begin, i)]


def each_choice(pattern):
    """Patterns with one alternative alone: of the whole, or of one of its groups."""
    for begin, end in alternatives(pattern):
        part = pattern[begin:end]
        yield part
        for group in re.finditer(r"\\.|\(", part):
            if group[0] != "(":
                continue
            inner = alternatives(part, group.end())
            if len(inner) > 1:
                for b, e in inner:
                    if part[b:e] != "$":   # names that end there and names that go on: either will do
                        yield part[:group.end()] + part[b:e] + part[inner[-1][1]:]


def unmatched(presets, names):
    for preset in presets:
        for kind in ("include", "exclude"):
            pattern = preset.get("filter", {}).get(kind, {}).get("name")
            for choice in each_choice(pattern) if pattern else ():
                if not any(re.search(choice, name) for name in names):
                    yield f"CMakePresets.json: preset {preset['name']}: {kind} '{choice}' matches no test"


def main():
    build, source, ctest = sys.argv[1:]
    listed = subprocess.run([ctest, "--test-dir", build, "-N"], capture_output=True, text=True, check=True)
    if "_NOT_BUILT" in listed.stdout:
        print("the tests are not built, so their names are not known: `make test` builds them")
        sys.exit(77)
    names = [m[1] for m in re.finditer(r"^ *Test +#\d+: (.*)$", listed.stdout, re.M)]
    presets = json.loads((pathlib.Path(source) / "CMakePresets.json").read_text())["testPresets"]
    bad = list(unmatched(presets, names))
    # That the rule finds what it is for.
    wrong = [{"name": "p", "filter": {"exclude": {"name": r"one\.|(two|three)_x( |$)|[|)]four"}}}]
    found = list(unmatched(wrong, ["unit.one.a", "unit.b.two_x"]))
    if [m.split("'")[1] for m in found] != ["(three)_x( |$)", "(two|three)_x( )", "[|)]four"]:
        bad.append(f"preset_filters.py does not find what is wrong: {found}")
    for line in bad:
        print(line)
    sys.exit(bool(bad))


main()

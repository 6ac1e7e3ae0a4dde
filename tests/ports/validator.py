#!/usr/bin/env python3
"""validator.py DEFORM.exe PLUGINS BROKEN [NAME ...]: `deform plugin check` under Wine. Every shipped plugin
and the sound ones of tests/plugin/broken keep every rule; each broken one breaks the rule that check_test.cpp
names, what crashes or hangs included. Those that say "Not for Windows: " are not built. Models of a graphics
card refuse every body, since Wine has no driver; what mingw keeps for a thread that has thrown (1.4 kB) stays
when their file is unloaded, so V09 is not asked of them."""
import json
import pathlib
import re
import subprocess
import sys

PLUGIN = pathlib.Path(__file__).resolve().parents[1] / "plugin"


def main():
    command, plugins, broken = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    names = sys.argv[4:]

    def check(file, *more):
        """({rule: result}, exit code); the skipped ones left out"""
        done = subprocess.run(["wine", command, "plugin", "check", file, "--json", *more],
                              capture_output=True, encoding="utf-8")
        assert done.returncode in (0, 1), (file, done.returncode, done.stderr)
        said = json.loads(done.stdout)
        rules = said["rules"] + [rule for kind in said["types"] for rule in kind["rules"]]
        return {rule["id"]: rule for rule in rules if rule["result"] != "skip"}, done.returncode

    wrong, sound, found = [], 0, 0
    for file in [*sorted(plugins.glob("*.dll")), *sorted(broken.glob("*sound*.dll"))]:
        if names and file.stem not in names:
            continue
        rules, code = check(file, "--limit", "100")
        failed = [f"{rule['id']}: {rule['detail']}" for rule in rules.values() if rule["result"] == "fail"]
        if file.stem == "model_gpu":
            failed = [said for said in failed if "finds no driver" not in said and not said.startswith("V09")]
            code = 0
        if failed or code or len(rules) < 15:
            wrong.append(f"{file.stem}: {len(rules)} rules, exit code {code}, {failed}")
        sound += 1
    table = (PLUGIN / "check_test.cpp").read_text()
    cases = [(*case, "") for case in re.findall(r'Case\{"(\w+)", "([VFM]\d\d)"', table)]
    cases.append(("crashes_always", "V12", "ended its process"))
    for name, rule, sentence in cases:
        unfit = "Not for Windows: " in (PLUGIN / "broken" / f"{name}.c").read_text()
        if unfit or (names and name not in names):
            continue
        rules, code = check(broken / f"{name}.dll", "--only", rule, "--limit", "5")
        said = rules.get(rule, {})
        if code != 1 or said.get("result") != "fail" or sentence not in said["detail"]:
            wrong.append(f"{name}: {rule} is not broken: {rules}")
        found += 1
    print(*wrong, sep="\n")
    print(f"{sound} sound plugins, {found} broken ones, {len(wrong)} wrong")
    assert names or (found > 100 and sound >= 5 + 13), "not all are built"
    return 1 if wrong or not (sound + found) else 0


if __name__ == "__main__":
    sys.exit(main())

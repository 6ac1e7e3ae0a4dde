#!/usr/bin/env python3
"""Plugins that were built once, when ABI 1 was frozen, and programs of the C API, built when it was promised,
against today's library (tests/abi/kept/README.md). A program must print what it did. Each plugin must keep
the rules of the validator, answer its host (kept.cpp) to the bit what it answered then, also where the
host's structs have grown since, and do in a scene what it did.

kept.py KEPT_PROGRAM DEFORM FOLDER SCRATCH           compares
kept.py KEPT_PROGRAM DEFORM FOLDER SCRATCH --write   writes answers.csv, scenes.csv and programs.txt again
"""
import csv
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

MOST_BYTES = 400 * 1000
# m and J; the library may compute otherwise one day, the plugin not
TOLERANCE = 1e-6


def run(*argv, env=None, cwd=None):
    done = subprocess.run([str(a) for a in argv], capture_output=True, text=True, env=env, cwd=cwd)
    if done.returncode:
        sys.exit(" ".join(map(str, argv)) + f" ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def inventory(folder):
    """Files of list.csv, whose bytes are still those; nothing else lies there."""
    listed = {row["file"]: row["sha256"] for row in rows_of(folder / "list.csv")}
    there = {str(path.relative_to(folder)): path for path in folder.glob("*/**/*") if path.is_file()}
    if listed.keys() != there.keys():
        sys.exit(f"list.csv and the folder differ: {sorted(listed.keys() ^ there.keys())}")
    for name, path in there.items():
        if hashlib.sha256(path.read_bytes()).hexdigest() != listed[name]:
            sys.exit(f"{name} is not the file that list.csv names: a kept file is never built again")
    if sum(path.stat().st_size for path in there.values()) > MOST_BYTES:
        sys.exit(f"the kept files are larger than {MOST_BYTES} bytes together")
    plugins = [there[name] for name in listed if name.endswith(".so")]
    return plugins, [there[name] for name in listed if "/programs/" in name]


def sentences(text):
    """The different lines, without their numbers: bodies that bounce end elsewhere with every change."""
    return sorted({re.sub(r"\d+(\.\d+)?", "#", line).replace("-#", "#").replace("+#", "#") for line in
                   text.splitlines()})


def answers(program, folder, files):
    out = ["file,type,asked,n,hash,one"]
    for path in files:
        said = run(program, path)
        if run(program, path, "grown") != said:
            sys.exit(f"{path} answers otherwise where the structs of its host are longer than it knows")
        out += [f"{path.relative_to(folder)},{line}" for line in said.splitlines()]
    return "\n".join(out) + "\n"


def printed(programs, deform, scratch):
    """What programs print that have the structs and sizes of then."""
    library = pathlib.Path(deform).resolve().parent.parent / "lib"
    env = {**{k: v for k, v in os.environ.items() if not k.startswith("DEFORM_")},
           "LD_LIBRARY_PATH": str(library)}
    return "".join(f"== {path.name}\n{run(path, env=env, cwd=scratch)}" for path in programs)


def scenes(deform, folder, scratch):
    """Where bodies of kept models under kept laws are at the end."""
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    kept = folder / "gcc12"
    env = {**{k: v for k, v in os.environ.items() if not k.startswith("DEFORM_")},
           "DEFORM_PLUGIN_PATH": str(kept)}
    out = ["scene,body,x,y,z,elastic_J"]
    for scene in sorted(folder.glob("*.json")):
        run(deform, "run", scene, "--out", scratch / scene.stem, "--quiet", env=env)
        summary = json.loads((scratch / scene.stem / "summary.json").read_text())
        text = scene.read_text()
        for plugin in summary["plugins"]:
            name = plugin["id"].rsplit(".", 1)[-1]
            if f'"{name}"' in text and not plugin["file"].startswith(str(kept)):
                sys.exit(f"{scene.name} took {plugin['id']} from {plugin['file']}, not from {kept}")
        if not summary["finite"] or not summary["contacts"]["max"]:
            sys.exit(f"{scene.name}: finite {summary['finite']}, contacts {summary['contacts']['max']}")
        for body, row in sorted(summary["bodies"].items()):
            elastic = row["elastic_J"] if row["elastic_J"] is not None else 0.0
            out.append(f"{scene.name},{body}," + ",".join(f"{x:.9g}" for x in (*row["com"], elastic)))
    return "\n".join(out) + "\n"


def near(before, now):
    """Do two tables of scenes agree within the tolerance?"""
    before, now = (list(csv.reader(text.splitlines())) for text in (before, now))
    return len(before) == len(now) and before[0] == now[0] and all(
        a[:2] == b[:2] and all(abs(float(x) - float(y)) <= TOLERANCE for x, y in zip(a[2:], b[2:]))
        for a, b in zip(before[1:], now[1:]))


def main():
    program, deform, folder, scratch = sys.argv[1:5]
    folder, scratch = pathlib.Path(folder).resolve(), pathlib.Path(scratch).resolve()
    files, programs = inventory(folder)
    for path in files:
        print(run(deform, "plugin", "check", path, "--quiet", "--limit", "100"))
    found = {"answers.csv": answers(program, folder, files), "scenes.csv": scenes(deform, folder, scratch),
             "programs.txt": printed(programs, deform, scratch)}
    if sys.argv[-1] == "--write":
        for name, text in found.items():
            (folder / name).write_text(text)
        return
    stored = {name: (folder / name).read_text() for name in found}
    if found["answers.csv"] != stored["answers.csv"]:
        lines = set(found["answers.csv"].splitlines()) ^ set(stored["answers.csv"].splitlines())
        sys.exit("answers of kept plugins changed, to which nothing of the library belongs: a struct of "
                 "plugin.h means something else, or the processor computes otherwise:\n" +
                 "\n".join(sorted(lines)))
    if not near(stored["scenes.csv"], found["scenes.csv"]):
        sys.exit(f"scenes with kept plugins end elsewhere, by more than {TOLERANCE}; what the library does "
                 "to them changed:\n" + stored["scenes.csv"] + found["scenes.csv"])
    if sentences(found["programs.txt"]) != sentences(stored["programs.txt"]):
        sys.exit("kept programs print something else: what the library does to them changed:\n" +
                 stored["programs.txt"] + found["programs.txt"])
    print(len(files), "plugins and", len(programs), "programs as they were")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Every program and shared object of the build tree looks for its libraries in folders that the build names,
and never in the current folder: the dynamic linker reads an empty or relative run path entry as the folder in
which the user happens to stand, and loads what lies there. The command proves it: it runs in a folder of
broken libraries.

run_paths.py READELF BUILD_DIR SCRATCH_DIR
"""
import pathlib
import re
import subprocess
import sys


def run_path(readelf, path):
    """The run path's entries, or None where the file is not an ELF object."""
    with open(path, "rb") as file:
        if file.read(4) != b"\x7fELF":
            return None
    text = subprocess.run([readelf, "-d", path], capture_output=True, text=True).stdout
    found = re.search(r"\((?:RUNPATH|RPATH)\)\s+Library \w+: \[(.*)\]", text)
    return found.group(1).split(":") if found else []


def bad_entries(readelf, folder):
    """(file, entry) for each entry below folder that is neither absolute nor relative to the file, and the
    number of files seen."""
    bad, seen = [], 0
    for path in sorted(p for p in pathlib.Path(folder).rglob("*") if p.is_file() and not p.is_symlink()):
        entries = run_path(readelf, path)
        if entries is None:
            continue
        seen += 1
        bad += [(path, entry) for entry in entries if not entry.startswith(("/", "$ORIGIN"))]
    return bad, seen


def main():
    readelf, build, scratch = sys.argv[1], *(pathlib.Path(a).resolve() for a in sys.argv[2:])
    failed = False
    for folder in (build / "bin", build / "lib"):
        bad, seen = bad_entries(readelf, folder)
        print(f"{folder}: {seen} objects")
        failed |= seen == 0
        for path, entry in bad:
            print(f"{path}: run path entry '{entry}'")
            failed = True
    command = build / "bin" / "deform"
    scratch.mkdir(parents=True, exist_ok=True)
    needed = re.findall(r"\(NEEDED\)\s+Shared library: \[(.*)\]",
                        subprocess.run([readelf, "-d", command], capture_output=True, text=True).stdout)
    for name in needed:
        if not name.startswith(("libc.", "ld-")):   # without these no program of the test would start either
            (scratch / name).write_bytes(b"not a library\n")
    done = subprocess.run([command, "--version"], cwd=scratch, capture_output=True, text=True)
    print(f"in a folder with broken {', '.join(needed)}: exit {done.returncode} {done.stdout.strip()} "
          f"{done.stderr.strip()}")
    return 1 if failed or done.returncode or not needed else 0


if __name__ == "__main__":
    sys.exit(main())

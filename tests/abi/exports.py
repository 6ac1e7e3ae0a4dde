#!/usr/bin/env python3
"""What the shared objects export: the library exactly the functions of the public headers, also those that
are inline because they take sizeof, a plugin its entry alone.

exports.py NM INCLUDE_DIR LIBRARY PLUGIN...
"""
import pathlib
import re
import subprocess
import sys


def exported(nm, path):
    out = subprocess.run([nm, "-D", "--defined-only", path], capture_output=True, text=True,
                         check=True).stdout
    # Version names stand among the symbols as absolute ones.
    return {line.split()[2].split("@")[0] for line in out.splitlines() if line.split()[1] != "A"}


def declared(include):
    names = set()
    for path in pathlib.Path(include).rglob("*.h"):
        text = re.sub(r"/\*.*?\*/", "", path.read_text(), flags=re.S)
        names |= set(re.findall(r"^DFM_(?:API|DEPRECATED)\b[^;{]*?\b(dfm_\w+)\s*\(", text, re.M))
        names |= set(re.findall(r"^static inline dfm_status (dfm_world_\w+)\s*\(", text, re.M))
        names |= set(re.findall(r"^static inline dfm_\w+ (dfm_\w+_default)\s*\(", text, re.M))
    return names


def main():
    nm, include, library, *plugins = sys.argv[1:]
    wanted = {library: declared(include), **{plugin: {"dfm_plugin_entry"} for plugin in plugins}}
    failed = not wanted[library]
    for path, names in wanted.items():
        found = exported(nm, path)
        for name in sorted(found - names):
            print(f"{path} exports {name}, which " + ("no public header declares" if path == library
                                                      else "is not its entry"))
        for name in sorted(names - found):
            print(f"{path} does not export {name}")
        failed |= found != names
        print(f"{path}: {len(found)} symbols")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

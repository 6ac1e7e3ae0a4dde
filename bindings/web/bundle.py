#!/usr/bin/env python3
"""bundle.py MODULE.js EXAMPLES OUT: OUT/deform.js, which a page loads: the module, worker.js, and the scenes
of EXAMPLES with the files that they read. A page that is opened from a folder may load scripts but no
data."""
import base64
import gzip
import json
import pathlib
import re
import sys


def packed(data):
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()


def scenes_of(examples):
    """Scenes that need nothing but the library, with the names of the files that they read."""
    for path in sorted((examples / "scenes").glob("*.json")):
        text = path.read_text()
        scene = json.loads(text)
        if (scene.get("rigid") or {}).get("host", "builtin") != "builtin":
            continue
        yield path.stem, ["scenes/" + path.name, *(name[3:] for name in re.findall(r'"(\.\./[^"]+)"', text))]


def main():
    module, examples, out = map(pathlib.Path, sys.argv[1:4])
    scenes = dict(scenes_of(examples), friction_rig=["friction/rig.json"])
    names = sorted({name for files in scenes.values() for name in files})
    data = [(examples / name).read_bytes() for name in names]
    worker = pathlib.Path(__file__).with_name("worker.js").read_text()
    out.mkdir(parents=True, exist_ok=True)
    (out / "deform.js").write_text("var deform = " + json.dumps({
        "scenes": scenes, "files": [[name, len(bytes_)] for name, bytes_ in zip(names, data)],
        "data": packed(b"".join(data)), "worker": packed((module.read_text() + worker).encode()),
        "wasm": packed(module.with_suffix(".wasm").read_bytes())}) + ";\n")


if __name__ == "__main__":
    main()

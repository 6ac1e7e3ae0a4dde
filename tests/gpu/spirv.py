#!/usr/bin/env python3
"""The SPIR-V in the source tree is what glslangValidator makes of spring_step.comp.

spirv.py GLSLANG FOLDER [--write]    --write replaces the words in the tree
"""
import pathlib
import re
import subprocess
import sys
import tempfile


def words(text):
    return re.findall(r"0x[0-9a-f]{8}", re.sub(r"//.*", "", text))


def main():
    glslang, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    kept = folder / "spring_step_spirv.inc"
    with tempfile.TemporaryDirectory() as scratch:
        made = pathlib.Path(scratch) / "words"
        subprocess.run([glslang, "-V", "--target-env", "vulkan1.1", "-x", "-o", made, "spring_step.comp"],
                       cwd=folder, check=True, stdout=subprocess.DEVNULL)
        found = words(made.read_text())
    if "--write" in sys.argv:
        rows = [", ".join(found[i:i + 8]) + ",\n" for i in range(0, len(found), 8)]
        kept.write_text("".join(rows))
    if not found or found != words(kept.read_text()):
        print(f"{kept.name} differs from what {glslang} makes; run {sys.argv[0]} with --write")
        return 1
    print(f"{len(found)} words, the same")
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""The SPIR-V in the source tree is what glslangValidator makes of the shaders, and no sum in it may be
contracted with a product.

spirv.py GLSLANG FOLDER [--write]    --write replaces the words in the tree
"""
import pathlib
import re
import subprocess
import sys
import tempfile

DECORATE, F_ADD, F_SUB, NO_CONTRACTION = 71, 129, 131, 42


def words(text):
    return re.findall(r"0x[0-9a-f]{8}", re.sub(r"//.*", "", text))


def contracted(found):
    """Sums and differences that are not precise."""
    code, at, kept, sums = [int(word, 16) for word in found], 5, set(), set()
    while at < len(code):
        length, op = code[at] >> 16, code[at] & 0xffff
        if op == DECORATE and code[at + 2] == NO_CONTRACTION:
            kept.add(code[at + 1])
        elif op in (F_ADD, F_SUB):
            sums.add(code[at + 2])
        at += length
    return len(sums - kept)


def main():
    glslang, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    shaders, wrong = sorted(folder.glob("*.comp")), 0
    if not shaders:
        sys.exit(f"{folder} has no shader")
    for shader in shaders:
        kept = shader.with_suffix(".inc")
        with tempfile.TemporaryDirectory() as scratch:
            made = pathlib.Path(scratch) / "words"
            subprocess.run([glslang, "-V", "--target-env", "vulkan1.1", "-x", "-o", made, shader.name],
                           cwd=folder, check=True, stdout=subprocess.DEVNULL)
            found = words(made.read_text())
        if "--write" in sys.argv:
            rows = [", ".join(found[i:i + 8]) + ",\n" for i in range(0, len(found), 8)]
            kept.write_text("".join(rows))
        if not found or found != words(kept.read_text()):
            print(f"{kept.name} differs from what {glslang} makes; run {sys.argv[0]} with --write")
            wrong += 1
        elif contracted(found):
            print(f"{shader.name}: {contracted(found)} sums are not precise")
            wrong += 1
        else:
            print(f"{kept.name}: {len(found)} words, the same")
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())

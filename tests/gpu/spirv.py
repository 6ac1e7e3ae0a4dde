#!/usr/bin/env python3
"""The SPIR-V in the source tree is what glslangValidator makes of the shaders, without names for debuggers,
and no sum in it may be contracted with a product.

spirv.py GLSLANG FOLDER [--write]    --write replaces the words in the tree
"""
import pathlib
import struct
import subprocess
import sys
import tempfile
import textwrap

DECORATE, F_ADD, F_SUB, NO_CONTRACTION = 71, 129, 131, 42
NAMES = range(3, 7)  # OpSource, OpSourceExtension, OpName, OpMemberName


def instructions(code):
    at = 5
    while at < len(code):
        yield code[at:at + (code[at] >> 16)]
        at += code[at] >> 16


def without_names(code):
    kept = [one for one in instructions(code) if one[0] & 0xffff not in NAMES]
    return [*code[:5], *(word for one in kept for word in one)]


def contracted(code):
    """Sums and differences that are not precise."""
    kept, sums = set(), set()
    for head, *rest in instructions(code):
        if head & 0xffff == DECORATE and rest[1] == NO_CONTRACTION:
            kept.add(rest[0])
        elif head & 0xffff in (F_ADD, F_SUB):
            sums.add(rest[1])
    return len(sums - kept)


def main():
    glslang, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    if glslang.endswith("-NOTFOUND"):
        print("skipped: no glslangValidator on this machine: install Debian's glslang-tools")
        return 77
    shaders, wrong = sorted(folder.glob("*.comp")), 0
    if not shaders:
        sys.exit(f"{folder} has no shader")
    for shader in shaders:
        kept = shader.with_suffix(".inc")
        with tempfile.TemporaryDirectory() as scratch:
            made = pathlib.Path(scratch) / "code"
            subprocess.run([glslang, "-V", "--target-env", "vulkan1.1", "-o", made, shader.name],
                           cwd=folder, check=True, stdout=subprocess.DEVNULL)
            data = made.read_bytes()
        found = without_names(struct.unpack(f"<{len(data) // 4}I", data))
        text = ",\n".join(textwrap.wrap(" ".join(map(str, found)), 109)).replace(" ", ",") + "\n"
        if "--write" in sys.argv:
            kept.write_text(text)
        if kept.read_text() != text:
            print(f"{kept.name} differs from what {glslang} makes; run {sys.argv[0]} with --write")
            wrong += 1
        elif contracted(found):
            print(f"{shader.name}: {contracted(found)} sums are not precise")
            wrong += 1
        else:
            print(f"{kept.name}: {len(found)} words, the same")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())

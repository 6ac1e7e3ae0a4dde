#!/usr/bin/env python3
"""What the compiler made of the wide kernels: no weak symbol, only entries that carry the instruction set in
their name, and no instruction that rounds otherwise than + - * / and sqrt (fused multiply-add, estimates).

kernel_objects.py NM OBJDUMP BUILD_DIR
A weak symbol (an inline function, a template) of an object compiled for AVX may be the one that the linker
keeps for everybody.
"""
import os
import pathlib
import platform
import re
import subprocess
import sys


OTHER_BITS = re.compile(r"\t(vfn?m(?:add|sub)\w*|vrcp\w*|vrsqrt\w*|rcpps|rcpss|rsqrtps|rsqrtss)\b")


def check(nm, objdump, objects):
    """Findings as lines."""
    found = []
    for path in objects:
        isa = re.search(r"_kernel_(avx\w+)\.", path.name).group(1)
        out = subprocess.run([nm, "--defined-only", path], capture_output=True, text=True, check=True).stdout
        for line in out.splitlines():
            _, kind, name = line.split(maxsplit=2)
            if kind in "WVuwv":
                found.append(f"{path}: weak symbol {name}; give it internal linkage")
            elif kind.isupper() and kind not in "NU" and isa not in name:
                found.append(f"{path}: external symbol {name} does not carry {isa} in its name")
        code = subprocess.run([objdump, "-d", path], capture_output=True, text=True, check=True).stdout
        for instruction in sorted(set(OTHER_BITS.findall(code))):
            found.append(f"{path}: instruction {instruction} gives other bits than plain operations")
    return found


def main():
    nm, objdump, build = sys.argv[1:]
    objects = sorted(pathlib.Path(folder) / name for folder, _, names in os.walk(build) for name in names
                     if re.search(r"_kernel_avx\w+\..*o$", name))  # os.walk: tests remove folders meanwhile
    found = check(nm, objdump, objects)
    if not objects and platform.machine() == "x86_64":
        found.append(f"{build}: no object of a wide kernel, though every build for this processor has them")
    print("\n".join(found))
    print(f"{len(objects)} wide kernel objects, {len(found)} findings")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Makes the Debian packages, unpacks them into a scratch root, and uses each there: the command, a program
that is built with the CMake package, the Python package. Each file is in one package, and each package says
what it needs.

packages.py CPACK BUILD_DIR SCRATCH_DIR C_COMPILER PYTHON
"""
import json
import pathlib
import re
import shutil
import sys

from installed_tree import PROGRAMS, clean_environment, run, without_spaces

NEEDS = {"libdeform0": ["libc6", "libstdc++6"], "libdeform-dev": ["libdeform0 (="],
         "libdeform-doc": [],
         "deform": ["libdeform0 (="],
         "deform-view": ["deform (=", "libglfw3"], "deform-serve": ["deform (=", "libwebsockets"],
         "libdeform-ode": ["libdeform0 (=", "libode8"],
         "libdeform-bullet": ["libdeform0 (=", "libbullet"],
         "python3-deform": ["libdeform0 (=", "libdeform-dev (=", "deform (=", "python3-numpy"],
         "libdeform-cholmod": ["libdeform0 (=", "libcholmod"]}
ALWAYS = ["libdeform0", "libdeform-dev", "libdeform-doc", "deform", "python3-deform"]


def unpack(packages, root):
    """The packages' names, with every file below root."""
    names, owner = [], {}
    for package in packages:
        name = run("dpkg-deb", "-f", package, "Package").strip()
        needs = run("dpkg-deb", "-f", package, "Depends")
        for need in NEEDS[name]:
            if need not in needs:
                sys.exit(f"{name} does not say that it needs {need}: {needs}")
        for line in run("dpkg-deb", "-c", package).splitlines():
            path = line.split()[5]
            if not path.endswith("/") and owner.setdefault(path, name) != name:
                sys.exit(f"{path} is in {name} and in {owner[path]}")
        run("dpkg-deb", "-x", package, root)
        names.append(name)
    headers = [p for p, name in owner.items() if p.endswith((".h", ".hpp")) and name == "libdeform0"]
    if headers:
        sys.exit(f"libdeform0 has headers: {headers}")
    return names


def says_what_is_inside(folder):
    """The bill of materials (SPDX 2.3): whole, with a license of each part, and the licenses' texts."""
    told = json.loads((folder / "deform.spdx.json").read_text())
    parts = {part["SPDXID"]: part for part in told["packages"]}
    kinds = {}
    for relation in told["relationships"]:
        kinds.setdefault(relation["relationshipType"], set()).add(
            parts[relation["relatedSpdxElement"]]["name"])
    if (told["spdxVersion"], told["dataLicense"], told["SPDXID"], kinds["DESCRIBES"]) != (
            "SPDX-2.3", "CC0-1.0", "SPDXRef-DOCUMENT", {"deform"}):
        sys.exit(f"{folder}/deform.spdx.json is no document of SPDX 2.3")
    for part in parts.values():
        if not all(part.get(key) for key in ("name", "versionInfo", "downloadLocation")):
            sys.exit(f"deform.spdx.json says too little: {part}")
        if part["licenseDeclared"] == "NOASSERTION":
            sys.exit(f"add the license of {part['name']} to LICENSES of cmake/packaging/sbom.py")
    for kind, names in (("STATIC_LINK", {"libeigen3-dev", "nlohmann-json3-dev", "libcli11-dev"}),
                        ("DYNAMIC_LINK", {"libc6", "libstdc++6", "zlib1g"})):
        if not names <= kinds[kind]:
            sys.exit(f"deform.spdx.json lacks {names - kinds[kind]} of {kind}")
    texts = (folder / "third_party.txt").read_text()
    for name in ("libeigen3-dev", "nlohmann-json3-dev"):
        if not re.search(rf"^====.* {name}\b", texts, re.M):
            sys.exit(f"third_party.txt lacks the license of {name}")


def main():
    cpack, build, scratch, compiler, python = sys.argv[1:]
    if not shutil.which("dpkg-shlibdeps") or not shutil.which("file"):
        print("no dpkg-dev, or no file, on this machine: no Debian packages")
        sys.exit(77)
    scratch = without_spaces(scratch)
    shutil.rmtree(scratch, ignore_errors=True)
    root = scratch / "root"
    root.mkdir(parents=True)
    clean = clean_environment()
    made = scratch / "made"
    run(cpack, "--config", pathlib.Path(build) / "CPackConfig.cmake", "-B", made,
        "-D", f"CPACK_OUTPUT_FILE_PREFIX={made}", "-D", f"CPACK_PACKAGE_DIRECTORY={made}", env=clean)
    names = unpack(sorted(made.glob("*.deb")), root)
    for name in ALWAYS:
        if name not in names:
            sys.exit(f"{name} was not made")

    prefix = root / "usr"
    says_what_is_inside(prefix / "share/doc/deform")
    here = pathlib.Path(__file__).resolve().parent / "stranger"
    run("cmake", "-S", here, "-B", scratch / "cmake", f"-DCMAKE_PREFIX_PATH={prefix}",
        f"-DCMAKE_C_COMPILER={compiler}", "-DCMAKE_BUILD_TYPE=Release", env=clean)
    run("cmake", "--build", scratch / "cmake", env=clean)
    run(scratch / "cmake" / "host", next((scratch / "cmake").glob("slab.*")), env=clean)
    if str(prefix) not in run(prefix / "bin" / "deform", "plugin", "list", env=clean):
        sys.exit("the command of the package found other plugins than the package's")
    for words in PROGRAMS:
        run(prefix / "bin" / "deform", *words, "--help", env=clean)
    said = run(python, "-c", "import deform\nwith deform.World() as w:\n  w.add_obstacle('plane')\n"
               "  b = w.add_body(deform.TetMesh.ball(0.1, cells=100), position=(0, 0, 0.15))\n"
               "  w.run(0.01, dt=1e-3)\n  print(deform.__file__, b.measure.com[2], w.film().html()[:7])",
               env={**clean, "PYTHONPATH": str(prefix / "lib/python3/dist-packages")})
    if "<iframe" not in said:
        sys.exit("the package shows no film")
    if str(root) not in said:
        sys.exit("another deform was imported than the package's")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""What is inside of programs and libraries of a build, and what they ask the system for: by the headers that
each was compiled from (ninja), the libraries that it is linked with (objdump), and the Debian packages
that these belong to (dpkg). Writes deform.spdx.json (SPDX 2.3) and third_party.txt, the licenses.

sbom.py BUILD OUT VERSION FILE...    FILE: built here, or of the system and shipped with it
"""
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

# Licenses of what is compiled in or shipped, by the name of the Debian package; of another one none is said,
# which tests/abi/packages.py refuses.
LICENSES = {"libbullet": "Zlib", "libc6": "LGPL-2.1-or-later", "libcli11": "BSD-3-Clause",
            "libegl": "MIT-Khronos-old AND Apache-2.0", "libeigen3": "MPL-2.0", "libgl-dev": "MIT",
            "libglfw3": "Zlib", "libhdf5": "BSD-3-Clause", "libimgui": "MIT", "libode": "BSD-3-Clause",
            "libosmesa6": "MIT", "libpng": "libpng-2.0", "libssl": "Apache-2.0", "libstb": "MIT",
            "libvulkan": "Apache-2.0", "libwebsockets": "MIT", "linux-libc-dev":
            "GPL-2.0-only WITH Linux-syscall-note", "nlohmann-json3": "MIT", "zlib1g": "Zlib",
            "libz-mingw-w64": "Zlib", "mingw-w64": "ZPL-2.1",
            "libcap": "BSD-3-Clause", "libsuitesparse": "GPL-2.0-or-later", "libcholmod": "GPL-2.0-or-later",
            "libassimp": "BSD-3-Clause", "libsimde": "MIT", "libspdlog": "MIT", "libfmt": "MIT",
            **dict.fromkeys(("libgcc", "libstdc++", "gcc-", "g++-"),
                            "GPL-3.0-or-later WITH GCC-exception-3.1")}
# Headers of the compiler and the system, whose licenses ask for no notice in programs.
TOOLCHAIN = ("libc6", "linux-libc", "libgcc", "libstdc++", "gcc-", "g++-")


def said(*argv, **more):
    return subprocess.run([str(a) for a in argv], capture_output=True, text=True, check=True, **more).stdout


def license_of(package):
    return next((text for name, text in LICENSES.items() if package.startswith(name)), "NOASSERTION")


def owners(paths):
    """{path: (package, version)} of Debian's files; a path that no package has is left out."""
    asked = {}
    for path in paths:
        real = os.path.realpath(path)
        for name in {path, real, real.removeprefix("/usr")}:
            asked.setdefault(name, path)
    if not asked:
        return {}
    out = subprocess.run(["dpkg-query", "-S", *sorted(asked)], capture_output=True, text=True).stdout
    found = {asked[path]: names.split(",")[0].strip() for names, path in
             (line.rsplit(": ", 1) for line in out.splitlines())
             if path in asked and not names.startswith("diversion ")}
    if not found:
        return {}
    rows = said("dpkg-query", "-W", "-f", "${binary:Package}\t${Version}\n", *sorted(set(found.values())))
    versions = dict(line.split("\t") for line in rows.splitlines())
    versions = {name.partition(":")[0]: version for name, version in versions.items()}
    return {path: (name.partition(":")[0], versions[name.partition(":")[0]]) for path, name in found.items()}


def headers_of(build):
    """{object: headers of the system}, as the compiler has told ninja."""
    out, own = {}, None
    for line in said("ninja", "-n", "-C", build, "-t", "deps").splitlines():
        if line.startswith("    "):
            if line.startswith("    /usr/"):
                own.add(os.path.normpath(line.strip()))
        elif line.strip():
            own = out.setdefault(line.partition(":")[0], set())
    return out


def resolved(path):
    """{name of a library: its file}, as the dynamic linker finds them."""
    out = subprocess.run(["ldd", path], capture_output=True, text=True).stdout
    return dict(re.findall(r"^\s*(\S+) => (/\S+)", out, re.M))


def main():
    os.environ["LC_ALL"] = "C"  # dpkg translates words that are read here
    build, out, version = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]), sys.argv[3]
    if not all(map(shutil.which, ("ninja", "objdump", "dpkg-query"))) or not (build / "build.ninja").exists():
        return print("sbom: takes a build by ninja, objdump and dpkg; nothing is written")
    found = [path for path in map(pathlib.Path, sys.argv[4:]) if path.exists()]
    headers, shipped = headers_of(build), {path.name for path in found}
    built = {path.name: path.resolve() for folder in ("bin", "lib", "lib/deform/*") for path in
             build.glob(f"{folder}/*") if path.name in shipped and path.is_file()}
    parts = [path.relative_to(build) for path in built.values()]
    objects = re.findall(r" -o (\S+\.o(?:bj)?) ", said("ninja", "-n", "-C", build, "-t", "commands", *parts))
    inside = set().union(*(headers.get(part, set()) for part in objects))
    linked, copied = set(), shipped - built.keys()
    for path in found:
        needed = re.findall(r"^ *NEEDED +(\S+)$", said("objdump", "-p", path), re.M)
        of = resolved(path)
        linked |= {of[name] for name in needed if name in of and name not in shipped}
    inside, linked = set(owners(inside).values()), set(owners(linked).values())
    folders = ("/usr/lib/*", "/lib/*", "/usr/lib")
    copied = set(owners({str(f) for name in copied for folder in folders for f in
                         pathlib.Path("/").glob(f"{folder[1:]}/{name}")}).values())

    if not inside:
        return print(f"sbom: dpkg has none of the headers of {build}; nothing is written")
    packages, relations = {}, set()
    for kind, who in (("STATIC_LINK", inside), ("DYNAMIC_LINK", linked), ("CONTAINS", copied)):
        for name, of in who:
            key = "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name)
            packages[key] = {
                "SPDXID": key, "name": name, "versionInfo": of, "downloadLocation": "NOASSERTION",
                "filesAnalyzed": False, "licenseConcluded": "NOASSERTION",
                "licenseDeclared": license_of(name), "copyrightText": "NOASSERTION",
                "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                                  "referenceLocator": f"pkg:deb/debian/{name}@{of}"}]}
            relations.add(("SPDXRef-deform", kind, key))
    own = {"SPDXID": "SPDXRef-deform", "name": "deform", "versionInfo": version,
           "downloadLocation": "NOASSERTION", "filesAnalyzed": False, "licenseConcluded": "MIT",
           "licenseDeclared": "MIT", "copyrightText": "NOASSERTION"}
    rows = [own, *(packages[key] for key in sorted(packages))]
    relations = [("SPDXRef-DOCUMENT", "DESCRIBES", "SPDXRef-deform"), *sorted(relations)]
    digest = hashlib.sha256(json.dumps([rows, relations]).encode()).hexdigest()
    created = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(int(os.environ.get("SOURCE_DATE_EPOCH", 0))))
    document = {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
                "name": f"deform-{version}", "documentNamespace": f"urn:deform:{version}:{digest}",
                "creationInfo": {"created": created, "creators": ["Tool: deform-sbom"]}, "packages": rows,
                "relationships": [{"spdxElementId": a, "relationshipType": kind, "relatedSpdxElement": b}
                                  for a, kind, b in relations]}
    texts = {}
    for name, _ in sorted(inside | copied):
        if name.startswith(TOOLCHAIN):
            continue
        notice = pathlib.Path(f"/usr/share/doc/{name}/copyright")
        if not notice.exists():
            sys.exit(f"sbom: {notice}, the license of what is shipped, is missing: reinstall {name} with it")
        texts.setdefault(notice.read_text(errors="replace"), []).append(name)
    out.mkdir(parents=True, exist_ok=True)
    (out / "deform.spdx.json").write_text(json.dumps(document, indent=1) + "\n")
    (out / "third_party.txt").write_text("".join(
        f"==== {', '.join(names)}\n\n{text.rstrip()}\n\n" for text, names in texts.items()))
    print(f"{out}/deform.spdx.json: {len(found)} programs and libraries, {len(packages)} packages")


if __name__ == "__main__":
    main()

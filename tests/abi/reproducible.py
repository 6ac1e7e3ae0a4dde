#!/usr/bin/env python3
"""The source archive, unpacked in two folders without git and without what lies beside the repository, makes
there the same bytes of each package: the wheel and Debian's. Compiles the library twice: `make packages`.

reproducible.py SOURCE OUT SCRATCH    OUT: gets the archive and the wheel
"""
import filecmp
import os
import pathlib
import shutil
import subprocess
import sys
import tarfile

DATE = "1700000000"


def backend(source, call, folder):
    """Calls wheel_backend of that tree as a packager would, with nothing of this process but the way to
    programs."""
    keep = ("PATH", "HOME", "CMAKE_BUILD_PARALLEL_LEVEL")
    env = {**{k: os.environ[k] for k in keep if k in os.environ}, "SOURCE_DATE_EPOCH": DATE}
    code = f"import wheel_backend as b; b.{call}"
    subprocess.run([sys.executable, "-B", "-c", code, folder], check=True, env=env,
                   cwd=source / "bindings" / "python")
    return env


def main():
    source, out, scratch = (pathlib.Path(a).resolve() for a in sys.argv[1:])
    shutil.rmtree(scratch, ignore_errors=True)
    out.mkdir(parents=True, exist_ok=True)
    backend(source, "build_sdist(__import__('sys').argv[1])", out)
    archive = max(out.glob("deform-*.tar.gz"), key=lambda path: path.stat().st_mtime)
    made = []
    for name in ("first", "a folder of another name"):
        folder = scratch / name
        with tarfile.open(archive) as tar:
            tar.extractall(folder)
        tree, packages = next(folder.iterdir()), folder / "packages"
        packages.mkdir()
        env = backend(tree, "build_wheel(__import__('sys').argv[1])", packages)
        build = tree / "build" / "wheel"
        subprocess.run(["cpack", "--config", build / "CPackConfig.cmake", "-B", packages, "-D",
                        f"CPACK_OUTPUT_FILE_PREFIX={packages}", "-D", f"CPACK_PACKAGE_DIRECTORY={packages}"],
                       check=True, env=env, stdout=subprocess.DEVNULL)
        made.append({path.name: path for path in packages.iterdir() if path.is_file()})
    first, second = made
    differ = [name for name in sorted(first.keys() | second.keys()) if name not in first or name not in second
              or not filecmp.cmp(first[name], second[name], shallow=False)]
    for path in out.glob("deform-*.whl"):
        path.unlink()
    for name, path in first.items():
        print("differs" if name in differ else "same bytes", path.stat().st_size, name)
        if name.endswith(".whl"):
            shutil.copy(path, out)
    if differ or len(first) < 5:
        sys.exit(f"two builds in different folders differ, or made too little: {differ}")


if __name__ == "__main__":
    main()

"""Builds the wheel (PEP 517): the package's Python files, and beneath deform/native what `cmake --install`
of this tree writes: the library, the plugins, the command. It needs CMake, Ninja and a compiler, and nothing
from a registry, so that `pip install .` works wherever the library builds.

The wheel is for any Python 3 (py3-none-PLATFORM): nothing in it is compiled against an interpreter. Its
platform is manylinux_2_N where all that it needs from the system is what every Linux of that name has
(PEP 600): a wheel built without ODE, Bullet and HDF5, as prebuilt=no builds it. libpng travels in it.

Settings (pip: --config-settings NAME=VALUE):
  prebuilt  a build folder of this tree whose target deform_tools is built; nothing is compiled then.
            Without it build/release is taken and brought up to date, if `make` or the release preset has
            made it; with "no" the wheel has a build of its own, in build/wheel
  cmake     further arguments for configuring, in one text
"""
import base64
import gzip
import hashlib
import io
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIBRARIES = re.compile(r"libdeform(_\w+)?\.so\.\d+|libdeform_python(_law|_serve)?\.so|deform/plugins-\d+/.*|"
                       r"libpng\d+\.so\.\d+")
SERVER = "lib/libdeform_python_serve.so"
PACKAGE = ROOT / "bindings" / "python" / "deform"


def _project():
    """The table [project] of pyproject.toml, as far as the metadata of a wheel goes (Python 3.9 has no
    reader)."""
    text = (ROOT / "pyproject.toml").read_text()
    project = dict(re.findall(r'^([\w-]+) = "([^"]*)"$', text.split("[project]")[1].split("\n[")[0], re.M))
    project["dependencies"] = re.findall(r'"([^"]+)"', re.search(r"^dependencies = \[(.*)\]$", text, re.M)[1])
    project["extras"] = {name: re.findall(r'"([^"]+)"', value) for name, value in re.findall(
        r"^(\w+) = \[(.*)\]$", text.split("[project.optional-dependencies]")[1].split("\n[")[0], re.M)}
    project["scripts"] = re.findall(r'^(\w+) = "([^"]+)"$', text.split("[project.scripts]")[1], re.M)
    return project


def _metadata(project):
    lines = ["Metadata-Version: 2.1", f"Name: {project['name']}", f"Version: {project['version']}",
             f"Summary: {project['description']}", "License: MIT",
             f"Requires-Python: {project['requires-python']}"]
    lines += [f"Requires-Dist: {need}" for need in project["dependencies"]]
    for extra, needs in project["extras"].items():
        lines.append(f"Provides-Extra: {extra}")
        lines += [f'Requires-Dist: {need}; extra == "{extra}"' for need in needs]
    lines += ["Description-Content-Type: text/markdown", "", (ROOT / "README.md").read_text()]
    return "\n".join(lines)


# Libraries of every manylinux system; of their versions the last number of the newest, and N of the first
# manylinux_2_N that has it.
EVERYWHERE = {"libc.so.6", "libm.so.6", "libgcc_s.so.1", "libstdc++.so.6", "libz.so.1",
              "ld-linux-x86-64.so.2"}
NEWEST = {"GLIBCXX_3.4": [(24, 28), (28, 31), (29, 34), (30, 35), (33, 39)],
          "CXXABI_1.3": [(11, 28), (12, 31), (13, 34), (15, 39)], "GCC": [(7, 28), (12, 35), (14, 39)],
          "ZLIB_1.2": [(9, 28), (12, 37)], "GLIBC_2": [(n, n) for n in range(28, 100)]}


def _oldest(version):
    """N of the first manylinux_2_N that has this version of a symbol, None where none is known."""
    for name, rows in NEWEST.items():
        found = re.fullmatch(re.escape(name) + r"(?:[._](\d+)(?:\.\d+)*)?", version)
        if found:
            return next((n for newest, n in rows if int(found[1] or 0) <= newest), None)
    return None


def asked_of_system(path):
    """(libraries that not every system has, versions of symbols that it asks the others for)"""
    said = subprocess.run(["objdump", "-p", str(path)], capture_output=True, text=True, check=True,
                          env={**os.environ, "LC_ALL": "C"}).stdout  # it translates what is read here
    of = re.findall(r"^  required from (\S+):\n((?:    0x.*\n)+)", said, re.M)
    return (set(re.findall(r"^ *NEEDED +(\S+)$", said, re.M)) - EVERYWHERE,
            {line.split()[-1] for library, lines in of if library in EVERYWHERE
             for line in lines.splitlines()})


def _tag(files=()):
    """The wheel's tag by what its files ask the system for."""
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    machine = platform.removeprefix("linux_")
    programs = {inside: path for inside, path in files if inside.startswith(("bin/", "lib/"))}
    if "bin/libdeform.dll" in programs:
        return "py3-none-win_amd64"
    programs.pop(SERVER, None)
    own, first = {pathlib.PurePath(inside).name for inside in programs}, 28
    for path in programs.values():
        needed, symbols = asked_of_system(path)
        versions = {_oldest(version) for version in symbols}
        if needed - own or None in versions:
            return f"py3-none-{platform}"
        first = max({first, *versions})
    return f"py3-none-manylinux_2_{first}_{machine}" if programs and machine != platform else (
        f"py3-none-{platform}")


def _run(*command):
    print("+", shlex.join(str(c) for c in command), flush=True)
    subprocess.run([str(c) for c in command], check=True)


def configure(build, settings):
    """What the wheel is built from, where nothing is built already."""
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    without = [f"-DDEFORM_{part}=OFF" for part in ("TESTS", "EXAMPLES", "VIEW", "ODE", "BULLET", "ASSIMP")]
    _run("cmake", "-S", ROOT, "-B", build, *generator, "-DCMAKE_BUILD_TYPE=Release", "-DDEFORM_UNITY=ON",
         *without, "-DCMAKE_DISABLE_FIND_PACKAGE_HDF5=ON", "-DCMAKE_INSTALL_LIBDIR=lib",
         *shlex.split(settings.get("cmake", "")))


def release_build():
    """build/release where it can be packed: configured in this place, as Release, with a shared library that
    installed programs look for in lib; else None. What is up to date there is not compiled again."""
    build = ROOT / "build" / "release"
    cache = build / "CMakeCache.txt"
    wanted = {f"CMAKE_HOME_DIRECTORY:INTERNAL={ROOT}", "CMAKE_BUILD_TYPE:STRING=Release",
              "DEFORM_SHARED:BOOL=ON", "CMAKE_INSTALL_LIBDIR:PATH=lib"}
    return build if cache.exists() and wanted <= set(cache.read_text().splitlines()) else None


def _installed(prefix, settings):
    """What the tree installs, beneath prefix; from which build folder."""
    if not shutil.which("cmake"):
        raise SystemExit("deform: there is no cmake; building the library needs CMake 3.22, Ninja or make, a "
                         "C++20 compiler and some headers: `cmake/setup.sh doors` installs them on Debian")
    build = settings.get("prebuilt")
    release = None if build or "cmake" in settings else release_build()
    build = None if build == "no" else build
    if build and not (pathlib.Path(build) / "cmake_install.cmake").exists():
        raise SystemExit(f"deform: prebuilt={build} is no build folder of this tree; configure and build it "
                         f"first (cmake --preset release; cmake --build --preset release)")
    if build:
        build = pathlib.Path(build).absolute()
    else:
        build = release or ROOT / "build" / "wheel"
        if not release:
            configure(build, settings)
        _run("cmake", "--build", build, "--target", "deform_tools", "--target", "deform_python_native",
             "--parallel", os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL") or len(os.sched_getaffinity(0)))
    _run("cmake", "--install", build, "--strip", "--prefix", prefix)
    _run("cmake", "--install", build, "--strip", "--prefix", prefix, "--component", "python")
    return build


def native_files(prefix):
    """(path below deform/native, file) of what the wheel takes: the library under the name that the loader
    asks for."""
    if not [*prefix.glob("lib/libdeform.so.*"), *prefix.glob("bin/libdeform.dll")]:
        raise SystemExit("deform: this build installs no libdeform.so to lib; configure it with "
                         "-DDEFORM_SHARED=ON -DCMAKE_INSTALL_LIBDIR=lib")
    for path in sorted((prefix / "lib").rglob("*")):
        inside = path.relative_to(prefix / "lib").as_posix()
        if path.is_file() and LIBRARIES.fullmatch(inside):
            yield f"lib/{inside}", path
    for path in sorted((prefix / "bin").glob("*deform*")):
        if path.name not in ("deform-view", "deform-serve"):  # which need libraries of a window, a network
            yield f"bin/{path.name}", path
    for folder in ("share/deform", "include/deform"):
        for path in sorted((prefix / folder).rglob("*")):
            if path.is_file():
                yield path.relative_to(prefix).as_posix(), path


def _information(project, tag):
    """Files of the wheel's .dist-info folder, RECORD left out."""
    lines = ["Wheel-Version: 1.0", "Generator: deform", "Root-Is-Purelib: false", f"Tag: {tag}", ""]
    scripts = "".join(f"{script} = {target}\n" for script, target in project["scripts"])
    return {"METADATA": _metadata(project), "WHEEL": "\n".join(lines),
            "entry_points.txt": f"[console_scripts]\n{scripts}", "LICENSE": (ROOT / "LICENSE").read_text()}


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """What pip asks first, so that it need not build the wheel to learn what it requires."""
    project = _project()
    info = pathlib.Path(metadata_directory) / f"{project['name']}-{project['version']}.dist-info"
    info.mkdir()
    for name, text in _information(project, _tag()).items():
        (info / name).write_text(text)
    return info.name


class _Wheel:
    def __init__(self, path):
        self.zip = zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED)
        self.record = []

    def _write(self, name, data, mode=0o644):
        info = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))  # the same bytes whenever it is built
        info.external_attr = (0o100000 | mode) << 16
        info.compress_type = zipfile.ZIP_DEFLATED
        self.zip.writestr(info, data)

    def add(self, name, data, mode=0o644):
        self._write(name, data, mode)
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        self.record.append(f"{name},sha256={digest},{len(data)}")

    def close(self, info):
        self.record.append(f"{info}/RECORD,,")
        self._write(f"{info}/RECORD", "\n".join(self.record) + "\n")
        self.zip.close()


def _contents(build, version, files):
    """{name in .dist-info: text}: what is inside of the programs, and its licenses, if sbom.py can tell."""
    with tempfile.TemporaryDirectory() as out:
        _run(sys.executable, "-B", ROOT / "cmake" / "packaging" / "sbom.py", build, out, version,
             *(path for inside, path in files if inside.startswith(("bin/", "lib/"))))
        return {f"{place}/{name}": (pathlib.Path(out) / name).read_text()
                for place, name in (("sboms", "deform.spdx.json"), ("licenses", "third_party.txt"))
                if (pathlib.Path(out) / name).exists()}


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    settings = dict(config_settings or {})
    project = _project()
    name = f"{project['name']}-{project['version']}"
    with tempfile.TemporaryDirectory() as folder:
        prefix = pathlib.Path(folder) / "prefix"
        build = _installed(prefix, settings)
        files = list(native_files(prefix))
        tag = _tag(files)
        if "manylinux" in tag:  # a system of that name need not have libwebsockets; deform.serve() says so
            files = [file for file in files if file[0] != SERVER]
        wheel = _Wheel(pathlib.Path(wheel_directory) / f"{name}-{tag}.whl")
        for path in sorted(PACKAGE.rglob("*")):
            if path.is_file() and path.suffix in (".py", ".js", ".html", ".typed"):
                wheel.add(f"deform/{path.relative_to(PACKAGE).as_posix()}", path.read_bytes())
        wheel.add("deform/page.html", (ROOT / "bindings" / "serve" / "page.html").read_bytes())
        for inside, path in files:
            mode = 0o755 if inside.startswith(("bin/", "lib/")) else 0o644
            wheel.add(f"deform/native/{inside}", path.read_bytes(), mode)
        contents = _contents(build, project["version"], files)
    info = f"{name}.dist-info"
    for file, text in {**_information(project, tag), **contents}.items():
        wheel.add(f"{info}/{file}", text.encode())
    wheel.close(info)
    return f"{name}-{tag}.whl"


def build_sdist(sdist_directory, config_settings=None):
    """The tree as git has it."""
    project = _project()
    name = f"{project['name']}-{project['version']}"
    git = ["git", "-C", str(ROOT), "ls-files", "-z"]
    listed = subprocess.run(git, check=True, capture_output=True).stdout
    target = pathlib.Path(sdist_directory) / f"{name}.tar.gz"
    with gzip.GzipFile(target, "wb", mtime=0) as file, tarfile.open(fileobj=file, mode="w") as tar:

        def add(path, data, mode):  # the same bytes whenever, wherever and by whomever it is made
            info = tarfile.TarInfo(f"{name}/{path}")
            info.size, info.mode, info.mtime = len(data), mode, 315532800
            tar.addfile(info, io.BytesIO(data))
        for path in filter(None, listed.decode().split("\0")):
            if (ROOT / path).is_file():
                add(path, (ROOT / path).read_bytes(), 0o755 if os.access(ROOT / path, os.X_OK) else 0o644)
        add("PKG-INFO", _metadata(project).encode(), 0o644)
    return target.name

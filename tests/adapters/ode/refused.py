"""libdeform_ode is refused when configured: another precision, another version, none; asked for it stops,
else it is left out, each with a sentence.

usage: refused.py SOURCE CMAKE
"""
import os
import subprocess
import sys
import tempfile
from pathlib import Path

source, cmake = sys.argv[1:3]
HEADER = """typedef %s dReal;
static inline int dCheckConfiguration(const char *token) {
  return sizeof(dReal) == 8 || token[sizeof("ODE_") - 1] == 'E';
}
"""
CASES = [("float", "0.16.2", "double precision"), ("double", "0.13.1", "no ODE 0.16"),
         (None, None, "no ODE 0.16")]


def configure(folder: Path, real: str | None, version: str | None,
              wanted: str) -> subprocess.CompletedProcess:
    (folder / "include" / "ode").mkdir(parents=True)
    (folder / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.22)\nproject(refused C CXX)\n"
                                           "add_library(deform INTERFACE)\n"
                                           "add_library(deform_flags INTERFACE)\nset(DEFORM_SHARED ON)\n"
                                           f'add_subdirectory("{source}/bindings/ode" ode)\n')
    if real:
        (folder / "include" / "ode" / "ode.h").write_text(HEADER % real)
        (folder / "ode.pc").write_text(f"Name: ode\nDescription: a stand-in\nVersion: {version}\n"
                                       f"Cflags: -I{folder}/include\n")
    # Nothing but the stand-in is seen.
    env = dict(os.environ, PKG_CONFIG_LIBDIR=str(folder), PKG_CONFIG_PATH="")
    return subprocess.run([cmake, "-S", folder, "-B", folder / "build", f"-DDEFORM_ODE={wanted}"],
                          capture_output=True, text=True, env=env)


failures = 0
for real, version, sentence in CASES:
    for wanted in ("ON", "AUTO"):
        with tempfile.TemporaryDirectory() as name:
            run = configure(Path(name), real, version, wanted)
        said = " ".join((run.stdout + run.stderr).split())
        remedy = "install libode-dev" if wanted == "ON" else "left out"
        if (run.returncode == 0) == (wanted == "ON") or sentence not in said or remedy not in said:
            failures += 1
            print(f"{real} {version} {wanted}: exit {run.returncode}\n{run.stdout}{run.stderr}")
sys.exit(failures > 0)

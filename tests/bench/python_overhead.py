#!/usr/bin/env python3
"""What a step, and a look at an array, costs from Python beyond what it costs in C: an empty world stepped
by a C program and by the package in turn; processor time of the thread, the least of several rounds each.

python_overhead.py BUILD_DIR [SOURCE_DIR]    prints head and row of results/python_overhead.csv
"""
import ctypes
import os
import pathlib
import subprocess
import sys
import tempfile
import time

STEPS, ROUNDS = 200_000, 7
PROGRAM = r"""
#include <deform/deform.h>
#include <stdio.h>
#include <time.h>
static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}
int main(void) {
  dfm_context *context;
  dfm_world world;
  const dfm_world_def def = dfm_world_def_default();
  uint32_t trouble;
  if (dfm_context_create(NULL, &context) || dfm_world_create(context, &def, &world)) return 1;
  for (int round = 0; round < ROUNDS; ++round) {
    const double begin = now();
    for (int i = 0; i < STEPS; ++i) if (dfm_world_step(world, 1e-3, &trouble)) return 1;
    printf("%.6f\n", (now() - begin) / STEPS);
  }
  dfm_context_destroy(context);
  return 0;
}
"""


def in_c(build, source):
    with tempfile.TemporaryDirectory() as name:
        program = pathlib.Path(name) / "steps.c"
        program.write_text(PROGRAM)
        subprocess.run(["cc", "-O2", "-D_POSIX_C_SOURCE=199309L", f"-DSTEPS={STEPS}", f"-DROUNDS={ROUNDS}",
                        f"-I{source}/libdeform/include", program, f"-L{build}/lib", "-ldeform",
                        f"-Wl,-rpath,{build}/lib", "-o", program.with_suffix("")], check=True)
        said = subprocess.run([program.with_suffix("")], check=True, capture_output=True, text=True).stdout
    return min(float(line) for line in said.split())


def least(function):
    """us per call, of the least round."""
    best = float("inf")
    for _ in range(ROUNDS):
        begin = time.thread_time()
        for _ in range(STEPS // 4):
            function()
        best = min(best, (time.thread_time() - begin) / (STEPS // 4) * 1e6)
    return best


def machine():
    """The processor's name."""
    with open("/proc/cpuinfo") as info:
        names = (line.split(": ")[1].strip() for line in info if line.startswith("model name"))
        return next(names, "unknown")


def commit(source):
    done = subprocess.run(["git", "-C", source, "rev-parse", "--short", "HEAD"], capture_output=True)
    return done.stdout.decode().strip() or "unknown"


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    source = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else __file__).resolve()
    source = source if source.is_dir() else source.parents[2]
    os.environ["DEFORM_LIBRARY"] = str(build / "lib" / "libdeform.so.0")
    sys.path.insert(0, str(source / "bindings" / "python"))
    import deform
    from deform import _library

    c = in_c(build, source)
    world = deform.World()
    step = least(lambda: world.step(1e-3))
    empty = least(lambda: None)
    world.add_obstacle("plane")
    body = world.add_body(deform.TetMesh.ball(0.1, cells=2000), position=(0, 0, 0.2))
    look = least(lambda: body.positions)
    raw_memory = (ctypes.c_double * (3 * body.nsurfel))()
    raw = least(lambda: _library.quick.dfm_surface_positions(body.handle, body.nsurfel, raw_memory, None))
    print("machine,commit,python,c_step_us,python_step_us,step_beyond_c_us,look_us,"
          "look_beyond_raw_call_us")
    print(f"{machine()},{commit(source)},{sys.version.split()[0]},{c:.3f},{step - empty:.3f},"
          f"{step - empty - c:.3f},{look - empty:.3f},{look - raw:.3f}")


if __name__ == "__main__":
    main()

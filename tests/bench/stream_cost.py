#!/usr/bin/env python3
"""stream_cost.py BIN [sizes] [viewers] [latency]: what it costs to show a run, in processor time, so that it
holds on a busy machine. Tables 7.3 and 7.4 of Zerbato (2010) compare physics, local and remote drawing.

sizes    two balls with the sizes of table 7.4: physics alone, a picture drawn here, a frame sent by RTP, a
         frame served to one viewer and to eight
viewers  the thread that steps a scene, with one viewer and with eight by turns
latency  20,000 surface points in headless Chromium, 30 pictures a second: from the end of a step to the call
         that draws, and to the picture
"""
import json
import os
import resource
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
for folder in ("examples", "tests/serve", "bindings/python"):
    sys.path.insert(0, os.path.join(ROOT, folder))
from stream_receiver import Connection  # noqa: E402

RATE, SIZE = 30, (400, 300)  # pictures a second, their pixels
BALLS = {"low": 5413, "high": 39740}  # cells


def cpu(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout


class Viewer(threading.Thread):
    """Counts frames until it is closed, and keeps the last state."""

    def __init__(self, url):
        super().__init__(daemon=True)
        self.connection, self.frames, self.state = Connection(url, 60), 0, {}
        self.start()

    def run(self):
        try:
            while True:
                message = self.connection.receive()
                if isinstance(message, bytes):
                    self.frames += 1
                else:
                    self.state.update(json.loads(message))
        except (ConnectionError, OSError):
            pass

    def close(self):
        self.connection.socket.shutdown(socket.SHUT_RDWR)
        self.join()
        self.connection.close()


def threads_of(pid):
    """s of processor time: of the first thread, and of all others."""
    out = [0.0, 0.0]
    for thread in os.listdir(f"/proc/{pid}/task"):
        with open(f"/proc/{pid}/task/{thread}/schedstat", encoding="ascii") as stat:
            out[int(thread) != pid] += 1e-9 * int(stat.read().split()[0])
    return out


class Served:
    def __init__(self, binaries, scene, *options):
        self.process = subprocess.Popen([os.path.join(binaries, "deform-serve"), "serve", scene, *options],
                                        stdout=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().strip()

    def cost(self, viewers, seconds, per):
        """Processor time of both kinds of threads while so many look on, per what per(viewer) counts."""
        all_viewers = [Viewer(self.url) for _ in range(viewers)]
        end = time.monotonic() + 60
        while not all(v.frames > 5 for v in all_viewers):
            if time.monotonic() > end:
                raise SystemExit("stream_cost: a viewer gets no frames")
            time.sleep(0.05)
        before, first = threads_of(self.process.pid), per(all_viewers[0])
        time.sleep(seconds)
        after, n = threads_of(self.process.pid), per(all_viewers[0]) - first
        for viewer in all_viewers:
            viewer.close()
        return [(b - a) / n for a, b in zip(before, after)]

    def end(self):
        self.process.terminate()
        self.process.wait()


def ball(folder, cells):
    """A scene file; it falls on a floor and rolls down."""
    path = os.path.join(folder, f"ball_{cells}.json")
    with open(path, "w", encoding="ascii") as file:
        json.dump({"format": "deform-scene", "version": 1, "time": {"duration": 1, "step": 1e-3},
                   "gravity": [2, 0, -9.6],
                   "bodies": [{"name": "ball", "mesh": {"make": "ball", "radius": 0.1, "cells": cells},
                               "pose": {"position": [0, 0, 0.101]}}],
                   "obstacles": [{"name": "floor", "shape": "plane"}]}, file)
    return path


def sizes(binaries):
    deform = os.path.join(binaries, "deform")
    print("| ball | cells, surface points | physics alone, steps a second | a picture drawn here, ms |"
          " a frame by RTP, ms | served to one, ms a frame (network's"
          " thread) | to eight |\n|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as out, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sink:
        sink.bind(("127.0.0.1", 0))
        for name, cells in BALLS.items():
            scene = ball(out, cells)
            listed = json.loads(subprocess.run([deform, "explain", scene, "--json"], check=True,
                                               capture_output=True, text=True).stdout)["bodies"][0]
            run = [deform, "run", scene, "--out", os.path.join(out, "run"), "--set", "/output/frames=false"]
            short, _ = cpu(run + ["--time", "0.001"])  # what it takes to begin
            physics = cpu(run + ["--time", "0.5"])[0] - short
            drawn = run[:-2] + ["--frames"]
            few, _ = cpu(drawn + ["1000", "--time", "0.002"])
            drawing, _ = cpu(drawn + ["1000", "--time", "0.006"])
            streamed = run + ["--time", "0.5", "--stream", f"rtp://127.0.0.1:{sink.getsockname()[1]}"]
            rtp = statistics.median(float(cpu(streamed)[1].split("MB, ")[1].split()[0]) for _ in range(3))
            rate = 500 / physics
            served = Served(binaries, scene, "--paused")
            one, eight = (served.cost(n, 10, lambda viewer: viewer.frames) for n in (1, 8))
            served.end()
            print(f"| {name} | {listed['cells']:,}, {listed['surfels']:,} | {rate:.0f} |"
                  f" {1e3 * (drawing - few) / 4:.0f} | {rtp:.3f} |"
                  f" {1e3 * one[0]:.2f} ({1e3 * one[1]:.2f}) | {1e3 * eight[0]:.2f} ({1e3 * eight[1]:.2f}) |",
                  flush=True)


def viewers(binaries):
    """By turns, so that what else the machine does meets both alike; what it does only adds."""
    served = Served(binaries, os.path.join(ROOT, "examples", "scenes", "slope_block.json"), "--set",
                    "/time/duration=1000")
    costs = {1: [], 8: []}
    served.cost(1, 5, lambda viewer: viewer.state["time"])
    for _ in range(16):
        for n, all_of in costs.items():
            all_of.append(1e3 * served.cost(n, 2, lambda viewer: viewer.state["time"])[0])
    served.end()
    for name, at in (("median", 8), ("lower quarter", 4)):
        one, eight = (sorted(all_of)[at] for all_of in costs.values())
        print(f"slope_block, ms of the thread that steps for a second of the scene, {name}: {one:.2f} with "
              f"one viewer, {eight:.2f} with eight, {100 * (eight / one - 1):+.1f} %")


HOOKS = """(() => { const log = window.log = [], now = () => performance.timeOrigin + performance.now();
  let came = 0;
  const r = read, d = draw;
  read = b => { came = now(); r(b); };
  draw = () => { const begin = now(); d(); const called = now();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    log.push([world.frame, came, begin, called, now()]); }; })()"""


def latency(binaries):
    os.environ.setdefault("DEFORM_LIBRARY", os.path.join(binaries, "..", "lib", "libdeform.so"))
    import deform
    from browser import Browser
    with deform.World(integrator="implicit_euler") as world:
        surface = deform.TriMesh.make("ball", [0.1], 40000)
        body = world.add_body(deform.TetMesh.lattice(surface, cells=300), surface=surface,
                              model="corotational_fem", position=(0, 0, 0.15), material={"young": 2e4})
        world.add_obstacle("plane")
        server, ends, logs = deform.Server(world), {}, []

        def look():
            browser = Browser("chromium-headless-shell", server.url, SIZE)
            browser.wait("typeof world !== 'undefined' && world.frame > 10", "frames")
            browser.value(HOOKS)
            time.sleep(15)
            logs.extend(browser.value("log"))
            browser.close()

        page = threading.Thread(target=look)
        page.start()
        due = time.monotonic()
        while page.is_alive():
            world.step(1 / RATE)
            ends[server._frame] = 1e3 * time.time()
            server._exchange()
            due = max(due + 1 / RATE, time.monotonic())
            time.sleep(max(0, due - time.monotonic()))
        rows = [[x - ends[frame] for x in row] for frame, *row in logs if frame in ends]
        print(f"{body.nsurfel} surface points, {len(rows)} pictures in 15 s; median and 95 % in ms from the "
              "end of the step:")
        stages = ("message has come", "drawing begins", "it is called", "picture is there")
        for what, column in zip(stages, zip(*rows)):
            every = sorted(column)
            print(f"  {what}: {statistics.median(every):.1f}, {every[int(0.95 * len(every))]:.1f}")
        server.close()


def main():
    chosen = sys.argv[2:] or ["sizes", "viewers", "latency"]
    for part in chosen:
        {"sizes": sizes, "viewers": viewers, "latency": latency}[part](os.path.abspath(sys.argv[1]))


if __name__ == "__main__":
    main()

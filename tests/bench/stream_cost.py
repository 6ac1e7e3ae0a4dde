#!/usr/bin/env python3
"""stream_cost.py BIN: what it costs to show a run: physics alone, pictures drawn here, packets of RTP, a
browser's stream to one viewer and to eight. Processor time, so that it holds on a busy machine. Tables 7.3
and 7.4 of Zerbato (2010) compare physics, local and remote drawing in the same way."""
import os
import resource
import socket
import subprocess
import sys
import tempfile
import threading
import time

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
sys.path.insert(0, os.path.join(ROOT, "examples"))
from stream_receiver import Connection  # noqa: E402

SECONDS, RATE = 2.0, 30


def cpu(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout


def drained(url, frames):
    """Reads until the server ends, and counts frames."""
    viewer = Connection(url, 60)
    try:
        while True:
            if isinstance(viewer.receive(), bytes):
                frames[0] += 1
    except (ConnectionError, OSError):
        pass


def threads_of(pid):
    """s of processor time: of the first thread, and of all others."""
    out = [0.0, 0.0]
    for thread in os.listdir(f"/proc/{pid}/task"):
        with open(f"/proc/{pid}/task/{thread}/stat", encoding="ascii") as stat:
            fields = stat.read().rsplit(")", 1)[1].split()
        out[int(thread) != pid] += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return out


def served(binaries, scene, viewers):
    """ms of processor time per picture: of the thread that steps, of that of the network."""
    served = subprocess.Popen([os.path.join(binaries, "deform-serve"), "serve", scene, "--seconds", "12",
                               "--paused"], stdout=subprocess.PIPE, text=True)
    url = served.stdout.readline().strip()
    frames = [[0] for _ in range(viewers)]
    all_viewers = [threading.Thread(target=drained, args=(url, f)) for f in frames]
    for thread in all_viewers:
        thread.start()
    time.sleep(1)
    before, at = threads_of(served.pid), frames[0][0]
    time.sleep(10)
    after, n = threads_of(served.pid), max(1, frames[0][0] - at)
    served.wait()
    for thread in all_viewers:
        thread.join()
    return [1e3 * (b - a) / n for a, b in zip(before, after)], n


def main():
    binaries = sys.argv[1]
    deform = os.path.join(binaries, "deform")
    print("| scene | physics, s | pictures drawn here, ms each | RTP packets, ms a frame |"
          " served to one, ms a frame (network's thread) | to eight |\n|---|---|---|---|---|---|", flush=True)
    for name in ("ten_bodies", "liver"):
        scene = os.path.join(ROOT, "examples", "scenes", name + ".json")
        with tempfile.TemporaryDirectory() as out, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sink:
            sink.bind(("127.0.0.1", 0))
            run = [deform, "run", scene, "--out", out, "--time", str(SECONDS)]
            run += ["--set", "/output/frames=false"]
            physics, _ = cpu(run)
            drawing, _ = cpu(run[:-2] + ["--frames", str(RATE)])
            _, text = cpu(run + ["--stream", f"rtp://127.0.0.1:{sink.getsockname()[1]}"])
            told = next(line for line in text.splitlines() if line.startswith("streamed:"))
            rtp = told.split("MB, ")[1].split()[0]
        one, n = served(binaries, scene, 1)
        eight, _ = served(binaries, scene, 8)
        print(f"| {name} | {physics:.2f} | {1e3 * (drawing - physics) / (SECONDS * RATE):.1f} | {rtp} |"
              f" {one[0]:.2f} ({one[1]:.2f}), {n / 10:.0f} a second | {eight[0]:.2f} ({eight[1]:.2f}) |",
              flush=True)


if __name__ == "__main__":
    main()

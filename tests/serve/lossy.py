#!/usr/bin/env python3
"""lossy.py DEFORM SCENE SECONDS OUT: a run that is streamed over a network that loses, doubles and reorders
packets, beside a receiver of the same packets without loss. Whatever is lost, no triangle is broken, and at
the end, cuts included, both have the same."""
import json
import os
import random
import socket
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "..", "examples"))
from stream_receiver import Scene, says_goodbye  # noqa: E402

LOST, DOUBLED, LATE = 0.05, 0.02, 0.05


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def measure(packet, brought):
    """Bytes of displacements in a packet, added for each body."""
    at = 32
    while at < len(packet):
        n = 8 + int.from_bytes(packet[at + 4:at + 8], "little")
        if packet[at:at + 4] == b"SURF":
            number = int.from_bytes(packet[at + 8:at + 12], "little")
            brought[number] = brought.get(number, 0) + n
        at += n


def check(scene, places):
    for number, body in scene.bodies.items():
        n = len(body.base) // 3
        assert all(t is None or t < n for t in body.triangles), "a triangle of points that are not there"
        if not body.missing:
            places.setdefault((number, body.shape), set()).add(len(body.triangles))


def main():
    deform, scene_file, seconds, out = sys.argv[1:5]
    port, dice = free_port(), random.Random(1)
    incoming = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    incoming.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
    incoming.bind(("127.0.0.1", port))
    incoming.settimeout(60)
    run = subprocess.Popen([deform, "run", scene_file, "--time", seconds, "--out", out, "--quiet", "--stream",
                            f"rtp://127.0.0.1:{port}"])
    clean, lossy, waiting, shapes = Scene(), Scene(), [], {}
    brought, ended = {}, set()  # bytes of each body; frames
    # who joins in the middle, when, and after how long it has all, by the clock of the sender
    late, joined, whole = Scene(), None, None
    count = dropped = 0
    sequence, gone = None, set()
    while True:
        data, _ = incoming.recvfrom(1 << 16)
        if 200 <= data[1] <= 204:
            if says_goodbye(data):
                break
            continue
        number = int.from_bytes(data[2:4], "big")
        assert sequence is None or number == (sequence + 1) & 0xffff, "numbers of packets go up by one"
        sequence = number
        count += 1
        sent_at, payload = int.from_bytes(data[4:8], "big"), data[12:]
        assert len(data) <= 1200
        clean.read(payload)
        if joined is not None or clean.time > 0.5 * float(seconds):
            joined = sent_at if joined is None else joined
            late.read(payload)
            if whole is None and late.present and all(
                    number in late.surfaces and not late.surfaces[number].missing for number in late.present):
                whole = ((sent_at - joined) & 0xffffffff) / 90000
        if payload[5] == 1 and (frame := payload[20:24]) not in ended:  # the last one is sent three times
            measure(payload, brought)
            if data[1] & 128:
                ended.add(frame)
        # not the same part of two frames in a row: the end of a run is sent more than once for that
        part = (payload[5], int.from_bytes(payload[12:16], "little"))
        if part not in gone and dice.random() < LOST:
            gone.add(part)
            dropped += 1
            continue
        gone.discard(part)
        waiting += [payload] * (2 if dice.random() < DOUBLED else 1)
        if dice.random() < LATE:
            continue  # what waits comes with the next ones, in another order
        dice.shuffle(waiting)
        for packet in waiting:
            lossy.read(packet)
            check(lossy, shapes)
        waiting = []
    for packet in waiting:
        lossy.read(packet)
    assert run.wait() == 0
    with open(os.path.join(out, "summary.json"), encoding="utf-8") as file:
        sent = json.load(file)["stream"]
    assert sent["frames"] == len(ended) and sent["packets"] == count
    assert whole is not None, "who joins late is never whole"
    assert whole < 1.0, f"who joins late is whole after {whole:.2f} s"  # 0.9 s and a frame by design
    rates = {clean.bodies[number].name: n for number, n in brought.items() if number in clean.present}
    for name, n in rates.items():  # all of the same time
        assert abs(sent["kbit_per_s"][name] / n - sum(sent["kbit_per_s"].values()) / sum(rates.values())) \
            < 1e-6 * sent["kbit_per_s"][name] / n, sent
    assert 0.5 * float(seconds) < 8e-3 * n / sent["kbit_per_s"][name] < 30
    assert dropped > 0
    cuts = sum(len(v) for v in shapes.values()) - len({number for number, _ in shapes})
    print(f"{count} packets, {dropped} lost; who joins late is whole after {whole:.2f} s")
    print(f"triangles of {len(shapes)} bodies, changed by cuts: {cuts}")
    assert set(clean.bodies) == set(lossy.bodies) and clean.present == lossy.present
    worst = 0.0
    for number, body in clean.bodies.items():
        other = lossy.bodies[number]
        assert body.missing == 0 and other.missing == 0 and body.triangles == other.triangles
        worst = max([worst] + [abs(a - b) for a, b in zip(body.x, other.x)])
    print(f"largest difference at the end: {worst:.3g} m")
    assert worst == 0


if __name__ == "__main__":
    main()

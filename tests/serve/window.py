#!/usr/bin/env python3
"""window.py SERVE VIEW SCENE OUT: `deform view` of a stream over a network that loses a part of all
packets in both directions. What the window draws is looked at; its mouse pulls, its slider moves, its keys
run and pause the scene there, each once, whatever is lost. Who lacks the token only looks on."""
import json
import os
import random
import select
import socket
import subprocess
import sys
import threading
import zlib

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "..", "examples"))
from abuse import state_of  # noqa: E402
from stream_receiver import Connection  # noqa: E402

LOST, SKIPPED = 0.05, 77


def bound(port=0):
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
    out.bind(("127.0.0.1", port))
    return out


class Network(threading.Thread):
    """Between a sender and a window."""

    def __init__(self, window):
        super().__init__(daemon=True)
        self.near, self.far = bound(), bound()
        self.port = self.near.getsockname()[1]
        self.window, self.sender = ("127.0.0.1", window), None
        self.dice, self.dropped, self.forged = random.Random(1), [0, 0], None
        self.ends = False
        self.bad = 0  # answers that a window must not take

    def spoil(self, data):
        """Sends answers as no good sender does, before a good one."""
        state = json.loads(data[20:])
        good = {"name": "x", "label": "x", "value": 1, "low": 0.5, "high": 2, "logarithmic": False}
        for change in ({"label": ""}, {"name": ""}, {"low": 3}, {"high": 1e39}, {"low": -1e999}, {"value": 7},
                       {"low": 0, "logarithmic": True}, {"label": "a\0b"}, {"label": "x" * 1000},
                       {"low": {}}, {"high": None}):
            wrong = {**state, "sliders": [{**good, **change}], "up": [0, 0, 0], "eye": [1e999] * 3}
            self.far.sendto(packet(data[:20], wrong), self.window)
            self.bad += 1

    def run(self):
        while not self.ends:
            for side in select.select([self.near, self.far], [], [], 0.1)[0]:
                data, source = side.recvfrom(1 << 16)
                out = side is self.near
                if out:
                    self.sender = source
                elif data[1] == 204 and len(data) > 80:  # one that asks for something
                    self.forged = data
                # of each side one at least
                asked = out or (data[1] == 204 and len(data) > 80)
                if not 200 <= data[1] <= 203 and asked and (
                        not self.dropped[not out] or self.dice.random() < LOST):
                    self.dropped[not out] += 1
                    continue
                if out:
                    if data[1] == 204:
                        self.spoil(data)
                    self.far.sendto(data, self.window)
                elif self.sender:
                    self.near.sendto(data, self.sender)


def packet(head, text):
    text = json.dumps(text).encode()
    text += b" " * (-len(text) % 4)
    return head[:2] + ((len(head) + len(text)) // 4 - 1).to_bytes(2, "big") + head[4:] + text


def pixels(path):
    """Rows of RGB of a PNG of 8 bits that is not interlaced."""
    with open(path, "rb") as file:
        data = file.read()
    at, packed, width, height = 8, b"", 0, 0
    while at < len(data):
        n, kind = int.from_bytes(data[at:at + 4], "big"), data[at + 4:at + 8]
        body = data[at + 8:at + 8 + n]
        if kind == b"IHDR":
            width, height = int.from_bytes(body[:4], "big"), int.from_bytes(body[4:8], "big")
            assert body[8:10] == b"\x08\x02"
        elif kind == b"IDAT":
            packed += body
        at += 12 + n
    raw, above, rows, stride = zlib.decompress(packed), bytes(3 * width), [], 3 * width
    for y in range(height):
        how, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            a, b, c = line[i - 3] if i >= 3 else 0, above[i], above[i - 3] if i >= 3 else 0
            nearest = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            line[i] = (line[i] + (0, a, b, (a + b) // 2, nearest)[how]) & 255
        rows.append(bytes(line))
        above = rows[-1]
    return rows


def red(rows):
    """How many pixels a red body covers, and their middle across."""
    all_of = [x for row in rows for x in range(len(row) // 3) if row[3 * x] > row[3 * x + 1] + 60]
    return len(all_of), sum(all_of) / max(1, len(all_of))


def watch(view, url, script, out, display):
    path = os.path.join(out, "script.txt")
    with open(path, "w", encoding="ascii") as file:
        file.write("0 key t\n" + script)
    done = subprocess.run([view, "view", url, "--script", path, "--out", out, "--size", "320x240", "--json"],
                          capture_output=True, text=True, timeout=200, check=False,
                          env={**os.environ, "DISPLAY": display})
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    return {os.path.basename(row["shot"]): row for row in rows}


def restart(run, served, page, window, out, display):
    """A window steers a run, and the next one that is sent to the same place."""
    script, seen = "1 key c\n1.5 key space\n8 key c\n8.5 key space\n11 shot again.png\n", {}
    look = threading.Thread(target=lambda: seen.update(watch(*window, script, out, display)))
    look.start()
    viewer = Connection(page)
    state_of(viewer, lambda state: state["running"])
    viewer.close()
    served.terminate()
    served.wait()
    with subprocess.Popen(run, stdout=subprocess.PIPE, text=True) as again:
        try:
            look.join()
        finally:
            again.terminate()
    assert seen["again.png"]["t"] > 0.1, "the window runs the next scene too"


def check(serve, view, scene, out, display):
    at_window = bound()
    port = at_window.getsockname()[1]
    at_window.close()
    network = Network(port)
    network.start()
    run = [serve, "serve", scene, "--paused", "--seconds", "150", "--stream",
           f"rtp://127.0.0.1:{network.port}"]
    with subprocess.Popen(run, stdout=subprocess.PIPE, text=True) as served:
        page, told = (served.stdout.readline().strip() for _ in range(2))
        token = told.split("?token=")[1]
        assert token == page.split("?token=")[1]
        url = f"rtp://127.0.0.1:{port}"
        try:
            # without the token: it sees all, and asks for nothing
            # and its strokes turn the camera, they cut nothing
            seen = watch(view, url, "0.5 shot a.png\n0.6 key space\n1.6 shot b.png\n1.7 key x\n"
                         "1.8 drag 20 20 120 40 0.3\n2.4 shot c.png\n", out, display)
            assert seen["a.png"]["t"] == seen["b.png"]["t"] == 0, "who lacks the token does not run the scene"
            a, b, c = (pixels(os.path.join(out, f"{shot}.png")) for shot in "abc")
            assert a == b != c, "the stroke of who does not steer"
            area, middle = red(a)
            assert area > 1000, f"the block covers {area} pixels"
            watch(view, url + "?token=" + "0" * len(token),
                  "1.5 key space\n2.5 key space\n2.6 shot a.png\n", out, display)
            # with it: the block is at rest, is pulled to the right, and comes to rest again
            seen = watch(view, url + "?token=" + token,
                         "0.5 shot start.png\n1 key c\n1.5 key space\n2.5 shot rest.png\n"
                         "2.5 drag 160 120 220 120 0.4 1.5\n4.2 shot held.png\n"
                         # a reset ends the plots
                         "4.6 key r\n6 shot reset.png\n"
                         "6.1 slider gravity 3.5\n6.4 key space\n7.6 shot end.png\n8.1 shot after.png\n"
                         # a stroke from above to below, after it the mouse pulls again
                         "8.2 key x\n8.3 drag 160 20 160 220 0.3\n8.9 key x\n9 key t\n10.1 shot cut.png\n",
                         out, display)
            assert seen["start.png"]["t"] == 0, "another token runs nothing"
            assert seen["rest.png"]["t"] > 0.1
            assert seen["end.png"]["t"] == seen["after.png"]["t"] > seen["reset.png"]["t"]
            x = [seen[shot]["middle"]["block"][0] for shot in ("rest.png", "held.png")]
            assert x[1] > x[0] + 0.02, f"the mouse has pulled the block from {x[0]} to {x[1]}"
            across = [red(pixels(os.path.join(out, f"{shot}.png"))) for shot in ("rest", "held")]
            assert across[1][0] > 1000 and across[1][1] > across[0][1] + 10, f"a picture shows it: {across}"
            assert seen["cut.png"]["triangles"] > seen["after.png"]["triangles"], "the stroke has cut"
            assert seen["held.png"]["plotted"]["probe top"] > 10 < seen["held.png"]["plotted"]["pull"]
            assert "pull" not in seen["reset.png"]["plotted"], "a plot of what was before the reset"
            # what was heard once is not heard again
            request = network.forged
            viewer = Connection(page)
            network.near.sendto(request, network.sender)
            bound().sendto(request, network.sender)
            for _ in range(2000):  # nor what is malformed, but for its number, which is old
                data, dice = bytearray(request), network.dice
                for _ in range(dice.randrange(1, 6)):
                    place = dice.randrange(len(data))
                    if not 76 <= place < 80:
                        data[place] = dice.randrange(256)
                network.near.sendto(data[:dice.randrange(len(data) + 1)], network.sender)
            # nor the next one from elsewhere, or with another token; else it is
            last = int.from_bytes(request[76:80], "big")
            state = {"do": "slider", "name": "gravity", "value": 7}
            head, then = (request[:76] + (last + i).to_bytes(4, "big") for i in (1, 2))
            bound().sendto(packet(head, {"do": "take"}), network.sender)
            for place in range(12, 76):
                wrong = head[:place] + bytes([head[place] ^ 1]) + head[place + 1:]
                network.near.sendto(packet(wrong, {"do": "take"}), network.sender)
            states = [state_of(viewer) for _ in range(20)]
            assert states[-1]["sliders"][0]["value"] == 3.5 and not states[-1]["running"]
            # the scene names mu_C alone; mu_S, which is another value by default, has a slider of its own
            levels = {s["name"]: s["value"] for s in states[-1]["sliders"] if s["name"].startswith("mu")}
            assert levels == {"mu_C:block:floor": 0.3, "mu_S:block:floor": 0.5}, levels
            network.near.sendto(packet(head, {"do": "take"}), network.sender)
            network.near.sendto(packet(then, state), network.sender)
            state_of(viewer, lambda state: state["sliders"][0]["value"] == 7)
            viewer.close()
            assert all(network.dropped) and network.bad, network.dropped
            restart(run + ["--token", token], served, page, (view, url + "?token=" + token), out, display)
            print(f"pulled from {x[0]:.3f} to {x[1]:.3f} m; lost on the way: {network.dropped}")
        finally:
            served.terminate()
            network.ends = True


def main():
    serve, view, scene, out = sys.argv[1:5]
    os.makedirs(out, exist_ok=True)
    here, there = os.pipe()
    try:
        screen = subprocess.Popen(["Xvfb", "-displayfd", str(there), "-screen", "0", "640x480x24",
                                   "-nolisten", "tcp"], pass_fds=[there], stderr=subprocess.DEVNULL)
    except FileNotFoundError:
        print("skipped: no Xvfb on this machine: install Debian's xvfb")
        sys.exit(SKIPPED)
    try:
        os.close(there)
        with os.fdopen(here) as number:
            check(serve, view, scene, out, ":" + number.readline().strip())
    finally:
        screen.terminate()
        screen.wait()


if __name__ == "__main__":
    main()

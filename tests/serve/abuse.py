#!/usr/bin/env python3
"""abuse.py SERVE SCENE MESSAGES: who is not asked in stays out, and what viewers send harms nobody: not the
simulation, not other viewers. MESSAGES: how many malformed ones."""
import json
import os
import random
import socket
import subprocess
import sys
import time
import urllib.parse

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "..", "examples"))
from stream_receiver import Connection, Scene  # noqa: E402


def refused(url, **how):
    try:
        Connection(url, **how).receive()
    except (ConnectionError, OSError):
        return True
    return False


def state_of(viewer, until=lambda state: True, seconds=30):
    """The next state for which `until` holds; frames are read too."""
    scene, end = Scene(), time.time() + seconds
    while time.time() < end:
        message = viewer.receive()
        if isinstance(message, bytes):
            scene.read(message)
        elif "time" in (state := json.loads(message)) and until(state):
            return state
    raise AssertionError("no such state came")


def states_of_frames(viewer, n):
    """Of n frames, how many have a state of their number before them."""
    last, count, frames = None, 0, 0
    while frames < n:
        message = viewer.receive()
        if isinstance(message, str):
            last = json.loads(message).get("frame")
        elif message[5] == 1:
            count += last == int.from_bytes(message[20:24], "little")
            frames += 1
    return count


def http(url, target, host=None):
    at = urllib.parse.urlsplit(url)
    with socket.create_connection((at.hostname, at.port), 10) as s:
        s.sendall(f"GET {target} HTTP/1.1\r\nHost: {host or at.netloc}\r\nConnection: close\r\n\r\n".encode())
        return s.recv(4096).split(b"\r\n", 1)[0].decode()


def blade(dice):
    """From above through anything, somewhere."""
    x, y, far = dice.uniform(-0.1, 0.3), dice.uniform(-0.1, 0.3), dice.uniform(-1, 1)
    return [x, y, -1, x, y, 1, x + far, y + 0.3, 1, x + far, y + 0.3, -1]


def malformed(dice):
    """Text of a viewer that means no good, or nothing."""
    request = dice.choice([
        {"do": "grab", "from": [dice.uniform(-0.1, 0.3), dice.uniform(-0.1, 0.3), 1], "along": [0, 0, -1]},
        {"do": "pull", "to": [0, 0, 0]},
        {"do": "release"},
        {"do": "slider", "name": "mu:*:*", "value": 0.3}, {"do": "cut", "blade": [0.0] * 12},
        {"do": "cut", "blade": blade(dice)}, {"do": "reset"},
        {"do": "run", "on": True},
        {"do": "step"}, {"do": "nothing"}, {"do": "pull", "to": [1e308, -1e308, 1e999]}, [], {}, 7, None])
    text = bytearray(json.dumps(request).encode())
    for _ in range(dice.randrange(4)):
        how = dice.randrange(4)
        place = dice.randrange(len(text)) if text else 0
        if how == 0 and text:
            text[place] = dice.randrange(256)
        elif how == 1:
            text[place:place] = bytes(dice.randrange(256) for _ in range(dice.randrange(8)))
        elif how == 2:
            del text[place:place + dice.randrange(8)]
        else:
            text += b"[" * dice.randrange(200)
    return bytes(text[:1000])


def main():
    serve, scene, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
    served = subprocess.Popen([serve, "serve", scene, "--rate", "60"], stdout=subprocess.PIPE, text=True)
    try:
        url = served.stdout.readline().strip()
        port, dice = urllib.parse.urlsplit(url).port, random.Random(1)
        # who stays out
        assert refused(url.replace("token=", "token=0")), "another token"
        assert refused(f"http://127.0.0.1:{port}/"), "no token"
        assert refused(url, origin="http://example.org"), "a page of another origin"
        assert refused(url, origin="http://" + "x" * 300 + ".example.org"), "a long name of it"
        assert refused(f"http://127.0.0.1:{port}/", protocol=None), "no protocol and no token"
        assert not refused(url, origin=f"http://127.0.0.1:{port}"), "the page itself"
        target = url[url.index("/", 8):]
        assert " 200 " in http(url, target) and " 403 " in http(url, "/?token=x")
        assert " 404 " in http(url, "/etc/passwd")
        assert " 403 " in http(url, target, f"stranger.example:{port}"), "a stranger's name that leads here"
        # one in control, the other one looks on until it takes over
        first = Connection(url)
        first.receive()  # the server knows it, before it knows the other
        second = Connection(url)
        number = json.loads(second.receive())["you"]
        state = state_of(second, lambda state: state["viewers"] == 2)  # who was let in above may leave late
        assert state["control"] != number
        assert states_of_frames(second, 40) > 20  # one that is late may get a newer one
        slider = state["sliders"][0]
        to_low = {"do": "slider", "name": slider["name"], "value": slider["low"]}
        second.send(to_low)
        time.sleep(0.3)
        assert state_of(second)["sliders"][0]["value"] == slider["value"], "only who is in control"
        second.send({"do": "take"})
        state_of(second, lambda s: s["control"] == number)
        second.send(to_low)
        state_of(second, lambda s: s["sliders"][0]["value"] == slider["low"])
        second.send({**to_low, "value": "high"})
        state_of(second, lambda s: "expected a number" in s["message"])
        assert state_of(second)["sliders"][0]["value"] == slider["low"], "no number"
        second.send({"do": "slider", "name": "no such", "value": 1})
        state_of(second, lambda s: "no such" in s["message"])
        second.send({"do": "run", "on": True})
        # one that stalls, in the middle of a frame
        stalled = Connection(url)
        stalled.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        # one that floods, from the place of control
        flood = Connection(url)
        flood.send({"do": "take"})
        state_of(second, lambda s: s["viewers"] == 4)
        for i in range(count):
            try:
                flood.send_frame(dice.choice([1, 1, 1, 1, 1, 1, 1, 2]), malformed(dice))
            except OSError:  # what is no text, or too long, ends a connection
                flood = Connection(url)
                flood.send({"do": "take"})
            if i % 50 == 0:
                state_of(second)  # the other one is served meanwhile
        # frames that are none of WebSocket's, and messages that are too long
        for _ in range(20):
            liar = Connection(url)
            liar.socket.sendall(bytes(dice.randrange(256) for _ in range(300)))
            liar.close()
        long = Connection(url)
        try:
            long.send_frame(1, b"x" * 5000)
            while True:
                long.receive()
        except (ConnectionError, OSError):
            pass
        flood.close()
        second.send({"do": "take"})
        second.send({"do": "run", "on": False})
        second.send({"do": "reset"})  # after all that the other one has asked for
        state_of(second, lambda s: s["time"] == 0 and s["control"] == number)
        second.send({"do": "run", "on": True})
        state_of(second, lambda s: s["time"] > 0)
        with open(f"/proc/{served.pid}/status", encoding="ascii") as status:
            kb = next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))
        print(f"{count} malformed messages; {kb / 1024:.0f} MB of memory")
        first.close(), second.close(), stalled.close()
        assert served.poll() is None
    finally:
        served.terminate()
        code = served.wait(30)
    assert code == 0, f"exit code {code}"


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""receivers.py PAGE [CHROMIUM]: packets that are lost, late, malformed or boastful, and what a viewer must
have after them: the plain receiver, and the page where there is a browser. `api_received_test` has the same
for the window."""
import base64
import json
import os
import pathlib
import random
import socket
import struct
import sys
import tracemalloc

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "..", "examples"))
from stream_receiver import RtpConnection, Scene  # noqa: E402

ONE = 0x3f800000  # 1.0


def chunk(tag, *words):
    return tag.encode() + struct.pack(f"<I{len(words)}I", 4 * len(words), *words)


def packet(frame, *chunks, whole=0, odd=0, time=0.0, part=0):
    """Of a frame where the first chunk is one of a frame. odd: bytes that its first length is off."""
    data = bytearray(b"".join(chunks))
    data[4:8] = struct.pack("<I", int.from_bytes(data[4:8], "little") + odd)
    kind = data[:4] in (b"LIST", b"POSE", b"SURF", b"CONT")
    return struct.pack("<4sBBHIIIId", b"DFMS", 1, kind, whole, 1, part, 32 + len(data), frame, time) + data


def body(number, shape):
    """Of one triangle."""
    return [chunk("BODY", number, shape, 3, 1, 0), chunk("BASE", number, shape, 0, 3, *[0] * 9),
            chunk("TRIS", number, shape, 0, 1, 0, 1, 2)]


def still(number, shape):
    return chunk("SURF", number, shape, 0, 3, 1, *[0] * 9)


def sphere(number, shape, kind=1):
    return chunk("OBST", number, shape, 0, 0, kind, ONE, 0, 0, 0, 0, 0)


def listed(total, *numbers):
    return chunk("LIST", total, *(word for number in numbers for word in (number, 1)))


def posed(*numbers):
    return chunk("POSE", *(word for number in numbers for word in (number, 0, 0, 0, 0, 0, 0, ONE)))


def touching(n, *more):
    return chunk("CONT", *[ONE] * 7 * n, *more)


MANY = range(10, 310)
LARGEST = (1 << 21) - 64
CASES = {  # what it is about: packets, the numbers of bodies and of things to draw, of sensors; contacts
    "a number that goes from a body to an obstacle": (
        [packet(0, *body(7, 1)), packet(0, listed(1, 7), still(7, 1)),
         packet(1, sphere(7, 1)), packet(1, listed(1, 7), posed(7))], [], [7]),
    "and back": (
        [packet(0, sphere(7, 1)), packet(0, listed(1, 7), posed(7)),
         packet(1, *body(7, 1)), packet(1, listed(1, 7), still(7, 1))], [7], []),
    "an obstacle that has no pose yet": ([packet(0, sphere(7, 1)), packet(0, listed(1, 7))], [], []),
    "a list of which a part is lost": (
        [packet(0, *map(lambda n: sphere(n, 1), MANY)),
         packet(0, listed(300, *MANY), *map(posed, MANY)),
         packet(1, listed(300, *MANY[:200])), packet(2, listed(300, *MANY[100:]))], [], list(MANY)),
    "a list in parts": (
        [packet(0, *map(lambda n: sphere(n, 1), MANY)), packet(0, listed(300, *MANY), *map(posed, MANY)),
         packet(1, listed(200, *MANY[100:200])), packet(1, listed(200, *MANY[:100]))], [], list(MANY[:200])),
    "a list of nothing": (
        [packet(0, sphere(7, 1)), packet(0, listed(1, 7), posed(7)), packet(1, listed(0))], [], []),
    "a late scene": (
        [packet(6, sphere(7, 1)), packet(6, listed(1, 7), posed(7)), packet(5, *body(8, 1), whole=1)],
        [], [7]),
    "a scene without it": (
        [packet(6, sphere(7, 1)), packet(6, listed(1, 7), posed(7)), packet(6, *body(8, 1), whole=1)],
        [], []),
    "a length that is no multiple of 4": (
        [packet(0, sphere(7, 1), sphere(8, 1), odd=1), packet(0, listed(2, 7, 8), posed(7), posed(8))],
        [], []),
    "a chunk that is too short": (
        [packet(0, chunk("BODY", 7), chunk("OBST", 7, 1, 0, 0, 1), *body(8, 1)),
         packet(0, listed(1, 8), still(8, 1))], [8], []),
    "a corner that is no point": (
        [packet(0, chunk("BODY", 7, 1, 3, 1, 0), chunk("BASE", 7, 1, 0, 3, *[0] * 9),
                chunk("TRIS", 7, 1, 0, 1, 0, 1, 3)), packet(0, listed(1, 7), still(7, 1))], [], []),
    "a time that is no number": (
        [packet(0, *body(7, 1)), packet(0, listed(1, 7), still(7, 1)),
         packet(1, listed(0), time=float("nan"))], [7], []),
    "a place that is no number": (
        [packet(0, *body(7, 1)), packet(0, listed(1, 7), still(7, 1)),
         packet(1, chunk("SURF", 7, 1, 0, 1, 1, 0x7fc00000, 0, 0))], [7], []),
    "the largest surface, announced": (
        [packet(0, chunk("BODY", 7, 1, LARGEST, LARGEST, 0))]
        + [packet(0, chunk("BASE", 7, 1, LARGEST - i, 1, 0, 0, 0)) for i in range(1, 50)]
        + [packet(0, chunk("BODY", 8, 1, LARGEST, LARGEST, 0)), packet(0, listed(2, 7, 8))], [], []),
    "a small body in its place": (
        [packet(0, chunk("BODY", 7, 1, 2 * LARGEST + 64, 0, 0)), packet(1, *body(7, 2)),
         packet(1, listed(1, 7), still(7, 2))], [7], []),
    "an obstacle in its place": (
        [packet(0, chunk("BODY", 7, 1, 2 * LARGEST + 64, 0, 0)), packet(1, sphere(7, 2)),
         packet(1, listed(1, 7), posed(7))], [], [7]),
    "a list that is longer than it says": (
        [packet(0, *map(lambda n: sphere(n, 1), (7, 8, 9))), packet(0, posed(7, 8, 9), listed(1, 7, 8, 9))]
        + [packet(0, listed(1, 7, *range(8 * i, 8 * i + 8))) for i in range(10, 20)], [], [7]),
    "a list with half a row": (
        [packet(0, sphere(7, 1)), packet(0, chunk("LIST", 1, 7, 1, 8), posed(7))], [], [7]),
    "poses and contacts with half a row": (
        [packet(0, sphere(7, 1)),
         packet(0, listed(1, 7), chunk("POSE", 7, *[0] * 6, ONE, 7), touching(2, ONE))], [], [7], [], 2),
    "contacts that come twice": (
        [packet(0, listed(0), touching(2), touching(1), part=3), packet(0, touching(4), part=2)] * 3,
        [], [], [], 7),
    "contacts of the next frame": (
        [packet(0, touching(2)), packet(1, touching(3)), packet(1, touching(3))], [], [], [], 3),
    "a first frame of a large number": (
        [packet(0x90000000, *body(7, 1)), packet(0x90000000, listed(1, 7), still(7, 1))], [7], []),
    "a sensor, with bits of a later version": (
        [packet(0, sphere(7, 1, 0x10001), sphere(8, 1, 0x20001), sphere(9, 1, 0x30001)),
         packet(0, listed(3, 7, 8, 9), posed(7, 8, 9))], [], [7, 8, 9], [7, 9]),
    "a name that is longer than its chunk": (
        [packet(0, chunk("BODY", 7, 1, 0, 0, 9, 0x61616161)), packet(0, listed(1, 7))], [7], []),
    "a name without end": (
        [packet(0, chunk("OBST", 7, 1, 0, 0, 1, ONE, 0, 0, 0, 0, 10000, *[0x61616161] * 2500)),
         packet(0, listed(1, 7), posed(7))], [], [7]),
}


def plain(packets):
    scene = Scene()
    tracemalloc.start()
    for one in packets:
        scene.read(one)
    assert tracemalloc.get_traced_memory()[1] < 4e6, "what is announced takes memory"
    tracemalloc.stop()
    assert all(len(s.name) <= 100 for s in scene.surfaces.values())
    bodies, things = [sorted(n for n, s in kind.items() if not s.missing and n in scene.present)
                      for kind in (scene.bodies, scene.things)]
    assert len(scene.present) <= 300, "a list is no longer than it says"
    return [bodies, things, [n for n in things if scene.things[n].sensor], len(scene.contacts)]


def in_page(browser, packets):
    data = base64.b64encode(b"".join(packets)).decode()
    return json.loads(browser.value(f"""(() => {{
      anew(); read(Uint8Array.from(atob("{data}"), c => c.charCodeAt(0)).buffer); draw();
      const all = [...world.meshes.values()];
      if (all.some(m => m.base && m.base.length > 1e5)) return '"what is announced takes memory"';
      if (all.some(m => m.name.length > 100)) return '"a name without end"';
      if (world.present && world.present.size > 300) return '"a list is longer than it says"';
      if (all.some(m => m.rigid && m.x.length)) return '"things of a kind have a shape together"';
      const ids = list => list.map(m => m.id).sort((a, b) => a - b);
      return JSON.stringify([ids(bodies()), ids(things()), ids(things().filter(t => t.sensor)),
        world.contacts.length]);
    }})()"""))


def others():
    """What others send to the plain receiver's port while a sender is there changes nothing."""
    def datagram(payload, source, number):
        return struct.pack(">BBHII", 0x80, 96, number, 0, source) + payload

    goodbye = struct.pack(">BBHIBBHI", 0x80, 201, 1, 1, 0x81, 203, 1, 1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        at = probe.getsockname()
    connection = RtpConnection(f"rtp://127.0.0.1:{at[1]}", 5)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender, \
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        first, second, third = [packet(frame, listed(0)) for frame in range(3)]
        for one in (datagram(b"no packet", 9, 5), goodbye, datagram(third[:-4], 9, 6)):
            other.sendto(one, at)
        sender.sendto(datagram(first, 1, 1), at)
        assert connection.receive() == first and connection.anew
        for one in (datagram(third, 9, 7), goodbye, b"", bytes(12)):
            other.sendto(one, at)
        sender.sendto(datagram(b"no packet", 1, 2), at)
        sender.sendto(datagram(second, 1, 2), at)
        assert connection.receive() == second and not connection.anew and connection.lost() == 0
        sender.sendto(goodbye, at)
        try:
            connection.receive()
            raise AssertionError("the sender has ended")
        except ConnectionError:
            pass
    connection.close()


def malformed(dice, n):
    """Packets of all cases, each with some wrong words."""
    good = [one for packets, *_ in CASES.values() for one in packets]
    for _ in range(n):
        one = bytearray(dice.choice(good))
        for _ in range(dice.randrange(1, 4)):
            at = 4 * dice.randrange(5, len(one) // 4)
            one[at:at + 4] = struct.pack("<I", dice.choice([0, 1, 3, 7, 0x7fc00000, 0xffffffff, LARGEST]))
        yield bytes(one)


def main():
    browser = None
    if len(sys.argv) > 2:
        from browser import Browser
        browser = Browser(sys.argv[2], pathlib.Path(sys.argv[1]).resolve().as_uri(), (300, 200))
        browser.wait("typeof anew === 'function' && $('message').textContent.includes('deform.js')",
                     "the page")
    try:
        for what, (packets, *expected) in CASES.items():
            expected += [[], 0][len(expected) - 2:]
            assert plain(packets) == expected, (what, plain(packets))
            if browser:
                seen = in_page(browser, packets)
                assert seen == expected, (what, seen)
        others()
        bad = []
        for one in [*malformed(random.Random(1), 5000), None]:
            if one and sum(map(len, bad)) < 20000:
                bad.append(one)
                continue
            plain(bad)
            if browser:
                seen = in_page(browser, bad)
                assert isinstance(seen, list), seen
            bad = [one]
        if browser:
            told = browser.value("(read(new TextEncoder().encode('no packet'.repeat(9)).buffer), draw(), "
                                 "frames(new ArrayBuffer(64)).length)")
            assert told == 0, "what is no recording has no frames"
    finally:
        if browser:
            browser.close()
    print(f"{len(CASES)} cases, plain" + (" and in the page" if browser else ""))


if __name__ == "__main__":
    main()

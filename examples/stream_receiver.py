#!/usr/bin/env python3
"""Receives what `deform serve` and `deform run --stream` send, with Python's standard library alone: the
scene, and then where every point of every surface is. It prints a line for each frame, and can write the
surfaces as OBJ files. The format: libdeform/doc/reference/stream.md.

    deform serve SCENE             prints the URL
    python3 stream_receiver.py URL [--frames N] [--obj FOLDER] [--send '{"do":"run","on":false}']
    python3 stream_receiver.py rtp://127.0.0.1:5004 [--frames N] [--obj FOLDER], and then
    deform run SCENE --stream rtp://127.0.0.1:5004
"""
import argparse
import base64
import json
import math
import os
import socket
import struct
import sys
import time
import urllib.parse


class Connection:
    """The client's end of a WebSocket (RFC 6455)."""

    def __init__(self, url, timeout=10, origin=None, protocol="dfm.stream.1"):
        at = urllib.parse.urlsplit(url)
        self.rest = b""
        self.socket = socket.create_connection((at.hostname, at.port), timeout)
        path = (at.path or "/") + ("?" + at.query if at.query else "")
        lines = [f"GET {path} HTTP/1.1", f"Host: {at.hostname}:{at.port}",
                 "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                 f"Sec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}"]
        more = (("Sec-WebSocket-Protocol", protocol), ("Origin", origin))
        lines += [f"{name}: {value}" for name, value in more if value]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        while b"\r\n\r\n" not in self.rest:
            self.more()
        head, self.rest = self.rest.split(b"\r\n\r\n", 1)
        status = head.split(b"\r\n", 1)[0].decode()
        if " 101 " not in status + " ":
            raise ConnectionError(f"the server has answered: {status}")

    def more(self):
        part = self.socket.recv(1 << 16)
        if not part:
            raise ConnectionError("the server has closed the connection")
        self.rest += part

    def take(self, n):
        while len(self.rest) < n:
            self.more()
        out, self.rest = self.rest[:n], self.rest[n:]
        return out

    def frame(self):
        first, second = self.take(2)
        n = second & 127
        if n > 125:
            n = int.from_bytes(self.take(2 if n == 126 else 8), "big")
        return first & 128, first & 15, self.take(n)

    def receive(self):
        """The next message: text as str, packets as bytes."""
        data, kind = b"", 0
        while True:
            last, code, part = self.frame()
            if code == 8:
                raise ConnectionError("the server has closed the connection")
            if code == 9:
                self.send_frame(10, part)
            if code in (9, 10):
                continue
            kind, data = kind or code, data + part
            if last:
                return data.decode() if kind == 1 else data

    def send_frame(self, code, data):
        mask = os.urandom(4)
        n = len(data)
        head = struct.pack("!BB", 128 | code, 128 | n) if n < 126 else struct.pack("!BBH", 128 | code, 254, n)
        self.socket.sendall(head + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(data)))

    def send(self, request):
        self.send_frame(1, json.dumps(request).encode())

    def close(self):
        self.socket.close()


def says_goodbye(data):
    """Whether one of the packets of RTCP in a datagram ends the stream (RFC 3550, 6.6)."""
    while len(data) >= 4:
        if data[1] == 203:
            return True
        data = data[4 + 4 * int.from_bytes(data[2:4], "big"):]
    return False


class RtpConnection:
    """Datagrams of RTP (RFC 3550) at an address of this machine; their sender gets a report each second."""

    def __init__(self, url, timeout=10):
        at = urllib.parse.urlsplit(url)
        family = socket.AF_INET6 if ":" in at.hostname else socket.AF_INET
        self.socket = socket.socket(family, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
        self.socket.bind((at.hostname, at.port))
        self.socket.settimeout(timeout)
        self.sender, self.source, self.anew, self.frame_ends = None, None, False, False
        self.first, self.highest, self.received = 0, 0, 0
        self.heard, self.reported, self.before = 0.0, time.monotonic(), (0, 0)

    def receive(self):
        """The payload of the next packet. frame_ends: whether it is the last one of a frame; anew: whether
        it is of another run. One sender at a time: another one counts when this one is silent."""
        while True:
            data, sender = self.socket.recvfrom(1 << 16)
            its, now = sender == self.sender, time.monotonic()
            if len(data) < 12 or data[0] >> 6 != 2 or (self.sender and not its and now < self.heard + 2):
                continue
            if 200 <= data[1] <= 204:  # RTCP
                if its and says_goodbye(data):
                    raise ConnectionError("the sender has ended")
                continue
            if data[12:17] != b"DFMS\x01" or data[28:32] != struct.pack("<I", len(data) - 12):
                continue
            self.sender, self.heard = sender, now
            sequence, _, source = struct.unpack_from(">HII", data, 2)
            self.anew = source != self.source
            if self.anew:
                self.source, self.first, self.highest = source, sequence, sequence
                self.received, self.before = 0, (0, 0)
            ahead = (sequence - self.highest) & 0xffff
            if ahead < 0x8000:
                self.highest += ahead  # counts on past 16 bits
            self.received += 1
            self.frame_ends = data[1] >> 7 == 1
            if now - self.reported > 1:
                self.report(sender)
            return data[12:]

    def lost(self):
        return max(0, self.highest - self.first + 1 - self.received)

    def report(self, sender):
        expected = self.highest - self.first + 1 - self.before[0]
        share = max(0, expected - (self.received - self.before[1])) / max(1, expected)
        self.before, self.reported = (self.before[0] + expected, self.received), time.monotonic()
        self.socket.sendto(struct.pack(">BBHII", 0x81, 201, 7, 0, self.source)
                           + struct.pack(">IIIII", int(255 * share) << 24 | min(self.lost(), 0xffffff),
                                         self.highest & 0xffffffff, 0, 0, 0), sender)

    def close(self):
        self.socket.close()


def word(data, at):
    return struct.unpack_from("<I", data, at)[0]


def older(frame, other):
    """Numbers of frames begin again at 2^32."""
    return 0 < (other - frame) & 0xffffffff < 1 << 31


def rows(form, data):
    """Those that are whole."""
    return struct.iter_unpack(form, data[:len(data) - len(data) % struct.calcsize(form)])


MOST, EACH, MOST_ROWS, LONGEST_NAME = 1 << 22, 64, 1 << 16, 100


class Surface:
    """Of a body, or of an obstacle (rigid); `missing`: values that have not come yet. Its chunks wait until
    as much has come as it needs: what is announced takes no memory."""

    def __init__(self, rigid, name, shape, n, m, frame):
        self.rigid, self.name, self.shape, self.points, self.faces = rigid, name, shape, n, m
        self.frame, self.in_packet, self.pose, self.waiting = frame, True, None, bytearray()
        self.base, self.moved, self.triangles = [], [], []
        self.missing = 3 * m + (3 * n + 1 if rigid else 6 * n)

    @property
    def weight(self):
        return EACH + self.points + self.faces

    def fill(self):
        self.base, self.triangles = [None] * (3 * self.points), [None] * (3 * self.faces)
        self.moved = [0.0 if self.rigid else None] * (3 * self.points)

    def put(self, values, first, new):
        self.missing -= sum(v is None for v in values[3 * first:3 * first + len(new)])
        values[3 * first:3 * first + len(new)] = new

    @property
    def x(self):
        return [b + u for b, u in zip(self.base, self.moved)]


class Scene:
    """What has been received: bodies and things by their numbers, contacts, time."""

    def __init__(self):
        self.surfaces, self.held, self.contacts = {}, 0, []
        self.present, self.listing, self.listed = {}, {}, -1
        self.time, self.frame, self.packet_frame, self.begun = 0.0, 0, 0, False
        self.part, self.parts = 0, set()  # packets of the frame of which the contacts have come

    @property
    def bodies(self):
        return {number: s for number, s in self.surfaces.items() if not s.rigid}

    @property
    def things(self):
        return {number: s for number, s in self.surfaces.items() if s.rigid}

    def read(self, message):
        """Packets of one message, one behind the other. Returns whether one of them was of a frame."""
        at, any_frame = 0, False
        while at + 32 <= len(message):
            (mark, version, kind, whole, count, self.part, size, frame,
             time) = struct.unpack_from("<4sBBHIIIId", message, at)
            if mark != b"DFMS" or version != 1 or size < 32 or at + size > len(message):
                raise ValueError("this is no packet of dfm.stream 1")
            everything = kind == 0 and whole == 1 and count == 1
            for surface in self.surfaces.values() if everything else ():
                surface.in_packet = False
            # a packet of a frame that is over has come late: what is there is newer
            late = kind == 1 and (self.begun and older(frame, self.frame) or not math.isfinite(time))
            self.packet_frame = frame
            if kind == 1 and not late:
                if frame != self.frame:
                    self.contacts, self.parts = [], set()
                any_frame = self.begun = True
                self.frame, self.time = frame, time
            if not late:
                contacts = len(self.contacts)
                self.read_chunks(message[at + 32:at + size])
                if len(self.contacts) > contacts:
                    self.parts.add(self.part)
            if everything:
                self.forget(lambda _, s: not s.in_packet and not older(self.packet_frame, s.frame))
            at += size
        return any_frame

    def read_chunks(self, packet):
        at = 0
        while at + 8 <= len(packet):
            tag, size = struct.unpack_from("<4sI", packet, at)
            if size % 4 or at + 8 + size > len(packet):
                break
            read = getattr(self, "read_" + tag.decode("ascii", "replace").lower(), None)
            try:
                if read:  # what a later version adds is skipped
                    read(packet[at + 8:at + 8 + size])
            except struct.error:  # a chunk that is shorter than it says
                pass
            at += 8 + size

    def forget(self, gone):
        for number, surface in list(self.surfaces.items()):
            if gone(number, surface):
                self.held -= self.surfaces.pop(number).weight

    def tell(self, data, name, rigid):
        """One thing has a number, and the newest that was told has it. Returns it where it is a new one."""
        number, shape, n, m = struct.unpack_from("<4I", data)
        have = self.surfaces.get(number)
        if have:
            have.in_packet = True
            if (have.shape, have.rigid) == (shape, rigid) or older(self.packet_frame, have.frame):
                return None
        text = data[name + 4:name + 4 + min(word(data, name), LONGEST_NAME)].decode("utf-8", "replace")
        fresh = Surface(rigid, text, shape, n, m, self.packet_frame)
        held = self.held - (have.weight if have else 0) + fresh.weight
        if held > MOST:
            return None
        self.held = held
        self.surfaces[number] = fresh
        return fresh

    def read_body(self, data):
        self.tell(data, 16, False)

    def read_obst(self, data):
        kind, size = word(data, 16), struct.unpack_from("<5f", data, 20)
        thing = self.tell(data, 40, True) if all(map(math.isfinite, size)) else None
        if thing:
            thing.kind, thing.sensor = kind & 0xffff, kind >> 16 & 1 == 1
            thing.radius, thing.half_length, *thing.half_size = size

    def ranges(self, tag, data, values):
        """Puts the values of a range where they belong, or keeps the chunk."""
        number, shape, first, n = struct.unpack_from("<4I", data)
        s = self.surfaces.get(number)
        if n == 0 or not s or s.shape != shape or (tag == b"SURF" and s.rigid):
            return
        good = math.isfinite if tag != b"TRIS" else lambda corner: corner < s.points
        if first + n > (s.faces if tag == b"TRIS" else s.points) or not all(map(good, values)):
            return
        if s.waiting is None:
            return s.put({b"BASE": s.base, b"TRIS": s.triangles, b"SURF": s.moved}[tag], first, values)
        s.waiting += tag + struct.pack("<I", len(data)) + data
        if len(s.waiting) >= 12 * (s.points + s.faces):
            waiting, s.waiting = bytes(s.waiting), None
            s.fill()
            self.read_chunks(waiting)

    def read_base(self, data):
        self.ranges(b"BASE", data, struct.unpack_from(f"<{3 * word(data, 12)}f", data, 16))

    def read_tris(self, data):
        self.ranges(b"TRIS", data, struct.unpack_from(f"<{3 * word(data, 12)}I", data, 16))

    def read_list(self, data):
        """What a list that is whole leaves out is gone, unless it was told later."""
        n = word(data, 0)
        if self.listed != self.frame:
            self.listing, self.listed = {}, self.frame
        for number, shape in rows("<II", data[4:]):
            if len(self.listing) < min(n, MOST_ROWS):
                self.listing[number] = shape
        if len(self.listing) >= n:
            self.present, self.listing = self.listing, {}
            self.forget(lambda number, s: number not in self.present and older(s.frame, self.frame))

    def read_pose(self, data):
        for number, *pose in rows("<I7f", data):
            thing = self.surfaces.get(number)
            if thing and thing.rigid and all(map(math.isfinite, pose)):
                thing.missing -= thing.pose is None
                thing.pose = tuple(pose)

    def read_surf(self, data):
        n, floats = struct.unpack_from("<2I", data, 12)
        if floats & 1:
            moved = struct.unpack_from(f"<{3 * n}f", data, 20)
        else:
            low, step = struct.unpack_from("<3f", data, 20), struct.unpack_from("<3f", data, 32)
            steps = struct.unpack_from(f"<{3 * n}H", data, 48)
            moved = [low[i % 3] + step[i % 3] * q for i, q in enumerate(steps)]
        self.ranges(b"SURF", data, moved)

    def read_cont(self, data):
        for row in rows("<6fI", data) if self.part not in self.parts else ():
            if all(map(math.isfinite, row)) and len(self.contacts) < MOST_ROWS:
                self.contacts.append((row[:3], row[3:6], row[6]))

    def write_obj(self, path):
        with open(path, "w", encoding="utf-8") as out:
            for number, body in self.bodies.items():
                if number not in self.present or body.missing:
                    continue
                out.write(f"o {body.name}\n")
                x = body.x
                for i in range(0, len(x), 3):
                    out.write("v %.7g %.7g %.7g\n" % tuple(x[i:i + 3]))
                for i in range(0, len(body.triangles), 3):
                    out.write("f %d %d %d\n" % tuple(k - body.points for k in body.triangles[i:i + 3]))


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    arguments.add_argument("url", help="what `deform serve` has printed")
    arguments.add_argument("--frames", type=int, default=0, help="after which it ends (0: never)")
    arguments.add_argument("--obj", help="folder for the surfaces of each frame")
    arguments.add_argument("--send", action="append", default=[], help="a request, JSON, at the start")
    given = arguments.parse_args()
    if given.obj:
        os.makedirs(given.obj, exist_ok=True)
    rtp = given.url.startswith("rtp://")
    if rtp and given.send:
        arguments.error("--send: RTP brings pictures alone; give the URL that `deform serve` has printed")
    connection, scene, seen = (RtpConnection if rtp else Connection)(given.url, 60), Scene(), 0
    for request in given.send:
        connection.send(json.loads(request))
    while not given.frames or seen < given.frames:
        message = connection.receive()
        if rtp and connection.anew:
            scene = Scene()
        if isinstance(message, str) or not scene.read(message) or (rtp and not connection.frame_ends):
            continue
        seen += 1
        points = sum(b.points for b in scene.bodies.values())
        bodies = len(scene.bodies.keys() & scene.present.keys())
        print(f"frame {scene.frame}, {scene.time:.4f} s: {bodies} bodies, {points} points, "
              f"{len(scene.contacts)} contacts" + (f", {connection.lost()} packets lost" if rtp else ""),
              flush=True)
        if given.obj:
            scene.write_obj(os.path.join(given.obj, f"{scene.frame:06d}.obj"))
    connection.close()


if __name__ == "__main__":
    try:
        main()
    except (ConnectionError, OSError, ValueError) as error:
        sys.exit(f"stream_receiver: {error}")
    except KeyboardInterrupt:
        pass

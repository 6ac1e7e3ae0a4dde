#!/usr/bin/env python3
"""Receives what `deform serve` and `deform run --stream` send, with Python's standard library alone: the
scene, and then where every point of every surface is. It prints a line for each frame, and can write the
surfaces as OBJ files. The format: libdeform/doc/reference/stream.md.

    deform serve SCENE             prints the URL
    python3 stream_receiver.py URL [--frames N] [--obj FOLDER] [--send '{"do":"run","on":false}']
or
    python3 stream_receiver.py rtp://127.0.0.1:5004 [--frames N] [--obj FOLDER]
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
        key = base64.b64encode(os.urandom(16)).decode()
        path = (at.path or "/") + ("?" + at.query if at.query else "")
        lines = [f"GET {path} HTTP/1.1", f"Host: {at.hostname}:{at.port}",
                 "Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}",
                 "Sec-WebSocket-Version: 13"]
        if protocol:
            lines.append(f"Sec-WebSocket-Protocol: {protocol}")
        if origin:
            lines.append(f"Origin: {origin}")
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
        if n == 126:
            n, = struct.unpack(">H", self.take(2))
        elif n == 127:
            n, = struct.unpack(">Q", self.take(8))
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
                continue
            if code == 10:
                continue
            kind = kind or code
            data += part
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
        self.source, self.anew, self.frame_ends = None, False, False
        self.first, self.highest, self.received = 0, 0, 0
        self.reported, self.before = time.monotonic(), (0, 0)

    def receive(self):
        """The payload of the next packet. frame_ends: whether it is the last one of a frame; anew: whether
        its sender is another one than before, of another run."""
        while True:
            data, sender = self.socket.recvfrom(1 << 16)
            if len(data) < 12 or data[0] >> 6 != 2:
                continue
            if 200 <= data[1] <= 204:  # RTCP
                if says_goodbye(data):
                    raise ConnectionError("the sender has ended")
                continue
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
            if time.monotonic() - self.reported > 1:
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


def older(frame, other):
    """Numbers of frames begin again at 2^32."""
    return 0 < (other - frame) & 0xffffffff < 1 << 31


MOST, EACH, MOST_ROWS, LONGEST_NAME = 1 << 22, 64, 1 << 16, 100


class Surface:
    """Of a body, or of an obstacle (rigid); `missing`: values that have not come yet. Its chunks wait until
    as much has come as it needs: what is announced takes no memory."""

    def __init__(self, rigid, name, shape, n, m, frame):
        self.rigid, self.name, self.shape, self.points, self.faces = rigid, name, shape, n, m
        self.frame, self.told, self.pose, self.waiting, self.waits = frame, True, None, [], 0
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
        self.time, self.frame, self.told = 0.0, 0, 0

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
            mark, version, kind, whole, count, fragment, size, frame, time = struct.unpack_from("<4sBBHIIIId",
                                                                                                message, at)
            if mark != b"DFMS" or version != 1 or size < 32 or at + size > len(message):
                raise ValueError("this is no packet of dfm.stream 1")
            everything = kind == 0 and whole == 1 and count == 1
            for surface in self.surfaces.values() if everything else ():
                surface.told = False
            # a packet of a frame that is over has come late: what is there is newer
            late = kind == 1 and (older(frame, self.frame) or not math.isfinite(time))
            self.told = frame
            if kind == 1 and not late:
                any_frame = True
                if frame != self.frame:
                    self.contacts = []
                self.frame, self.time = frame, time
            if not late:
                self.read_chunks(message[at:at + size])
            if everything:
                self.forget(lambda _, s: not s.told and not older(self.told, s.frame))
            at += size
        return any_frame

    def read_chunks(self, packet):
        at = 32
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
            have.told = True
            if (have.shape, have.rigid) == (shape, rigid) or older(self.told, have.frame):
                return None
        letters, = struct.unpack_from("<I", data, name)
        text = data[name + 4:name + 4 + min(letters, LONGEST_NAME)].decode("utf-8", "replace")
        fresh = Surface(rigid, text, shape, n, m, self.told)
        if self.held + fresh.weight > MOST:
            return None
        self.held += fresh.weight - (have.weight if have else 0)
        self.surfaces[number] = fresh
        return fresh

    def read_body(self, data):
        self.tell(data, 16, False)

    def read_obst(self, data):
        kind, size = struct.unpack_from("<I", data, 16)[0], struct.unpack_from("<5f", data, 20)
        thing = self.tell(data, 40, True) if all(map(math.isfinite, size)) else None
        if thing:
            thing.kind, thing.sensor = kind & 0xffff, kind >> 16 == 1
            thing.radius, thing.half_length, *thing.half_size = size

    def ranges(self, tag, data, values):
        """Puts the values of a range where they belong, or keeps the chunk."""
        number, shape, first, n = struct.unpack_from("<4I", data)
        s = self.surfaces.get(number)
        if not s or s.shape != shape or (tag == "surf" and s.rigid):
            return
        if first + n > (s.faces if tag == "tris" else s.points) or not all(map(math.isfinite, values)):
            return
        if tag == "tris" and any(i >= s.points for i in values):
            return
        if s.waiting is None:
            s.put({"base": s.base, "tris": s.triangles, "surf": s.moved}[tag], first, values)
            return
        s.waiting.append((tag, data, values))
        s.waits += 8 + len(data)
        if s.waits >= 12 * (s.points + s.faces):
            waiting, s.waiting = s.waiting, None
            s.fill()
            for kept in waiting:
                self.ranges(*kept)

    def read_base(self, data):
        self.ranges("base", data, struct.unpack_from(f"<{3 * self.rows(data)}f", data, 16))

    def read_tris(self, data):
        self.ranges("tris", data, struct.unpack_from(f"<{3 * self.rows(data)}I", data, 16))

    @staticmethod
    def rows(data):
        return struct.unpack_from("<I", data, 12)[0]

    def read_list(self, data):
        """What a list that is whole leaves out is gone, unless it was told later."""
        n, = struct.unpack_from("<I", data)
        if n > MOST_ROWS:
            return
        if self.listed != self.frame:
            self.listing, self.listed = {}, self.frame
        self.listing.update(struct.iter_unpack("<II", data[4:]))
        if len(self.listing) >= n:
            self.present = self.listing
            self.forget(lambda number, s: number not in self.present and older(s.frame, self.frame))

    def read_pose(self, data):
        for number, *pose in struct.iter_unpack("<I7f", data):
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
        self.ranges("surf", data, moved)

    def read_cont(self, data):
        rows = [row for row in struct.iter_unpack("<6fI", data) if all(map(math.isfinite, row))]
        self.contacts += [(row[:3], row[3:6], row[6]) for row in rows[:MOST_ROWS - len(self.contacts)]]

    def write_obj(self, path):
        with open(path, "w", encoding="utf-8") as out:
            before = 1
            for number, body in self.bodies.items():
                if number not in self.present or body.missing:
                    continue
                out.write(f"o {body.name}\n")
                x = body.x
                for i in range(0, len(x), 3):
                    out.write("v %.7g %.7g %.7g\n" % tuple(x[i:i + 3]))
                for i in range(0, len(body.triangles), 3):
                    out.write("f %d %d %d\n" % tuple(before + k for k in body.triangles[i:i + 3]))
                before += len(x) // 3


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

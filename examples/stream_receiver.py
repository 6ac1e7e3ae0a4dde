#!/usr/bin/env python3
"""Receives what `deform serve` streams, with Python's standard library alone: the scene once, then where every
point of every surface is. It prints a line for each frame, and can write the surfaces as OBJ files. The format
is described in libdeform/doc/reference/stream.md.

    deform serve SCENE             prints a URL
    python3 stream_receiver.py URL [--frames N] [--obj FOLDER] [--send '{"do":"run","on":false}']
"""
import argparse
import base64
import json
import os
import socket
import struct
import sys
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


class Body:
    def __init__(self, name, shape, base, triangles):
        self.name, self.shape, self.base, self.triangles = name, shape, base, triangles
        self.x = list(base)


class Scene:
    """What has been received: bodies and things by their numbers, contacts, time."""

    def __init__(self):
        self.bodies, self.things, self.contacts, self.present = {}, {}, [], {}
        self.time, self.frame = 0.0, -1

    def read(self, message):
        """Packets of one message, one behind the other. Returns whether one of them was of a frame."""
        at, any_frame = 0, False
        while at + 32 <= len(message):
            mark, version, kind, whole, count, fragment, size, frame, time = struct.unpack_from("<4sBBHIIIId",
                                                                                                message, at)
            if mark != b"DFMS" or version != 1 or size < 32 or at + size > len(message):
                raise ValueError("this is no packet of dfm.stream 1")
            if kind == 0 and whole:
                self.bodies, self.things = {}, {}
            if kind == 1:
                any_frame = True
                if frame != self.frame:
                    self.contacts, self.present = [], {}
                self.frame, self.time = frame, time
            self.read_chunks(message[at:at + size])
            at += size
        return any_frame

    def read_chunks(self, packet):
        at = 32
        while at + 8 <= len(packet):
            tag, size = struct.unpack_from("<4sI", packet, at)
            data = packet[at + 8:at + 8 + size]
            read = getattr(self, "read_" + tag.decode("ascii", "replace").lower(), None)
            if read:  # what a later version adds is skipped
                read(data)
            at += 8 + size

    @staticmethod
    def text(data, at, n):
        return data[at:at + n].decode(), at + (n + 3) // 4 * 4

    def read_body(self, data):
        number, shape, n, m, letters = struct.unpack_from("<5I", data)
        name, at = self.text(data, 20, letters)
        base = struct.unpack_from(f"<{3 * n}f", data, at)
        self.bodies[number] = Body(name, shape, base, struct.unpack_from(f"<{3 * m}I", data, at + 12 * n))

    def read_obst(self, data):
        number, shape, sensor = struct.unpack_from("<3I", data)
        size = struct.unpack_from("<5f", data, 12)
        n, m, letters = struct.unpack_from("<3I", data, 32)
        name, at = self.text(data, 44, letters)
        self.things[number] = {
            "name": name, "shape": shape, "sensor": bool(sensor), "radius": size[0], "half_length": size[1],
            "half_size": size[2:], "points": struct.unpack_from(f"<{3 * n}f", data, at),
            "triangles": struct.unpack_from(f"<{3 * m}I", data, at + 12 * n), "pose": (0, 0, 0, 0, 0, 0, 1)}

    def read_list(self, data):
        self.present.update(struct.iter_unpack("<II", data))

    def read_pose(self, data):
        for number, *pose in struct.iter_unpack("<I7f", data):
            if number in self.things:
                self.things[number]["pose"] = tuple(pose)

    def read_surf(self, data):
        number, shape, first, n, floats = struct.unpack_from("<5I", data)
        body = self.bodies.get(number)
        if body is None or body.shape != shape:  # its triangles are on their way
            return
        if floats:
            moved = struct.unpack_from(f"<{3 * n}f", data, 20)
        else:
            low, step = struct.unpack_from("<3f", data, 20), struct.unpack_from("<3f", data, 32)
            moved = [low[i % 3] + step[i % 3] * q for i, q in enumerate(struct.unpack_from(f"<{3 * n}H", data, 48))]
        base = body.base[3 * first:3 * (first + n)]
        body.x[3 * first:3 * (first + n)] = [b + u for b, u in zip(base, moved)]

    def read_cont(self, data):
        self.contacts += [(row[:3], row[3:6], row[6]) for row in struct.iter_unpack("<6fI", data)]

    def write_obj(self, path):
        with open(path, "w", encoding="utf-8") as out:
            before = 1
            for number, body in self.bodies.items():
                if number not in self.present:
                    continue
                out.write(f"o {body.name}\n")
                for i in range(0, len(body.x), 3):
                    out.write("v %.7g %.7g %.7g\n" % tuple(body.x[i:i + 3]))
                for i in range(0, len(body.triangles), 3):
                    out.write("f %d %d %d\n" % tuple(before + k for k in body.triangles[i:i + 3]))
                before += len(body.x) // 3


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    arguments.add_argument("url", help="what `deform serve` has printed")
    arguments.add_argument("--frames", type=int, default=0, help="after which it ends (0: never)")
    arguments.add_argument("--obj", help="folder for the surfaces of each frame")
    arguments.add_argument("--send", action="append", default=[], help="a request, JSON, at the start")
    given = arguments.parse_args()
    if given.obj:
        os.makedirs(given.obj, exist_ok=True)
    connection, scene, seen = Connection(given.url), Scene(), 0
    for request in given.send:
        connection.send(json.loads(request))
    while not given.frames or seen < given.frames:
        message = connection.receive()
        if isinstance(message, str) or not scene.read(message):
            continue
        seen += 1
        points = sum(len(b.x) // 3 for b in scene.bodies.values())
        print(f"frame {scene.frame}, {scene.time:.4f} s: {len(scene.present)} bodies, {points} points, "
              f"{len(scene.contacts)} contacts, {len(message)} bytes", flush=True)
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

#!/usr/bin/env python3
"""Measures live runs: the table of docs/measurements/live.md.

    scripts/measurements/live_doc.py [SCENE ...]    default: the scenes of the page, which is written

Runs build/release/bin/counterpoint live and reads its frames as a page would, without drawing them.
"""
import base64
import json
import os
import pathlib
import signal
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import time

import marked

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs/measurements/live.md"
PROGRAM = ROOT / "build/release/bin/counterpoint"
SCENES = ["humanoid_drop", "piles/pile_200", "hard/tower_200", "boxes_1000"]
SECONDS, POKES = 6.0, 20
HEADER = ("| scene | bodies | step [us] | times real time | frames [1/s] | frame [us] | frames / steps [%] | bytes a frame "
          "| message to force [ms]: median (largest) |\n|---|---|---|---|---|---|---|---|---|\n")


class Page:
    """A WebSocket client (RFC 6455) of a live run."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=20)
        host = f"127.0.0.1:{port}"
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET /live HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nUpgrade: websocket\r\n"
                             f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n").encode())
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self.socket.recv(1)
        self.stream = self.socket.makefile("rb")

    def send(self, **message):
        data = json.dumps(message).encode()  # shorter than 126 bytes, or than 64 kB
        size = bytes([0x80 | len(data)]) if len(data) < 126 else bytes([0x80 | 126]) + struct.pack(">H", len(data))
        self.socket.sendall(b"\x81" + size + bytes(4) + data)  # a mask of zeros

    def receive(self):
        """Returns a status as a dictionary, or the bytes of a frame."""
        kind, size = self.stream.read(2)
        if size == 126:
            size = struct.unpack(">H", self.stream.read(2))[0]
        elif size == 127:
            size = struct.unpack(">Q", self.stream.read(8))[0]
        data = self.stream.read(size)
        return json.loads(data) if kind & 15 == 1 else data


def boxes_1000(folder):
    """Writes a scene of 1000 boxes that fall beside each other."""
    models = "\n".join(f"  - {{name: b{i}, box: [0.1, 0.1, 0.1], mass: 1, position: [{0.3 * (i % 32)}, {0.3 * (i // 32)}, 0.3]}}"
                       for i in range(1000))
    file = pathlib.Path(folder) / "boxes_1000.yaml"
    file.write_text(f"name: boxes_1000\nground: {{}}\nmodels:\n{models}\n")
    return file


def watch(page, seconds):
    """Reads for a while; returns the statuses, the sizes of frames, and the number of bodies."""
    statuses, sizes, bodies, end = [], [], 0, time.monotonic() + seconds
    while time.monotonic() < end:
        message = page.receive()
        if isinstance(message, dict):
            statuses.append(message)
        else:
            sizes.append(len(message))
            bodies = struct.unpack_from("<I", message, 16)[0] - 1  # without the world
    return statuses, sizes, bodies


def read_until_held(page, body):
    """Reads until a frame in which the hand holds this body; 0: none."""
    while True:
        message = page.receive()
        if isinstance(message, bytes) and struct.unpack_from("<I", message, 4)[0] == body:
            return


def latency(page):
    """Time from a message to the first frame with its force [s]."""
    page.send(do="drag", body=1, point=[0, 0, 0], target=[0, 0, 1])
    start = time.monotonic()
    read_until_held(page, 1)
    out = time.monotonic() - start
    page.send(do="release")
    read_until_held(page, 0)
    return out


def row(scene):
    command = [PROGRAM, "live", scene, "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        page = Page(int(process.stdout.readline().strip().rstrip("/").rsplit(":", 1)[1]))
        statuses, sizes, bodies = watch(page, SECONDS)
        waits = [1e3 * latency(page) for _ in range(POKES)]
        process.send_signal(signal.SIGINT)
    statuses = [s for s in statuses if s["time"] > 0.0]
    step, frame = (statistics.mean(s[key] for s in statuses) for key in ("step_us", "frame_us"))
    simulated = statuses[-1]["time"] - statuses[0]["time"]
    steps = simulated / statuses[-1]["settings"]["time_step"] / SECONDS  # a second
    frames = len(sizes) / SECONDS
    return (f"| {pathlib.Path(scene).stem} | {bodies} | {step:.3g} | {simulated / SECONDS:.2g} | {frames:.3g} | {frame:.3g} "
            f"| {100 * frame * frames / (step * steps):.2g} | {statistics.median(sizes):.0f} "
            f"| {statistics.median(waits):.2g} ({max(waits):.2g}) |\n")


def main():
    with tempfile.TemporaryDirectory() as folder:
        table = HEADER + "".join(row(boxes_1000(folder) if name == "boxes_1000" else name) for name in sys.argv[1:] or SCENES)
    if sys.argv[1:]:
        print(table)
    else:
        marked.write(PAGE, "table", table)
    return 0


if __name__ == "__main__":
    sys.exit(main())

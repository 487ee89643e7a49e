"""Programs that are served live, and pages that look at them, for the tests of this folder."""
import base64
import contextlib
import json
import os
import re
import socket
import struct
import subprocess
import time

MODEL = """model: served
step: 0.001
variables:
  k: {value: 0.3, maximum: 5}
blocks:
  sine: {block: Sine, frequency: 7}
  error: {block: Sum, signs: +-}
  control: {block: Gain, K: k}
  plant: {block: DiscreteIntegrator}
  wide: {block: Gain, K: "ones(500, 1)"}
connections: {sine: [error.u1, wide], plant: error.u2, error: control, control: plant}
plots: {Control: [control, error, plant]}
record: [control, error, plant, sine]
"""
SIGNALS = ["sine.y", "error.y", "control.y", "plant.y", "wide.y"]


@contextlib.contextmanager
def started(command, pattern, **options):
    """The process, and the first text in what it prints that fits the pattern."""
    with subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          **options) as process:
        try:
            told = []
            for line in process.stdout:
                told.append(line)
                if found := re.search(pattern, line):
                    yield process, found[0]
                    break
            else:
                raise AssertionError("".join(told))
        finally:
            process.terminate()
            process.stdout.read()


def served(command, **options):
    """A program that is served, and its address."""
    return started(command, r"(ws:|unix:)\S+", **options)


def attached(bf, model, address):
    """bf edit, and the address of its page."""
    return started([bf, "edit", "--no-browser", "--attach", address, model], r"http:\S+")


def timing(message):
    """What a notification tells of the loop; {} where it tells nothing."""
    return (message["params"]["timing"] or {}) if message.get("method") == "live" else {}


class Page:
    """A page of bf edit without a browser, over a bare socket; it reads when it is told to."""

    def __init__(self, address):
        host, port, self.token = re.match(r"http://([^:]+):(\d+)/\?token=(\w+)", address).groups()
        self.socket = socket.socket()
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self.socket.settimeout(20)
        self.socket.connect((host, int(port)))
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET /socket?token={self.token} HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\n"
                             f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n").encode())
        self.received = b""
        while b"\r\n\r\n" not in self.received:
            self.received += self.socket.recv(1)
        assert b" 101 " in self.received.splitlines()[0], self.received
        self.received = b""
        self.count = 0

    def say(self, method, **params):
        self.count += 1
        text = json.dumps({"jsonrpc": "2.0", "id": self.count, "method": method, "params": params}).encode()
        length = bytes([0x80 | len(text)]) if len(text) < 126 else b"\xfe" + struct.pack(">H", len(text))
        self.socket.sendall(b"\x81" + length + bytes(4) + text)  # masked by zeros
        return self.count

    def _take(self, count):
        while len(self.received) < count:
            part = self.socket.recv(1 << 16)
            if not part:
                raise ConnectionError("the page was sent away")
            self.received += part
        taken, self.received = self.received[:count], self.received[count:]
        return taken

    def read(self):
        """The next message: JSON, or bytes."""
        kind, message = 0, b""
        while True:
            first, length = self._take(2)
            if length == 126:
                length, = struct.unpack(">H", self._take(2))
            elif length == 127:
                length, = struct.unpack(">Q", self._take(8))
            content = self._take(length)
            if first & 0xf > 2:
                continue  # of the connection
            kind, message = first & 0xf or kind, message + content
            if first & 0x80:  # the last part
                return json.loads(message) if kind == 1 else message

    def until(self, is_it):
        end, message = time.monotonic() + 30, None
        while time.monotonic() < end:
            message = self.read()
            if isinstance(message, dict) and is_it(message):
                return message
        raise AssertionError(f"it did not come, but at last {message}")

    def ask(self, method, **params):
        """The result, or the message of the error."""
        number = self.say(method, **params)
        answer = self.until(lambda message: message.get("id") == number)
        return answer["result"] if "result" in answer else answer["error"]["message"]

    def kill(self):
        """The connection is reset, as of a browser that is killed."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.socket.close()

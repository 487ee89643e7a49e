"""A generated program that runs in real time and is told values on its command port."""
import re
import socket
import subprocess


class Commanded:
    """Runs it as long as the `with` lasts; it must end well when it is told to."""

    def __init__(self, program):
        self.program = subprocess.Popen([program, "--realtime", "--stop", "inf", "--command-port", "0"], text=True,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

    def __enter__(self):
        try:
            port = None
            while port is None:
                found = re.search(r"127\.0\.0\.1:(\d+)", self.program.stderr.readline())
                port = found and int(found[1])
            self.lines = socket.create_connection(("127.0.0.1", port), timeout=20).makefile("rw")
        except BaseException:
            self.program.kill()
            raise
        return self

    def __exit__(self, kind, *_):
        self.program.terminate()
        self.program.wait(20)
        assert kind or self.program.returncode == 0, self.program.returncode

    def ask(self, line):
        self.lines.write(line + "\n")
        self.lines.flush()
        return self.lines.readline().strip()

    def values(self, *names):
        self.lines.write("?\n")
        self.lines.flush()
        found = {}
        while line := self.lines.readline().strip():
            name, value = line.split("  # ")[0].split(": ", 1)
            found[name] = value
        return tuple(found[name] for name in names)

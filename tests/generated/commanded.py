"""A generated program that runs in real time and is told values over its Unix socket."""
import os
import socket
import subprocess
import tempfile


class Commanded:
    """Runs it as long as the `with` lasts; it must end well when it is told to."""

    def __init__(self, program, *options):
        self.folder = tempfile.TemporaryDirectory()
        self.path = os.path.join(self.folder.name, "commands")
        self.program = subprocess.Popen([program, "--realtime", "--stop", "inf", "--priority", "0", "--command-port",
                                         self.path, *options],
                                        text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

    def __enter__(self):
        try:
            while self.path not in self.program.stderr.readline():
                assert self.program.poll() is None
            assert os.stat(self.path).st_mode & 0o777 == 0o600
            self.connection = self.connect()
            self.lines = self.connection.makefile("rw")
        except BaseException:
            self.program.kill()
            raise
        return self

    def __exit__(self, kind, *_):
        self.program.terminate()
        self.program.wait(20)
        assert kind or self.program.returncode == 128 + 15, self.program.returncode
        assert kind or not os.path.exists(self.path)
        self.folder.cleanup()

    def connect(self):
        connection = socket.socket(socket.AF_UNIX)
        connection.settimeout(20)
        connection.connect(self.path)
        return connection

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

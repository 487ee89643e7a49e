#!/usr/bin/env python3
"""A signal ends a generated program that waits in a block in order, as it ends `bf run`: waits.py PROGRAM."""

import os
import signal
import subprocess
import sys
import tempfile
import time

for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    with tempfile.TemporaryDirectory() as folder:
        program = subprocess.Popen([sys.argv[1], "--stop", "Inf", "--csv", "out.csv", "--command-port",
                                    os.path.join(folder, "port")], cwd=folder, stderr=subprocess.PIPE, text=True)
        told = program.stderr.readline()  # signals are caught from here on
        assert "takes commands at" in told, told
        time.sleep(0.5)  # the first step is done, the second waits
        assert program.poll() is None
        program.send_signal(number)
        try:
            told = program.communicate(timeout=30)[1]
        finally:
            program.kill()
        assert program.returncode == 128 + number, (program.returncode, told)
        assert told.endswith("stopped at t = 0.01 s: interrupted\n"), told

"""any_size.py BF MODEL PROGRAM: does the program, generated with --sizes=runtime, record what the simulation records with
the same parameter file, bit for bit? And does it refuse values outside of their limits, at its start and while it runs?
"""
import pathlib
import re
import socket
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples"))
from recorded import compare, read_csv, read_recording, run

bf, model, program = sys.argv[1:]

counts = []
for parameters in ["", "n: 5\n", "{n: 2, x0: [7, -1]}\n"]:
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "p.yaml").write_text(parameters or "{}\n")
        options = ["--params", folder / "p.yaml"] if parameters else []
        run(bf, "run", model, "--quiet", "--record", folder / "run.mcap", *options)
        run(program, "--csv", folder / "program.csv", *options)
        compared, _, difference = compare(read_recording(bf, folder / "run.mcap"), read_csv(folder / "program.csv"))
        assert not difference, f"{parameters}: {difference}"
        counts.append(compared)
assert counts[1] > counts[0] > counts[2] > 500, counts

with tempfile.TemporaryDirectory() as name:
    file = pathlib.Path(name) / "p.yaml"
    file.write_text("n: 2\nc.tracking_time: 0\n")
    refused = subprocess.run([program, "--params", file], capture_output=True, text=True)
    assert refused.returncode != 0
    assert "c: parameter 'tracking_time' must be greater than 0, but is 0" in refused.stderr, refused.stderr

running = subprocess.Popen([program, "--realtime", "--stop", "inf", "--command-port", "0"], text=True,
                           stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
try:
    port = None
    while port is None:
        found = re.search(r"127\.0\.0\.1:(\d+)", running.stderr.readline())
        port = found and int(found[1])
    lines = socket.create_connection(("127.0.0.1", port), timeout=20).makefile("rw")

    def ask(line):
        lines.write(line + "\n")
        lines.flush()
        return lines.readline().strip()

    def values():
        lines.write("?\n")
        lines.flush()
        found = {}
        while line := lines.readline().strip():
            key, value = line.split(": ", 1)
            found[key] = value
        return found["T"], found["slow.K"], found["c.tracking_time"]

    before = values()
    problem = "error: parameter 'c.tracking_time' must be greater than 0, but is "
    assert ask("{slow.K: 7, c.tracking_time: -1}") == problem + "-1"
    assert ask("{slow.K: 7, T: -1}") == problem + "-2"
    assert values() == before == ("0.1", "2", "0.2"), before
    assert ask("{slow.K: 7, T: 1}") == "ok"
    assert values() == ("1", "7", "2"), values()
finally:
    running.terminate()
    running.wait(20)
assert running.returncode == 0, running.returncode

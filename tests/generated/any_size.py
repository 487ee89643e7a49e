"""any_size.py BF MODEL PROGRAM: does the program, generated with --sizes=runtime, record what the simulation records with
the same parameter file, bit for bit? And does it refuse values outside of their limits, at its start and while it runs?
"""
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "examples"))
from commanded import Commanded
from recorded import columns, columns_of_recording, compare, read_csv, read_recording, run

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
        differing = columns_of_recording(bf, folder / "run.mcap") - columns(folder / "program.csv")
        assert not differing, differing
        counts.append(compared)
assert counts[1] > counts[0] > counts[2] > 500, counts

with tempfile.TemporaryDirectory() as name:
    file = pathlib.Path(name) / "p.yaml"
    file.write_text("n: 2\nc.tracking_time: 0\n")
    refused = subprocess.run([program, "--params", file], capture_output=True, text=True)
    assert refused.returncode != 0
    assert "c: parameter 'tracking_time' must be greater than 0, but is 0" in refused.stderr, refused.stderr
    file.write_text("n: 2\nT: 6\n")
    refused = subprocess.run([program, "--params", file], capture_output=True, text=True)
    assert refused.returncode != 0
    assert "p.yaml:2:4: variable 'T' must be at most 5, but is 6" in refused.stderr, refused.stderr

names = "T", "slow.K", "c.tracking_time"
with Commanded(program) as running:
    before = running.values(*names)
    problem = "error: parameter 'c.tracking_time' must be greater than 0, but is "
    assert running.ask("{slow.K: 7, c.tracking_time: -1}") == problem + "-1"
    assert running.ask("{slow.K: 7, T: -1}") == problem + "-2"
    assert running.ask("{slow.K: 7, T: 6}") == "error: variable 'T' must be at most 5, but is 6"
    assert running.values(*names) == before == ("0.1", "2", "0.2"), before
    assert running.ask("{slow.K: 7, T: 1}") == "ok"
    assert running.values(*names) == ("1", "7", "2"), running.values(*names)

"""Runs an example and compares what it records with expected.csv in its folder.

Usage: compare.py BF FOLDER TOLERANCE. Columns of expected.csv are recorded signals, rows are times that are recorded; an
empty cell is not compared. The tolerance is absolute, or relative for values above 1.
"""
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path


def read(file):
    with open(file) as text:
        rows = list(csv.reader(text))
    return {name: [float(row[i]) if row[i] else None for row in rows[1:]] for i, name in enumerate(rows[0])}


def recorded(bf, model, folder):
    """Each recorded column as {time: value}; of two records at an instant, before and after an event, the first.
    Recordings hold times in whole nanoseconds."""
    run, table = Path(folder, "run.mcap"), Path(folder, "run.csv")
    result = subprocess.run([bf, "run", model, "--quiet", "--json", "--record", run], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    failed = [name for name, value in json.loads(result.stdout)["checks"].items() if value is False]
    assert not failed, f"failed: {failed}"
    subprocess.run([bf, "export", run, "-o", table], check=True, stdout=subprocess.DEVNULL)
    columns = {}
    for file in Path(folder).glob("run*.csv"):
        data = read(file)
        times = [round(t, 9) for t in data.pop("time (s)")]
        for name, values in data.items():
            columns[name] = dict(zip(reversed(times), reversed(values)))
    return columns


bf, example, tolerance = sys.argv[1], Path(sys.argv[2]), float(sys.argv[3])
expected = read(example / "expected.csv")
times = [round(t, 9) for t in expected.pop("time")]
with tempfile.TemporaryDirectory() as folder:
    actual = recorded(bf, example / "model.yaml", folder)
for name, values in expected.items():
    assert name in actual, f"{name} is not recorded; there are {', '.join(actual)}"
    rows = [(time, value) for time, value in zip(times, values) if value is not None]
    for time, value in rows:
        assert time in actual[name], f"{name} is not recorded at {time} s"
        difference = abs(actual[name][time] - value)
        assert difference <= tolerance * max(1, abs(value)), \
            f"{name} at {time} s: expected {value}, got {actual[name][time]}, a difference of {difference:.3g}"
    worst = max(abs(actual[name][time] - value) / max(1, abs(value)) for time, value in rows)
    print(f"{name}: largest difference {worst:.3g}")

"""The program generated from the model records what the simulation records, bit for bit.

Usage: generated.py BF MODEL PROGRAM
"""
import csv
import pathlib
import subprocess
import sys
import tempfile

bf, model, program = sys.argv[1:]


def run(*command):
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    assert result.returncode == 0, f"{command}: {result.stdout}{result.stderr}"


def read(file):
    with open(file, newline="") as stream:
        names, *rows = csv.reader(stream)
    return names, [[float(x) for x in row] for row in rows]


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    run(program, "--stop", "2", "--csv", folder / "generated.csv")
    run(bf, "run", model, "--set", "stop=2", "--quiet", "--record", folder / "run.mcap")
    run(bf, "export", folder / "run.mcap", "-o", folder / "run.csv")
    names, rows = read(folder / "generated.csv")
    by_time = {round(row[0] * 1e9): row for row in rows}
    compared = 0
    for file in sorted(folder.glob("run_*.csv")):
        signal = file.stem.removeprefix("run_")
        columns = [0] + [i for i, column in enumerate(names) if column.split("[")[0] == signal]
        expected_names, expected = read(file)
        assert len(columns) == len(expected_names), (signal, expected_names)
        # The file of a slower signal holds its own samples only; its times are whole nanoseconds.
        for row in expected:
            same = by_time[round(row[0] * 1e9)]
            assert [same[i] for i in columns[1:]] == row[1:], f"{signal} differs at t = {row[0]} s"
            compared += len(row)
    assert compared > 100_000, compared

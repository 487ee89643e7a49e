"""any_size.py BF MODEL PROGRAM: does the program, generated with --sizes=runtime, record what the simulation records with
the same parameter file, bit for bit?
"""
import csv
import pathlib
import re
import subprocess
import sys
import tempfile

bf, model, program = sys.argv[1:]


def run(*command):
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, f"{command}: {result.stdout}{result.stderr}"


def read(file):
    """Signal -> {time in ns: row}."""
    with open(file, newline="") as stream:
        names, *rows = csv.reader(stream)
    signals = {}
    for i, name in enumerate(names[1:], 1):
        signals.setdefault(re.sub(r"((\[\d+\])+|\(\d+\))?( \(.*\))?$", "", name), []).append(i)
    return {
        signal: {round(float(row[0]) * 1e9): [float(row[i]) for i in columns] for row in rows}
        for signal, columns in signals.items()
    }


counts = []
for parameters in ["", "n: 5\n", "{n: 2, x0: [7, -1]}\n"]:
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "p.yaml").write_text(parameters or "{}\n")
        options = ["--params", folder / "p.yaml"] if parameters else []
        run(bf, "run", model, "--quiet", "--record", folder / "run.mcap", *options)
        run(bf, "export", folder / "run.mcap", "-o", folder / "run.csv")
        run(program, "--csv", folder / "program.csv", *options)
        seen = read(folder / "program.csv")
        compared = 0
        for part in folder.glob("run*.csv"):
            for signal, rows in read(part).items():
                for time, row in rows.items():
                    assert seen[signal][time] == row, f"{parameters}: {signal} at {time / 1e9} s"
                    compared += len(row)
        counts.append(compared)
assert counts[1] > counts[0] > counts[2] > 500, counts

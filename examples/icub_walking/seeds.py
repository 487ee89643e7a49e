"""Walks with the noise of several seeds and expects every check of the model to pass in each.

Usage: seeds.py BF MODEL COUNT [OPTION...]
"""
import csv
import os
import subprocess
import sys
import tempfile

bf, model, count, *options = sys.argv[1:]
with tempfile.TemporaryDirectory() as folder:
    table = os.path.join(folder, "seeds.csv")
    subprocess.run([bf, "sweep", model, "--quiet", "--jobs", "2", *options, "--set", f"seed=1:{count}", "-o", table],
                   check=True)
    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))
assert len(rows) == int(count), rows
for row in rows:
    verdicts = {name: value for name, value in row.items() if name == "stood" or name.endswith(".passed")}
    assert len(verdicts) > 5 and all(value == "1" for value in verdicts.values()), row
assert len({row["foot_slip_m"] for row in rows}) == len(rows), "the noise makes no difference"

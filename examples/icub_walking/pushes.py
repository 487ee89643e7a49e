"""A push that no foothold alone can catch is caught where the foot lands at another time, too.

Usage: pushes.py BF MODEL
"""
import csv
import subprocess
import sys
import tempfile

bf, model = sys.argv[1:]
with tempfile.NamedTemporaryFile(suffix=".csv") as table:
    subprocess.run([bf, "sweep", model, "--quiet", "--jobs", "2", "--stop", "8", "--set", "scenario=2", "--set", "Push.left=90",
                    "--set", "Push.forward=0", "--set", "Push.at_y=[3.1 3.35 3.6]", "--set", "Walk.delay_cost=[0.1 inf]",
                    "-o", table.name], check=True)
    with open(table.name, newline="") as file:
        rows = list(csv.DictReader(file))
stood = {cost: [row["stood"] for row in rows if row["Walk.delay_cost"] == cost] for cost in ("0.1", "inf")}
assert stood["0.1"] == ["1"] * 3, stood
assert stood["inf"].count("0") >= 2, stood

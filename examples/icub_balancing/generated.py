"""The program generated from the model records what the simulation records, bit for bit.

Usage: generated.py BF MODEL PROGRAM
"""
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from recorded import compare, read_csv, read_recording, run

bf, model, program = sys.argv[1:]

with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    run(program, "--stop", "2", "--csv", folder / "generated.csv")
    run(bf, "run", model, "--set", "stop=2", "--quiet", "--record", folder / "run.mcap")
    compared, _, difference = compare(read_recording(bf, folder / "run.mcap"), read_csv(folder / "generated.csv"))
    assert not difference, difference
    assert compared > 100_000, compared

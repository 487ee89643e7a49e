"""The program generated from the model records what the simulation records, bit for bit and under the
same names of elements.

Usage: generated.py BF MODEL PROGRAM STOP [OPTION OF bf run]...
"""
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from recorded import columns, columns_of_recording, compare, read_csv, read_recording, run

bf, model, program, stop, *options = sys.argv[1:]

with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    run(program, "--stop", stop, "--csv", folder / "generated.csv")
    run(bf, "run", model, "--set", f"stop={stop}", *options, "--quiet", "--record", folder / "run.mcap")
    compared, _, difference = compare(read_recording(bf, folder / "run.mcap"), read_csv(folder / "generated.csv"))
    assert not difference, difference
    differing = columns_of_recording(bf, folder / "run.mcap") - columns(folder / "generated.csv")
    assert not differing, f"the program calls these otherwise: {differing}"
    assert compared > 500, compared

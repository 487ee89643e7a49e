"""any_size.py BF MODEL PROGRAM: does the program, generated with --sizes=runtime, record what the simulation records with
the same parameter file, bit for bit?
"""
import pathlib
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

"""One compiled program balances several robots: each run records what the simulation with the same values records.

Usage: test.py BF MODEL PROGRAM FIXED [PARAMETERS...]. PROGRAM is generated with --sizes=runtime; it runs once without a
parameter file, and once with each. Every robot must stand. FIXED has the sizes of the model: it takes the robots with as
many joints, and refuses the others.
"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

bf, model, program, fixed, *files = sys.argv[1:]
STOP = "5"


def run(*command, code=0):
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=300)
    assert result.returncode == code, f"{command}: {result.stdout}{result.stderr}"
    return result


def read(file):
    with open(file, newline="") as stream:
        names, *rows = csv.reader(stream)
    return names, {round(float(row[0]) * 1e9): [float(x) for x in row] for row in rows}


widths = set()
with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    for file in [None, *files]:
        parameters = ["--params", file] if file else []
        summary = run(bf, "run", model, "--quiet", "--json", "--stop", STOP, "--record", folder / "run.mcap", *parameters)
        checks = json.loads(summary.stdout)["checks"]
        assert checks["stood"] is True and checks["contact_wrenches_feasible"] is True, (file, checks)
        run(bf, "export", folder / "run.mcap", "-o", folder / "run.csv")
        run(program, "--stop", STOP, "--csv", folder / "program.csv", *parameters)
        names, rows = read(folder / "program.csv")
        widths.add(len(names))
        same_size = len(names) == max(widths)
        other = run(fixed, "--stop", STOP, "--csv", folder / "fixed.csv", *parameters, code=0 if same_size else 1)
        if same_size:
            assert (folder / "fixed.csv").read_bytes() == (folder / "program.csv").read_bytes(), file
        else:
            assert "'n' cannot change: " in other.stderr, other.stderr
        compared = 0
        for part in folder.glob("run_*.csv"):
            signal = part.stem.removeprefix("run_")
            columns = [i for i, column in enumerate(names) if column.split("[")[0] == signal]
            for time, row in read(part)[1].items():
                assert [rows[time][i] for i in columns] == row[1:], f"{file}: {signal} differs at {time / 1e9} s"
                compared += len(columns)
            part.unlink()
        assert compared > 100_000, compared
    assert len(widths) == 2, f"the robots have {widths} signals"

    # Mistakes end in a message: a name, a value that is no expression, a robot for which sizes do not fit.
    wrong = folder / "wrong.yaml"
    for text, message in [
        ("Gain.delat: 1\n", "wrong.yaml:1:13: nothing is called 'Gain.delat'; did you mean 'Gain.delta'"),
        ("Gain: {delta: 1 +}\n", "wrong.yaml:1:18: Gain.delta: '1 +': expected a value"),
        ("n: 15\n", "controller."),
        ("T_control: 0.001\n", "has another structure than the code was generated for"),
    ]:
        wrong.write_text(text)
        error = run(program, "--params", wrong, code=1).stderr
        assert message in error, error

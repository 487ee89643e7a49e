"""One compiled program balances several robots: each run records what the simulation with the same values records.

Usage: test.py BF MODEL PROGRAM FIXED [PARAMETERS...]. PROGRAM is generated with --sizes=runtime; it runs once without a
parameter file, and once with each. Every robot must stand. FIXED has the sizes of the model: it takes the robots with as
many joints, and refuses the others.
"""
import json
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from recorded import compare, read_csv, read_recording, run

bf, model, program, fixed, *files = sys.argv[1:]
STOP = "5"
widths = set()
with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    for file in [None, *files]:
        parameters = ["--params", file] if file else []
        summary = run(bf, "run", model, "--quiet", "--json", "--stop", STOP, "--record", folder / "run.mcap", *parameters)
        checks = json.loads(summary.stdout)["checks"]
        assert checks["stood"] is True and checks["contact_wrenches_feasible"] is True, (file, checks)
        run(program, "--stop", STOP, "--csv", folder / "program.csv", *parameters)
        signals = read_csv(folder / "program.csv")
        width = sum(len(next(iter(rows.values()))[0]) for rows in signals.values())
        widths.add(width)
        same_size = width == max(widths)
        other = run(fixed, "--stop", STOP, "--csv", folder / "fixed.csv", *parameters, code=0 if same_size else 1)
        if same_size:
            assert (folder / "fixed.csv").read_bytes() == (folder / "program.csv").read_bytes(), file
        else:
            assert "'n' cannot change: " in other.stderr, other.stderr
        compared, _, difference = compare(read_recording(bf, folder / "run.mcap"), signals)
        assert not difference, f"{file}: {difference}"
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

"""any_size_embedded.py USE_C FOLDER: do C and Python, over the library of a model generated with --sizes=runtime, find its sizes at
the start, and come to the closed form: element i of the position begins at x0 = i and moves at its own speed for 1 s?
FOLDER has the module, AnySize_LIBRARY names its library."""
import pathlib
import subprocess
import sys
import tempfile

use_c, module_folder = sys.argv[1:]
sys.path.insert(0, module_folder)
from any_size import AnySize


def position(model):
    for _ in range(51):
        model.step()
    return list(model.outputs.position)


with tempfile.TemporaryDirectory() as folder:
    file = pathlib.Path(folder) / "p.yaml"
    for parameters, n in ("", 3), ("n: 5\n", 5):
        file.write_text(parameters or "{}\n")
        model = AnySize(file) if parameters else AnySize()
        assert len(model.inputs.speed) == n and model.get("spread.K") == list(range(1, n + 1))
        model.inputs.speed = [10 * i for i in range(n)]
        found = position(model)
        assert all(abs(x - (i + 1 + 10 * i)) < 1e-12 for i, x in enumerate(found)), found
        printed = subprocess.run([use_c, file], capture_output=True, text=True, check=True).stdout
        assert [float(x) for x in printed.split()] == found, (printed, found)

        model.inputs.speed = -1
        model.inputs.speed[1] = 0
        model.initialize()  # inputs stay
        again = position(model)
        assert all(abs(x - (2 if i == 1 else i)) < 1e-12 for i, x in enumerate(again)), again
        try:
            model.inputs.speed = [1]
            raise AssertionError("it has more elements")
        except ValueError:
            pass
        before = model.get("T")
        try:
            model.set_parameters({"slow.K": 7, "T": 6})
            raise AssertionError("T may be 5 at most")
        except ValueError as wrong:
            assert str(wrong) == "slow.K, T: variable 'T' must be at most 5, but is 6", wrong
        assert model.get("T") == before and model.get("slow.K") != [7]

    file.write_text("n: 2\nT: 6\n")
    try:
        AnySize(file)
        raise AssertionError("T may be 5 at most")
    except ValueError as wrong:
        assert str(wrong).endswith("p.yaml:2:4: variable 'T' must be at most 5, but is 6"), wrong
    refused = subprocess.run([use_c, file], capture_output=True, text=True)
    assert refused.returncode == 1 and refused.stderr.endswith("but is 6\n"), refused

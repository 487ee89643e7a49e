"""hosted_from_python.py PROGRAM FOLDER: does the module in FOLDER, over the library that Hosted_LIBRARY names, take a parameter file and the
folder of the files that blocks read, and compute what the program computes with both?"""
import pathlib
import sys
import tempfile

program, module_folder = sys.argv[1:]
sys.path[:0] = [module_folder, str(pathlib.Path(__file__).resolve().parents[2] / "examples")]
from hosted import Hosted
from recorded import read_csv, run


def heights(**options):
    model = Hosted(**options)
    found = []
    for _ in range(350):
        model.output()
        found += model.get("height.y")
        model.update()
    return found


def refusal(kind, **options):
    try:
        Hosted(**options)
    except kind as wrong:
        return str(wrong)
    raise AssertionError(options)


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    (folder / "pull.csv").write_text("0,-2\n0.5,1\n")
    file = folder / "p.yaml"
    file.write_text("restitution: 0.5\npush.file: pull.csv\n")
    run(program, "--params", file, "--folder", folder, "--csv", folder / "program.csv")
    expected = [rows[-1][0] for rows in read_csv(folder / "program.csv")["height.y"].values()]
    assert heights(parameters=file, folder=folder) == expected
    assert heights() != expected

    assert "push.csv" in refusal(RuntimeError, folder=folder)
    file.write_text("restitution: 2\n")
    assert refusal(ValueError, parameters=file) == f"{file}:1: variable 'restitution' must be from 0 to 1, but is 2"

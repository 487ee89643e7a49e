"""Types and texts for those who write programs."""

import inspect
import pathlib
import subprocess
import sys

import blockfactory as bf
import stubs
from conftest import ROOT


def test_the_stub_is_that_of_the_module():
    assert stubs.FILE.read_text() == stubs.made(), "run python python/test/stubs.py with the package in PYTHONPATH"


def test_the_package_and_programs_pass_mypy_in_strict_mode(tmp_path):
    right = (
        "import blockfactory as bf\n"
        "import blockfactory._worker\n"
        "m = bf.load('m.yaml', {'Gain.Kp': 3}, stop=2)\n"
        "sim = m.simulate()\n"
        "sim.run(1)\n"
        "x: float = float(sim['a'].max())\n"
        "sim.parameters['a.K'] = [1, 2]\n"
        "names: list[str] = list(m.blocks)\n"
        "class Twice(bf.Block):\n"
        "    u = bf.Input('n')\n"
        "    y = bf.Output('n')\n"
        "    def output(self, at: bf.At, out: bf.Writer, /) -> None:\n"
        "        out.y = 2 * at.u\n"
    )
    (tmp_path / "right.py").write_text(right)
    (tmp_path / "wrong.py").write_text("import blockfactory as bf\nbf.load('m.yaml').simulate().run('long')\nbf.load(3)\n")
    configuration = ["--config-file", str(ROOT / "python/pyproject.toml"), "--cache-dir=/dev/null"]
    checked = subprocess.run(
        [sys.executable, "-m", "mypy", *configuration, "right.py", "wrong.py"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={"MYPYPATH": str(pathlib.Path(bf.__file__).parents[1]), "PATH": "/usr/bin:/bin"},
    )
    errors = [line for line in checked.stdout.splitlines() if ": error:" in line]
    assert [line.split(": ")[0] for line in errors] == ["wrong.py:2", "wrong.py:3"], checked.stdout


def test_all_that_is_public_says_what_it_is():
    missing = []
    for name in bf.__all__:
        thing = getattr(bf, name)
        if not inspect.getdoc(thing):
            missing.append(name)
        if inspect.isclass(thing) and thing.__module__.startswith("blockfactory"):
            for member, value in vars(thing).items():
                if not member.startswith("_") and (callable(value) or isinstance(value, property)) and not inspect.getdoc(value):
                    missing.append(f"{name}.{member}")
    assert not missing

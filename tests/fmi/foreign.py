"""FMUs of another exporter, PythonFMU3, in our block: the numbers of their equation, in this process and in one of their own,
and a system of one of them beside one of ours.

Usage: foreign.py BF EXAMPLES
"""
import os
import pathlib
import subprocess
import sys
import sysconfig
import tempfile

bf, examples = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import read_recording, run  # noqa: E402

DECAY = """from pythonfmu3 import Fmi3Causality, Fmi3Initial, Fmi3Slave, Fmi3Variability, Float64


class Decay(Fmi3Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time, self.u, self.x, self.a = 0.0, 0.0, 1.0, -2.0
        self.register_variable(Float64("time", causality=Fmi3Causality.independent, variability=Fmi3Variability.continuous))
        self.register_variable(Float64("u", causality=Fmi3Causality.input, start=0.0))
        self.register_variable(Float64("a", causality=Fmi3Causality.parameter, variability=Fmi3Variability.tunable, start=-2.0))
        self.register_variable(Float64("x", causality=Fmi3Causality.output, initial=Fmi3Initial.exact, start=1.0))

    def do_step(self, t, h):
        self.x += h * (self.a * self.x + self.u)
        return True
"""
STEP, STEPS = 0.01, 50

# The FMU embeds an interpreter, whose library it leaves to whoever loads it.
library = pathlib.Path(sysconfig.get_config_var("LIBDIR"), sysconfig.get_config_var("MULTIARCH") or "",
                       sysconfig.get_config_var("INSTSONAME"))
library = next(p for p in (library, library.parent.parent / library.name) if p.exists())
os.environ["LD_PRELOAD"] = str(library)

with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    fmus = folder / "fmus"
    fmus.mkdir()
    (folder / "decay.py").write_text(DECAY)
    subprocess.run([sys.executable, "-m", "pythonfmu3", "build", "-f", folder / "decay.py", "-d", fmus], check=True, capture_output=True)
    model = folder / "model.yaml"
    expected = [1.0]
    for k in range(STEPS):
        expected.append(expected[-1] + STEP * (-3.0 * expected[-1] + 0.5))
    for process in ("shared", "own"):
        model.write_text(f"model: foreign\nplugins: [FMI]\nstep: {STEP}\nstop: {STEP * STEPS}\nblocks:\n  half: {{block: Constant, value: 0.5}}\n"
                         f"  f: {{block: FMI/FMU, fmu: Decay.fmu, period: {STEP}, a: -3, process: {process}}}\n"
                         "connections: {half: f.u}\nrecord: [f]\n")
        run(bf, "run", model, "--plugin-path", fmus, "--quiet", "--record", folder / "run.mcap")
        got = read_recording(bf, folder / "run.mcap")["f"]
        for k, x in enumerate(expected[:-1]):
            assert got[k * 10_000_000][-1] == [x], (process, k, got[k * 10_000_000], x)
    run(bf, "export-ssp", model, "-o", folder / "system.ssp", "--plugin-path", fmus)
    run(bf, "run", folder / "system.ssp", "--quiet", "--record", folder / "system.mcap")
    assert read_recording(bf, folder / "system.mcap")["f"] == got
    print(f"{len(expected) - 1} numbers of PythonFMU3 are those of its equation")

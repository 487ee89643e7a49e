"""FMUs with structural parameters: each size of a model computes what the model of that size does, in FMPy and in our
own blocks; sizes that it has not, and models that have no such description, are messages.

Usage: structural.py BF EXAMPLES
"""
import pathlib
import subprocess
import sys
import tempfile

import fmpy
import fmpy.fmi1
import fmpy.fmi3
import fmpy.validation

bf, examples = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import read_recording, run  # noqa: E402

STEP, STEPS = 0.01, 50
MODEL = """model: chain
step: 0.01
stop: 0.5
solver: rk4
variables:
  n: {value: 3, doc: how many there are}
  m: 2
  k: {value: 2, minimum: 0}
  K: {value: "(1:n)'"}
inputs: {u: {shape: n}}
outputs: [y, total, pairs]
blocks:
  gain: {block: Gain, K: k}
  weights: {block: Constant, value: K}
  own: {block: Product}
  x: {block: Integrator, initial: "ones(n,1)/n"}
  sum: {block: SumOfElements}
  rows: {block: Gain, K: "ones(m,n)", multiplication: "K*u"}
connections:
  u: gain
  gain: own.u1
  weights: own.u2
  own: x
  x: [y, sum, rows]
  sum: total
  rows: pairs
record: [x]
"""


def closed_form(n, i, t, k=2, u=1):
    """Of y_i, which has the derivative k i u."""
    return 1 / n + k * (i + 1) * u * t


def refusal(*arguments):
    result = subprocess.run([bf, *map(str, arguments)], capture_output=True, text=True, timeout=300)
    assert result.returncode == 1, result
    return result.stderr


class Instance:
    def __init__(self, folder, described, kind=fmpy.fmi3.FMU3Slave):
        self.messages = []
        self.fmu = kind(guid=described.instantiationToken, unzipDirectory=folder, instanceName="one",
                        modelIdentifier=described.coSimulation.modelIdentifier)
        self.references = {v.name: v.valueReference for v in described.modelVariables}
        self.fmu.instantiate(logMessage=lambda _, status, category, text: self.messages.append(text.decode()),
                             loggingOn=True)

    def configure(self, **sizes):
        self.fmu.enterConfigurationMode()
        for name, value in sizes.items():
            self.fmu.setUInt64([self.references[name]], [value])
        self.fmu.exitConfigurationMode()

    def begin(self):
        self.fmu.enterInitializationMode(startTime=0.0)
        self.fmu.exitInitializationMode()

    def set(self, name, *values):
        self.fmu.setFloat64([self.references[name]], list(values))

    def get(self, name, count):
        return list(self.fmu.getFloat64([self.references[name]], count))

    def step(self, k):
        self.fmu.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)

    def refused(self, call, *arguments, **options):
        before = len(self.messages)
        try:
            call(*arguments, **options)
        except fmpy.fmi1.FMICallException as error:
            assert error.status == 3 and len(self.messages) > before, error
            return self.messages[before]
        raise AssertionError("it was not refused")


with tempfile.TemporaryDirectory() as temporary:
    folder = pathlib.Path(temporary)
    model = folder / "chain.yaml"
    model.write_text(MODEL)
    (folder / "fmus").mkdir()
    fmu = folder / "fmus/chain.fmu"
    run(bf, "export-fmu", model, "--structural", "n=1:4", "--structural", "m=[1 2]", "-o", fmu)
    assert fmpy.validation.validate_fmu(str(fmu)) == []
    run(bf, "check-fmu", fmu)
    extracted = fmpy.extract(str(fmu))
    described = fmpy.read_model_description(str(fmu))
    variables = {v.name: v for v in described.modelVariables}
    n = variables["n"]
    said = [n.type, n.causality, n.variability, n.start, n.description]
    assert said == ["UInt64", "structuralParameter", "fixed", "3", "how many there are"], said
    assert 'min="1" max="4" start="3"' in (pathlib.Path(extracted) / "modelDescription.xml").read_text()
    assert [variables[name].causality for name in ("k", "K", "x.initial")] == ["parameter"] + 2 * ["calculatedParameter"]
    assert [d.variable.name for d in variables["pairs"].dimensions] == ["m"] and variables["pairs"].shape == (2,)

    # Every size is the model of that size, bit for bit, and near its closed form.
    for size in (1, 2, 3, 4):
        for pairs in (1, 2):
            inputs = folder / "inputs.csv"
            names = ["u"] if size == 1 else [f"u[{i + 1}]" for i in range(size)]
            inputs.write_text("time," + ",".join(names) + "\n" + "0" + ",1" * size + "\n")
            run(bf, "run", model, "--set", f"n={size}", "--set", f"m={pairs}", "--quiet", "--inputs", inputs, "--record",
                folder / "run.mcap")
            recorded = read_recording(bf, folder / "run.mcap")["x"]
            one = Instance(extracted, described)
            one.configure(n=size, m=pairs)
            one.set("u", *[1.0] * size)
            one.begin()
            assert list(one.fmu.getUInt64([one.references["n"], one.references["m"]])) == [size, pairs]
            for k in range(STEPS):
                y = one.get("y", size)
                expected = recorded[round(k * STEP * 1e9)][-1]
                assert y == expected, (size, k, y, expected)
                assert one.get("total", 1) == [sum(y)]
                assert all(abs(p - sum(y)) < 1e-12 for p in one.get("pairs", pairs))
                one.step(k)
            for i, y in enumerate(one.get("y", size)):
                assert abs(y - closed_form(size, i, STEPS * STEP)) < 1e-12, (size, i, y)
            one.fmu.terminate()
            one.fmu.freeInstance()

    # What was written before stays where it fits, an FMU that begins anew has its first size, and states are those of
    # their size.
    one = Instance(extracted, described)
    one.set("k", 5.0)
    one.configure(n=2)
    one.set("u", 1.0, 1.0)
    one.begin()
    for k in range(10):
        one.step(k)
    assert abs(one.get("y", 2)[1] - closed_form(2, 1, 0.1, k=5)) < 1e-12
    state = one.fmu.getFMUState()
    held = one.get("y", 2)
    bytes_of_2 = one.fmu.serializeFMUState(state)
    one.fmu.reset()
    one.begin()
    assert one.get("y", 3) == [1 / 3] * 3
    one.refused(one.fmu.deserializeFMUState, bytes_of_2)
    one.fmu.setFMUState(state)
    assert one.get("y", 2) == held and list(one.fmu.getUInt64([one.references["n"]])) == [2]
    one.fmu.freeFMUState(state)
    assert "fixed when it is initialized" in one.refused(one.fmu.enterConfigurationMode)
    one.fmu.freeInstance()

    # In model exchange.
    one = Instance(extracted, described, fmpy.fmi3.FMU3Model)
    one.configure(n=4)
    assert one.fmu.getNumberOfContinuousStates() == 4
    one.set("u", *[1.0] * 4)
    one.begin()
    one.fmu.updateDiscreteStates()
    one.fmu.enterContinuousTimeMode()
    assert one.get("der(x.x)", 4) == [2.0, 4.0, 6.0, 8.0]
    assert list(one.fmu.getDirectionalDerivative([one.references["der(x.x)"]], [one.references["u"]], [1.0] * 4, 4)) == [
        2.0, 4.0, 6.0, 8.0]
    one.fmu.freeInstance()

    # Wrong calls.
    one = Instance(extracted, described)
    assert "set in the Configuration Mode" in one.refused(one.fmu.setUInt64, [one.references["n"]], [2])
    one.fmu.enterConfigurationMode()
    assert "'k' is no structural parameter" in one.refused(one.set, "k", 1.0)
    for wrong in (0, 9, 2**63):
        assert f"'n' cannot be {wrong}: the FMU was exported for 1, 2, 3, 4" in one.refused(
            one.fmu.setUInt64, [one.references["n"]], [wrong])
    assert one.fmu.getUInt64([one.references["n"]]) == [3], "nothing has changed"
    one.fmu.freeInstance()

    # In our block.
    wrapper = folder / "wrapper.yaml"

    def wrap(settings):
        wrapper.write_text("model: wrapper\nstep: 0.01\nstop: 0.5\nplugins: [FMI]\nblocks:\n"
                           '  one: {block: Constant, value: "ones(2,1)"}\n'
                           f"  f: {{block: FMI/FMU, fmu: chain.fmu, period: 0.01, structure: [n=2]{settings}}}\n"
                           "connections:\n  one: f.u\nrecord: [f.y]\n")
        return ["run", wrapper, "--plugin-path", folder / "fmus", "--quiet", "--record", folder / "wrapped.mcap"]

    run(bf, *wrap(", k: 3"))
    for time, (values,) in read_recording(bf, folder / "wrapped.mcap")["f.y"].items():
        for i, y in enumerate(values):
            assert abs(y - closed_form(2, i, time * 1e-9, k=3)) < 1e-12, (time, values)

    # What has no such description.
    export = ["export-fmu", model, "-o", folder / "no.fmu"]
    assert "FMI 2.0 has no structural parameters; leave --fmi 2" in refusal(*export, "--fmi", "2", "--structural", "n=1:2")
    assert "the model has no variable 'size'; a variable that decides sizes" in refusal(*export, "--structural", "size=1:2")
    assert "'n' is given twice; give all its values at once" in refusal(*export, "--structural", "n=1", "--structural", "n=2")
    assert "'n' must be whole numbers from 1, but is 0" in refusal(*export, "--structural", "n=0:2")
    assert "'n' must be whole numbers from 1, but is 1.5" in refusal(*export, "--structural", "n=[1 1.5]")
    assert "have 70 combinations" in refusal(*export, "--structural", "n=1:35", "--structural", "m=1:2")
    model.write_text(MODEL.replace("shape: n", "shape: 3"))
    assert "chain.yaml:" in refusal(*export, "--structural", "n=1:2")  # that size is wrong
    model.write_text(MODEL.replace('K: "ones(m,n)"', 'K: "ones(2*n,n)"'))
    text = refusal(*export, "--structural", "n=1:2")
    assert "'pairs' has as many rows as no structural parameter says (2 where n = 1, 4 where n = 2)" in text, text
    # Parameters and signals of such sizes are left out.
    model.write_text(MODEL.replace("  sum: {", '  wide: {block: Constant, value: "ones(2*n,1)"}\n  sum: {').replace("[x]", "[x, wide]"))
    run(bf, *export, "--structural", "n=1:2")
    assert not [v.name for v in fmpy.read_model_description(str(folder / "no.fmu")).modelVariables if "wide" in v.name]
    # Guards of another size leave model exchange out.
    model.write_text(MODEL.replace("block: Integrator", "block: LimitedIntegrator, lower: -5, upper: 5"))
    run(bf, *export, "--structural", "n=1:2")
    assert fmpy.validation.validate_fmu(str(folder / "no.fmu")) == []
    assert fmpy.read_model_description(str(folder / "no.fmu")).modelExchange is None

"""Derivatives of an exported FMU, directional and adjoint, in both versions: those of differences, and linearisation takes them.

Usage: derivatives.py BF EXAMPLES MODEL
"""
import ctypes
import json
import math
import pathlib
import random
import re
import sys
import tempfile
import zipfile

import fmpy
import fmpy.fmi1
import fmpy.fmi2
import fmpy.fmi3
import fmpy.validation

bf, examples, model = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import run  # noqa: E402


class Instance:
    """Of model exchange, between two steps; all numbers of variables are called by name."""

    def __init__(self, fmu):
        self.described = fmpy.read_model_description(str(fmu))
        self.is_3 = self.described.fmiVersion.startswith("3")
        kind = fmpy.fmi3.FMU3Model if self.is_3 else fmpy.fmi2.FMU2Model
        self.messages = []
        self.fmu = kind(
            guid=self.described.guid or self.described.instantiationToken, unzipDirectory=fmpy.extract(str(fmu)),
            modelIdentifier=self.described.modelExchange.modelIdentifier, instanceName="one")
        if self.is_3:
            self.fmu.instantiate(logMessage=lambda _, status, category, text: self.messages.append(text.decode()))
        else:
            callbacks = fmpy.fmi2.fmi2CallbackFunctions()
            callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(
                lambda _, name, status, category, text: self.messages.append(text.decode()))
            self.fmu.instantiate(callbacks=callbacks)
            self.fmu.setupExperiment(startTime=0.0)
        self.variables = {}
        for v in self.described.modelVariables:
            self.variables.setdefault(v.name if self.is_3 else v.name.split("[")[0], []).append(v)
        self.rates = [d.variable for d in self.described.derivatives]
        self.states = sum(self.count(v) for v in self.rates)

    def begin(self):
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def go_on(self):
        (self.fmu.updateDiscreteStates if self.is_3 else self.fmu.newDiscreteStates)()
        self.fmu.enterContinuousTimeMode()

    @staticmethod
    def count(v):
        return math.prod(int(d.start) for d in v.dimensions) if v.dimensions else 1

    def get(self, variables):
        references = [v.valueReference for v in variables]
        if self.is_3:
            return list(self.fmu.getFloat64(references, sum(map(self.count, variables))))
        return list(self.fmu.getReal(references))

    def put(self, states, inputs, values):
        rows = (ctypes.c_double * self.states)(*values[:self.states])
        self.fmu.setContinuousStates(rows, self.states)
        (self.fmu.setFloat64 if self.is_3 else self.fmu.setReal)([v.valueReference for v in inputs], values[self.states:])

    def directional(self, unknowns, knowns, seed):
        of, by = ([v.valueReference for v in its] for its in (unknowns, knowns))
        if not self.is_3:
            return list(self.fmu.getDirectionalDerivative(of, by, seed))
        return list(self.fmu.getDirectionalDerivative(of, by, seed, sum(map(self.count, unknowns))))

    def adjoint(self, unknowns, knowns, seed):
        of, by = ([v.valueReference for v in its] for its in (unknowns, knowns))
        return list(self.fmu.getAdjointDerivative(of, by, seed, sum(map(self.count, knowns))))

    def refused(self, *arguments):
        try:
            self.directional(*arguments)
        except fmpy.fmi1.FMICallException:
            return self.messages[-1]
        raise AssertionError("it was not refused")


def promises(fmu):
    """The kinds of derivatives that the description says it has in model exchange."""
    text = zipfile.ZipFile(fmu).read("modelDescription.xml").decode()
    return re.findall(r'provides(\w+)Derivatives?="true"', re.search("<ModelExchange[^>]*>", text)[0])


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    chance = random.Random(1)
    for version in (2, 3):
        fmu = folder / f"swing{version}.fmu"
        run(bf, "export-fmu", model, "--fmi", version, "-o", fmu, timeout=600)
        assert fmpy.validation.validate_fmu(str(fmu)) == []
        its = Instance(fmu)
        assert promises(fmu) == (["Directional", "Adjoint"] if version == 3 else ["Directional"]), promises(fmu)
        its.begin()
        inputs = its.variables["torque"] + its.variables["push"]
        states = [v.derivative for v in its.rates]
        knowns = states + inputs
        unknowns = its.rates + [v for v in its.described.modelVariables if v.causality == "output" or v.name == "weight"]
        text = its.refused(unknowns, knowns, [1.0] * 7)
        assert "those between two steps of the model, and one is under way" in text, text
        its.go_on()
        largest = 0.0
        for torque in (0.2, -0.3, 2.0, -2.0):  # on both sides of the switch, inside and outside of the limits
            here = [chance.uniform(-2, 2) for _ in range(its.states)] + [torque, 0.4, -0.1]

            def values(at):
                its.put(states, inputs, at)
                return its.get(unknowns)

            def moved(i, by):
                return [x + by * (k == i) for k, x in enumerate(here)]

            rows = []  # by columns
            for i in range(len(here)):
                h = 1e-5
                differences = [(a - b) / (2 * h) for a, b in zip(values(moved(i, h)), values(moved(i, -h)), strict=True)]
                its.put(states, inputs, here)
                seed = [float(k == i) for k in range(len(here))]
                rows.append(its.directional(unknowns, knowns, seed))
                for v, (got, wanted) in enumerate(zip(rows[-1], differences, strict=True)):
                    assert abs(got - wanted) <= 1e-7 * (1 + abs(wanted)), (version, i, v, got, wanted)
                    largest = max(largest, abs(got - wanted))
            assert sum(x != 0 for row in rows for x in row) >= 14, rows
            # Any direction is a sum of them, and the adjoint is their transpose.
            seed = [chance.uniform(-1, 1) for _ in here]
            for k, got in enumerate(its.directional(unknowns, knowns, seed)):
                assert math.isclose(got, sum(s * row[k] for s, row in zip(seed, rows)), rel_tol=1e-12, abs_tol=1e-12)
            if version == 3:
                weights = [chance.uniform(-1, 1) for _ in rows[0]]
                for row, got in zip(rows, its.adjoint(unknowns, knowns, weights), strict=True):
                    assert math.isclose(got, sum(w * x for w, x in zip(weights, row)), rel_tol=1e-12, abs_tol=1e-12)
            values(here)
        print(f"FMI {version}.0: derivatives differ by {largest:.1e} from differences")
        assert "'friction' has no derivative" in its.refused(unknowns, its.variables["friction"], [1.0])

        # `bf linearize` takes them: of the model as a block the linear system is the model's own.
        smooth = folder / "smooth.yaml"
        smooth.write_text(pathlib.Path(model).read_text().replace(", period: 0.05", ""))
        run(bf, "export-fmu", smooth, "--fmi", version, "-o", folder / "smooth.fmu", timeout=600)
        (folder / "block.yaml").write_text(
            "model: block\nplugins: [FMI]\nstep: 0.01\nsolver: rk4\ninputs: {torque: {}, push: {shape: 2}}\n"
            "outputs: [angle, energy, filtered]\nblocks:\n  f: {block: FMI/ModelExchange, fmu: smooth.fmu}\n"
            "connections:\n  torque: f.torque\n" + (
                "  push: f.push\n" if version == 3 else "  push: [one, two]\n  one: f.push_1\n  two: f.push_2\n") +
            "  f.angle: angle\n  f.energy: energy\n  f.filtered: filtered\n")
        if version == 2:
            text = (folder / "block.yaml").read_text()
            (folder / "block.yaml").write_text(text.replace(
                "connections:", "  one: {block: Selector, indices: 1}\n  two: {block: Selector, indices: 2}\nconnections:"))
        signals = ["angle", "energy", "filtered"]
        found = {}
        for name, file in (("model", smooth), ("block", folder / "block.yaml")):
            to = [x for signal in signals for x in ("--to", signal)]
            run(bf, "linearize", file, "--at", 0.2, *to, "--plugin-path", folder, "-o", folder / f"{name}.json")
            found[name] = json.loads((folder / f"{name}.json").read_text())
            assert found[name]["differenced"] == [], found[name]
        for matrix in "ABCD":
            for a, b in zip(sum(found["model"][matrix], []), sum(found["block"][matrix], []), strict=True):
                assert math.isclose(a, b, rel_tol=1e-9, abs_tol=1e-9), (version, matrix, found)
        assert abs(found["block"]["A"][0][1]) > 5, "it is that of a pendulum"

    # What is more than equations has none, and says so.
    (folder / "none.yaml").write_text(
        "model: none\nstep: 0.01\nsolver: rk4\ninputs: [u]\noutputs: [y]\nblocks:\n"
        "  table: {block: Lookup1D, breakpoints: [0, 1, 2, 3], table: [0, 1, 4, 9]}\n  x: {block: Integrator}\n"
        "connections: {u: table, table: x, x: y}\n")
    none = folder / "none.fmu"
    run(bf, "export-fmu", folder / "none.yaml", "-o", none, timeout=600)
    its = Instance(none)
    assert promises(none) == []
    its.begin()
    its.go_on()
    assert "derivatives of this model are not known" in its.refused(its.rates, its.variables["u"], [1.0])

    # The first event, in which sampled blocks compute, ends before the derivatives, and goes on afterwards.
    (folder / "sampled.yaml").write_text(
        "model: sampled\nstep: 0.01\nsolver: rk4\ninputs: [u]\noutputs: [y]\nblocks:\n"
        "  lag: {block: TransferFunction, numerator: 2, denominator: \"[1 3]\"}\n  late: {block: UnitDelay, period: 0.05}\n"
        "  sum: {block: Sum}\nconnections: {u: sum.u1, late: sum.u2, sum: lag, lag: [late, y]}\n")
    run(bf, "export-fmu", folder / "sampled.yaml", "-o", folder / "sampled.fmu", timeout=600)
    (folder / "begin.yaml").write_text("model: begin\nplugins: [FMI]\nstep: 0.01\nsolver: rk4\ninputs: [u]\noutputs: [y]\n"
                                       "blocks: {f: {block: FMI/ModelExchange, fmu: sampled.fmu}}\n"
                                       "connections: {u: f.u, f.y: y}\n")
    for at in (0, 0.1):
        run(bf, "linearize", folder / "begin.yaml", "--at", at, "--plugin-path", folder, "-o", folder / "begin.json")
        found = json.loads((folder / "begin.json").read_text())
        assert [found[m] for m in "ABCD"] == [[[-3]], [[1]], [[2]], [[0]]], (at, found)

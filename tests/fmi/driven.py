"""An exported FMU driven by hand, in both versions: inputs, types, matrices, parameters, states, instances, wrong calls.

Usage: driven.py BF EXAMPLES MODEL
"""
import ctypes
import math
import pathlib
import sys
import tempfile

import fmpy
import fmpy.fmi1
import fmpy.fmi2
import fmpy.fmi3

bf, examples, model = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import read_recording, run  # noqa: E402

STEP, STEPS = 0.01, 50


class Instance:
    """One instance, whose variables are called by name; arrays are lists, row by row."""

    def __init__(self, fmu, token=None):
        self.described = fmpy.read_model_description(str(fmu))
        self.version = int(self.described.fmiVersion[0])
        self.messages = []
        folder = str(fmu) + ".extracted"
        if not pathlib.Path(folder).exists():
            fmpy.extract(str(fmu), folder)
        kind = fmpy.fmi3.FMU3Slave if self.version == 3 else fmpy.fmi2.FMU2Slave
        self.fmu = kind(
            guid=token or self.described.guid or self.described.instantiationToken, unzipDirectory=folder,
            modelIdentifier=self.described.coSimulation.modelIdentifier, instanceName="one")
        if self.version == 3:
            self.fmu.instantiate(
                loggingOn=True, earlyReturnAllowed=True, intermediateUpdate=self._between,
                logMessage=lambda _, status, category, text: self.messages.append(text.decode()))
        else:
            log = lambda _, name, status, category, text: self.messages.append(text.decode())  # noqa: E731
            callbacks = fmpy.fmi2.fmi2CallbackFunctions()
            callbacks.logger = fmpy.fmi2.fmi2CallbackLoggerTYPE(log)
            self.fmu.instantiate(callbacks=callbacks, loggingOn=True)
        self.between = None
        names = {}
        for v in self.described.modelVariables:
            names.setdefault(v.name.split("[")[0] if self.version == 2 else v.name, []).append(v)
        self.variables = names

    def _between(self, environment, time, set_requested, get_allowed, finished, may_return, asks, when):
        if self.between:
            asks[0] = self.between(time)

    def _call(self, verb, kind):
        return getattr(self.fmu, verb + kind)

    def get(self, name):
        its = self.variables[name]
        references = [v.valueReference for v in its]
        if self.version == 2:
            return [float(x) for x in self._call("get", its[0].type)(references)]
        count = math.prod(int(d.start) for d in its[0].dimensions)
        return [float(x) for x in self._call("get", its[0].type)(references, count)]

    def set(self, name, values):
        its = self.variables[name]
        kind = {"Real": float, "Float64": float}.get(its[0].type, int)
        self._call("set", its[0].type)([v.valueReference for v in its], [kind(x) for x in values])

    def initialize(self, **parameters):
        for name, values in parameters.items():
            self.set(name, values)
        if self.version == 2:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def step(self, k, count=1):
        return self.fmu.doStep(k * STEP, count * STEP)

    def refused(self, call, *arguments):
        """What it logs when it refuses a call."""
        before = len(self.messages)
        try:
            call(*arguments)
        except fmpy.fmi1.FMICallException as error:
            assert error.status == 3, error
            assert len(self.messages) > before, "it said nothing"
            return self.messages[before]
        raise AssertionError("it was not refused")


def inputs_at(k):
    return {"push": [math.sin(k), 2.5 * k, -1.0], "steps": [3 * k - 20], "on": [k % 3]}


outputs = {"position": "plant", "product": "matrix", "counted": "sum", "chosen": "off", "late": "slow", "scaled": "scaled"}


def run_alone(instance, **parameters):
    """All outputs, step by step; inputs are written first at some instants, last at others."""
    instance.initialize(**parameters)
    rows = []
    for k in range(STEPS + 1):
        if k % 2:
            for name in outputs:
                instance.get(name)  # too early: these inputs are old
        for name, values in inputs_at(k).items():
            instance.set(name, values)
        rows.append({name: instance.get(name) for name in outputs})
        if k < STEPS:
            instance.step(k)
    return rows


def matrix_row_by_row(values, rows, columns):
    return [values[j * rows + i] for i in range(rows) for j in range(columns)]


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    with open(folder / "inputs.csv", "w") as table:
        table.write("time,push[1],push[2],push[3],steps,on\n")
        for k in range(STEPS + 1):
            at = inputs_at(k)
            table.write(",".join(map(repr, [k * STEP, *at["push"], *at["steps"], *at["on"]])) + "\n")
    run(bf, "run", model, "--quiet", "--inputs", folder / "inputs.csv", "--record", folder / "run.mcap")
    recorded = read_recording(bf, folder / "run.mcap")

    for version in (2, 3):
        fmu = folder / f"sides{version}.fmu"
        run(bf, "export-fmu", model, "--fmi", version, "-o", fmu)

        # What the simulation gives with these inputs, at every step.
        rows = run_alone(Instance(fmu))
        compared = 0
        for name, block in outputs.items():
            for time, values in recorded[block].items():
                wanted = matrix_row_by_row(values[-1], 3, 2) if name == "scaled" else values[-1]
                k = round(time / 1e9 / STEP)
                assert rows[k][name] == wanted, (version, name, k, rows[k][name], wanted)
                compared += len(wanted)
        assert compared == 386, compared

        # Several at once do not know of one another.
        one, other = Instance(fmu), Instance(fmu)
        one.initialize(k=[1.0])
        other.initialize()
        for k in range(STEPS):
            for name, values in inputs_at(k).items():
                one.set(name, values)
                other.set(name, values)
            assert other.get("position") == rows[k]["position"]
            one.step(k)
            other.step(k)
        assert one.get("position") != other.get("position")

        # What follows from a variable follows; a value outside its limits is refused and changes nothing.
        one.set("k", [3.0])
        assert one.get("twice") == [6.0] and one.get("scaled")[0] == 6.0
        assert "must be from 0 to 10, but is 11" in one.refused(one.set, "k", [11.0])
        assert one.get("k") == [3.0] and one.get("twice") == [6.0]
        assert "'twice' is computed" in one.refused(one.set, "twice", [1.0])
        assert "'slow.initial' is fixed" in one.refused(one.set, "slow.initial", [1.0])
        fixed = {v.name for v in one.described.modelVariables if v.variability == "fixed"}
        assert fixed == {"slow.initial", *(["plant.initial"] if version == 3 else
                                           [f"plant.initial[{i}]" for i in (1, 2, 3)])}, fixed

        # A state is gone back to, also from bytes and in another instance.
        save = other.fmu.getFMUState if version == 3 else other.fmu.getFMUstate
        state = save()
        end = other.get("position")
        to_bytes = other.fmu.serializeFMUState if version == 3 else other.fmu.serializeFMUstate
        saved = to_bytes(state)
        after = []
        for again in range(2):
            assert other.get("position") == end
            for k in range(STEPS, STEPS + 5):
                other.step(k)
            after.append((other.get("position"), other.get("late"), other.get("counted")))
            (other.fmu.setFMUState if version == 3 else other.fmu.setFMUstate)(state)
        assert after[0] == after[1] and after[0][0] != end
        third = Instance(fmu)
        third.initialize(k=[2.0])
        from_bytes = third.fmu.deserializeFMUState if version == 3 else third.fmu.deSerializeFMUstate
        (third.fmu.setFMUState if version == 3 else third.fmu.setFMUstate)(from_bytes(saved))
        assert third.get("k") == [4.0] and third.get("position") == end
        for k in range(STEPS, STEPS + 5):
            third.step(k)
        assert (third.get("position"), third.get("late"), third.get("counted")) == after[0]
        assert "no state of an instance of this kind" in third.refused(from_bytes, saved[:-1])
        assert "no state of an instance of this kind" in third.refused(from_bytes, b"x" * len(saved))
        for at in range(0, len(saved), max(1, len(saved) // 40)):
            damaged = saved[:at] + bytes([saved[at] ^ 4]) + saved[at + 1:]
            assert "no state of an instance of this kind" in third.refused(from_bytes, damaged), at

        # One long step has the same end as many short ones, and half ones keep the outputs in between.
        long, half = Instance(fmu), Instance(fmu)
        for instance in (long, half):
            instance.initialize()
            instance.set("push", [1.0, 2.0, 3.0])
        long.step(0, 10)
        for k in range(20):
            half.fmu.doStep(k * STEP / 2, STEP / 2)
        assert long.get("position") == half.get("position") != [1.0, 2.0, 3.0]
        if version == 3:
            seen = []
            long.between = lambda time: seen.append(time) or len(seen) == 3
            _, _, returned_early, reached = long.step(10, 10)
            assert returned_early and len(seen) == 3 and abs(reached - 0.13) < 1e-12, (seen, reached)
            seen = []
            half.between = lambda time: seen.append(round(time / STEP, 6)) or False
            half.fmu.doStep(20 * STEP / 2, 2.5 * STEP)
            half.fmu.doStep(12.5 * STEP, 1.5 * STEP)
            assert seen == [11, 12, 13], seen

        # Begun anew it gives the same; wrong calls are refused, with what is allowed.
        third.fmu.reset()
        assert run_alone(third) == rows
        wrong = Instance(fmu)
        doing = "fmi3DoStep" if version == 3 else "fmi2DoStep"
        text = wrong.refused(wrong.step, 0)
        assert text.startswith(f"{doing} is called in the state 'Instantiated', but is allowed in: Step Mode (FMI "), text
        if version == 2:
            assert "is called in the state 'Instantiated'" in wrong.refused(wrong.get, "position")
        else:  # its start value
            early = Instance(fmu)
            assert early.get("position")[:3] == [1, 2, 3]
        if version == 2:
            assert "before fmi2SetupExperiment" in wrong.refused(wrong.fmu.enterInitializationMode)
        if version == 2:
            assert "must be a number" in wrong.refused(wrong.fmu.setupExperiment, None, math.nan)
        else:
            assert "must be a number" in wrong.refused(wrong.fmu.enterInitializationMode, None, math.nan)
        wrong.initialize()
        assert "a step begins at 1 s, but the last one ended at 0 s" in wrong.refused(wrong.fmu.doStep, 1.0, STEP)
        assert "is called in the state 'error'" in wrong.refused(wrong.step, 0)
        wrong.fmu.reset()
        if version == 2:
            wrong.fmu.setupExperiment(startTime=0.0, stopTime=3 * STEP)
            wrong.fmu.enterInitializationMode()
        else:
            wrong.fmu.enterInitializationMode(startTime=0.0, stopTime=3 * STEP)
        wrong.fmu.exitInitializationMode()
        wrong.step(0, 3)
        assert "was given as the stop time (FMI 2.0, section 2.1.6; FMI 3.0, section 2.3.2)" in wrong.refused(wrong.step, 3)
        wrong.fmu.reset()
        wrong.initialize()
        wrong.step(0)
        wrong.fmu.terminate()
        assert "in the state 'Terminated'" in wrong.refused(wrong.step, 1)
        assert wrong.get("position") != [1.0, 2.0, 3.0], "values can be read after the end"
        try:
            Instance(fmu, token="{other}")
        except Exception as error:
            assert "nstantiate" in str(error), error
        else:
            raise AssertionError("another token was taken")
        if version == 3:  # States belong to one kind of instance.
            saved = early.fmu.serializeFMUState(early.fmu.getFMUState())
            exchanged = fmpy.fmi3.FMU3Model(guid=early.described.guid or early.described.instantiationToken,
                                            unzipDirectory=str(fmu) + ".extracted", instanceName="two",
                                            modelIdentifier=early.described.modelExchange.modelIdentifier)
            exchanged.instantiate(loggingOn=True, logMessage=lambda *about: early.messages.append(about[-1].decode()))
            assert "no state of an instance of this kind" in early.refused(exchanged.deserializeFMUState, saved)
            assert "an instance of the other kind" in early.refused(exchanged.setFMUState, early.fmu.getFMUState())
            exchanged.freeInstance()
            early.fmu.freeInstance()
        for instance in (one, other, third, long, half, wrong):
            instance.fmu.freeInstance()
        print(f"FMI {version}.0: {compared} numbers are the same; states, instances and wrong calls are as they should be")

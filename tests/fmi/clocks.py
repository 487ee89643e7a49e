"""FMUs with clocks: a model whose rates an importer ticks, by hand through FMPy and in our own blocks; wrong ticks and
clocks that nobody can tick are messages.

Usage: clocks.py BF EXAMPLES MODEL CC SOURCE
"""
import ctypes
import math
import pathlib
import subprocess
import sys
import tempfile
import zipfile

import fmpy
import fmpy.fmi1
import fmpy.fmi3
import fmpy.validation
import lxml.etree

bf, examples, model, compiler, source = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import read_recording, run  # noqa: E402

STEP, STEPS = 0.01, 100
outputs = {"position": "plant", "command": "gain", "counted": "counter", "late": "slow", "soon": "fast"}
ticks = {"clock_50ms": (5, 0), "clock_20ms_after_10ms": (2, 1)}  # steps of the model
clocked = {"target": ["clock_50ms"], "rough": ["clock_20ms_after_10ms"], "both": ["clock_50ms", "clock_20ms_after_10ms"],
           "command": ["clock_50ms"], "counted": ["clock_20ms_after_10ms"], "late": ["clock_50ms"],
           "soon": ["clock_20ms_after_10ms"]}
local = {"gain": ["clock_50ms"], "counter": ["clock_20ms_after_10ms"], "slow": ["clock_50ms"], "fast": ["clock_20ms_after_10ms"]}


def inputs_at(k):
    return {"push": math.sin(0.1 * k), "target": math.cos(0.3 * k), "rough": k * 0.7 % 1, "both": float(k)}


def due(k):
    return [name for name, (period, offset) in ticks.items() if k >= offset and (k - offset) % period == 0]


class Instance:
    def __init__(self, fmu, kind=fmpy.fmi3.FMU3Slave, **options):
        self.described = fmpy.read_model_description(str(fmu))
        self.messages = []
        folder = str(fmu) + ".extracted"
        if not pathlib.Path(folder).exists():
            fmpy.extract(str(fmu), folder)
        self.fmu = kind(guid=self.described.instantiationToken, unzipDirectory=folder,
                        modelIdentifier=self.described.coSimulation.modelIdentifier, instanceName="one")
        self.references = {v.name: v.valueReference for v in self.described.modelVariables}
        log = {"logMessage": lambda _, status, category, text: self.messages.append(text.decode()), "loggingOn": True}
        self.fmu.instantiate(**log, **options)

    def begin(self):
        self.fmu.enterInitializationMode(startTime=0.0)
        self.fmu.exitInitializationMode()

    def get(self, name):
        return self.fmu.getFloat64([self.references[name]])[0]

    def set(self, name, value):
        self.fmu.setFloat64([self.references[name]], [value])

    def activate(self, *names, active=True):
        self.fmu.setClock([self.references[name] for name in names], [active] * len(names))

    def update(self):
        return self.fmu.updateDiscreteStates()

    def refused(self, call, *arguments, **options):
        before = len(self.messages)
        try:
            call(*arguments, **options)
        except fmpy.fmi1.FMICallException as error:
            assert error.status == 3 and len(self.messages) > before, error
            return self.messages[before]
        raise AssertionError("it was not refused")


def is_active(name, k):
    return name not in clocked or any(clock in due(k) for clock in clocked[name])


def tick(instance, k, early):
    """The event of step k: inputs may be read before they are written."""
    instance.activate(*due(k))
    assert list(instance.fmu.getClock([instance.references[name] for name in ticks])) == [name in due(k) for name in ticks]
    if early:
        for name in outputs:
            if is_active(name, k):
                instance.get(name)
    for name, value in inputs_at(k).items():
        if is_active(name, k):
            instance.set(name, value)
    row = {name: instance.get(name) for name in outputs if is_active(name, k)}
    again, end, _, _, _, _ = instance.update()
    assert not again and not end
    return row


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    fmus = folder / "fmus"
    fmus.mkdir()
    fmu = fmus / "clocked.fmu"
    names = list(inputs_at(0))
    with open(folder / "inputs.csv", "w") as table:
        table.write(",".join(["time", *names]) + "\n")
        for k in range(STEPS + 1):
            table.write(",".join(map(repr, [k * STEP, *(inputs_at(k)[name] for name in names)])) + "\n")
    run(bf, "run", model, "--quiet", "--inputs", folder / "inputs.csv", "--record", folder / "run.mcap")
    recorded = read_recording(bf, folder / "run.mcap")

    def wanted(name, k):
        """A signal keeps its value between the hits of its rate, and is 0 before the first."""
        its = {round(time / 1e9 / STEP): values[-1][0] for time, values in recorded[outputs[name]].items()}
        return its.get(max((at for at in its if at <= k), default=None), 0.0)

    # ---- the description
    run(bf, "export-fmu", model, "--clocks", "-o", fmu)
    run(bf, "check-fmu", fmu)
    problems = fmpy.validation.validate_fmu(str(fmu))
    assert problems == [], problems
    described = fmpy.read_model_description(str(fmu))
    variables = {v.name: v for v in described.modelVariables}
    for name, v in variables.items():
        assert sorted(c.name for c in v.clocks or []) == sorted({**clocked, **local}.get(name, [])), (name, v.clocks)
    assert {name for name, v in variables.items() if v.type == "Clock"} == set(ticks)
    with zipfile.ZipFile(fmu) as archive:
        elements = lxml.etree.fromstring(archive.read("modelDescription.xml")).findall(".//Clock")
    for v, (name, (period, offset)) in zip(elements, ticks.items(), strict=True):
        v = v.attrib
        assert (v["name"], v["causality"], v["variability"], v["intervalVariability"]) == (name, "input", "discrete", "constant"), v
        assert float(v["intervalDecimal"]) == period * STEP and float(v.get("shiftDecimal", 0)) == offset * STEP, v
        assert (v["intervalCounter"], v["shiftCounter"], v["resolution"]) == (str(period), str(offset), "100"), v
    assert described.coSimulation.hasEventMode
    text = subprocess.run([bf, "export-fmu", model, "--clocks", "--fmi", "2"], capture_output=True, text=True, check=False)
    assert text.returncode == 1 and "FMI 2.0 has no clocks" in text.stderr, text
    (folder / "plain.yaml").write_text("model: plain\nstep: 0.01\nsolver: rk4\noutputs: [y]\n"
                                       "blocks: {c: {block: Constant}, x: {block: Integrator}}\nconnections: {c: x, x: y}\n")
    text = subprocess.run([bf, "export-fmu", str(folder / "plain.yaml"), "--clocks"], capture_output=True, text=True, check=False)
    assert text.returncode == 1 and "has 0 rates of sampled blocks" in text.stderr, text

    # ---- co-simulation, ticked by hand
    instance = Instance(fmu, eventModeUsed=True)
    instance.begin()
    its = [instance.references[name] for name in ticks]
    intervals, qualifiers = (ctypes.c_double * 2)(), (ctypes.c_int * 2)()
    instance.fmu.fmi3GetIntervalDecimal(instance.fmu.component, (ctypes.c_uint32 * 2)(*its), 2, intervals, qualifiers)
    assert list(intervals) == [0.05, 0.02] and list(qualifiers) == [1, 1], (list(intervals), list(qualifiers))
    counters, resolutions = (ctypes.c_uint64 * 2)(), (ctypes.c_uint64 * 2)()
    instance.fmu.fmi3GetShiftFraction(instance.fmu.component, (ctypes.c_uint32 * 2)(*its), 2, counters, resolutions)
    assert list(counters) == [0, 1] and list(resolutions) == [100, 100]
    compared, k, state, kept = 0, 0, None, {}
    while k < STEPS:
        if due(k):
            if k:
                instance.fmu.enterEventMode()
            if k == 41:
                instance.activate(*due(k))
                state = instance.fmu.getFMUState()
            row = tick(instance, k, k % 3 == 0)
            for name, value in row.items():
                if name in clocked:
                    assert value == wanted(name, k), (name, k, value, wanted(name, k))
                    compared += 1
            instance.fmu.enterStepMode()
        elif k == 0:
            instance.update()
            instance.fmu.enterStepMode()
        instance.set("push", inputs_at(k)["push"])
        assert instance.get("position") == wanted("position", k), (k, instance.get("position"), wanted("position", k))
        compared += 1
        kept[k] = instance.get("position")
        instance.fmu.doStep(k * STEP, STEP)
        k += 1
        if k == 60 and state is not None:  # back into the event, in which the clocks are active
            instance.fmu.setFMUState(state)
            state, k = None, 41
            row = tick(instance, k, False)
            assert row["counted"] == wanted("counted", k)
            instance.fmu.enterStepMode()
            instance.set("push", inputs_at(k)["push"])
            assert instance.get("position") == kept[k]
            instance.fmu.doStep(k * STEP, STEP)
            k += 1
    assert compared > 250, compared
    print(f"{compared} numbers of an FMU that was ticked by hand are the same")

    # ---- what is wrong
    try:
        Instance(fmu)
        raise AssertionError("it has clocks, but needs no event mode")
    except Exception as error:  # noqa: BLE001
        assert "AssertionError" not in repr(error), error
    its = Instance(fmu, eventModeUsed=True)
    assert "fmi3SetClock is called in the state 'Instantiated'" in its.refused(its.activate, "clock_50ms")
    its.begin()
    assert "'clock_20ms_after_10ms' does not tick at 0 s: the next to tick is 'clock_50ms', at 0 s" in its.refused(
        its.activate, "clock_20ms_after_10ms")
    assert "'command' can be read and written while its clock 'clock_50ms' is active" in its.refused(its.get, "command")
    assert "'target' can be read and written while" in its.refused(its.set, "target", 1.0)
    its.activate("clock_50ms")
    assert "'clock_50ms' cannot be deactivated" in its.refused(its.activate, "clock_50ms", active=False)
    its.activate("clock_20ms_after_10ms", active=False)  # which it is
    assert "'counted' can be read and written" in its.refused(its.get, "counted")
    its.get("command")
    its.update()
    assert "can be read and written" in its.refused(its.get, "command")
    assert "does not tick at 0 s: the next to tick is 'clock_20ms_after_10ms', at 0.01" in its.refused(its.activate, "clock_50ms")
    its.fmu.enterStepMode()
    assert "at 0.01 s, before 0.02 s, 'clock_20ms_after_10ms' ticks" in its.refused(its.fmu.doStep, 0.0, 0.02)
    its = Instance(fmu, eventModeUsed=True)
    its.begin()
    k = 0
    while k < 5:
        if due(k):
            its.activate(*due(k))
        its.update()
        its.fmu.enterStepMode()
        its.fmu.doStep(k * STEP, STEP)
        its.fmu.enterEventMode()
        k += 1
    its.activate("clock_50ms")
    assert "'clock_20ms_after_10ms' ticks at 0.05" in its.refused(its.update), its.messages
    # In model exchange a solver looks beyond a tick, but no event does.
    its = Instance(fmu, fmpy.fmi3.FMU3Model)
    its.begin()
    its.update()
    its.fmu.enterContinuousTimeMode()
    its.fmu.setTime(0.004)
    its.get("position")
    assert "at 0 s, before 0.004" in its.refused(its.fmu.enterEventMode)

    # ---- in our blocks
    # An adaptive solver looks beyond ticks: x' is what was sampled every 50 ms of a ramp, t.
    (folder / "held.yaml").write_text("model: held\nstep: 0.01\nsolver: rk4\ninputs: [u]\noutputs: [x]\nblocks:\n"
                                      "  hold: {block: ZeroOrderHold, period: 0.05}\n  i: {block: Integrator}\n"
                                      "connections: {u: hold, hold: i, i: x}\n")
    run(bf, "export-fmu", folder / "held.yaml", "--clocks", "-o", folder / "held.fmu", timeout=600)
    for solver in ("dormand_prince45", "cvode_bdf"):
        (folder / "ramp.yaml").write_text(f"model: ramp\nplugins: [FMI]\nstep: 0.05\nstop: 1.05\nsolver: {solver}\nblocks:\n"
                                          "  t: {block: Clock}\n  f: {block: FMI/ModelExchange, fmu: held.fmu}\n"
                                          "connections: {t: f.u}\nrecord: [f.x]\n")
        run(bf, "run", folder / "ramp.yaml", "--quiet", "--plugin-path", folder, "--record", folder / "ramp.mcap")
        x = read_recording(bf, folder / "ramp.mcap")["f.x"]
        assert abs(x[10**9][-1][0] - sum(0.05 * 0.05 * k for k in range(20))) < 1e-9, (solver, x)

    def wrapper(block, fmu, more="", solver="rk4", step=STEP, inputs=names):
        wires = "".join(f"  {name}: f.{name}\n" for name in inputs)
        return (f"model: wrapper\nplugins: [FMI]\nstep: {step}\nstop: 1\nsolver: {solver}\ninputs: [{', '.join(inputs)}]\n"
                f"blocks:\n  f: {{block: FMI/{block}, fmu: {fmu}{more}}}\n" + (f"connections:\n{wires}" if wires else "")
                + "record: ['f.*']\n")

    wrapped = folder / "wrapped.yaml"
    for block, more, solver in (("FMU", ", period: 0.01", "rk4"), ("FMU", ", period: 0.01, process: own", "rk4"),
                                ("ModelExchange", "", "rk4"), ("ModelExchange", "", "dormand_prince45")):
        wrapped.write_text(wrapper(block, fmu.name, more, solver))
        options = ["--set", "relative_tolerance=1e-9"] if solver != "rk4" else []
        run(bf, "run", wrapped, "--quiet", "--plugin-path", fmus, "--inputs", folder / "inputs.csv", "--record",
            folder / "wrapped.mcap", "--checkpoint-every", "0.25", *options)
        inside = read_recording(bf, folder / "wrapped.mcap")
        compared = 0
        for name in outputs:
            for time, values in inside[f"f.{name}"].items():
                k = round(time / 1e9 / STEP)
                difference = abs(values[-1][0] - wanted(name, k))
                assert difference <= (0 if solver == "rk4" else 1e-6), (block, solver, name, k, values, wanted(name, k))
                compared += 1
        assert compared >= 4 * STEPS, compared
        run(bf, "replay", folder / "wrapped.mcap", "--plugin-path", fmus, "--from", "0.6")
        print(f"FMI/{block}{more}, {solver}: {compared} numbers are the same")

    def says(text, inputs="inputs.csv"):
        wrapped.write_text(text)
        result = subprocess.run([bf, "run", str(wrapped), "--plugin-path", str(fmus), "--quiet", "--inputs", str(folder / inputs)],
                                capture_output=True, text=True, timeout=120, check=False)
        assert result.returncode == 1, result
        return result.stderr

    text = says(wrapper("FMU", fmu.name, ", period: 0.02", step=0.02))
    assert "the clock 'clock_50ms' of the FMU ticks between the steps of the block" in text, text

    text = says(wrapper("ModelExchange", fmu.name, step=0.02))
    assert "one of its clocks ticks between two steps of the model; give the model a step" in text, text

    # ---- one that somebody wrote by hand
    def by_hand(change=lambda xml: xml, defines=()):
        run(*compiler.split(), "-x", "c", "-shared", "-fPIC", *defines, f"-I{source}/fmi/include",
            f"{source}/tests/fmi/clocks.c", f"{source}/tests/fmi/others.c", "-o", folder / "ticked.so")
        with zipfile.ZipFile(fmus / "ticked.fmu", "w") as archive:
            archive.writestr("modelDescription.xml", change((pathlib.Path(source) / "tests/fmi/clocks.xml").read_text()))
            archive.write(folder / "ticked.so", "binaries/x86_64-linux/ticked.so")

    (folder / "push.csv").write_text("time,push\n" + "".join(f"{k * STEP!r},{inputs_at(k)['push']!r}\n" for k in range(STEPS + 1)))
    by_hand()
    run(bf, "check-fmu", fmus / "ticked.fmu")
    problems = fmpy.validation.validate_fmu(str(fmus / "ticked.fmu"))
    assert problems == [], problems
    for block, more in (("FMU", ", period: 0.01"), ("ModelExchange", "")):
        wrapped.write_text(wrapper(block, "ticked.fmu", more, inputs=["push"]))
        run(bf, "run", wrapped, "--quiet", "--plugin-path", fmus, "--inputs", folder / "push.csv", "--record",
            folder / "wrapped.mcap")
        inside = read_recording(bf, folder / "wrapped.mcap")
        total, count = 0.0, 0
        for k in range(STEPS):  # its fixed clock ticks every 0.03 s from 0.02 s on, its constant one every 0.1 s
            time = round(k * STEP * 1e9)
            if k >= 2 and (k - 2) % 3 == 0:
                total += inputs_at(k)["push"]
                count += 1
            assert abs(inside["f.total"][time][-1][0] - total) < 1e-12, (block, k, inside["f.total"][time], total)
            assert inside["f.count"][time][-1][0] == k // 10 + 1, (block, k, inside["f.count"][time])
    text = says(wrapper("ModelExchange", "ticked.fmu", step=0.04, solver="dormand_prince45", inputs=["push"]), "push.csv")
    assert "ticked.fmu: one of its clocks ticks between two steps of the model" in text, text
    for old, new, text in (
            ('intervalVariability="constant"', 'intervalVariability="triggered"', "its input clock 'tenth' is triggered by another FMU"),
            ('intervalVariability="constant"', 'intervalVariability="countdown"', "its input clock 'tenth' ticks at times that it finds"),
            ('intervalVariability="constant"', 'intervalVariability="changing"', "its input clock 'tenth' ticks at times that it finds"),
            ('intervalVariability="constant"', 'intervalVariability="constantly"', "'intervalVariability' is 'constantly'"),
            ('intervalVariability="constant" intervalDecimal="0.1"', 'intervalVariability="constant"', "has no intervalDecimal"),
            ('intervalDecimal="0.1"', 'intervalDecimal="-1"', "the interval of 'tenth' is -1 s"),
            ('clocks="4"', 'clocks="2"', "'count' has the clock 'total', which is none"),
            ('clocks="4"', 'clocks="77"', "'clocks' is 77, which is no variable's reference"),
            (' hasEventMode="true"', "", "it has clocks, but no event mode in which they tick"),
            ('causality="input" variability="discrete" intervalVariability="constant" intervalDecimal="0.1"',
             'causality="output" variability="discrete" intervalVariability="triggered"',
             "'count' has a value only in the ticks of 'tenth', which the FMU triggers itself")):
        by_hand(lambda xml, old=old, new=new: xml.replace(old, new, 1))
        got = says(wrapper("FMU", "ticked.fmu", ", period: 0.01", inputs=["push"]), "push.csv")
        assert text in got, (text, got)
    by_hand(defines=["-DINTERVAL=0.0"])
    got = says(wrapper("FMU", "ticked.fmu", ", period: 0.01", inputs=["push"]), "push.csv")
    assert "fmi3GetIntervalDecimal gave an interval that is not above 0" in got, got
    print("clocks of FMUs tick in our blocks; others are messages")

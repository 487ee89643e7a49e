"""Systems of FMUs (SSP): a model that becomes one and comes back gives the same numbers; what others wrote is read as the
standard says; hostile packages are messages. Where FMPy is installed it reads, validates and simulates ours.

Usage: systems.py BF EXAMPLES
"""
import importlib.util
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import zipfile

bf, examples = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import compare, read_recording, run  # noqa: E402

SPACES = " ".join(f'xmlns:{short}="http://ssp-standard.org/SSP1/SystemStructure{name}"' for short, name in
                  (("ssd", "Description"), ("ssc", "Common"), ("ssv", "ParameterValues"), ("ssm", "ParameterMapping")))

CONTROLLER = """model: controller
step: 0.01
inputs: [reference, speed]
outputs: [voltage]
variables: {Gain: {Kp: {value: 0.2, unit: V.s/rad}}}
blocks:
  error: {block: Sum, signs: +-}
  gain: {block: Gain, K: Gain.Kp}
connections: {reference: error.u1, speed: error.u2, error: gain, gain: voltage}
"""
MOTOR = """model: motor
step: 0.01
solver: rk4
inputs: [voltage]
outputs: [speed]
blocks: {motor: {block: TransferFunction, numerator: 10, denominator: "[0.2 1]"}}
connections: {voltage: motor, motor: speed}
"""
VECTORS = """model: vectors
step: 0.01
inputs: {u: {shape: 2}, steps: {type: int32}}
outputs: [y, n]
variables: {A: {value: "[1 2; 3 4]"}}
blocks: {product: {block: Gain, K: A, multiplication: K*u}, delay: {block: UnitDelay, initial: 0}}
connections: {u: product, product: y, steps: delay, delay: n}
"""
# FMUs of both kinds beside blocks that are none: with states, several rates, continuous ones, vectors, integers.
SYSTEM = """model: motor and load
doc: A loop.
plugins: [FMI]
step: 0.01
stop: 1
solver: rk4
inputs: [reference]
outputs: [angle]
variables: {k: {value: 0.5, minimum: 0}, n: int32(3)}
blocks:
  controller: {block: FMI/FMU, fmu: controller.fmu, period: 0.02, Gain_Kp: k, doc: of the speed}
  drive:
    inputs: [voltage]
    outputs: [speed, more]
    blocks:
      motor: {block: FMI/ModelExchange, fmu: motor.fmu}
      twice: {block: Gain, K: 2*k}
    connections: {voltage: motor.voltage, motor.speed: [speed, twice], twice: more}
  filter:
    inputs: [u]
    outputs: [y]
    variables: {a: 0.9}
    blocks:
      old: {block: UnitDelay, initial: 0.25, period: 0.02}
      sum: {block: Sum}
      scaled: {block: Gain, K: a*k}
    connections: {u: sum.u1, old: scaled, scaled: sum.u2, sum: [old, y]}
  integrator: {block: Integrator, initial: 1}
  start: {block: Constant, value: n}
  both: {block: Mux}
  vectors: {block: FMI/FMU, fmu: vectors.fmu, period: 0.01, A: "[1 k; 3 4]"}
connections:
  reference: [controller.reference, both.u2]
  filter: controller.speed
  controller.voltage: drive.voltage
  drive.speed: [filter, both.u1]
  drive.more: integrator
  integrator: angle
  both: vectors.u
  start: vectors.steps
layout:
  blocks:
    controller: {x: 100, y: 40, width: 80, height: 60}
    filter: {x: 200, y: 140, width: 60, height: 40, flipped: true}
    integrator: {x: 360, y: 40, width: 40, height: 60, rotated: 90}
  wires: {controller.speed: [[60, 160], [60, 84]]}
record: [controller, drive.motor, drive.more, filter, integrator, vectors.*, reference, filter.scaled]
"""

# A clocked FMU (clocked.yaml): its importer ticks it, wherever it stands.
CLOCKED = """model: clocked
plugins: [FMI]
step: 0.01
stop: 1
solver: rk4
inputs: [push, target]
outputs: [command]
blocks: {control: {block: KIND, fmu: control.fmu}}
connections: {push: [control.push, control.rough, control.both], target: control.target, control.command: command}
record: [control.*]
"""


def said(*command, code=1):
    result = subprocess.run([bf, *map(str, command)], capture_output=True, text=True, timeout=300)
    assert result.returncode == code, result
    return result.stderr


def package(file, document, files={}):
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("SystemStructure.ssd", document)
        for name, content in files.items():
            archive.writestr(name, content)
    return file


def recorded(file, *options):
    recording = folder / "run.mcap"
    run(bf, "run", file, "--quiet", "--record", recording, *options)
    return read_recording(bf, recording)


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    before = set(os.listdir(tempfile.gettempdir()))
    fmus = folder / "fmus"
    fmus.mkdir()
    for text in (CONTROLLER, MOTOR, VECTORS):
        name = re.match("model: (.*)", text)[1]
        (folder / f"{name}.yaml").write_text(text)
        run(bf, "export-fmu", folder / f"{name}.yaml", "-o", fmus / f"{name}.fmu")
    model, system = folder / "system.yaml", folder / "system.ssp"
    model.write_text(SYSTEM)
    inputs = folder / "inputs.csv"
    inputs.write_text("time,reference\n" + "".join(f"{k / 100!r},{3 + k % 17}\n" for k in range(101)))
    text = run(bf, "export-ssp", model, "-o", system, "--plugin-path", fmus, "--set", "k=0.75").stdout
    assert text.endswith("a system of 7 elements; 1 recorded signals are inside of FMUs now\n"), text

    # It comes back as what it was, without a folder of FMUs.
    original = recorded(model, "--plugin-path", fmus, "--set", "k=0.75", "--inputs", inputs)
    del original["filter.scaled"]
    got = recorded(system, "--inputs", inputs)
    count, largest, first = compare(original, got)
    assert count > 800 and largest == 0, (count, largest, first)
    assert set(got) == set(original), (set(got), set(original))
    run(bf, "export-ssp", system, "-o", folder / "again.ssp")
    with zipfile.ZipFile(system) as one, zipfile.ZipFile(folder / "again.ssp") as other:
        assert one.namelist() == other.namelist(), (one.namelist(), other.namelist())
        for name in one.namelist():
            if not name.endswith(".fmu"):
                assert one.read(name).decode().splitlines() == other.read(name).decode().splitlines(), name
        document = one.read("SystemStructure.ssd").decode()
        values = one.read("resources/parameters.ssv").decode()
        assert sorted(n for n in one.namelist() if n.endswith(".fmu")) == [
            f"resources/{n}.fmu" for n in ("both", "controller", "drive.twice", "filter", "integrator", "motor", "start", "vectors")]
    assert re.findall('name="([^"]*)"><ssv:Float64 value="([^"]*)"', values) == [
        ("controller.Gain.Kp", "0.75"), ("vectors.A", "1 0.75 3 4")], values
    assert 'implementation="ModelExchange"' in document and '<element period="0.02"/>' in document, document
    # Wires of a model carry numbers as they are, whatever units their ends have.
    mixed = folder / "mixed.yaml"
    mixed.write_text(SYSTEM.replace("inputs: [reference]", "inputs: {reference: {unit: rad/s}}").replace(
        "inputs: [voltage]", "inputs: {voltage: {unit: V}}").replace("outputs: [speed, more]", "outputs: {speed: {unit: m}, more: {unit: K}}"))
    run(bf, "export-ssp", mixed, "-o", folder / "mixed.ssp", "--plugin-path", fmus, "--set", "k=0.75")
    count, largest, first = compare(got, recorded(folder / "mixed.ssp", "--inputs", inputs))
    assert count > 800 and largest == 0, (count, largest, first)
    # Other verbs take it as well, and its parameters may be changed.
    run(bf, "check", system)
    slower = recorded(system, "--inputs", inputs, "--set", "controller.Gain_Kp=0.1")
    assert slower["controller"] != got["controller"]
    print(f"{count} numbers are the same in the system that the model became")

    # What cannot become one, by name.
    model.write_text("model: alone\nstep: 0.1\nblocks: {one: {block: Constant, value: 1}}\n")
    assert "it has no FMU; export it as one (bf export-fmu)" in said("export-ssp", model)
    model.write_text(SYSTEM.replace("value: n}", "value: 3}"))
    assert ("'start.value' is a scalar of type int32 by the wires around it, and by itself a scalar of type double; give it a value of that "
            "type and size, or put a Convert behind it") in said("export-ssp", model, "--plugin-path", fmus)
    model.write_text("model: when\nplugins: [FMI]\nstep: 0.01\nstop: 1\nblocks:\n  on: {block: Constant, value: 1}\n  some:\n"
                     "    execution: enabled\n    blocks: {m: {block: FMI/FMU, fmu: motor.fmu, period: 0.01}}\n"
                     "connections: {on: some.enable}\n")
    text = said("export-ssp", model, "--plugin-path", fmus)
    assert "the subsystem 'some' has FMUs and runs under a condition or several times" in text, text

    # A package that somebody else wrote: hierarchy, units, mappings, names that are none here, no step.
    def component(name, source, connectors, more=""):
        inner = "".join(f'<ssd:Connector name="{c}" kind="{kind}"><ssc:Real{unit and f" unit={unit!r}"}/></ssd:Connector>'
                        for c, kind, unit in connectors)
        return f'<ssd:Component name="{name}" source="resources/{source}.fmu"><ssd:Connectors>{inner}</ssd:Connectors>{more}</ssd:Component>'

    controller = component("my.controller", "controller", [("reference", "input", ""), ("speed", "input", "rad/s"), ("voltage", "output", "")],
                           '<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="p">'
                           '<ssv:Parameters><ssv:Parameter name="Gain.Kp"><ssv:Real value="9"/></ssv:Parameter><ssv:Parameter '
                           'name="reference"><ssv:Real value="4"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>'
                           '</ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>')
    foreign = (f'<?xml version="1.0" encoding="UTF-8"?><ssd:SystemStructureDescription version="1.0" name="foreign" {SPACES}>'
               '<ssd:System name="root"><ssd:Connectors><ssd:Connector name="speed" kind="output"><ssc:Real unit="deg/s"/>'
               '</ssd:Connector></ssd:Connectors><ssd:ParameterBindings><ssd:ParameterBinding source="resources/v.ssv">'
               '<ssd:ParameterMapping source="resources/m.ssm"/></ssd:ParameterBinding></ssd:ParameterBindings><ssd:Elements>'
               + controller + '<ssd:System name="drive"><ssd:Connectors><ssd:Connector name="u" kind="input"/><ssd:Connector name="w" '
               'kind="output"><ssc:Real unit="rad/s"/></ssd:Connector></ssd:Connectors><ssd:Elements>'
               + component("m", "motor", [("voltage", "input", ""), ("speed", "output", "rad/s")])
               + '</ssd:Elements><ssd:Connections><ssd:Connection startConnector="u" endElement="m" endConnector="voltage">'
               '<ssc:LinearTransformation factor="2" offset="0.5"/></ssd:Connection><ssd:Connection startElement="m" '
               'startConnector="speed" endConnector="w"/></ssd:Connections></ssd:System></ssd:Elements><ssd:Connections>'
               '<ssd:Connection startElement="my.controller" startConnector="voltage" endElement="drive" endConnector="u"/>'
               '<ssd:Connection startElement="drive" startConnector="w" endElement="my.controller" endConnector="speed"/>'
               '<ssd:Connection startElement="drive" startConnector="w" endConnector="speed"/></ssd:Connections></ssd:System>'
               '<ssd:Units><ssc:Unit name="rad/s"><ssc:BaseUnit rad="1" s="-1"/></ssc:Unit><ssc:Unit name="deg/s"><ssc:BaseUnit '
               'rad="1" s="-1" factor="0.017453292519943295"/></ssc:Unit></ssd:Units>'
               '<ssd:DefaultExperiment stopTime="0.5"/></ssd:SystemStructureDescription>')
    resources = {"resources/v.ssv": f'<ssv:ParameterSet version="1.0" name="v" {SPACES}><ssv:Parameters><ssv:Parameter name="gain">'
                                    '<ssv:Real value="5"/></ssv:Parameter><ssv:Parameter name="more"><ssv:Real value="1"/></ssv:Parameter>'
                                    '</ssv:Parameters></ssv:ParameterSet>',
                 "resources/m.ssm": f'<ssm:ParameterMapping version="1.0" {SPACES}><ssm:MappingEntry source="gain" '
                                    'target="my.controller.Gain.Kp"><ssc:LinearTransformation factor="0.01"/></ssm:MappingEntry>'
                                    '</ssm:ParameterMapping>',
                 **{f"resources/{n}.fmu": (fmus / f"{n}.fmu").read_bytes() for n in ("controller", "motor")}}
    other = package(folder / "other.ssp", foreign, resources)
    got = recorded(other)
    # What leads nowhere is told, with its place; a name that is given twice in one set is refused.
    for (file, old, new), warning in {
            ("m.ssm", "my.controller.Gain.Kp", "my.controller.Gain.Kq"):
                "resources/m.ssm:1: 'my.controller.Gain.Kq' is given a value, but nothing takes it",
            ("m.ssm", "my.controller.Gain.Kp", "none.Gain.Kp"): "resources/m.ssm:1: 'none.Gain.Kp' is given a value, but nothing takes it",
            ("m.ssm", 'source="gain"', 'source="gian"'):
                "resources/m.ssm:1: no parameter 'gian' is given, so that nothing is mapped to 'my.controller.Gain.Kp'"}.items():
        misspelled = package(folder / "misspelled.ssp", foreign, {
            **resources, f"resources/{file}": resources[f"resources/{file}"].replace(old, new)})
        result = subprocess.run([bf, "run", str(misspelled), "--quiet"], capture_output=True, text=True, check=True)
        assert f"misspelled.ssp: {warning}" in result.stderr, result.stderr
    package(folder / "twice.ssp", foreign, {**resources, "resources/v.ssv": resources["resources/v.ssv"].replace('"more"', '"gain"')})
    assert "resources/v.ssv:1: two parameters of the set are called 'gain' (SSP 2.0, section 6.3)" in said("run", folder / "twice.ssp")
    # The same loop by hand: the FMU of the motor holds its input during a step, Kp = 0.05 from outside, u = 2 v + 0.5.
    w, a = 0.0, None
    by_hand = folder / "by_hand.yaml"
    by_hand.write_text("model: by_hand\nplugins: [FMI]\nstep: 0.01\nstop: 0.5\nblocks:\n  four: {block: Constant, value: 4}\n"
                       "  c: {block: FMI/FMU, fmu: controller.fmu, period: 0.01, Gain_Kp: 0.05}\n  two: {block: Gain, K: 2}\n"
                       "  half: {block: Bias, bias: 0.5}\n  m: {block: FMI/FMU, fmu: motor.fmu, period: 0.01}\n"
                       "  degrees: {block: Gain, K: 1/0.017453292519943295}\nconnections:\n  four: c.reference\n  m.speed: [c.speed, degrees]\n"
                       "  c.voltage: two\n  two: half\n  half: m.voltage\nrecord: [c.voltage, m.speed, degrees]\n")
    expected = recorded(by_hand, "--plugin-path", fmus)
    names = {"c.voltage": "my_controller.voltage", "m.speed": "drive.m.speed", "degrees": "speed K.y"}
    names = {a: next(n for n in got if n in (b, b.removesuffix(".y"))) for a, b in names.items()}
    count, largest, first = compare({names[k]: v for k, v in expected.items()}, got)
    assert count == 150 and largest == 0, (count, largest, first, names)
    # With another step the FMUs do others, too.
    by_hand.write_text(by_hand.read_text().replace("step: 0.01", "step: 0.02").replace("period: 0.01", "period: 0.02"))
    expected = recorded(by_hand, "--plugin-path", fmus)
    count, largest, first = compare({names[k]: v for k, v in expected.items()}, recorded(other, "--set", "step=0.02"))
    assert count == 75 and largest == 0, (count, largest, first, names)
    print("a system of another tool is what its document says")

    # Clocks are connectors of the system, and are ticked there.
    run(bf, "export-fmu", pathlib.Path(__file__).with_name("clocked.yaml"), "--clocks", "-o", fmus / "control.fmu")
    inputs.write_text("time,push,target\n" + "".join(f"{k / 100!r},{3 + k % 17},{k * 7 % 5}\n" for k in range(101)))
    for kind in ("FMI/ModelExchange", "FMI/FMU, period: 0.01"):
        clocked, ticked = folder / "clocked.yaml", folder / "clocked.ssp"
        clocked.write_text(CLOCKED.replace("KIND", kind))
        run(bf, "export-ssp", clocked, "-o", ticked, "--plugin-path", fmus)
        expected = recorded(clocked, "--plugin-path", fmus, "--inputs", inputs)
        assert len({values[-1][0] for values in expected["control.command"].values()}) > 15, expected["control.command"]
        count, largest, first = compare(expected, recorded(ticked, "--inputs", inputs))
        assert count > 500 and largest == 0, (kind, count, largest, first)
        run(bf, "export-ssp", ticked, "-o", folder / "again.ssp")
        with zipfile.ZipFile(ticked) as one, zipfile.ZipFile(folder / "again.ssp") as other_one:
            with_clocks = one.read("SystemStructure.ssd").decode()
            assert with_clocks == other_one.read("SystemStructure.ssd").decode()
    assert re.findall('"(clock_[^"]*)" kind="input"><ssc:Clock ([^/]*)/>', with_clocks) == [
        ("clock_50ms", 'intervalVariability="constant" intervalDecimal="0.05" supportsFraction="true" resolution="100" '
                       'intervalCounter="5" shiftCounter="0"'),
        ("clock_20ms_after_10ms", 'intervalVariability="constant" intervalDecimal="0.02" shiftDecimal="0.01" '
                                  'supportsFraction="true" resolution="100" intervalCounter="2" shiftCounter="1"')], with_clocks
    for of_connector in ('name="both" kind="input"><ssc:Float64/><ssd:Clock name="clock_50ms"/><ssd:Clock name="clock_20ms_after_10ms"/>',
                         'name="command" kind="output"><ssc:Float64/><ssd:Clock name="clock_50ms"/>', 'name="push" kind="input"><ssc:Float64/>'):
        assert f"<ssd:Connector {of_connector}</ssd:Connector>" in with_clocks, with_clocks
    print(f"{count} numbers of a clocked FMU are the same in the system")

    # Without our notes, and of an FMU that names no step, one is found to which all ticks belong. A clock of the system
    # that is connected to one of an FMU ticks with it.
    with zipfile.ZipFile(fmus / "control.fmu") as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    said_of_steps = re.compile(' (fixedInternalStepSize|stepSize)="[^"]*"')
    files["modelDescription.xml"], n = said_of_steps.subn("", files["modelDescription.xml"].decode())
    assert n > 0
    with zipfile.ZipFile(folder / "control.fmu", "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    plain = re.sub(r"<ssd:Annotations>.*?</ssd:Annotations>", "", with_clocks, flags=re.S)
    assert plain.count("<ssd:Connectors>") == 2
    plain = plain.replace("<ssd:Connectors>", '<ssd:Connectors><ssd:Connector name="tick" kind="input"><ssc:Clock '
                          'intervalVariability="constant" intervalDecimal="0.05"/></ssd:Connector>', 1).replace(
        "<ssd:Connections>", '<ssd:Connections><ssd:Connection startConnector="tick" endElement="control" endConnector="clock_50ms"/>', 1)
    with_ticks = {"resources/control.fmu": (folder / "control.fmu").read_bytes()}
    got = recorded(package(folder / "plain.ssp", plain, with_ticks), "--inputs", inputs)
    expected = {name: values for name, values in expected.items() if name.startswith("control.")}
    count, largest, first = compare(expected, got)
    assert count == 500 and largest == 0, (count, largest, first)
    assert all(got[name].keys() == values.keys() for name, values in expected.items()), "the step is another one"

    def wrong(old, new):
        assert plain.count(old) >= 1, old
        return said("run", package(folder / "bad.ssp", plain.replace(old, new, 1), with_ticks))

    assert ("the clock 'tick' ticks every 0.04 s from 0 s on, but by 'control.clock_50ms' every 0.05 s from 0 s on; give both the same "
            "interval and shift" in wrong('intervalVariability="constant" intervalDecimal="0.05"/>', 'intervalVariability="constant" intervalDecimal="0.04"/>'))
    assert "the clock 'control.clock_50ms' ticks every 0.1 s from 0 s on, but by resources/control.fmu every 0.05 s" in wrong(
        'intervalDecimal="0.05" supports', 'intervalDecimal="0.1" supports')
    assert "'target' and 'control.clock_50ms' are connected, of which one is a clock and the other none" in wrong(
        'startConnector="tick"', 'startConnector="target"')
    assert "'target' has the clock 'tack', which is no clock of 'control' (SSP 2.0, section 5.2.1)" in wrong(
        '<ssd:Clock name="clock_50ms"/>', '<ssd:Clock name="tack"/>')
    assert "the interval of 'tick' is -1 s, but must be a number above 0" in wrong('intervalDecimal="0.05"/>', 'intervalDecimal="-1"/>')
    print("clocks of a system of another tool tick, and those that contradict each other are messages")

    # Hostile and broken packages.
    def refusal(document=foreign, files=resources):
        return said("run", package(folder / "bad.ssp", document, files))

    assert "bad.ssp: it holds the file '../x', which leaves its folder; a system structure package's files are named " \
           "relative to its root (SSP 2.0, chapter 3)" in refusal(files={"../x": ""})
    assert "there is no file 'resources/controller.fmu' in the package" in refusal(files={n: c for n, c in resources.items() if "controller" not in n})
    assert "is no file of the package" in refusal(foreign.replace("resources/motor.fmu", "../fmus/motor.fmu"))
    bomb = '<!DOCTYPE x [<!ENTITY a "' + "x" * 1000 + '">]>'
    assert "&a;" not in refusal(foreign.replace("<ssd:System ", bomb + "<ssd:System ", 1).replace('name="root"', 'name="&a;"').replace(
        'name="m"', 'name="my.controller"'))
    assert "is no variable of resources/motor.fmu" in refusal(foreign.replace('name="speed" kind="output"><ssc:Real unit=\'rad/s\'', 'name="spin" kind="output"><ssc:Real unit=\'rad/s\'')
                                                              .replace('startElement="m" startConnector="speed"', 'startElement="m" startConnector="spin"')), refusal()
    for kind, what in (("Boolean value='true'", "a boolean"), ("String value='4'", "a text")):
        assert f"'my.controller.reference' is a number, but is given {what}; give it a value of its type" in refusal(
            foreign.replace('<ssv:Real value="4"/>', f"<ssv:{kind}/>")), kind
    assert ("the connector 'm.voltage' has 3 x 2 elements, but the variable of resources/motor.fmu has 1 (SSP 2.0, section 5.2.1)"
            in refusal(foreign.replace('kind="input"><ssc:Real/></ssd:Connector><ssd:Connector name="speed" kind="output">',
                                       'kind="input"><ssc:Real/><ssc:Dimension size="3"/><ssc:Dimension size="2"/></ssd:Connector>'
                                       '<ssd:Connector name="speed" kind="output">'))), refusal()
    assert "its experiment begins at 1 s" in refusal(foreign.replace('stopTime="0.5"', 'startTime="1" stopTime="2"'))
    assert "it is no ZIP archive" in (folder / "bad.ssp").write_text("PK") * "" + said("run", folder / "bad.ssp")
    left = {name for name in os.listdir(tempfile.gettempdir()) if name.startswith("bf_")} - before
    assert not {name for name in left if "system" in name or "part" in name}, left
    print("bad systems are messages, and leave nothing behind")

    # Other tools read it: the schemas of SSP 2.0, and FMPy, which simulates systems of FMI 2.0 for co-simulation.
    if importlib.util.find_spec("pyssp_standard"):
        from lxml import etree
        schemas = pathlib.Path(importlib.util.find_spec("pyssp_standard").origin).parent / "resources/ssp2"
        for name, schema, content in (("SystemStructure.ssd", "Description", document), ("parameters.ssv", "ParameterValues", values),
                                      ("clocked", "Description", with_clocks)):
            validator = etree.XMLSchema(etree.parse(schemas / f"SystemStructure{schema}.xsd"))
            validator.assertValid(etree.fromstring(content.encode()))
        print("it is valid by the schemas of SSP 2.0")
    if importlib.util.find_spec("fmpy"):
        from fmpy.ssp.simulation import simulate_ssp
        from fmpy.ssp.ssd import read_ssd
        # FMPy hands signals on after each step, so that it is compared where outputs follow from states alone.
        (folder / "loop.yaml").write_text(
            "model: loop\nplugins: [FMI]\nstep: 0.01\nstop: 0.5\nblocks:\n"
            "  a: {block: FMI/FMU, fmu: delay.fmu, period: 0.01, K: -0.5}\n  b: {block: FMI/FMU, fmu: delay.fmu, period: 0.01, K: 0.75}\n"
            "  one: {block: DiscreteIntegrator, gain: 0.25}\n"
            "connections: {a.y: b.u, b.y: one, one: a.u}\nrecord: [a, b, one]\n")
        (folder / "delay.yaml").write_text(
            "model: delay\nstep: 0.01\ninputs: [u]\noutputs: [y]\nvariables: {K: 1}\nblocks: {g: {block: Gain, K: K}, s: {block: Bias, bias: 1}, "
            "d: {block: UnitDelay}}\nconnections: {u: g, g: s, s: d, d: y}\n")
        run(bf, "export-fmu", folder / "delay.yaml", "--fmi", 2, "-o", fmus / "delay.fmu")
        run(bf, "export-ssp", folder / "loop.yaml", "--fmi", 2, "-o", folder / "loop.ssp", "--plugin-path", fmus)
        parameters = read_ssd(folder / "loop.ssp").system.parameterBindings[0].parameterValues[0]
        assert {p.name: float(p.value) for p in parameters.parameters} == {"a.K": -0.5, "b.K": 0.75}
        theirs = simulate_ssp(str(folder / "loop.ssp"), stop_time=0.495, step_size=0.01, parameter_set=parameters)
        ours = recorded(folder / "loop.ssp")
        numbers = 0
        for name, block in (("a.y", "a"), ("b.y", "b"), ("one.y", "one")):
            for k in range(49):
                its, own = theirs[name][k], ours[block][(k + 1) * 10_000_000][-1][0]
                assert its == own, (name, k, its, own)
                numbers += 1
        print(f"FMPy gives the same {numbers} numbers")

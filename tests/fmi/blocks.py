"""Single blocks, and enumerations, as FMUs: FMPy finds nothing wrong with them and simulates what the blocks say.

Usage: blocks.py BF EXAMPLES
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import zipfile

import fmpy
import fmpy.fmi1
import fmpy.fmi2
import fmpy.fmi3
import fmpy.validation
import lxml.etree
import numpy

bf, examples = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import read_recording, run  # noqa: E402

STEP, STEPS = 0.01, 20
terminals = lxml.etree.XMLSchema(file=str(pathlib.Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd"))


def exported(folder, what, *options):
    fmu = folder / "block.fmu"
    run(bf, "export-fmu", what, *options, "-o", fmu, timeout=900)
    run(bf, "check-fmu", fmu)
    problems = fmpy.validation.validate_fmu(str(fmu))
    assert problems == [], problems
    with zipfile.ZipFile(fmu) as archive:
        if "terminalsAndIcons/terminalsAndIcons.xml" in archive.namelist():
            terminals.assertValid(lxml.etree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml")))
    return str(fmu)


def simulated(fmu, output, **start_values):
    result = fmpy.simulate_fmu(fmu, fmi_type="CoSimulation", step_size=STEP, output_interval=STEP, stop_time=STEP * STEPS,
                               output=[output], start_values=start_values, use_event_mode=False)
    return numpy.asarray([numpy.asarray(x, dtype=float) for x in result[output]])


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    K, u = numpy.array([[1, 2], [3, 4], [5, 6]]), [0.5, -2]
    for version in ("2", "3"):
        fmu = exported(folder, "Gain", "--set", "K=[1 2; 3 4; 5 6]", "--set", "multiplication=K*u", "--set", "u=2", "--fmi", version)
        if version == "3":
            assert numpy.array_equal(simulated(fmu, "y", u=u)[-1], K @ u)
        else:
            got = [simulated(fmu, f"y[{i + 1}]", **{f"u[{j + 1}]": u[j] for j in range(2)})[-1] for i in range(3)]
            assert numpy.array_equal(got, K @ u), got
    fmu = exported(folder, "Integrator", "--set", "initial=2", "--set", f"step={STEP}")
    y = simulated(fmu, "y", u=3.0)
    assert numpy.allclose(y, 2 + 3 * STEP * numpy.arange(STEPS + 1), rtol=0, atol=1e-12), y
    fmu = exported(folder, "Sum", "--set", "signs=+-+")
    assert simulated(fmu, "y", u1=1.0, u2=10.0, u3=100.0)[-1] == 91

    # A plugin's block with a robot from a file, which the FMU brings along, in FMI 2.0.
    robot = folder / "robot"
    robot.mkdir()
    shutil.copy(pathlib.Path(examples, "two_robots/arm.urdf"), robot)
    (robot / "model.yaml").write_text(
        f"model: kinematics\nplugins: [WholeBodyToolbox]\nstep: {STEP}\nstop: {STEP}\ninputs: {{s: {{shape: 3}}}}\n"
        "outputs: [pose]\nblocks:\n  arm: {block: WholeBodyToolbox/Configuration, robot: arm.urdf, floating_base: false}\n"
        "  tip: {block: WholeBodyToolbox/ForwardKinematics, frame: tip}\n  base: {block: Constant, value: eye(4)}\n"
        "connections: {s: tip.s, base: tip.w_H_b, tip: pose}\nrecord: [tip]\n")
    (folder / "s.csv").write_text("time,s[1],s[2],s[3]\n0,0.3,-0.4,0.5\n1,0.3,-0.4,0.5\n")
    run(bf, "run", robot / "model.yaml", "--quiet", "--inputs", folder / "s.csv", "--record", folder / "run.mcap")
    fmu = exported(folder, robot / "model.yaml", "--fmi", "2")
    shutil.rmtree(robot)
    expected = numpy.reshape(read_recording(bf, folder / "run.mcap")["tip"][0][0], (4, 4), order="F")  # column by column
    got = [[simulated(fmu, f"pose[{i + 1},{j + 1}]", **{"s[1]": 0.3, "s[2]": -0.4, "s[3]": 0.5})[-1] for j in range(4)]
           for i in range(4)]
    assert numpy.array_equal(got, expected) and not numpy.array_equal(got, numpy.eye(4)), (got, expected)

    # What is no block is said with what is like it.
    result = subprocess.run([bf, "export-fmu", "Gian"], capture_output=True, text=True, cwd=folder, check=False)
    assert result.returncode == 1 and "there is no block 'Gian'; did you mean 'Gain'" in result.stderr, result
    result = subprocess.run([bf, "export-fmu", "Gain", "--set", "k=2"], capture_output=True, text=True, cwd=folder, check=False)
    assert result.returncode == 1 and "'k'" in result.stderr and "'K'" in result.stderr, result

    result = subprocess.run([bf, "export-fmu", "Integrator", "--set", "solver=dormand_prince45"], capture_output=True, text=True,
                            cwd=folder, check=False)
    assert result.returncode == 1 and result.stderr.rstrip().endswith("with fixed steps, e.g. solver: rk4"), result

    # A run that ends before it begins is refused.
    for version, kind in ((2, fmpy.fmi2.FMU2Slave), (3, fmpy.fmi3.FMU3Slave)):
        fmu = exported(folder, "Gain", "--fmi", version)
        described = fmpy.read_model_description(fmu)
        instance = kind(guid=described.guid or described.instantiationToken, unzipDirectory=fmpy.extract(fmu),
                        modelIdentifier=described.coSimulation.modelIdentifier, instanceName="one")
        instance.instantiate()
        begin = instance.setupExperiment if version == 2 else instance.enterInitializationMode
        try:
            begin(startTime=1.0, stopTime=0.5)
            raise AssertionError("a stop before the start was taken")
        except fmpy.fmi1.FMICallException:
            pass
        begin(startTime=0.5, stopTime=1.0)
        instance.freeInstance()

    # Enumerations keep the names of their values; FMI 3.0 has them in 64 bits, the model in 32.
    model = folder / "modes.yaml"
    model.write_text(
        f"model: modes\nstep: {STEP}\nenumerations: {{Mode: [rest, walk], Level: {{low: -1, high: 7}}}}\n"
        "inputs: {mode: {type: Mode}, level: {type: Level}, n: {type: int32}}\n"
        "outputs: {next: {type: Mode}, sum: {type: int32}}\n"
        "blocks:\n  one: {block: Constant, value: int32(1)}\n  other: {block: Sum, signs: +-}\n  add: {block: Sum, signs: ++}\n"
        "connections: {one: other.u1, mode: other.u2, other: next, level: add.u1, n: add.u2, add: sum}\n")
    for version in (2, 3):
        fmu = exported(folder, model, "--fmi", version)
        described = fmpy.read_model_description(fmu)
        types = {t.name: {i.name: int(i.value) for i in t.items} for t in described.typeDefinitions}
        assert list(types.values()) == [{"rest": 0, "walk": 1}, {"low": -1, "high": 7}], types
        declared = {v.name: v.declaredType.name if v.declaredType else None for v in described.modelVariables}
        assert declared["mode"] == declared["next"] != declared["level"] and declared["sum"] is None, declared
        assert simulated(fmu, "next", mode=1)[-1] == 0 and simulated(fmu, "next", mode=0)[-1] == 1
        assert simulated(fmu, "sum", level=7, n=35)[-1] == 42
        # An enumeration without a 0 begins with its first value.
        assert [float(v.start) for v in described.modelVariables if v.name in ("mode", "level")] == [0, -1]
        assert simulated(fmu, "sum", n=35)[-1] == 34
        with zipfile.ZipFile(fmu) as archive, zipfile.ZipFile(folder / "wrong.fmu", "w") as wrong:
            for name in archive.namelist():
                content = archive.read(name)
                wrong.writestr(name, content.replace(b'start="-1"', b'start="3"') if name == "modelDescription.xml" else content)
        text = subprocess.run([bf, "check-fmu", folder / "wrong.fmu", "--description-only"], capture_output=True, text=True,
                              check=False).stderr
        assert "'level' starts at 3, which its type 'type of level' has not" in text, text
        if version == 3:
            try:
                simulated(fmu, "sum", level=2**32)
                raise AssertionError("2^32 was taken")
            except fmpy.fmi1.FMICallException:
                pass
    print("blocks and enumerations are as they should be")

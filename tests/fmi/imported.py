"""FMUs as blocks: an exported model gives in a block what it gives alone, bit for bit; bad FMUs are messages.

Usage: imported.py BF EXAMPLES MODEL CXX SOURCE
"""
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import zipfile

bf, examples, model, compiler, source = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import read_recording, run  # noqa: E402

STEP, STEPS = 0.01, 50
outputs = {"position": "plant", "product": "matrix", "counted": "sum", "chosen": "off", "late": "slow"}


def wrapper(fmu, inputs, connections="", record="['*']"):
    wires = "".join(f"  {name}: f.{name}\n" for name in inputs)
    return (f"model: wrapper\nplugins: [FMI]\nstep: {STEP}\nstop: {STEPS * STEP}\ninputs: [{', '.join(inputs)}]\n"
            f"blocks:\n  f: {{block: FMI/FMU, fmu: {fmu}, period: {STEP}}}\n"
            + (f"connections:\n{wires}{connections}" if wires else "") + f"record: {record}\n")


def said(*command):
    result = subprocess.run([bf, *map(str, command)], capture_output=True, text=True, timeout=120)
    assert result.returncode == 1, result
    return result.stderr


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    before = set(os.listdir(tempfile.gettempdir()))
    fmus = folder / "fmus"
    fmus.mkdir()
    columns = ["push[1]", "push[2]", "push[3]", "steps", "on"]
    table = [[k * STEP, math.sin(k), 2.5 * k, -1.0, 3 * k - 20, k % 3] for k in range(STEPS + 1)]

    def write_inputs(file, names):
        file.write_text("\n".join([",".join(["time", *names]), *(",".join(map(repr, row)) for row in table)]) + "\n")
        return file

    alone = write_inputs(folder / "alone.csv", columns)
    run(bf, "run", model, "--quiet", "--inputs", alone, "--record", folder / "alone.mcap")
    recorded = read_recording(bf, folder / "alone.mcap")
    for version in (2, 3):
        fmu = fmus / f"sides{version}.fmu"
        run(bf, "export-fmu", model, "--fmi", version, "-o", fmu)
        # Any importer compiles its sources, whatever it asks its compiler.
        with zipfile.ZipFile(fmu) as archive:
            archive.extractall(folder / f"sides{version}")
        for file in (folder / f"sides{version}/sources").glob("*.cpp"):
            run("c++", "-std=c++17", "-Wall", "-Wextra", "-pedantic", "-Werror", "-fsyntax-only", f"-I{file.parent}", file)
        wrapped = folder / f"wrapper{version}.yaml"
        names = ["push", "steps", "on"] if version == 3 else ["push_1", "push_2", "push_3", "steps", "on"]
        wrapped.write_text(wrapper(fmu.name, names))
        inputs = alone if version == 3 else write_inputs(folder / "scalars.csv", names)
        recording = folder / f"wrapped{version}.mcap"
        run(bf, "run", wrapped, "--plugin-path", fmus, "--quiet", "--inputs", inputs, "--record", recording,
            "--checkpoint-every", "0.1")
        got = read_recording(bf, recording)
        compared = 0
        for name, block in outputs.items():
            for time, values in recorded[block].items():
                if version == 3 or len(values[-1]) == 1:
                    its = got[f"f.{name}"][time][-1]
                else:
                    its = [got[f"f.{name}_{i + 1}"][time][-1][0] for i in range(len(values[-1]))]
                assert its == values[-1], (version, name, time, its, values[-1])
                compared += len(its)
        assert compared == 380, compared

        # Its state is in the snapshots of the recording: it goes on from there.
        text = run(bf, "replay", recording, "--plugin-path", fmus, "--from", "0.35").stdout
        assert "0.3" in text, text
        run(bf, "replay", recording, "--plugin-path", fmus)

        # In a process of its own it does the same.
        text = wrapped.read_text()
        wrapped.write_text(text.replace("FMI/FMU,", "FMI/FMU, process: own,"))
        run(bf, "run", wrapped, "--plugin-path", fmus, "--quiet", "--inputs", inputs, "--record", folder / "own.mcap",
            "--checkpoint-every", "0.1")
        assert read_recording(bf, folder / "own.mcap") == got
        run(bf, "replay", folder / "own.mcap", "--plugin-path", fmus, "--from", "0.35")
        wrapped.write_text(text)

        # Parameters are those of the description, with its limits; they may change in the run.
        run(bf, "run", wrapped, "--plugin-path", fmus, "--quiet", "--inputs", inputs, "--set", "f.k=1", "--record",
            folder / "slow.mcap")
        name = "f.position" if version == 3 else "f.position_1"
        slow = read_recording(bf, folder / "slow.mcap")[name]
        assert slow[0] == got[name][0] and slow[490000000] != got[name][490000000]
        text = said("run", wrapped, "--plugin-path", fmus, "--quiet", "--set", "f.k=11")
        assert "from 0 to 10, but is 11" in text, text

        # An output waits for the inputs that the description names, and for no others.
        names = [n for n in names if not n.startswith("push")]
        if version == 3:
            wrapped.write_text(wrapper(fmu.name, names, "  f.position: f.push\n"))
            run(bf, "run", wrapped, "--plugin-path", fmus, "--quiet")
        wrapped.write_text(wrapper(fmu.name, ["on"], "  f.counted: f.steps\n"))
        text = said("check", wrapped, "--plugin-path", fmus)
        assert "loop" in text and "f.counted" in text, text
        print(f"FMI {version}.0: {compared} numbers are the same; snapshots, parameters and loops are as they should be")

    # An output depends on what makes states jump in the same instant, and on nothing else that these follow.
    jumps = folder / "jumps.yaml"
    jumps.write_text(f"model: jumps\nstep: {STEP}\nstop: {STEPS * STEP}\nsolver: rk4\ninputs: [u, go]\noutputs: [y, z]\n"
                     "blocks:\n  a: {block: LimitedIntegrator, reset: rising, initial: -1}\n  b: {block: LimitedIntegrator, "
                     "lower: -2}\nconnections: {u: [a.u, b], go: a.reset, a: y, b: z}\nrecord: [a, b]\n")
    inputs = folder / "jumps.csv"
    inputs.write_text("time,u,go\n" + "".join(f"{k * STEP!r},{3 * math.sin(k)!r},{k // 13 % 2}\n" for k in range(STEPS + 1)))
    run(bf, "run", jumps, "--quiet", "--inputs", inputs, "--record", folder / "alone.mcap")
    recorded = read_recording(bf, folder / "alone.mcap")
    for version in (2, 3):
        run(bf, "export-fmu", jumps, "--fmi", version, "-o", fmus / "jumps.fmu")
        with zipfile.ZipFile(fmus / "jumps.fmu") as archive:
            description = archive.read("modelDescription.xml").decode()
        assert re.findall('<(?:Output|Unknown) [a-zA-Z]*="[345]" dependencies="([0-9 ]*)"', description)[:2] == (
            ["2 13", "14"] if version == 3 else ["3 14", "15"]), description
        wrapped = folder / "wrapped.yaml"
        wrapped.write_text(wrapper("jumps.fmu", ["u", "go"], record="[f.y, f.z]"))
        run(bf, "run", wrapped, "--plugin-path", fmus, "--quiet", "--inputs", inputs, "--record", folder / "wrapped.mcap")
        got = read_recording(bf, folder / "wrapped.mcap")
        for name, block in (("f.y", "a"), ("f.z", "b")):
            for time, values in recorded[block].items():
                assert got[name][time][-1] == values[-1], (version, name, time, got[name][time], values)
        assert [-1.0] == got["f.y"][130_000_000][-1]

    # A document does not say where programs come from.
    wrapped = folder / "wrapped.yaml"
    for name in ("sides3.fmu", str(fmus / "sides3.fmu"), "../fmus/sides3.fmu"):
        wrapped.write_text(wrapper(name, []))
        text = said("check", wrapped, *(["--plugin-path", fmus] if name != "sides3.fmu" else []))
        assert f"there is no FMU '{name}' in the folders that plugins are taken from" in text, text

    # FMUs that somebody wrote by hand, with what can be wrong.
    wrapped.write_text(wrapper("odd.fmu", []))

    def odd(defines="", change=lambda xml: xml, library="x86_64-linux/odd.so", files={}):
        run(*compiler.split(), "-x", "c", "-shared", "-fPIC", *defines.split(), f"-I{source}/fmi/include",
            f"{source}/tests/fmi/odd.c", "-o", folder / "odd.so")
        with zipfile.ZipFile(fmus / "odd.fmu", "w") as archive:
            archive.writestr("modelDescription.xml", change((pathlib.Path(source) / "tests/fmi/odd.xml").read_text()))
            archive.write(folder / "odd.so", f"binaries/{library}")
            for name, content in files.items():
                archive.writestr(name, content)

    def says(*options, verb="run", code=1):
        result = subprocess.run([bf, verb, str(wrapped), "--plugin-path", str(fmus), *options], capture_output=True,
                                text=True, timeout=120)
        assert result.returncode == code, result
        return result.stderr

    odd()
    recording = folder / "odd.mcap"
    assert says("--quiet", "--record", str(recording), code=0) == ""
    values = read_recording(bf, recording)["f.y"]
    assert [values[k * 10_000_000][-1] for k in range(3)] == [[1.0], [2.0], [3.0]], values
    text = says("--quiet", "--snapshot", str(folder / "snapshot.bin"))
    assert "f: its state lives outside and cannot be saved" in text, text
    odd("-DCOMPUTES_ONCE")  # an input that no output waits for is written before outputs are read, where it has its value
    assert says("--quiet", code=0) == ""
    odd("-DFAILS_AT=3")
    assert "odd.fmu: fmi3DoStep gave Error: thrown on purpose" in says(), says()
    odd("-DTERMINATES")
    assert "odd.fmu: fmi3DoStep asks for the end of the simulation" in says(), says()
    odd("-DRETURNS_EARLY")
    assert "ended its step early, though it was not allowed to" in says(), says()
    odd("-DNO_INSTANCE")
    assert "odd.fmu: it makes no instance: there is none" in says(), says()
    odd("-DWITHOUT_STEP")
    assert "its library lacks the functions fmi3DoStep (FMI 3.0, section 2.2)" in says(), says()
    needy = lambda xml: xml.replace('modelIdentifier="odd"', 'modelIdentifier="odd" needsExecutionTool="true"')  # noqa: E731
    odd("-DNO_INSTANCE", needy)
    assert "there is none; it says that it needs the tool that made it, which it does not name" in says(), says()
    odd(change=needy)
    assert says("--quiet", code=0) == ""
    odd(library="riscv64-linux/odd.so")
    assert "it has no binaries/x86_64-linux/odd.so, but binaries for: riscv64-linux" in says(), says()
    odd(change=lambda xml: xml.replace("<CoSimulation", "<ModelExchange"))
    assert "it is for model exchange alone" in says(), says()
    odd(change=lambda xml: xml.replace("<Dimension", "<Dimension start='30000000'/><Dimension"))
    assert re.search(r"modelDescription.xml:\d+: 'v' has a size of 3e\+07", says()), says()
    odd(change=lambda xml: xml.replace('<Dimension valueReference="1"/>', '<Dimension start="0"/>'))
    assert says("--quiet", code=0) == ""
    odd(files={"../escaped": "x"})
    assert "leaves its folder" in says(), says()
    assert not (folder / "escaped").exists()

    # Units are those of the model's checks; one of another size is a warning.
    odd()
    text = wrapped.read_text()
    wrapped.write_text(text.replace("inputs: []", "inputs: {volts: {unit: V}}").replace("record:", "connections: {volts: f.u}\nrecord:"))
    assert "f: input 'u' is in m/s, but is wired to volts in V; convert the signal" in says(), says()
    wrapped.write_text(text)
    odd(change=lambda xml: xml.replace("<TypeDefinitions>", '<UnitDefinitions><Unit name="m/s"><BaseUnit m="1" s="-1" '
                                       'factor="0.001"/></Unit></UnitDefinitions><TypeDefinitions>'))
    assert "odd.fmu: 'u' is in m/s, of which 1 is 0.001 of base units; wires carry numbers" in says("--quiet", code=0)
    odd(change=lambda xml: xml.replace("<TypeDefinitions>", '<UnitDefinitions><Unit name="m/s"><BaseUnit m="1.5"/></Unit>'
                                       '</UnitDefinitions><TypeDefinitions>'))
    assert "'m' is no small whole number" in says(), says()

    # In a process of its own whatever it does is a message, and the run ends as it should.
    text = wrapped.read_text()
    wrapped.write_text(text.replace("FMI/FMU,", "FMI/FMU, process: own, timeout: 0.5,"))
    for defines, message in (
            ("-DCRASHES", "stopped at t = 0 s: f: odd.fmu: fmi3DoStep crashed (Segmentation fault)"),
            ("-DHANGS", "stopped at t = 0 s: f: odd.fmu: fmi3DoStep did not return within 0.5 s"),
            ("-DABORTS_AT=3", "stopped at t = 0.02 s: f: odd.fmu: fmi3DoStep crashed (Aborted)"),
            ("-DEXITS", "f: odd.fmu: fmi3DoStep ended its process"),
            ("-DCRASHES_FIRST", "odd.fmu: fmi3InstantiateCoSimulation crashed (Segmentation fault)"),
            ("-DFAILS_AT=3", "odd.fmu: fmi3DoStep gave Error: thrown on purpose"),
            ("-DNO_INSTANCE", "odd.fmu: it makes no instance: there is none"),
            ("-DWITHOUT_STEP", "its library lacks the functions fmi3DoStep (FMI 3.0, section 2.2)")):
        odd(defines)
        assert message in says("--record", str(recording)), (message, says())
        read_recording(bf, recording)
    odd()
    assert says("--quiet", "--record", str(recording), code=0) == ""
    assert read_recording(bf, recording)["f.y"] == values
    odd("-DHANGS_LAST")
    assert says("--quiet", code=0) == ""
    wrapped.write_text(text)

    # In the shared process one that ends it is said, and the run has failed; its folder is gone.
    for defines, function in (("-DEXITS", "fmi3DoStep"), ("-DEXITS_QUICKLY", "fmi3DoStep"), ("-DEXITS_FIRST", "its opening")):
        odd(defines)
        assert f"bf: odd.fmu: {function} ended the process" in says("--quiet"), (defines, says("--quiet"))

    # A size that no saved state has is a message, and a run without its snapshot has failed.
    saves = lambda xml: xml.replace("<CoSimulation", '<CoSimulation canGetAndSetFMUState="true" canSerializeFMUState="true"')  # noqa: E731
    for own in (False, True):
        if own:
            wrapped.write_text(text.replace("FMI/FMU,", "FMI/FMU, process: own,"))
        for size, what in (("-1", "18446744073709551615 bytes"), ("1000000000000", "1000000000000 bytes"), ("0", "0 bytes")):
            odd(f"-DSTATE_SIZE={size}", saves)
            snapshot = folder / "lies.bin"
            for options in (("--snapshot", snapshot), ("--snapshot", snapshot, "--snapshot-at", "0.1"),
                            ("--checkpoint-every", "0.1", "--record", recording)):
                said_of = says("--quiet", *map(str, options))
                assert f"odd.fmu: fmi3SerializedFMUStateSize gave {what} as the size of a saved state" in said_of, said_of
                assert "(FMI 3.0, section 2.2.7)" in said_of and not snapshot.exists(), said_of
    wrapped.write_text(text)

    # Other blocks compute as they did, whatever the FMU does to the arithmetic of the process.
    small = wrapped.read_text().replace("blocks:\n", "blocks:\n  c: {block: Constant, value: 1e-310}\n  g: {block: Gain, K: 2}\n"
                                        "  tenth: {block: Constant, value: 0.1}\n  h: {block: Gain, K: 0.7}\n").replace(
        "record: ['*']", "connections: {c: g, tenth: h}\nrecord: [g, h]")
    assert small != wrapped.read_text()
    wrapped.write_text(small)
    for defines, message in (("-Ofast", "odd.fmu: its library changes the arithmetic of the process when it is opened"),
                             ("-DROUNDS_DOWN", "odd.fmu: fmi3DoStep leaves the arithmetic of the process changed")):
        odd(defines)
        said_of = says("--quiet", "--record", str(recording), code=0)
        assert said_of.count(message) == 1, said_of
        got = read_recording(bf, recording)
        for time in got["g"]:
            assert got["g"][time][-1] == [2e-310] and got["h"][time][-1] == [0.1 * 0.7], (defines, time, got)
    wrapped.write_text(text)

    # What bf check-fmu says of them, and of exported ones.
    assert "nothere.fmu: there is no such file" in said("check-fmu", folder / "nothere.fmu")
    def found(*options, fmu="odd.fmu"):
        result = subprocess.run([bf, "check-fmu", str(fmus / fmu), *options], capture_output=True, text=True, timeout=120)
        assert result.returncode == (1 if result.stderr else 0), result
        return result.stderr.split("\n  ")[1:] if result.stderr else result.stdout.split("; ")[-1].strip()

    assert found(fmu="sides2.fmu") == found(fmu="sides3.fmu") == "nothing is wrong"
    odd()
    lacks = [line for line in found() if line.startswith("its library lacks the function ")]
    assert len(lacks) == 37 and lacks[0].endswith("fmi3SetDebugLogging"), (len(lacks), lacks)
    others = [line for line in found() if not line.startswith("its library lacks")]
    assert others == [f"'{name}' is missing among the initial unknowns (FMI 3.0, section 2.4.8)"
                      for name in ("y", "v", "colour")], others
    odd("-DCRASHES")
    assert found()[-1].strip() == "fmi3DoStep crashed (Segmentation fault), at its steps", found()
    for defines, message in (("-DEXITS", "fmi3DoStep ended the process, at its steps"),
                             ("-DEXITS_QUICKLY", "fmi3DoStep ended the process, at its steps"),
                             ("-DENDS", "fmi3DoStep ended the process, at its steps"),
                             ("-DEXITS_FIRST", "it ended the process, at its opening"),
                             ("-Ofast", "its library changes the arithmetic of the process when it is opened"),
                             ("-DROUNDS_DOWN", "fmi3DoStep leaves the arithmetic of the process changed")):
        odd(defines)
        assert found()[-1].strip().startswith(message), (defines, found())
    odd("-DSTATE_SIZE=-1", saves)
    assert found()[-1].strip() == ("odd.fmu: fmi3SerializedFMUStateSize gave 18446744073709551615 bytes as the size of a saved "
                                   "state, which are more than fit into memory (FMI 3.0, section 2.2.7)"), found()
    odd("-DHANGS")
    assert found("--timeout", "0.5")[-1].strip() == "fmi3DoStep did not return within 0.5 s, at its steps", found("--timeout", "0.5")
    odd("-DFORGETS_TO_BEGIN_ANEW")
    assert found()[-1].strip() == "'u' differs after it was begun anew", found()
    odd(change=lambda xml: xml.replace('causality="input"', 'causality="parameter" variability="continuous"')
        .replace('name="y"', 'name="y" start="3"').replace('<Output valueReference="4" dependencies=""/>', ""))
    assert found("--description-only")[:3] == [
        "'u' is parameter and continuous, which exclude each other (FMI 3.0, section 2.4.7)",
        "'y' has a start value, though it is calculated (FMI 3.0, section 2.4.7)",
        "'v' is missing among the outputs (FMI 3.0, section 2.4.8)"], found("--description-only")
    odd()
    with zipfile.ZipFile(fmus / "odd.fmu", "a") as archive:
        archive.writestr("terminalsAndIcons/terminalsAndIcons.xml",
                         '<fmiTerminalsAndIcons fmiVersion="3.0"><GraphicalRepresentation><Icon x1="0" y1="0" x2="9" y2="9"/>'
                         '</GraphicalRepresentation><Terminals><Terminal name="t" matchingRule="bus"><TerminalMemberVariable '
                         'variableName="gone" memberName="u" variableKind="signal"/></Terminal></Terminals></fmiTerminalsAndIcons>')
    assert [line.strip().partition("terminalsAndIcons.xml:1: ")[2] for line in found("--description-only")[-2:]] == [
        "there is no picture 'terminalsAndIcons/icon.png' beside it (FMI 3.0, section 2.4.9)",
        "the terminal 't' has the variable 'gone', which the FMU has not (FMI 3.0, section 2.4.9)"], found("--description-only")
    left = {name for name in os.listdir(tempfile.gettempdir()) if name.startswith("bf_")} - before
    assert not {name for name in left if "odd" in name or "sides" in name}, left
    print("bad FMUs are messages, and leave nothing behind")

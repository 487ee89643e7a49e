"""FMUs for model exchange as blocks: an exported model gives in a block what it gives alone; bad FMUs are messages.

Usage: exchanged.py BF EXAMPLES MODEL CXX SOURCE
"""
import math
import pathlib
import subprocess
import sys
import tempfile
import zipfile

bf, examples, model, compiler, source = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import read_recording, run  # noqa: E402

STEP, STEPS = 0.01, 200
outputs = {"position": "travel", "speed": "speed_of", "passed": "relay", "filtered": "follows", "total": "counter",
           "chosen": "negated", "direct": "doubled"}


def wrapper(fmu, solver, inputs=("push", "offset", "on"), more="", step=STEP):
    wires = "".join(f"  {name}: f.{name}\n" for name in inputs)
    return (f"model: wrapper\nplugins: [FMI]\nstep: {step}\nstop: {STEPS * STEP}\nsolver: {solver}\n"
            f"inputs: [{', '.join(inputs)}]\nblocks:\n  f: {{block: FMI/ModelExchange, fmu: {fmu}}}\n{more}"
            + (f"connections:\n{wires}" if wires else ""))


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    fmus = folder / "fmus"
    fmus.mkdir()
    inputs = folder / "inputs.csv"
    inputs.write_text("time,push,offset,on\n" + "".join(
        f"{k * STEP!r},{12 * math.sin(0.05 * k)!r},{math.cos(k)!r},{k // 37 % 2}\n" for k in range(STEPS + 1)))

    def recorded(file, solver, *options):
        recording = folder / "run.mcap"
        run(bf, "run", file, "--quiet", "--plugin-path", fmus, "--inputs", inputs, "--set", f"solver={solver}", "--set", "relative_tolerance=1e-9",
            "--record", recording, *options)
        return read_recording(bf, recording)

    for version in (2, 3):
        fmu = fmus / f"plant{version}.fmu"
        run(bf, "export-fmu", model, "--fmi", version, "-o", fmu)
        wrapped = folder / "wrapped.yaml"
        wrapped.write_text(wrapper(fmu.name, "rk4") + "record: [" + ", ".join(f"f.{name}" for name in outputs) + "]\n")
        for solver, tolerance in (("rk4", 0), ("euler", 0), ("dormand_prince45", 1e-6), ("cvode_bdf", 1e-4)):
            alone, inside = recorded(model, solver), recorded(wrapped, solver)
            compared, worst = 0, 0.0
            for name, block in outputs.items():
                for time, values in alone[block].items():
                    if time not in inside[f"f.{name}"]:
                        continue  # where a solver located an event
                    for x, y in zip(values[-1], inside[f"f.{name}"][time][-1], strict=True):
                        assert abs(x - y) <= tolerance, (version, solver, name, time, x, y)
                        worst, compared = max(worst, abs(x - y)), compared + 1
            assert compared > 1100, compared
            print(f"FMI {version}.0, {solver}: {compared} numbers differ by {worst:.1e} at most")

        # What it did is in snapshots: a run goes on from one, bit for bit.
        recording = folder / "kept.mcap"
        run(bf, "run", wrapped, "--quiet", "--plugin-path", fmus, "--inputs", inputs, "--set", "solver=dormand_prince45",
            "--record", recording, "--checkpoint-every", "0.25")
        run(bf, "replay", recording, "--plugin-path", fmus)
        run(bf, "replay", recording, "--plugin-path", fmus, "--from", "0.8")

        # Parameters may change while it runs, in an event; outputs wait for the inputs that the description names.
        slower = recorded(wrapped, "rk4", "--set", "f.damping=9")["f.speed"]
        assert slower[0] == inside["f.speed"][0] and slower[500000000] != inside["f.speed"][500000000]
        looped = folder / "looped.yaml"
        looped.write_text(wrapper(fmu.name, "rk4", ["offset"]) + "  f.position: f.push\n")
        run(bf, "run", looped, "--quiet", "--plugin-path", fmus)
        looped.write_text(wrapper(fmu.name, "rk4", ["on"]) + "  f.direct: f.offset\n")
        text = subprocess.run([bf, "check", str(looped), "--plugin-path", str(fmus)], capture_output=True, text=True).stderr
        assert "loop" in text and "f.direct" in text, text

    # One that somebody wrote by hand, whose events are of every kind.
    wrapped.write_text(wrapper("odd.fmu", "dormand_prince45", ["on"], "  k: {block: Constant, value: 0.5}\n")
                       + "  k: f.u\nrelative_tolerance: 1e-9\nrecord: [f.y, f.count]\n")

    def odd(defines="", change=lambda xml: xml):
        run(*compiler.split(), "-x", "c", "-shared", "-fPIC", *defines.split(), f"-I{source}/fmi/include",
            f"{source}/tests/fmi/exchanged.c", "-o", folder / "odd.so")
        with zipfile.ZipFile(fmus / "odd.fmu", "w") as archive:
            archive.writestr("modelDescription.xml", change((pathlib.Path(source) / "tests/fmi/exchanged.xml").read_text()))
            archive.write(folder / "odd.so", "binaries/x86_64-linux/odd.so")

    inputs.write_text("time,on\n" + "".join(f"{k * STEP!r},{k // 37 % 2}\n" for k in range(STEPS + 1)))
    odd()
    values = recorded(wrapped, "dormand_prince45")
    at = {time: value[-1][0] for time, value in values["f.y"].items()}
    for k in range(STEPS):
        t = k * STEP
        wanted = 0.5 + 0.5 * math.exp(-t) if t < 0.353 else 0.5 + 4.5 * math.exp(-(t - 0.353))
        assert abs(at[round(t * 1e9)] - wanted) < 1e-7, (t, at[round(t * 1e9)], wanted)
    count = values["f.count"][(STEPS - 1) * 10_000_000][-1][0]
    assert count == 1 + 1 + 5 + 2, f"the jump, its wish, five changes of the input and twice x = 2, but {count} were counted"

    def says(*options):
        result = subprocess.run([bf, "run", str(wrapped), "--plugin-path", str(fmus), "--quiet", "--inputs", str(inputs),
                                 *options], capture_output=True, text=True, timeout=120)
        assert result.returncode == 1, result
        return result.stderr

    plain = wrapped.read_text()
    wrapped.write_text(plain.replace("ModelExchange,", "ModelExchange, process: own,"))
    assert recorded(wrapped, "dormand_prince45") == values
    wrapped.write_text(plain)

    for defines, wanted in (
            ("-DSTATES=3", "odd.fmu: fmi3GetNumberOfContinuousStates gave 3, but its description has 1 continuous states "
                           "(FMI 3.0, section 2.4.8)"),
            ("-DWRITES_MORE", "odd.fmu: fmi3GetContinuousStateDerivatives wrote more numbers than the description has "
                              "(FMI 3.0, section 2.4.8)"),
            ("-DRATE=NAN", "f: odd.fmu: fmi3GetContinuousStateDerivatives gave nan as 'der(x)' (FMI 3.0, section 3.2.1)"),
            ("-DENDLESS", "f: odd.fmu: fmi3UpdateDiscreteStates asks for yet another iteration of one event after 1000 "
                          "(FMI 3.0, section 2.3.5)"),
            ("-DTERMINATES", "stopped at t = 0.35 s: f: odd.fmu: fmi3UpdateDiscreteStates asks for the end of the simulation"),
            ("-DNEXT=NAN", "odd.fmu: fmi3UpdateDiscreteStates gave a next event at NaN s (FMI 3.0, section 2.3.5)"),
            ("-DJUMPS_FIRST", "f: odd.fmu: fmi3UpdateDiscreteStates makes continuous states jump in the first event")):
        odd(defines)
        text = says()
        assert wanted in text, (wanted, text)
        found = subprocess.run([bf, "check-fmu", str(fmus / "odd.fmu")], capture_output=True, text=True, timeout=120).stderr
        if "-DTERMINATES" not in defines and "-DJUMPS_FIRST" not in defines:
            assert wanted.split("odd.fmu: ")[1] in found, (wanted, found)
    odd(change=lambda xml: xml.replace("<ModelExchange", "<CoSimulation"))
    assert "it is for co-simulation alone; use the block FMI/FMU" in says(), says()
    print("events of every kind come in their time; bad FMUs are messages")

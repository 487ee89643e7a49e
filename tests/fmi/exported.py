"""An exported FMU: FMPy finds nothing wrong with it, and simulates what `bf run` does: in co-simulation bit for bit, in
model exchange to a tolerance.

Usage: exported.py BF EXAMPLES MODEL [SOLVER]

SOLVER is the one of fixed steps that the FMU has in co-simulation, where the model's own is adaptive.
"""
import pathlib
import struct
import sys
import tempfile

import fmpy
import fmpy.validation
import numpy

bf, examples, model, *solver = sys.argv[1:]
options = ["--set", f"solver={solver[0]}"] if solver else []
sys.path.insert(0, examples)
from recorded import read_recording, run  # noqa: E402


def structured(name):
    return ".".join(part if part.isidentifier() else f"'{part}'" for part in name.split("."))


def elements(result, version, name, i):
    """Of a variable in row i, column by column as in recordings; FMI 2.0 has one for each, "A[2,1]"."""
    if version == 3:
        return [float(x) for x in numpy.asarray(result[name][i], dtype=float).flatten(order="F")]
    its = [s for s in result.dtype.names if s == name or s.startswith(name + "[")]
    its.sort(key=lambda s: [int(k) for k in s[len(name):].strip("[]").split(",") if k][::-1])
    return [float(result[s][i]) for s in its]


def bits(values):
    return struct.pack(f"{len(values)}d", *values)


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    run(bf, "run", model, *options, "--quiet", "--record", folder / "run.mcap")
    recorded = read_recording(bf, folder / "run.mcap")
    run(bf, "run", model, "--quiet", "--record", folder / "own.mcap")
    own = read_recording(bf, folder / "own.mcap")
    for version in (2, 3):
        fmu = folder / f"model{version}.fmu"
        run(bf, "export-fmu", model, *options, "--fmi", version, "-o", fmu, timeout=600)
        run(bf, "check-fmu", fmu)
        problems = fmpy.validation.validate_fmu(str(fmu))
        assert problems == [], problems
        described = fmpy.read_model_description(str(fmu))
        signals = [v.name for v in described.modelVariables if v.causality in ("local", "output")]
        assert signals, "the model records nothing"
        step = described.defaultExperiment.stepSize
        result = fmpy.simulate_fmu(
            str(fmu), fmi_type="CoSimulation", step_size=float(step), output_interval=float(step), output=signals,
            use_event_mode=False)
        compared = 0
        rows = {round(t * 1e9): i for i, t in enumerate(result["time"])}
        for name, samples in recorded.items():
            name = structured(name)
            for time, values in samples.items():
                i = rows.get(time)
                if i is None:
                    continue
                got = elements(result, version, name, i)
                assert bits(got) == bits(values[-1]), (version, name, time, got, values)
                compared += len(got)
        assert compared > 100, f"only {compared} numbers were compared"

        print(f"FMI {version}.0: {compared} numbers of {len(recorded)} signals are the same")

        # In model exchange the importer's solver gives the same, to what both of them leave.
        exchanged = fmpy.simulate_fmu(
            str(fmu), fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-10, output_interval=float(step),
            output=signals)
        times = {round(t * 1e9): i for i, t in enumerate(exchanged["time"])}
        largest, compared_exchanged = 0.0, 0
        for name, samples in own.items():
            name = structured(name)
            scale = max(abs(x) for values in samples.values() for x in values[-1]) + 1e-3
            for time, values in samples.items():
                if time in times:
                    got = elements(exchanged, version, name, times[time])
                    largest = max([largest, *(abs(x - y) / scale for x, y in zip(got, values[-1], strict=True))])
                    compared_exchanged += len(got)
        assert compared_exchanged > 100, f"only {compared_exchanged} numbers were compared"
        print(f"FMI {version}.0: model exchange differs by {largest:.1e}")
        assert largest < 2e-5, largest

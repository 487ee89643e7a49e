"""An exported FMU: FMPy finds nothing wrong with it, and simulates what `bf run` does, bit for bit.

Usage: exported.py BF EXAMPLES TOLERANCE MODEL [options of the model, e.g. --set solver=rk4]
"""
import pathlib
import struct
import sys
import tempfile

import fmpy
import fmpy.validation
import numpy

bf, examples, tolerance, model, *options = sys.argv[1:]
tolerance = float(tolerance)
sys.path.insert(0, examples)
from recorded import read_recording, run  # noqa: E402


def bits(values):
    return struct.pack(f"{len(values)}d", *values)


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    run(bf, "run", model, *options, "--quiet", "--record", folder / "run.mcap")
    recorded = read_recording(bf, folder / "run.mcap")
    for version in (2, 3):
        fmu = folder / f"model{version}.fmu"
        run(bf, "export-fmu", model, *options, "--fmi", version, "-o", fmu)
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
            name = ".".join(part if part.isidentifier() else f"'{part}'" for part in name.split("."))
            for time, values in samples.items():
                i = rows.get(time)
                if i is None:
                    continue
                if version == 3:
                    got = list(numpy.asarray(result[name][i], dtype=float).flatten())  # row by row
                else:
                    names = [s for s in signals if s == name or s.startswith(name + "[")]
                    got = [float(result[s][i]) for s in names]
                assert bits(got) == bits(values[-1]), (version, name, time, got, values)
                compared += len(got)
        assert compared > 100, f"only {compared} numbers were compared"

        # In model exchange the importer's solver gives the same, to what both of them leave.
        exchanged = fmpy.simulate_fmu(
            str(fmu), fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-10, output_interval=float(step),
            output=signals)
        end = {name: numpy.asarray(result[name], dtype=float) for name in signals}
        largest = 0.0
        for name in [s for s in signals if s.split("[")[0] in recorded]:
            times = {round(t * 1e9): i for i, t in enumerate(exchanged["time"])}
            scale = numpy.abs(end[name]).max() + 1e-3
            for time, i in rows.items():
                if time in times:
                    got = numpy.asarray(exchanged[name][times[time]], dtype=float)
                    largest = max(largest, float(numpy.abs(got - end[name][i]).max() / scale))
        print(f"FMI {version}.0: model exchange differs by {largest:.1e}")
        assert largest < tolerance, largest
        print(f"FMI {version}.0: {compared} numbers of {len(recorded)} signals are the same")

"""Exported FMUs in fmi-sim, an importer of its own: what it gives is what `bf run` gives, in both versions and kinds.

Usage: fmi_sim.py BF EXAMPLES FMI_SIM FOLDER

FOLDER holds the models.
"""
import csv
import pathlib
import re
import subprocess
import sys
import tempfile
import zipfile

bf, examples, simulator, models = sys.argv[1:]
sys.path.insert(0, examples)
from recorded import read_recording, run  # noqa: E402

outputs = {  # and the blocks that give them
    "clocked": {"position": "plant", "command": "gain", "counted": "counter", "late": "slow", "soon": "fast"},
    "plant": {"position": "travel", "speed": "speed_of", "passed": "relay", "filtered": "follows", "total": "counter",
              "chosen": "negated", "direct": "doubled"},
}


def without_units(fmu):
    """Its schema of FMI 3.0 knows no units of variables, and it refuses what has some."""
    plain = fmu.with_suffix(".plain.fmu")
    with zipfile.ZipFile(fmu) as archive, zipfile.ZipFile(plain, "w") as to:
        for name in archive.namelist():
            content = archive.read(name)
            to.writestr(name, re.sub(rb' unit="[^"]*"', b"", content) if name == "modelDescription.xml" else content)
    return plain


def simulated(fmu, kind, step, stop, out):
    result = subprocess.run([simulator, "--model", fmu, "-o", out, kind, "--step", str(step), "--output-interval", str(step),
                             "-f", str(stop)], capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 0, (fmu, kind, result.stderr[-2000:])
    with open(out) as table:
        rows = list(csv.DictReader(table))
    return {round(float(row["time"]) / step): row for row in rows}  # at an event the last one


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    for model, blocks in outputs.items():
        file, options = pathlib.Path(models, model + ".yaml"), ["--set", "solver=euler"]  # its solver is Euler's
        run(bf, "run", file, *options, "--quiet", "--record", folder / "run.mcap")
        recorded = read_recording(bf, folder / "run.mcap")
        times = sorted({time for samples in recorded.values() for time in samples})
        step = (times[1] - times[0]) / 1e9
        for version in (2, 3):
            fmu = folder / "model.fmu"
            run(bf, "export-fmu", file, *options, "--fmi", version, "-o", fmu, timeout=600)
            if version == 3:
                fmu = without_units(fmu)
            for kind in ("co-simulation", "model-exchange"):
                rows = simulated(fmu, kind, step, times[-1] / 1e9, folder / "out.csv")
                compared, largest = 0, 0.0
                for name, block in blocks.items():
                    for time, values in recorded[block].items():
                        text = rows[round(time / 1e9 / step)][name]
                        got = {"true": 1.0, "false": 0.0}.get(text) if text in ("true", "false") else float(text)
                        largest = max(largest, abs(got - values[-1][0]))
                        compared += 1
                assert compared > 100, (model, version, kind, compared)
                assert largest <= (0 if kind == "co-simulation" else 1e-9), (model, version, kind, largest)
                print(f"{model}, FMI {version}.0, {kind}: {compared} numbers differ by {largest:.1e}")

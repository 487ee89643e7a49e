"""Runs the pipeline for a moment; it compares all trajectories itself.

Usage: test.py BF PROGRAM, which was generated from the balancing iCub.
"""
import pathlib
import subprocess
import sys
import tempfile

bf, program = sys.argv[1:]
script = pathlib.Path(__file__).resolve().with_name("pipeline.py")
with tempfile.TemporaryDirectory() as folder:
    result = subprocess.run([sys.executable, script, bf, "--program", program, "--seconds", "1.5", "-o", folder],
                            capture_output=True, text=True, timeout=900)
    assert result.returncode == 0, result.stdout + result.stderr
    table = (pathlib.Path(folder) / "comparison.md").read_text().splitlines()[2:]
    assert len(table) == 5, table
    for row in table:
        _, name, samples, difference, missed, _ = [cell.strip() for cell in row.split("|")]
        assert int(samples) > 10_000 and float(difference) == 0, row
        assert ("real time" in name) == (missed != "-"), row
    drawing = (pathlib.Path(folder) / "comparison.svg").read_text()
    assert drawing.count("<polyline") >= 5 * 4, "every step draws its curves"

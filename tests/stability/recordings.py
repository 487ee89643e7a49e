#!/usr/bin/env python3
"""recordings.py BF: recordings of releases, recordings/VERSION.mcap, have the numbers that they had, VERSION.csv (what `bf export`
makes of each signal, one after the other), and can be replayed."""

import pathlib
import subprocess
import sys
import tempfile

bf, folder = sys.argv[1], pathlib.Path(__file__).resolve().parent / "recordings"
recordings = sorted(folder.glob("*.mcap"))
assert recordings, f"there is none in {folder}"
with tempfile.TemporaryDirectory() as work:
    for recording in recordings:
        subprocess.run([bf, "export", recording, "-o", pathlib.Path(work, "made.csv")], check=True, stdout=subprocess.DEVNULL)
        made = sorted(pathlib.Path(work).glob("made_*.csv"))
        text = "".join(f"# {file.stem.removeprefix('made_')}\n{file.read_text()}" for file in made)
        for file in made:
            file.unlink()
        assert text == recording.with_suffix(".csv").read_text(), f"{recording.name} has other numbers than before:\n{text}"
        subprocess.run([bf, "replay", recording], check=True, stdout=subprocess.DEVNULL)

#!/usr/bin/env python3
"""Runs the examples of standard blocks in Node, by the core in WebAssembly, and compares every recorded sample with
what `bf run` recorded.

usage: compare.py BF NODE COMPARE_JS SOURCES [NATIVE]; with NATIVE, which is the same program compiled for this computer,
also tells how much longer the steps take in WebAssembly.
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

# Of a signal's largest value. Only addition, multiplication, division and roots are exact everywhere; sin, exp, pow and
# the like are those of another C library, which rounds otherwise, and a variable step of CVODE follows what is rounded.
ROUNDING, CVODE = 1e-12, 1e-3
ARITHMETIC = {"start", "bouncing_ball", "dc_motor", "thermostat", "two_rates"}


def models(sources):
    files = [*sources.glob("docs/start/*.yaml"), *sources.glob("examples/*/model.yaml")]
    return [file for file in sorted(files) if not re.search(r"block: *\w+/", file.read_text())]


def compared(command, *arguments):
    return json.loads(subprocess.run([*command, *arguments], check=True, capture_output=True, text=True).stdout)


def main():
    bf, node, compare, sources, *native = sys.argv[1:]
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        for file in models(pathlib.Path(sources)):
            name, recording = file.parent.name, pathlib.Path(folder, "run.mcap")
            subprocess.run([bf, "run", file, "--record", recording, "--quiet"], check=True, stdout=subprocess.DEVNULL)
            here = compared([node, compare], file, recording)
            line = f"{name:16} {here['identical']} of {here['signals']} signals identical, {here['samples']} samples, " \
                   f"largest difference {here['difference']:.2g}"
            if native:
                there, again = (compared(command, file, recording, "2")["seconds"] for command in (native, [node, compare]))
                line += f", {here['steps'] / again:.0f} steps/s, {again / there:.1f} times as long"
            print(line)
            limit = 0 if name in ARITHMETIC else CVODE if "cvode" in file.read_text() else ROUNDING
            if not here["complete"] or here["signals"] == 0 or not here["difference"] <= limit:
                wrong.append(f"{name}: {here}")
    for text in wrong:
        print("differs:", text)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

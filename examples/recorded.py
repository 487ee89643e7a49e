"""Signals in tables that `bf export` and generated programs write: read, and compared number by number."""
import csv
import itertools
import math
import pathlib
import re
import subprocess
import tempfile


def run(*command, code=0, timeout=120):
    """Runs a command, which must end with that exit code."""
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=timeout)
    assert result.returncode == code, f"{command}: {result.stdout}{result.stderr}"
    return result


def read_csv(file):
    """Signal -> {time in ns: rows}, of a table of one or several signals; at an event two rows have the same time."""
    with open(file, newline="") as stream:
        names, *rows = csv.reader(stream)
    signals = {}
    for i, name in enumerate(names[1:], 1):
        signals.setdefault(re.sub(r"((\[[^]]*\])+)?( \(.*\))?$", "", name), []).append(i)
    samples = {signal: {} for signal in signals}
    for row in rows:
        time = round(float(row[0]) * 1e9)
        for signal, columns in signals.items():
            samples[signal].setdefault(time, []).append([float(row[i]) for i in columns])
    return samples


def columns(file):
    """What the columns of a table are called, without units."""
    with open(file, newline="") as stream:
        return {re.sub(r" \(.*\)$", "", name) for name in next(csv.reader(stream))}


def columns_of_recording(bf, file):
    """The same of what a recording is exported to."""
    with tempfile.TemporaryDirectory() as folder:
        run(bf, "export", file, "-o", pathlib.Path(folder) / "run.csv")
        return set().union(*map(columns, pathlib.Path(folder).glob("*.csv")))


def read_recording(bf, file):
    """The same of a recording, in which each signal has its own samples."""
    signals = {}
    with tempfile.TemporaryDirectory() as folder:
        run(bf, "export", file, "-o", pathlib.Path(folder) / "run.csv")
        for part in sorted(pathlib.Path(folder).glob("*.csv")):
            signals.update(read_csv(part))
    return signals


def compare(reference, other):
    """Numbers compared, the largest difference and the first one as a text, over all signals of the reference at its
    times. A number that only one of both is differs infinitely. A table repeats at an event what has one sample."""
    count, largest, first = 0, 0.0, ""
    for signal, rows in reference.items():
        assert signal in other, f"'{signal}' was not recorded"
        for time, expected in rows.items():
            found = other[signal].get(time, [])[-len(expected) :]
            assert len(found) == len(expected), f"'{signal}' has {len(found)} samples at {time / 1e9} s"
            for a, b in zip(itertools.chain(*expected), itertools.chain(*found), strict=True):
                count += 1
                if a == b or (a != a and b != b):
                    continue
                difference = abs(a - b)
                largest = max(largest, math.inf if math.isnan(difference) else difference)
                first = first or f"'{signal}' is {b}, not {a}, at {time / 1e9} s"
    return count, largest, first

"""From the design of a controller to the robot: every step runs, and all must come to the same trajectories.

Usage: pipeline.py BF [--model MODEL] [--seconds S] [-o FOLDER] [--prefix PREFIX | --program PROGRAM]

BF is the bf command. The generated project is compiled with the BlockFactory installed in PREFIX (that of BF by
default), or PROGRAM is the program that was already compiled from it. FOLDER (pipeline) gets recordings, the generated
project, the deployed package, comparison.md and comparison.svg. Exit code 1 when a step fails or a trajectory differs.
"""
import argparse
import pathlib
import re
import shutil
import sys

here = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(here.parent))
import recorded

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("bf", type=pathlib.Path)
parser.add_argument("--model", type=pathlib.Path, default=here.parent / "icub_balancing" / "balancing.yaml")
parser.add_argument("--seconds", type=float, default=20, help="of the model, in each step")
parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("pipeline"))
parser.add_argument("--prefix", type=pathlib.Path)
parser.add_argument("--program", type=pathlib.Path)
parser.add_argument("--signals", nargs="*", default=["world.com", "checks.com_error_mm"], help="to draw")
options = parser.parse_args()
bf, model = options.bf.resolve(), options.model.resolve()
out = options.output.resolve()
seconds = repr(options.seconds)
out.mkdir(parents=True, exist_ok=True)
for stale in ("generated", "build", "package"):
    shutil.rmtree(out / stale, ignore_errors=True)


def run(*command):
    """The standard output of a command; ends the script when it fails."""
    print("$", *command, flush=True)
    try:
        return recorded.run(*command, timeout=None).stdout
    except AssertionError as failure:
        sys.exit(str(failure))


def deadlines(text):
    """"missed of all" in a report of the real-time loop."""
    found = re.search(r"deadlines missed: (\d+) of (\d+)", text)
    return f"{found[1]} of {found[2]}" if found else "-"


steps = []  # name, trajectories, deadlines missed

run(bf, "check", model)
run(bf, "run", model, "--quiet", "--stop", seconds, "--record", out / "simulated.mcap")
steps.append(("simulation", recorded.read_recording(bf, out / "simulated.mcap"), "-"))

report = run(bf, "run", model, "--quiet", "--realtime", "--priority", 0, "--stop", seconds, "--record",
             out / "realtime.mcap")
steps.append(("real time", recorded.read_recording(bf, out / "realtime.mcap"), deadlines(report)))

program = options.program and options.program.resolve()
if not program:
    run(bf, "generate", model, "-o", out / "generated")
    run("cmake", "-S", out / "generated", "-B", out / "build",
        f"-DCMAKE_PREFIX_PATH={(options.prefix or bf.parent.parent).resolve()}")
    run("cmake", "--build", out / "build")
    program = next(p for p in (out / "build").glob("run_*") if p.is_file())
run(program, "--stop", seconds, "--csv", out / "generated.csv")
steps.append(("generated code, simulation", recorded.read_csv(out / "generated.csv"), "-"))
report = run(program, "--stop", seconds, "--realtime", "--csv", out / "generated_realtime.csv")
steps.append(("generated code, real time", recorded.read_csv(out / "generated_realtime.csv"), deadlines(report)))

run(bf, "deploy", model, "-o", out / "package")
report = run(out / "package" / "run", "--quiet", "--priority", 0, "--stop", seconds, "--record", out / "deployed.mcap")
steps.append(("deployed package, real time", recorded.read_recording(bf, out / "deployed.mcap"), deadlines(report)))


def drawing(signal, top):
    """A panel with every step's curves, each step drawn thinner than the one before, so that all are seen."""
    colours = ["#d0d0d0", "#f2a33a", "#2f8f5b", "#3366cc", "#000000"]
    width, height, left = 860, 200, 70
    reference = steps[0][1][signal]
    values = [x for rows in reference.values() for row in rows for x in row]
    low, high = min(values), max(values)
    high = high if high > low else low + 1
    end = max(reference) or 1
    place = lambda t, x: f"{left + t / end * width:.1f},{top + height - (x - low) / (high - low) * height:.1f}"
    parts = [f'<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#888"/>']
    for value, y in ((high, top + 10), (low, top + height)):
        parts.append(f'<text x="{left - 6}" y="{y}" text-anchor="end">{value:.3g}</text>')
    parts.append(f'<text x="{left}" y="{top - 6}">{signal}</text>')
    for k, (name, signals, _) in enumerate(steps):
        rows = [(t, row) for t, rows in sorted(signals[signal].items()) if t in reference for row in rows]
        rows = rows[:: max(1, len(rows) // 300)]
        for i in range(len(rows[0][1])):
            points = " ".join(place(t, row[i]) for t, row in rows)
            parts.append(f'<polyline points="{points}" fill="none" stroke="{colours[k]}" '
                         f'stroke-width="{9 - 2 * k}"/>')
        parts.append(f'<text x="{left + k * 175}" y="{len(options.signals) * 250 + 40}" '
                     f'fill="{colours[k]}" stroke="none">{name}</text>')
    return "\n".join(parts)


svg = "\n".join(drawing(signal, 30 + 250 * k) for k, signal in enumerate(options.signals))
(out / "comparison.svg").write_text(
    f'<svg xmlns="http://www.w3.org/2000/svg" width="960" height="{len(options.signals) * 250 + 60}" '
    f'font-family="sans-serif" font-size="12">\n<rect width="100%" height="100%" fill="white"/>\n{svg}\n</svg>\n')

lines = ["| step | samples compared | largest difference | deadlines missed |", "| --- | --- | --- | --- |"]
differs = False
for name, signals, missed in steps:
    try:
        count, largest, _ = recorded.compare(steps[0][1], signals)
    except AssertionError as missing:
        sys.exit(str(missing))
    differs = differs or largest > 0
    lines.append(f"| {name} | {count} | {largest:g} | {missed} |")
table = "\n".join(lines) + "\n"
(out / "comparison.md").write_text(table)
print(table, end="")
if differs:
    sys.exit("the trajectories differ")

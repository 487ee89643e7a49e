"""While the robot walks, its program loses every solution: each foot must press with more than the robot can. The run goes on, the
joints are damped, and so the torques only take energy away while the robot sinks down.

Usage: unsolved.py BF MODEL
"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

bf, model = sys.argv[1:]


def run(*options):
    done = subprocess.run([bf, "run", model, "--quiet", "--json", *options], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["checks"]


def rows(file):
    with open(file, newline="") as opened:
        return [[float(value) for value in row] for row in list(csv.reader(opened))[1:]]


with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    run("--stop", "4.4", "--snapshot", folder / "walking.bin")   # on one foot
    checks = run("--from-snapshot", folder / "walking.bin", "--set", "Foot.min_force=1e4", "--stop", "9", "--record", folder / "run.mcap")
    assert checks["stood"] is False and checks["program_status.passed"] is False and checks["gave_up_at_end"] == 1, checks
    subprocess.run([bf, "export", folder / "run.mcap", "-o", folder / "run.csv"], check=True, capture_output=True)
    torques = rows(folder / "run_controller.tau.csv")
    limit = 65                      # as long as it walks
    assert max(abs(value) for row in torques for value in row[1:]) <= limit, "torques grow"
    damped = [row for row in torques if row[0] > 4.4 + 0.1]
    assert max(abs(value) for row in damped for value in row[1:]) <= 20.000001, "Safe.max_torque"
    speeds = {round(row[0], 6): row[1:] for row in rows(folder / "run_world.s_dot.csv")}
    energy = [0.0]*50               # J, in each tenth of a second
    for time, *values in damped:
        power = sum(torque*speed for torque, speed in zip(values, speeds[round(time, 6)]))
        energy[int((time - 4.4)/0.1)] += 0.005*power
    assert max(energy[1:46]) < 0 and sum(energy) < -10, energy
    assert max(abs(value) for row in speeds.values() for value in row) < 20, "it thrashes"

"""Every iCub of the package icub-models with joints and sensors of the controller makes the step of scenario 3, at 1 kHz, and stands.

Usage: versions.py BF MODEL. Prints a table.
"""
import csv
import pathlib
import sys
import tempfile

import icub_models

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from recorded import run

bf, model = sys.argv[1:]
robots = [name for name in sorted(icub_models.get_robot_names())
          if all(word in pathlib.Path(icub_models.get_model_file(name)).read_text() for word in ("torso_yaw", "l_foot_ft_sensor"))]
assert len(robots) >= 13, robots
with tempfile.TemporaryDirectory() as folder:
    table = pathlib.Path(folder) / "runs.csv"
    names = "{" + " ".join(f"'{name}'" for name in robots) + "}"
    run(bf, "sweep", model, "--quiet", "--set", f"robot.robot={names}", "--set", "scenario=3", "--set", "T_control=0.001",
        "-o", table, timeout=600)
    rows = list(csv.DictReader(table.open()))
assert len(rows) == len(robots), rows
for row in rows:
    print(row["robot.robot"], *(f"{float(row[name]):.3g}" for name in ("com_rms_error_m", "com_peak_error_m", "max_torque_Nm")))
    for check in ("stood", "contact_wrenches_feasible", "com_final_error_m.passed", "left_foot_tilt_deg.passed", "final_state.passed"):
        assert float(row[check]) == 1, (check, row)

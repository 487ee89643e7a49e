"""The back end of the page leads the robot to its angle, says stop, and comes again without the robot.

Usage: test.py BF PLUGIN_FOLDER"""
import pathlib
import subprocess
import sys
import tempfile

here = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(here.parent))
import recorded

bf, plugins = sys.argv[1:]


def run(*command, code=0):
    return recorded.run(bf, *command, "--plugin-path", plugins, code=code)


robot = subprocess.Popen([sys.executable, here / "robot.py", "60"], stdout=subprocess.PIPE, text=True)
port = robot.stdout.readline().strip()
with tempfile.TemporaryDirectory() as folder:
    recording = pathlib.Path(folder) / "run.mcap"
    run("run", here / "model.yaml", "--quiet", "--realtime", "--priority", "0", "--set", f"robot.port='{port}'",
        "--set", "drive.age_limit=1", "--record", recording)
    *positions, word = robot.communicate(timeout=60)[0].split()
    assert word == "stop", word
    for found, wanted in zip(positions, (0.5, -0.3)):
        assert abs(float(found) - wanted) < 0.05, positions
    replay = recorded.run(bf, "replay", recording, "--plugin-path", plugins).stdout
    assert "identical" in replay and "from outside" in replay, replay
failed = run("run", here / "model.yaml", "--quiet", "--set", "robot.port='/nowhere/tty'", code=1)
assert "robot: /nowhere/tty: No such file or directory; plug the robot in" in failed.stderr, failed.stderr
wrong = run("check", here / "model.yaml", "--set", "drive.control_type='Velocity'", code=1)
assert "this robot takes torques alone; give control_type: Torque" in wrong.stderr, wrong.stderr
print("1 passed, 0 failed")

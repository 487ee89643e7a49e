"""What a program says that was built without SUNDIALS or robots.

Usage: missing.py BF SOURCE BF_SUNDIALS BF_ROBOTS.
"""
import subprocess
import sys
import tempfile
from pathlib import Path

bf, source = sys.argv[1], Path(sys.argv[2])
has_sundials, has_robots = (value == "ON" for value in sys.argv[3:])

loop = """model: loop
step: 0.1
stop: 1
algebraic_loops: solve
blocks:
  one: {block: Constant}
  half: {block: Gain, K: 0.5}
  sum: {block: Sum}
connections:
  one: sum.u1
  half: sum.u2
  sum: half
"""


def said(*command):
    result = subprocess.run([bf, *map(str, command)], capture_output=True, text=True)
    assert result.returncode == 1, result
    return result.stderr


if not has_sundials:
    assert "cvode_bdf and cvode_adams are missing" in said("run", source / "examples/stick_slip/model.yaml")
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder, "loop.yaml")
        model.write_text(loop)
        text = said("run", model)
        assert "it stands in an algebraic loop, and bf was built without SUNDIALS" in text, text
        assert any(f"{block}: it stands" in text for block in ("sum", "half")), text
if not has_robots:
    assert "BF_ROBOTS=ON" in said("film", "run.mcap", "-o", "film.mp4")
    text = said("check", source / "examples/icub_balancing/balancing.yaml")
    assert "WholeBodyToolbox" in text, text

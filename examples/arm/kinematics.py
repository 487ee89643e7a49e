"""Runs the model, in which the hand is where the published Denavit-Hartenberg parameters say.

Usage: kinematics.py BF MODEL
"""
import math
import pathlib
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from recorded import read_recording, run

# a, d, alpha of the joints 1 to 7 by Craig's convention: Rx(alpha) Tx(a) Rz(s) Tz(d).
PARAMETERS = [(0, 0.333, 0), (0, 0, -1), (0, 0.316, 1), (0.0825, 0, 1), (-0.0825, 0.384, -1), (0, 0, 1), (0.088, 0, 1)]


def transform(a, d, alpha, theta):
    c, s, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
    return np.array([[c, -s, 0, a], [s * ca, c * ca, -sa, -d * sa], [s * sa, c * sa, ca, d * ca], [0, 0, 0, 1]])


def hand(s):
    """Pose of the point between the finger tips: the flange at 0.107 m, the hand turned by -45 degrees, 0.1034 m to its tip."""
    H = np.eye(4)
    for (a, d, alpha), angle in zip(PARAMETERS, s):
        H = H @ transform(a, d, alpha * math.pi / 2, angle)
    return H @ transform(0, 0.107 + 0.1034, 0, -math.pi / 4)


bf, model = sys.argv[1:]
with tempfile.TemporaryDirectory() as folder:
    recording = pathlib.Path(folder) / "run.mcap"
    run(bf, "run", model, "--quiet", "--record", recording)
    signals = read_recording(bf, recording)
q, w_H_hand = signals["world.q"], signals["arm.w_H_hand"]
moved = set()
for time in list(q)[::500]:
    s = q[time][0][:7]
    moved.add(round(s[0], 1))
    difference = np.abs(hand(s) - np.reshape(w_H_hand[time][0], (4, 4), order="F")).max()
    assert difference < 1e-12, f"at {time / 1e9} s the hand is off by {difference}"
assert len(moved) > 5, moved

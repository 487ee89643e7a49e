"""What the scripts of the Python peers share: the cases' numbers, the clock and the form of a result.

Usage of each script: PYTHON SCRIPT CASE STEPS REPEATS, with CASE chain, chain23 or cartpole. It prints one line of JSON.
"""
import json
import sys
import time
from pathlib import Path

CASES = json.loads((Path(__file__).parent / "cases.json").read_text())
CHAIN, CARTPOLE = CASES["chain"], CASES["cartpole"]


def cart_pole(x, force, math):
    """Time derivative of x = [position, angle from upright, velocity, angular velocity] of a cart with a point-mass pole;
    `math` has the sine and cosine of the peer's numbers."""
    M, m, l, g = (CARTPOLE[name] for name in ("cart", "pole", "length", "gravity"))
    sin, cos = math.sin(x[1]), math.cos(x[1])
    acceleration = (force + m * sin * (l * x[3] ** 2 - g * cos)) / (M + m * sin**2)
    return [x[2], x[3], acceleration, (g * sin - acceleration * cos) / l]


def measure(chain, cart_pole):
    """Runs the case of the command line. `chain(width)` and `cart_pole()` make a model, ready for its first step, and
    return (advance, check, compile_s): `advance(n)` makes n steps, `check()` gives the last sum's first element or the
    angle. All times are CPU times, which other processes disturb least; the fastest of the repetitions counts."""
    case, steps, repeats = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    if case == "cartpole":
        advance, check, compile_s = cart_pole()
        check_steps = round(CARTPOLE["check_time"] / CARTPOLE["step"])
    else:
        advance, check, compile_s = chain(23 if case == "chain23" else 1)
        check_steps = CHAIN["check_steps"]
    startup = time.process_time() - compile_s  # interpreter and imports are part of it
    advance(check_steps)
    value = check()
    fastest = float("inf")
    for _ in range(repeats):
        begin = time.process_time()
        advance(steps)
        fastest = min(fastest, time.process_time() - begin)
    print(json.dumps({"step_ns": fastest / steps * 1e9, "startup_s": startup, "compile_s": compile_s, "check": value}))

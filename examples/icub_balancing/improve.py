#!/usr/bin/env python3
"""improve.py BF MODEL [--steps 4] [--duration 1.5]: gains of the centre of mass that let a push move it less.

The cost of a run is the integral of |c - c_r|, checks.distance, over `duration` seconds with a push at 0.2 s. `bf gradient`
says how it changes with the gains K_p and K_d of momentum_rate.yaml, through contacts and the quadratic program. Each step
goes down along it, in the logarithms of the gains, so that they stay above 0; it is halved until the cost falls.
"""
import argparse
import math
import re
import subprocess
import sys

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("bf")
parser.add_argument("model")
parser.add_argument("--steps", type=int, default=4)
parser.add_argument("--duration", type=float, default=1.5)
options = parser.parse_args()
PUSHED = ["--set", "scenario=2", "--set", "Push.at_y=0.2"]
GAINS = {"com_p": "controller.momentum_rate.K_p.K", "com_d": "controller.momentum_rate.K_d.K"}


def settings(gains):
    return [word for name, values in gains.items()
            for word in ("--set", f"Gain.{name}=[{', '.join(repr(value) for value in values)}]")]


def cost_of(gains):
    """Of a run, with its gradient; without gains those of the model."""
    by = [word for block in GAINS.values() for word in ("--by", block)]
    said = subprocess.run([options.bf, "gradient", options.model, "--cost", "checks.distance", "--duration",
                           str(options.duration), *by, *PUSHED, *settings(gains)], check=True, capture_output=True, text=True).stdout
    rows = re.findall(r"^  (\S+?)(?:\[\d+\])+ +at (\S+) +(\S+)$", said, re.MULTILINE)
    of = lambda column: {name: [float(row[column]) for row in rows if row[0] == block] for name, block in GAINS.items()}
    return float(re.search(r"^cost  (\S+)$", said, re.MULTILINE)[1]), of(1), of(2)


def moved(gains, slopes, by):
    """Down along the gradient in logarithms: the largest of them changes by `by`."""
    relative = {name: [g * s for g, s in zip(gains[name], slopes[name])] for name in gains}
    largest = max(abs(r) for all_of in relative.values() for r in all_of)
    return {name: [g * math.exp(-by * r / largest) for g, r in zip(gains[name], relative[name])] for name in gains}


cost, gains, slopes = cost_of({})
print(f"start   cost {1000 * cost:.4f} mm s")
by = 0.5
for k in range(options.steps):
    while by > 1e-3:
        tried = moved(gains, slopes, by)
        try:
            found = cost_of(tried)
        except subprocess.CalledProcessError:  # it fell
            found = (math.inf, {}, {})
        if found[0] < cost:
            break
        by /= 2
    else:
        sys.exit("no step along the gradient lets it cost less")
    cost, _, slopes = found
    gains = tried
    print(f"step {k + 1}  cost {1000 * cost:.4f} mm s  {' '.join(settings(gains)[1::2])}")

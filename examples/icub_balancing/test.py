"""Runs a scenario and expects every check of the model to pass.

Usage: test.py BF MODEL [--compare OPTION...] [-- OPTION...]. With --compare the model is run a second time with those
options, and both runs must come to the very same figures.
"""
import json
import subprocess
import sys


def run(bf, model, options):
    result = subprocess.run([bf, "run", model, "--quiet", "--json", *options], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


bf, model, *rest = sys.argv[1:]
compare = []
if "--compare" in rest:
    at = rest.index("--compare")
    rest, compare = rest[:at], rest[at + 1:]
summary = run(bf, model, rest)
failed = [name for name, value in summary["checks"].items() if value is False]
assert not failed, f"failed: {failed}; {summary['checks']}"
assert summary["checks"]["stood"] is True
if compare:
    assert run(bf, model, rest + compare)["checks"] == summary["checks"]

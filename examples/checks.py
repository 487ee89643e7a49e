"""Runs a model and expects every check in it to pass.

Usage: checks.py BF MODEL [OPTION...] [--compare OPTION...]. With --compare the model is run a second time with those
options as well, and both runs must come to the very same figures.
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
assert any(value is True for value in summary["checks"].values()), f"nothing is checked: {summary['checks']}"
if compare:
    assert run(bf, model, rest + compare)["checks"] == summary["checks"]

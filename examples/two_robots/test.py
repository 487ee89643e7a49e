"""Runs the model and expects all of its checks to pass.

Usage: test.py BF MODEL
"""
import json
import subprocess
import sys

bf, model = sys.argv[1:]
result = subprocess.run([bf, "run", model, "--quiet", "--json"], capture_output=True, text=True)
assert result.returncode == 0, result.stderr
checks = json.loads(result.stdout)["checks"]
passed = [value for value in checks.values() if isinstance(value, bool)]
assert len(passed) == 3 and all(passed), checks

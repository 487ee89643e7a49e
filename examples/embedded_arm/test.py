"""The bare-metal result is that of this computer, bit for bit in double precision. Usage: test.py BF; 77: skipped."""
import pathlib
import struct
import subprocess
import sys

result = subprocess.run([pathlib.Path(__file__).with_name("run.sh"), sys.argv[1]], capture_output=True, text=True)
if result.returncode == 77:
    print(result.stdout)
    sys.exit(77)
assert result.returncode == 0, result.stdout + result.stderr
double, single = result.stdout.split()
y = 0.0
for _ in range(10):
    y = y + 0.2 * (1.0 - y)
assert bytes.fromhex(double) == struct.pack("<d", y), (double, y)
assert abs(struct.unpack("<f", bytes.fromhex(single))[0] - y) < 1e-6, single

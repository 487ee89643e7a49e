"""Prints expected.csv from the data sheet: y = gain (raw - offset)."""
channels = [line.split() for line in open("calibration.txt")]
gain, offset = [float(c[1]) for c in channels], [float(c[2]) for c in channels]
print("time,measured.y[pressure],measured.y[temperature],measured.y[flow],pressure.y,temperature.y")
for k in range(10):
    t = 0.1 * k
    raw = [100 + 20 * t, 2981.5 + 5 * t, 50 + 100 * t]
    y = [g * (r - o) for g, r, o in zip(gain, raw, offset)]
    print(",".join(repr(x) for x in [t, *y, *y[:2]]))

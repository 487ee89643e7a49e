#!/usr/bin/env python3
"""Prints what model.yaml must give, from the difference equation as textbooks write it:

    y[k] = b0 u[k] + b1 u[k-1] + b2 u[k-2] - a1 y[k-1] - a2 y[k-2]
"""
from math import pi, sin, sqrt, tan

T, steps = 0.01, 200
k = tan(pi * 5 * T)
scale = 1 / (1 + sqrt(2) * k + k * k)
b = [k * k * scale, 2 * k * k * scale, k * k * scale]
a = [scale * 2 * (k * k - 1), scale * (1 - sqrt(2) * k + k * k)]

u, y = [], []
for i in range(steps):
    t = i * T
    disturbance = sum(size * sin(2 * pi * f * t) for size, f in ((0.3, 31), (0.2, 37), (0.1, 43)))
    u.append([sin(2 * pi * t + phase) + disturbance for phase in (0, pi / 2)])
    past_u = [u[i - j] if i >= j else [0, 0] for j in range(3)]
    past_y = [y[i - j] if i >= j else [0, 0] for j in (1, 2)]
    y.append([sum(b[j] * past_u[j][n] for j in range(3)) - sum(a[j] * past_y[j][n] for j in range(2)) for n in range(2)])

print("time,measured.y[1],measured.y[2],filter.y[1],filter.y[2]")
for i in range(steps):
    print(i * T, *u[i], *y[i], sep=",")

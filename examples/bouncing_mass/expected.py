#!/usr/bin/env python3
"""Prints what model.yaml must give: between two bounces the mass is on a parabola, and each takes 0.8 of the speed before it."""
from math import sqrt

g, e, h0 = 9.81, 0.8, 1
began, h, v = 0, h0, 0  # of the parabola
lands = sqrt(2 * h0 / g)

print("time,mass.h (m),mass.v (m/s)")
for i in range(0, 200, 5):
    t = i * 0.01
    while t > lands:
        began, h, v = lands, 0, e * (g * (lands - began) - v)
        lands = began + 2 * v / g
    s = t - began
    print(t, h + v * s - g * s**2 / 2, v - g * s, sep=",")

#!/usr/bin/env python3
"""Prints what model.yaml must give. The ball lands at t1 = √(2 h / g) and then after 2 t1 e, 2 t1 e², ...: bounce n is at
t1 (1 + 2 (e + ... + e^n)), in between it flies on a parabola."""
from math import sqrt

g, e, h = 9.81, 0.8, 1
fall = sqrt(2 * h / g)

print("time,height,velocity.y")
for i in range(0, 350, 5):
    t, since, up = i * 0.01, i * 0.01 + fall, g * fall  # as if thrown up from the ground at -t1
    while since >= 2 * up / g:
        since -= 2 * up / g
        up *= e
    print(t, up * since - g * since**2 / 2, up - g * since, sep=",")

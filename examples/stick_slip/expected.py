#!/usr/bin/env python3
"""Prints what model.yaml must give, by an implicit fifth-order Runge-Kutta method of SciPy (Radau)."""
import numpy as np
from scipy.integrate import solve_ivp

m, k, belt, stick, slide, fade, width = 1, 10, 0.2, 3, 2, 0.1, 1e-3


def friction(v):
    r = belt - v
    return (slide + (stick - slide) * np.exp(-((r / fade) ** 2))) * np.tanh(r / width)


times = [round(0.1 * i, 2) for i in range(80)]
x = solve_ivp(lambda _, x: [x[1], (friction(x[1]) - k * x[0]) / m], (0, 8), [0, 0], "Radau", times,
              rtol=1e-11, atol=1e-13).y
print("time,x,v")
for t, p, v in zip(times, *x):
    print(t, p, v, sep=",")

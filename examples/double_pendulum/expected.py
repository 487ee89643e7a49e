#!/usr/bin/env python3
"""Prints what model.yaml must give: the angles by an eighth-order method of SciPy on the equations solved for the
accelerations by hand, and the energy of the beginning."""
import numpy as np
from scipy.integrate import solve_ivp

g, start = 9.81, [2, 1.5, 0, 0]


def slope(_, x):
    theta1, theta2, w1, w2 = x
    c, s = np.cos(theta1 - theta2), np.sin(theta1 - theta2)
    b1, b2 = -s * w2**2 - 2 * g * np.sin(theta1), s * w1**2 - g * np.sin(theta2)
    return [w1, w2, (b1 - c * b2) / (2 - c**2), (2 * b2 - c * b1) / (2 - c**2)]


times = [round(0.1 * i, 2) for i in range(30)]
x = solve_ivp(slope, (0, 3), start, "DOP853", times, rtol=1e-13, atol=1e-13).y
energy = -g * (2 * np.cos(start[0]) + np.cos(start[1]))
print("time,q[1],q[2],w[1],w[2],energy")
for t, row in zip(times, x.T):
    print(t, *row, energy, sep=",")

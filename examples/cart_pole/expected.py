#!/usr/bin/env python3
"""Prints what model.yaml must give: the plant by an eighth-order method of SciPy from one sample of the controller to the
next, on its mass matrix, and the regulator's gain from the Riccati equation of the sampled plant."""
import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm, solve_discrete_are

M, m, l, g, T = 1, 0.1, 0.5, 9.81, 0.01


def slope(_, x, F):
    c, s = np.cos(x[1]), np.sin(x[1])
    mass = np.array([[M + m, m * l * c], [m * l * c, m * l**2]])
    return [x[2], x[3], *np.linalg.solve(mass, [F + m * l * s * x[3] ** 2, m * g * l * s])]


def regulator():
    A = np.zeros((5, 5))  # linear at rest upright, with the force as a fifth constant state
    A[0, 2] = A[1, 3] = 1
    A[2:4, 1:5:3] = np.linalg.solve([[M + m, m * l], [m * l, m * l**2]], [[0, 1], [m * g * l, 0]])
    sampled = expm(A * T)
    A, B = sampled[:4, :4], sampled[:4, 4:]
    Q, R = np.diag([10, 10, 1, 1]), np.array([[0.1]])
    P = solve_discrete_are(A, B, Q, R)
    return np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)[0]


def force(x):
    wrapped = np.arctan2(np.sin(x[1]), np.cos(x[1]))
    if abs(wrapped) <= 0.5:
        return -K @ [x[0], wrapped, x[2], x[3]]
    missing = m * l**2 / 2 * x[3] ** 2 + m * g * l * (np.cos(x[1]) - 1)
    return np.clip(20 * missing * x[3] * np.cos(x[1]) - 3 * x[0] - 4 * x[2], -10, 10)


K = regulator()
x = np.array([0, np.pi - 0.01, 0, 0])
print("time,plant.state[1],plant.state[2],plant.state[3],plant.state[4],controller.F")
for i in range(600):
    F = force(x)
    if i % 10 == 0:
        print(round(i * T, 2), *x, F, sep=",")
    x = solve_ivp(slope, (0, T), x, "DOP853", rtol=1e-12, atol=1e-12, args=(F,)).y[:, -1]

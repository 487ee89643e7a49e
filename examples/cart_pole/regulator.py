#!/usr/bin/env python3
"""The regulator of the cart-pole, twice: by Riccati's equation of its linearised diagram, and by following the exact gradient
of what a run of the diagram costs, which needs no equation and holds for any diagram and cost."""

import pathlib

import control
import numpy as np
from scipy.optimize import minimize

import blockfactory as bf

HERE = pathlib.Path(__file__).parent
T, Q, R = 0.01, np.diag([10, 10, 1, 1]), np.array([[0.1]])


def by_riccati():
    """F = -K x, and P of the least cost x' P x that is to come, in samples."""
    plant = bf.load(HERE / "plant.yaml", {"start": "zeros(4, 1)", "step": 0.001, "solver": "rk4"}).linearize("F", "state")
    order = plant.C  # of the states in the output
    A, B = order @ plant.A @ order.T, order @ plant.B
    sampled = control.c2d(control.ss(A, B, np.eye(4), 0), T)
    K, P, _ = control.dlqr(sampled.A, sampled.B, Q, R)
    return K[0], P


def by_gradient(K, steps=200):
    """From the gain K to a better one, with its cost."""
    sim = bf.load(HERE / "regulated.yaml").simulate()

    def cost(gain):
        sim.parameters["lqr.K"] = -gain.reshape(1, 4)
        found = sim.gradient("lqr.K", cost="cost", duration=10)
        return scale * found.cost, -scale * found.slopes

    scale = 1e5  # with which the first step is short
    found = minimize(cost, K, jac=True, method="BFGS", options={"maxiter": steps, "gtol": 1e-8})
    return found.x, found.fun / scale


if __name__ == "__main__":
    K, P = by_riccati()
    start = np.array([0.001, 0.0005, 0, 0])
    print("Riccati  K", K, " cost", T * start @ P @ start)
    K, cost = by_gradient(np.array([-4.0, -45, -7, -10]))
    print("gradient K", K, " cost", cost)

#!/usr/bin/env python3
"""Prints what model.yaml must give. The converter is linear with a piecewise constant input, so from sample to sample the
solution is a matrix exponential."""
import numpy as np
from scipy.linalg import expm

T, Vin, Ron, Cp, L, RL, C, load = 1e-5, 12, 0.05, 2e-8, 47e-6, 0.05, 22e-6, 5
A = np.array([
    [-1 / (Ron * Cp), -1 / Cp, 0, 1 / (Ron * Cp)],
    [1 / L, -RL / L, -1 / L, 0],
    [0, 1 / C, -1 / (load * C), 0],
    [0, 0, 0, 0]])
step = expm(A * T / 25)

x = np.zeros(4)  # with the voltage that the switch applies
print("time,supply,x[1],x[2],x[3]")
for i in range(2500):
    x[3] = Vin if i % 25 < 10 else 0
    if i % 21 == 0:
        print(i * (T / 25), x[3], *x[:3], sep=",")
    x = step @ x

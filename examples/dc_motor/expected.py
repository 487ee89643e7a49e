#!/usr/bin/env python3
"""Prints what model.yaml must give. Motor and controller are one linear system with piecewise constant inputs (the voltage
stays within the supply), so from sample to sample the solution is a matrix exponential."""
import numpy as np
from scipy.linalg import expm

R, L, k, J, b = 1, 0.01, 0.05, 2e-4, 1e-4
P, I, D, N = 0.1, 1.3, 5e-4, 200
# x = [current, speed, integral part, filtered error], u = [reference, load], e = r - speed
output = np.array([0, -(P + D * N), 1, -D * N, P + D * N, 0])  # the voltage, of [x, u]
A = np.array([
    [-R / L, -k / L, 0, 0, 0, 0],
    [k / J, -b / J, 0, 0, 0, -1 / J],
    [0, -I, 0, 0, I, 0],
    [0, -N, 0, -N, N, 0],
    [0] * 6,
    [0] * 6])
A[0] += output / L
step = expm(0.001 * A)

z = np.zeros(6)
print("time,reference,omega,current,pid")
for i in range(1000):
    z[4:] = 100 if i >= 100 else 0, 0.05 if i >= 600 else 0
    assert abs(output @ z) < 24
    if i % 20 == 0:
        print(i * 0.001, z[4], z[1], z[0], output @ z, sep=",")
    z = step @ z

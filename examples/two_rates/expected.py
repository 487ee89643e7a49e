#!/usr/bin/env python3
"""Prints what model.yaml must give. Between two hits of the controller the position moves on a straight line. At the hits
x[n+1] = x[n] + K T (1 - x[n-1]), whose deviation e = 1 - x follows e[n+1] - e[n] + K T e[n-1] = 0 from e[0] = e[1] = 1:
e[n] = 2 Re(c z^n) with the complex root z of z² - z + K T."""
import cmath

K, T = 4, 0.1
z = (1 + cmath.sqrt(1 - 4 * K * T)) / 2
c = complex(0.5, (z.real / 2 - 0.5) / z.imag)  # so that e[0] = 1 and e[1] = 1 for 2 Re(c z^n)


def deviation(n):
    return 2 * (c * z**n).real if n >= 0 else 0


print("time,controller.velocity,transition,position")
for i in range(0, 800, 4):
    n, part = divmod(i, 10)
    command = K * deviation(n - 1)
    slow = [K * deviation(n), command] if part == 0 else ["", ""]  # recorded at their hits
    print(i * 0.01, *slow, 1 - deviation(n) + part * 0.01 * command, sep=",")

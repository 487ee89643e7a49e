#!/usr/bin/env python3
"""Prints what model.yaml must give. While the heater stays on or off the temperature goes exponentially toward
outside + heat R; the thermostat decides at whole minutes."""
from math import exp

C, R, power, outside = 2e6, 0.01, 4000, -5
T, heat = 15.0, 0
print("time,temperature,heat")
for minute in range(360):
    if T <= 19:
        heat = power
    elif T >= 21:
        heat = 0
    end = outside + heat * R
    if minute % 5 == 0:
        print(minute * 60, T, heat, sep=",")
    T = end + (T - end) * exp(-60 / (R * C))

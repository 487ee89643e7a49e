import os
import pathlib

import pytest

import blockfactory as bf

ROOT = pathlib.Path(__file__).resolve().parents[2]

OSCILLATOR = """
model: oscillator
step: 0.01
stop: 4
solver: rk4
variables:
  k: {value: 40, minimum: 0, unit: N/m}
  d: 1.5
blocks:
  force: {block: Sum, signs: --}
  velocity: {block: Integrator}
  position: {block: Integrator, initial: 1}
  spring: {block: Gain, K: k}
  damper: {block: Gain, K: d}
connections:
  force: velocity
  velocity: [position, damper]
  position: spring
  spring: force.u1
  damper: force.u2
record: [position, velocity]
plots: {Position: [position]}
"""

# x+ = A x + B u, y = C x, of three states, two inputs and two outputs.
LINEAR = """
model: linear
step: 0.1
inputs: [u]
outputs: [y]
blocks:
  plant:
    block: DiscreteStateSpace
    A: "[0.9 0.1 0; -0.2 0.8 0.05; 0 0.3 0.7]"
    B: "[1 0; 0 0.5; 0.2 0]"
    C: "[1 0 0; 0 1 1]"
    D: "[0 0; 0 0]"
connections:
  u: plant
  plant: y
"""


@pytest.fixture
def write(tmp_path):
    """Writes a file of that name and gives its path."""

    def write(name, text):
        file = tmp_path / name
        file.write_text(text)
        return file

    return write


@pytest.fixture
def motor():
    return bf.load(ROOT / "docs/start/motor.yaml")


@pytest.fixture
def oscillator(write):
    return bf.load(write("oscillator.yaml", OSCILLATOR))

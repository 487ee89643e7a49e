"""Gains for requirements, beside python-control."""

import control
import numpy as np
import pytest

import blockfactory as bf

LOOP = """
model: loop
step: 0.002
solver: rk4
inputs: [r]
blocks:
  error: {block: Sum, signs: +-}
  pid: {block: PID, P: 0.1, I: 0.1, D: 0.1, N: 50}
  plant: {block: TransferFunction, numerator: 3, denominator: "[1 1.4 4 1]"}
connections:
  r: error.u1
  error: pid
  pid: plant
  plant: error.u2
"""


@pytest.fixture
def loop(write):
    return bf.load(write("loop.yaml", LOOP))


def test_tuned_loops_have_the_margins_that_python_control_finds(loop):
    tuned = loop.tune("pid", "pid", crossover=2, phase_margin=50)
    P, I, D = (tuned.gains[name] for name in ("pid.P", "pid.I", "pid.D"))
    L = (P + control.tf([I], [1, 0]) + D * control.tf([50, 0], [1, 50])) * control.tf([3], [1, 1.4, 4, 1])
    _, phase, _, _, at, _ = control.stability_margins(L)
    assert phase == pytest.approx(50, rel=1e-6)
    assert at == pytest.approx(2, rel=1e-6)
    assert P**2 == pytest.approx(4 * I * D)
    assert tuned.gains_before == {"pid.P": 0.1, "pid.I": 0.1, "pid.D": 0.1}
    assert bf.load(loop.file, tuned.gains).linearize(loop="pid").margins().phase == pytest.approx(50, abs=1e-6)
    assert len(tuned.bode().axes) == 2


def test_an_overshoot_is_that_of_python_control_and_of_the_simulation(loop):
    with loop.simulate() as sim:
        tuned = sim.tune("pid", "pid", bandwidth=4, overshoot=15)
        assert tuned.margins.bandwidth == pytest.approx(4, rel=1e-6)
        closed = tuned.loop.to_control().feedback(1)
        information = control.step_info(closed, T=20, T_num=20001)
        assert information["Overshoot"] == pytest.approx(15, abs=0.3)
        time, value = sim.loop_step("pid", 10)
        assert 100 * (value.max() - 1) == pytest.approx(15, abs=0.3)
        there = control.step_response(closed, T=time)
        np.testing.assert_allclose(value, there.outputs, atol=1e-3)
        assert sim.parameters["pid.P"] == tuned.gains["pid.P"]


def test_what_cannot_be_reached_is_said_with_what_can(loop):
    with pytest.raises(bf.RunError, match="cannot be reached with pid.P, pid.I: .*there are crossovers from"):
        loop.tune("pid", ["pid.P", "pid.I"], crossover=10, phase_margin=60)
    with pytest.raises(bf.RunError, match="say how fast"):
        loop.tune("pid", "pid")

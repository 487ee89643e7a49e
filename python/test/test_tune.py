"""Gains for requirements, beside python-control."""

import subprocess
import sys

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
        # With what it acts on held where it is, nothing comes back.
        assert not sim.loop_step("pid", 1, open="error")[1].any()


def test_what_cannot_be_reached_is_said_with_what_can(loop):
    with pytest.raises(bf.RunError, match="cannot be reached with pid.P, pid.I: .*there are crossovers from"):
        loop.tune("pid", ["pid.P", "pid.I"], crossover=10, phase_margin=60)
    with pytest.raises(bf.RunError, match="say how fast"):
        loop.tune("pid", "pid")


def test_tuning_simulated_steps_and_gradients_end_with_control_c(tmp_path):
    (tmp_path / "loop.yaml").write_text(LOOP)
    code = f"""
import os, signal, threading
import blockfactory as bf
sim = bf.load({str(tmp_path / "loop.yaml")!r}).simulate()
sim.step()
sim.loop_step("pid", 0.01) # imports what it needs
sim.tune("pid", "pid.P", crossover=1)
def gradient(way): sim.gradient("pid.P", cost="plant", duration=1e5, way=way)
for what in (lambda: sim.loop_step("pid", 1e5), lambda: [sim.tune("pid", "pid.P", phase_margin=50) for _ in range(1000)],
             lambda: gradient("forward"), lambda: gradient("adjoint")):
    threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    try: what()
    except KeyboardInterrupt: print("interrupted", sim.time)
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert ended.stdout == "interrupted 0.002\n" * 4, ended.stderr


def test_one_gain_has_the_margin_that_python_control_finds(write):
    """The integral gain of a servo, which hardly moves the crossover, and a gain in an inner loop."""
    text = LOOP.replace("P: 0.1, I: 0.1, D: 0.1", "P: 2, I: 0.5, D: 0.3").replace(
        'numerator: 3, denominator: "[1 1.4 4 1]"', 'numerator: 1, denominator: "[0.05 1.05 1 0]"'
    )
    servo = bf.load(write("servo.yaml", text))
    for margin in (25, 34, 40):
        tuned = servo.tune("pid", "pid.I", phase_margin=margin)
        controller = 2 + control.tf([tuned.gains["pid.I"]], [1, 0]) + 0.3 * control.tf([50, 0], [1, 50])
        _, phase, _, at = control.margin(controller * control.tf([1], [0.05, 1.05, 1, 0]))
        assert phase == pytest.approx(margin, abs=1e-4)
        assert at == pytest.approx(tuned.margins.gain_crossover, rel=1e-6)

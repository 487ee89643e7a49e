"""Sensitivities of checks, beside closed forms and other runs."""

import math

import numpy as np
import pytest

import blockfactory as bf

DECAY = """
model: decay
step: 0.001
stop: 1
solver: rk4
variables: {a: 0.7, b: 2}
blocks:
  x: {block: Integrator, initial: b}
  slope: {block: Gain, K: -a}
  end: {block: Check, kind: final, at_most: 1}
  error: {block: Check, kind: rms, at_most: 3}
connections: {x: [slope, end, error], slope: x}
"""


def test_sensitivities_are_those_of_the_closed_form(write):
    found = bf.load(write("decay.yaml", DECAY)).sensitivities()
    end = found.checks["end"]
    assert found.names == ["a", "b"]
    assert end.value == pytest.approx(2 * math.exp(-0.6993), rel=1e-9)
    np.testing.assert_allclose(end.slopes, [-0.999 * end.value, end.value / 2], rtol=1e-6)
    np.testing.assert_allclose(end.distance_slopes, -end.slopes)
    np.testing.assert_allclose(end.changes_to_limit, -end.distance / end.distance_slopes)
    assert end.differenced == "" and end.passed
    table = found.to_pandas()
    assert list(table["check"]) == ["end", "end", "error", "error"]
    assert table["is_exact"].all()


def test_a_change_to_the_limit_takes_the_check_there(write):
    file = write("decay.yaml", DECAY)
    found = bf.load(file).sensitivities("a", checks="end")
    a = 0.7 + found.checks["end"].changes_to_limit[0]
    with bf.load(file, {"a": a}).simulate() as sim:
        sim.run()
        assert sim.checks["end"] == pytest.approx(1, abs=1e-3)


def test_what_has_no_gradient_is_differenced(write):
    found = bf.load(write("decay.yaml", DECAY), solver="dormand_prince45").sensitivities("b", checks="end")
    end = found.checks["end"]
    assert "the solver chooses its steps" in end.differenced
    np.testing.assert_allclose(end.slopes, [end.value / 2], rtol=1e-4)
    with pytest.raises(bf.RunError, match="did you mean 'end'"):
        bf.load(write("decay.yaml", DECAY)).sensitivities(checks="edn")

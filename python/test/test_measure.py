"""Frequency responses by simulation, beside python-control."""

import control
import numpy as np
import pytest

import blockfactory as bf
from test_analysis import LOOP, L

OMEGA = [0.1, 0.3, 1, 3]


@pytest.fixture
def loop(write):
    return bf.load(write("loop.yaml", LOOP), {"pi.numerator": [0.2, 0.1]})


def test_a_measured_response_is_that_of_python_control(loop):
    closed = control.feedback(0.1 * L, 1)
    found = loop.frequency_response("r", "plant", omega=OMEGA, tolerance=1e-7)
    np.testing.assert_allclose(found.omega, OMEGA, rtol=2e-3)
    np.testing.assert_allclose(found.value, closed(1j * found.omega), rtol=1e-5)
    np.testing.assert_allclose(found.to_control()(1j * found.omega), found.value)
    assert found.distortion.max() < 1e-4 and found.coherence.min() > 0.9999
    assert len(found.bode().axes) == 3
    through = loop.frequency_response(loop="pi", omega=OMEGA, tolerance=1e-7)
    np.testing.assert_allclose(through.value, (0.1 * L)(1j * through.omega), rtol=1e-5)


def test_a_run_is_measured_where_it_is_and_stays_there(loop):
    with loop.simulate() as sim, loop.simulate() as other:
        for one in (sim, other):
            one.inputs["r"] = 1
            one.run(2)
        chirp = sim.frequency_response("r", "plant", omega=[0.5, 1, 2], chirp=True)
        assert np.isnan(chirp.distortion).all()
        assert len(chirp.bode().axes) == 3
        assert chirp.time == 2
        sim.run(1)
        other.run(1)
        assert sim["plant"] == other["plant"]


def test_what_is_wrong_is_refused(loop):
    with pytest.raises(bf.WrongValue, match="give from_ and to, or loop"):
        loop.frequency_response("r", omega=1)
    with pytest.raises(bf.RunError, match="did you mean 'plant'"):
        loop.frequency_response("r", "plnat", omega=1)
    with loop.simulate() as sim:
        sim.record()
        with pytest.raises(bf.RunError, match="the run is recorded or observed"):
            sim.frequency_response("r", "plant", omega=1)

"""State spaces, to and from python-control."""

import control
import numpy as np
import pytest

import blockfactory as bf


def loop(system, step):
    m = bf.Model("m").set("", step=step, **({} if getattr(system, "dt", 1) else {"solver": "rk4"}))
    m.add("u", "Constant", value=1).add_state_space("plant", system).add("end", "Terminator")
    return bf.load(m.connect("u", "plant").connect("plant", "end"))


@pytest.mark.parametrize(
    "system",
    [
        control.ss([[0.9, 0.1], [-0.2, 0.8]], [[0], [1]], [[1, 0]], [[0.5]], 0.1),
        control.ss([[0, 1], [-4, -0.4]], [[0], [1]], [[1, 0]], [[0]]),
        control.tf([1, 2], [1, 0.6, 5]),
        control.ss([[-2]], [[3]], [[4]], [[0]]),
        control.tf([1], [1, 2]),
    ],
    ids=["discrete", "continuous", "transfer function", "first order", "transfer function of first order"],
)
def test_a_system_of_python_control_steps_as_there_and_comes_back(system):
    step = system.dt or 0.01
    m = loop(system, step)
    sim = m.simulate()
    recording = sim.record("plant")
    sim.step(200)
    _, expected = control.step_response(system, T=np.arange(200) * step)
    np.testing.assert_allclose(recording["plant"].values.squeeze(), expected, atol=1e-7)
    back, whole = m.state_space("plant"), control.ss(system)
    for name in "ABCD":
        np.testing.assert_array_equal(getattr(back, name), getattr(whole, name))
    assert back.dt == (system.dt or 0)


def test_a_system_without_states_is_a_gain():
    m = bf.Model("m").set("", step=0.1).add("u", "Constant", value=[1, 2]).add("end", "Terminator")
    m.add_state_space("plant", control.ss([], [], [], [[1, 3], [0, 2], [5, 0]])).connect("u", "plant").connect("plant", "end")
    sim = bf.load(m).simulate()
    sim.step()
    np.testing.assert_array_equal(sim["plant"], [7, 4, 5])
    sim = loop(control.tf([3], [2]), 0.1).simulate()
    sim.step()
    assert sim["plant"] == 1.5


def test_systems_that_do_not_fit_are_refused():
    m = bf.Model("m")
    with pytest.raises(bf.WrongValue, match=r"B has shape \(1, 2\), but with the other matrices it must be \(2, 2\)"):
        m.add_state_space("p", (np.eye(2), [[1, 2]], np.eye(2), np.zeros((2, 2))))
    with pytest.raises(bf.WrongValue, match="matrix A is real, and given complex numbers"):
        m.add_state_space("p", (np.array([[1j]]), [[1]], [[1]], [[0]]))
    with pytest.raises(bf.WrongValue, match="without a period"):
        m.add_state_space("p", control.ss(0.5, 1, 1, 0, True))
    with pytest.raises(bf.UnknownName, match="'u' is of type Constant, not a state space"):
        loop(control.ss([[0.5, 0], [0, 0.1]], [[1], [1]], [[1, 1]], 0, 0.1), 0.1).state_space("u")

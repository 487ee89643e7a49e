"""Linear systems of models, beside python-control and SciPy."""

import re
import runpy

import control
import numpy as np
import pytest
from conftest import ROOT

import blockfactory as bf

LOOP = """
model: loop
step: 0.01
solver: rk4
inputs: [r]
outputs: [y]
blocks:
  error: {block: Sum, signs: +-}
  pi: {block: TransferFunction, numerator: "[2 1]", denominator: "[1 0]"}
  plant: {block: TransferFunction, numerator: 3, denominator: "[1 1.4 4 1]"}
connections:
  r: error.u1
  error: pi
  pi: plant
  plant: [error.u2, y]
"""

L = control.tf([2, 1], [1, 0]) * control.tf([3], [1, 1.4, 4, 1])


@pytest.fixture
def loop(write):
    return bf.load(write("loop.yaml", LOOP))


def test_matrices_go_to_python_control_with_their_names(oscillator, write):
    system = oscillator.linearize("force", ["position", "velocity.x"])
    there = system.to_control()
    assert system.states == ["velocity.x", "position.x"]
    np.testing.assert_allclose(system.A, [[-1.5, -40], [1, 0]])
    np.testing.assert_array_equal(there.A, system.A)
    assert there.state_labels == ["velocity_x", "position_x"]
    assert there.dt == 0


def test_a_closed_loop_has_the_transfer_function_of_its_parts(loop):
    system = loop.linearize("r", "plant")
    omega, value = system.frequency_response(np.logspace(-2, 2, 50))
    expected = control.feedback(L, 1)(1j * omega)
    np.testing.assert_allclose(value, expected, rtol=1e-9)
    np.testing.assert_allclose(np.sort_complex(system.poles()), np.sort_complex(control.feedback(L, 1).poles()), rtol=1e-9)
    np.testing.assert_allclose(system.zeros(), [-0.5], rtol=1e-9)


@pytest.mark.parametrize("k", [0.1, 1], ids=["stable", "unstable"])
def test_margins_are_those_of_python_control(loop, k):
    m = bf.load(loop.file, {"pi.numerator": [2 * k, k]}).linearize(loop="plant").margins()
    assert repr(m).startswith(f"<Margins: gain {m.gain:.4g} at ") and f"phase {m.phase:.4g} degrees" in repr(m)
    gain, phase, modulus, at_gain, at_phase, _ = control.stability_margins(k * L)
    assert m.is_stable == (k < 1) == bool(np.all(control.feedback(k * L, 1).poles().real < 0))
    assert (m.gain if k < 1 else m.gain_reduction) == pytest.approx(gain, rel=1e-6)
    np.testing.assert_allclose([m.phase, m.gain_crossover], [phase, at_phase], rtol=1e-6)
    if k < 1:
        assert m.phase_crossover == pytest.approx(at_gain, rel=1e-6)
    assert m.modulus == pytest.approx(modulus, rel=1e-3)


def test_a_step_is_that_of_python_control(loop):
    mild = bf.load(loop.file, {"pi.numerator": [0.2, 0.1]})
    response = mild.linearize("r", "plant").step_response()
    closed = control.feedback(L / 10, 1)
    info = control.step_info(closed, T=response._time[-1], T_num=20000)
    assert response.final == pytest.approx(1)
    assert response.overshoot == pytest.approx(info["Overshoot"], abs=0.05)
    assert response.rise_time == pytest.approx(info["RiseTime"], rel=0.01)
    assert response.settling_time == pytest.approx(info["SettlingTime"], rel=0.01)
    even = np.linspace(0, response._time[-1], 20001)  # python-control takes no other times
    _, expected = control.step_response(closed, T=even)
    np.testing.assert_allclose(response._value, np.interp(response._time, even, expected), atol=1e-5)


def test_root_loci_begin_at_the_open_loop_poles(loop):
    gains, roots = loop.linearize(loop="plant").root_locus([0, 0.5, 2])
    np.testing.assert_allclose(np.sort_complex(roots[0]), np.sort_complex(L.poles()), atol=1e-9)
    np.testing.assert_allclose(np.sort_complex(roots[1]), np.sort_complex(control.feedback(0.5 * L, 1).poles()), atol=1e-9)


def test_a_run_is_linearised_where_it_is_and_stays_there(oscillator):
    sim = oscillator.simulate()
    sim.run(0.5)
    before = sim.snapshot()
    system = sim.linearize("force", "position")
    assert system.time == pytest.approx(0.5)
    assert sim.snapshot() == before
    np.testing.assert_allclose(system.x, [sim["velocity"], sim["position"]], atol=0.5)


def test_lqr_of_a_cart_pole_from_its_own_diagram_is_that_of_its_closed_form(write):
    g, m, l = 9.81, 0.2, 0.5
    text = """
model: cart_pole
step: 0.001
solver: rk4
inputs: [u]
outputs: [q, p]
blocks:
  cart: {block: Fcn, expression: (u1 + 0.2*sin(u2)*(0.5*u3^2 - 9.81*cos(u2))) / (1 + 0.2*sin(u2)^2)}
  pole: {block: Fcn, expression: (u1*cos(u2) + 0.1*u3^2*cos(u2)*sin(u2) - 1.2*9.81*sin(u2)) / (-0.5*(1 + 0.2*sin(u2)^2))}
  v: {block: Integrator}
  x: {block: Integrator}
  w: {block: Integrator}
  angle: {block: Integrator}
connections:
  u: [cart.u1, pole.u1]
  angle: [cart.u2, pole.u2, q]
  w: [cart.u3, pole.u3, angle]
  cart: v
  v: x
  x: p
  pole: w
"""
    system = bf.load(write("cart_pole.yaml", text)).linearize()
    assert system.differenced == []
    A = np.array([[0, 0, 0, -m * g], [1, 0, 0, 0], [0, 0, 0, (1 + m) * g / l], [0, 0, 1, 0]])
    B = np.array([[1], [0], [-1 / l], [0]])
    Q, R = np.diag([1, 10, 1, 100]), np.eye(1)
    found, _, _ = control.lqr(system.A, system.B, Q, R)
    expected, _, _ = control.lqr(A, B, Q, R)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_pictures_are_drawn(loop, tmp_path):
    system = loop.linearize(loop="plant")
    for picture in (system.bode(), system.nyquist(), system.nichols()):
        picture.savefig(tmp_path / "a.png")
        assert (tmp_path / "a.png").stat().st_size > 5000


def test_what_cannot_be_done_is_said(loop):
    with pytest.raises(bf.RunError, match="no signal or state 'plnt'; did you mean 'plant'"):
        loop.linearize("plnt")
    with pytest.raises(bf.WrongValue, match="give loop, or from_ and to"):
        loop.linearize("r", loop="plant")
    with pytest.raises(bf.WrongValue, match="0 s or later, not at -1"):
        loop.linearize(at=-1)
    with pytest.raises(bf.UnknownName, match="no output 'x'; there are plant"):
        loop.linearize("r", "plant").margins(output="x")
    with pytest.raises(bf.WrongValue, match="1 outputs and 1 inputs"):
        loop.linearize("r", "plant").zeros(3)


def test_a_run_goes_to_an_operating_point(loop):
    sim = loop.simulate()
    found, residuals = sim.trim("r", target={"plant": 0.4})
    assert max(abs(value) for value in residuals.values()) < 1e-8
    assert found["r"] == pytest.approx(0.4)
    sim.step()
    assert sim["plant"] == pytest.approx(0.4)
    with pytest.raises(bf.RunError, match="'r' is at its bound; widen it, or ask for less"):
        loop.simulate().trim("r", target={"plant": 0.4}, bounds={"r": (-0.1, 0.1)})


def test_an_operating_point_is_found_past_points_at_which_a_block_in_python_raises(write):
    @bf.block
    def Cubed(u):
        if u > 3:
            raise ValueError(f"{float(u)} is more than 3")  # as the solver's first try, from 0.3 along the slope
        return u**3

    text = "model: m\nstep: 0.1\ninputs: [r]\nblocks: {b: {block: python/Cubed}, end: {block: Terminator}}\n"
    sim = bf.load(write("cubed.yaml", text + "connections: {r: b, b: end}\n"), blocks=[Cubed]).simulate()
    sim.inputs["r"] = 0.3
    found, _ = sim.trim("r", target={"b": 8})
    assert found["r"] == pytest.approx(2)
    sim.step()
    with pytest.raises(bf.RunError, match="no operating point was found"):
        sim.trim("r", target={"b": 64})


def test_the_gradient_of_a_run_is_that_of_differences_of_runs(oscillator):
    sim = oscillator.simulate()
    sim.parameters["spring.K"] = 30
    sim.run(1)
    found = sim.gradient(["spring.K", "position.x"], cost="position", duration=2, at_end=True)
    assert sim.time == pytest.approx(1), "it stays where it was"
    assert found.names == ["spring.K", "position.x"]
    np.testing.assert_array_equal(found.at, [30, 1])
    assert not found.has_corner and not found.is_adjoint and found.differenced == []
    back = sim.gradient(["spring.K", "position.x"], cost="position", duration=2, at_end=True, way="adjoint")
    assert back.is_adjoint
    np.testing.assert_allclose(back.slopes, found.slopes, rtol=1e-12)
    with pytest.raises(bf.RunError, match="way is 'cheaper', 'forward' or 'adjoint', not 'back'"):
        sim.gradient("spring.K", cost="position", duration=1, way="back")

    def end(k, x):
        run = bf.load(oscillator.file, {"k": k, "position.initial": x}).simulate()
        run.run(2)
        run.step()
        return float(run["position"])

    assert found.cost == pytest.approx(end(30, 1), rel=1e-12)
    differences = [(end(30 + 1e-5, 1) - end(30 - 1e-5, 1)) / 2e-5, (end(30, 1 + 1e-5) - end(30, 1 - 1e-5)) / 2e-5]
    np.testing.assert_allclose(found.slopes, differences, rtol=1e-7)
    with pytest.raises(bf.RunError, match="the model has no parameter, state or input 'spring.k'"):
        sim.gradient("spring.k", cost="position", duration=1)
    with pytest.raises(bf.RunError, match="name parameters by which the cost is differentiated"):
        sim.gradient([], cost="position", duration=1)


def test_the_regulator_of_the_cart_pole_follows_from_its_own_diagram():
    example = runpy.run_path(str(ROOT / "examples/cart_pole/regulator.py"))
    K, P = example["by_riccati"]()
    written = re.search(r'K: "\[(.*)\]"', (ROOT / "examples/cart_pole/controller.yaml").read_text())
    assert written
    np.testing.assert_allclose(K, np.fromstring(written[1], sep=" "), rtol=1e-7)

    start = np.array([0.001, 0.0005, 0, 0])
    least = 0.01 * start @ P @ start
    sim = bf.load(ROOT / "examples/cart_pole/regulated.yaml").simulate()
    worse = sim.gradient("lqr.K", cost="cost", duration=10)
    sim.parameters["lqr.K"] = -K.reshape(1, 4)
    found = sim.gradient("lqr.K", cost="cost", duration=10)
    assert found.cost == pytest.approx(least, rel=1e-5)
    assert worse.cost > 1.1 * least
    assert np.abs(found.slopes).max() < 1e-4 * np.abs(worse.slopes).max()
    tuned, cost = example["by_gradient"](-worse.at)
    assert cost == pytest.approx(least, rel=1e-5)
    np.testing.assert_allclose(tuned, K, rtol=1e-4)


def test_a_block_that_raises_in_an_analysis_does_not_end_the_run():
    raises = False

    class Counter(bf.Block):
        u = bf.Input(())
        y = bf.Output(())
        x = bf.DiscreteState(())

        def output(self, at, out):
            if raises:
                raise ValueError("on purpose")
            out.y = at.x

        def update(self, at, next):
            next.x = at.x + 1

    m = bf.Model("m").add("c", "Constant", value=1.0).add("b", "python/Counter").connect("c", "b").set("", step=0.1)
    for analyse in (lambda s: s.linearize("c", "b"), lambda s: s.gradient("c.value", cost="b", duration=0.5)):
        sim = bf.load(m, blocks=[Counter]).simulate()
        sim.step(2)
        raises = True
        with pytest.raises(bf.RunError, match="b: ValueError: on purpose"):
            analyse(sim)
        raises = False
        sim.step()
        assert sim["b"] == 2


def test_a_block_that_raises_beside_the_operating_point_has_the_slope_of_the_other_side_or_is_named():
    allowed = lambda u: True  # noqa: E731

    class Limited(bf.Block):
        u = bf.Input(())
        y = bf.Output(())

        def output(self, at, out):
            if not allowed(at.u):
                raise ValueError(f"{float(at.u) - 2:.0e} more than 2")
            out.y = 3 * at.u

    m = bf.Model("m").add("c", "Constant", value=2.0).add("b", "python/Limited").connect("c", "b").set("", step=0.1)
    model = bf.load(m, blocks=[Limited])
    sim = model.simulate()
    allowed = lambda u: u <= 2  # noqa: E731
    for of in (model, sim):
        assert of.linearize("c", "b").D == pytest.approx(np.array([[3.0]]))
    allowed = lambda u: u == 2  # noqa: E731
    for of in (model, sim):
        with pytest.raises(bf.RunError, match=r"b: it fails beside this operating point \(ValueError: .* more than 2\)"):
            of.linearize("c", "b")
    sim.step()


def test_a_run_is_linearised_at_point_after_point_as_the_model_is_at_each(oscillator):
    sim = oscillator.simulate()
    for time in (0, 0.5, 1):
        sim.run(to=time)
        for to in ("position", "velocity"):
            here, there = sim.linearize("force", to), oscillator.linearize("force", to, at=time)
            for matrix in "ABCDx":
                np.testing.assert_array_equal(getattr(here, matrix), getattr(there, matrix))
            assert here.outputs == there.outputs
    sim.start()
    assert sim.linearize("force", "position").time == 0


def test_what_a_chart_remembers_is_gone_through_both_ways(write):
    chart = """
model: remembers
step: 0.1
blocks:
  m:
    block: StateMachine
    p: "[3 5]"
    chart:
      inputs: [x]
      parameters: [s, q]
      variables: {k: 1}
      outputs: [k]
      states:
        a: {entry: k = s, transitions: [{to: b, if: x > 0.45}]}
        b: {entry: k = s*q}
  x: {block: DiscreteIntegrator}
  one: {block: Constant, value: 1}
  c: {block: DiscreteIntegrator}
connections: {one: x, x: m.x, m.k: c}
"""
    m = bf.load(write("chart.yaml", chart))

    def cost(s, q):
        return bf.load(m.file, {"m.p": [s, q]}).simulate().gradient(["m.p"], cost="c", duration=1).cost

    h = 1e-3  # the cost is linear in each of both
    differences = [(cost(3 + h, 5) - cost(3, 5)) / h, (cost(3, 5 + h) - cost(3, 5)) / h]
    for way in ("forward", "adjoint"):
        found = m.simulate().gradient(["m.p"], cost="c", duration=1, way=way)
        by = [f"by m.p[{i + 1}] {float(slope)!r}" for i, slope in enumerate(found.slopes)]
        assert repr(found) == f"<Gradient: cost {found.cost!r}, {by[0]}, {by[1]}>"
        assert found.is_adjoint == (way == "adjoint") and found.slopes == pytest.approx(differences)

#include "linear.hpp"

#include "bf/analysis/response.hpp"

#include <numbers>
#include <set>

namespace bf::analysis::test {

namespace {

/// m x'' = u - k x - d x'.
const std::string oscillator = R"m(
model: oscillator
step: 0.01
solver: rk4
inputs: [u]
outputs: [x]
blocks:
  force: {block: Sum, signs: +--}
  acceleration: {block: Gain, K: 1/2}
  velocity: {block: Integrator}
  position: {block: Integrator, initial: 1}
  spring: {block: Gain, K: 40}
  damper: {block: Gain, K: 3}
connections:
  u: force.u1
  force: acceleration
  acceleration: velocity
  velocity: [position, damper]
  position: [spring, x]
  spring: force.u2
  damper: force.u3
)m";

/// A cart with an inverted pole: masses 1 and 0.2, length 0.5, force u.
const std::string cart_pole = R"m(
model: cart_pole
step: 0.001
solver: rk4
inputs: [u]
outputs: [angle, position]
blocks:
  cart:
    block: Fcn
    expression: (u1 + 0.2*sin(u2)*(0.5*u3^2 - 9.81*cos(u2))) / (1 + 0.2*sin(u2)^2)
  pole:
    block: Fcn
    expression: (u1*cos(u2) + 0.1*u3^2*cos(u2)*sin(u2) - 1.2*9.81*sin(u2)) / (-0.5*(1 + 0.2*sin(u2)^2))
  v: {block: Integrator}
  p: {block: Integrator}
  w: {block: Integrator}
  q: {block: Integrator}
connections:
  u: [cart.u1, pole.u1]
  q: [cart.u2, pole.u2, angle]
  w: [cart.u3, pole.u3, q]
  cart: v
  v: p
  p: position
  pole: w
)m";

} // namespace

TEST(Linearize, FindsTheMatricesOfAMassOnASpringByName) {
    const auto system = linear(oscillator);
    EXPECT_EQ(system.states, (std::vector<std::string>{"velocity.x", "position.x"}));
    EXPECT_EQ(system.inputs, std::vector<std::string>{"u"});
    EXPECT_EQ(system.outputs, std::vector<std::string>{"x"});
    expect_near(system.A, matrix_of({{-1.5, -20}, {1, 0}}));
    expect_near(system.B, matrix_of({{0.5}, {0}}));
    expect_near(system.C, matrix_of({{0, 1}}));
    expect_near(system.D, matrix_of({{0}}));
    EXPECT_EQ(system.period, 0);
    EXPECT_EQ(system.x[1], 1);
    EXPECT_TRUE(system.differenced.empty());
}

TEST(Linearize, AddsInputsAnywhereAndLooksAtStates) {
    // From a disturbance of the velocity's derivative to the state itself.
    const auto system = linear(oscillator, {.from = {"acceleration"}, .to = {"velocity.x", "spring"}});
    expect_near(system.B, matrix_of({{1}, {0}}));
    expect_near(system.C, matrix_of({{1, 0}, {0, 40}}));
}

TEST(Linearize, CutsALoopAndGivesItsOpenLoopTransferFunction) {
    const auto cut = linear(oscillator, {.from = {"spring"}, .to = {"spring"}, .open = {"spring"}});
    expect_near(cut.A, matrix_of({{-1.5, 0}, {1, 0}}));
    expect_near(cut.B, matrix_of({{-0.5}, {0}}));
    expect_near(cut.C, matrix_of({{0, 40}}));
    expect_near(cut.D, matrix_of({{0}}));
    // Without a cut the input is added, and what is looked at includes it: the sensitivity function.
    const auto added = linear(oscillator, {.from = {"spring"}, .to = {"spring"}});
    expect_near(added.A, matrix_of({{-1.5, -20}, {1, 0}}));
    expect_near(added.D, matrix_of({{1}}));
}

TEST(Linearize, OfACartPoleEqualsItsClosedForm) {
    const auto system = linear(cart_pole);
    ASSERT_EQ(system.states, (std::vector<std::string>{"v.x", "p.x", "w.x", "q.x"}));
    const double g = 9.81;
    expect_near(system.A,
                matrix_of({{0, 0, 0, -0.2 * g}, {1, 0, 0, 0}, {0, 0, 0, 1.2 * g / 0.5}, {0, 0, 1, 0}}),
                1e-13);
    expect_near(system.B, matrix_of({{1}, {0}, {-1 / 0.5}, {0}}), 1e-13);
    // Away from the upright pose, as the tangent of two runs that begin beside one another.
    const auto text = cart_pole;
    auto moved = text;
    moved.replace(moved.find("q: {block: Integrator}"), 22, "q: {block: Integrator, initial: 0.4}");
    moved.replace(moved.find("w: {block: Integrator}"), 22, "w: {block: Integrator, initial: -1.1}");
    const auto exact = linear(moved), differenced = linear(moved, {.by_differences = true});
    expect_near(exact.A, differenced.A, 1e-8);
    expect_near(exact.B, differenced.B, 1e-8);
    EXPECT_EQ(differenced.differenced.size(), 2 + 4u);
}

TEST(Linearize, OfDelaysIsShifts) {
    const auto system = linear(R"m(
model: m
step: 0.1
inputs: [u]
outputs: [y]
blocks:
  a: {block: UnitDelay}
  b: {block: UnitDelay}
  k: {block: Gain, K: 3}
connections: {u: a, a: b, b: k, k: y}
)m");
    expect_near(system.A, matrix_of({{0, 0}, {1, 0}}));
    expect_near(system.B, matrix_of({{1}, {0}}));
    expect_near(system.C, matrix_of({{0, 3}}));
    EXPECT_EQ(system.period, 0.1);
}

TEST(Linearize, GoesThroughVariablesOfAChartToTheirPorts) {
    const auto system = linear(R"m(
model: chart
step: 0.1
inputs: [u]
outputs: [v, w]
blocks:
  m:
    block: StateMachine
    chart: {inputs: [u], variables: {v: 0, w: 0}, outputs: [w, v], states: {a: {entry: v = 3*u; w = v^2 + u}}}
connections: {u: m.u, m.v: v, m.w: w}
)m");
    expect_near(system.D, matrix_of({{3}, {1}}));
}

TEST(Linearize, LeavesOutStatesThatNoInputReachesOrNoOutputSees) {
    const std::string text = R"m(
model: m
step: 0.1
inputs: [u]
outputs: [y]
blocks:
  plant: {block: Integrator}
  alone: {block: Integrator, initial: 1}
  loss: {block: Gain, K: -1}
  unseen: {block: Integrator}
  end: {block: Terminator}
connections: {u: plant, plant: [y, unseen], unseen: end, alone: loss, loss: alone}
)m";
    EXPECT_EQ(linear(text).states, std::vector<std::string>{"plant.x"});
    EXPECT_EQ(linear(text, {.all_states = true}).states,
              (std::vector<std::string>{"plant.x", "alone.x", "unseen.x"}));
}

TEST(Linearize, SolvesAlgebraicLoopsByTheImplicitFunctionTheorem) {
    // y = u - y^3 - 2 y at u = 4 is y = 1; dy/du = 1 / (1 + 3 y² + 2).
    const auto system = linear(R"m(
model: m
step: 0.1
algebraic_loops: solve
inputs: [u]
outputs: [y]
blocks:
  four: {block: Constant, value: 4}
  sum: {block: Sum, signs: ++-}
  f: {block: Fcn, expression: u^3 + 2*u}
connections: {u: sum.u1, four: sum.u2, f: sum.u3, sum: [f, y]}
)m");
    expect_near(system.D, matrix_of({{1.0 / 6}}), 1e-8);
    EXPECT_NEAR(system.y[0], 1, 1e-9);
}

TEST(Linearize, CutsALoopWhoseControllerGoesOnFromItsOwnOutput) {
    // L = C P, C = (3 z - 2.8)/(z - 1), P = 0.1/(z - 0.9).
    const auto loop = linear(R"m(
model: m
step: 0.05
inputs: [r]
outputs: [y]
blocks:
  e: {block: Sum, signs: +-}
  pi: {block: DiscreteTransferFunction, numerator: [3 -2.8], denominator: [1 -1]}
  plant: {block: DiscreteTransferFunction, numerator: 0.1, denominator: [1 -0.9]}
connections: {r: e.u1, plant: [e.u2, y], e: pi, pi: plant}
)m",
                             {.from = {"pi"}, .to = {"pi"}, .open = {"pi"}});
    ASSERT_EQ(loop.states.size(), 2u);
    for (const double omega : {0.3, 4.0, 50.0}) {
        const Complex z = std::exp(Complex(0, omega * 0.05));
        EXPECT_LT(
            std::abs(frequency_response(loop, 0, 0, omega) + (3.0 * z - 2.8) / (z - 1.0) * 0.1 / (z - 0.9)),
            1e-12);
    }
}

TEST(Linearize, CutsAnAlgebraicLoopAnywhere) {
    // L = (2 s + 1)/(s + 3), which is 2 at once.
    const std::string text = R"m(
model: m
step: 0.001
algebraic_loops: solve
inputs: [r]
outputs: [y]
blocks:
  e: {block: Sum, signs: +-}
  g: {block: TransferFunction, numerator: [2 1], denominator: [1 3]}
connections: {r: e.u1, e: g, g: [e.u2, y]}
)m";
    const Complex s(0, 1.7), L = (2.0 * s + 1.0) / (s + 3.0);
    for (const std::string at : {"e", "g"}) {
        const auto cut = linear(text, {.from = {at}, .to = {at}, .open = {at}});
        expect_near(cut.A, matrix_of({{-3}}));
        expect_near(cut.D, matrix_of({{-2}}));
        EXPECT_LT(std::abs(frequency_response(cut, 0, 0, 1.7) + L), 1e-13) << at;
        const auto added = linear(text, {.from = {at}, .to = {at}});
        EXPECT_LT(std::abs(frequency_response(added, 0, 0, 1.7) - 1.0 / (1.0 + L)), 1e-13) << at;
    }
    const auto ahead = linear(text, {.to = {"g"}, .open = {"g"}});
    EXPECT_LT(std::abs(frequency_response(ahead, 0, 0, 1.7) - L), 1e-13);
}

TEST(Linearize, HoldsASampledAlgebraicLoopBetweenItsSamples) {
    const auto text = [](const std::string& blocks, const std::string& connections) {
        return "model: m\nstep: 0.01\nsolver: rk4\nalgebraic_loops: solve\ninputs: [r]\noutputs: [y]\n"
               "blocks:\n  h: {block: ZeroOrderHold, period: 0.02}\n  p: {block: Integrator}\n" +
               blocks + "connections: {r: h, p: y, " + connections + "}\n";
    };
    const auto loop = linear(text("  e: {block: Sum, signs: +-}\n  g: {block: DiscreteTransferFunction, "
                                  "numerator: [2 1], denominator: [1 -0.5]}\n",
                                  "h: e.u1, e: g, g: [e.u2, p]"));
    // G/(1 + G)
    const auto closed = linear(text("  g: {block: DiscreteTransferFunction, numerator: [2 1], "
                                    "denominator: [3 0.5]}\n",
                                    "h: g, g: p"));
    ASSERT_EQ(loop.period, 0.02);
    for (const double omega : {0.3, 4.0, 50.0})
        EXPECT_LT(std::abs(frequency_response(loop, 0, 0, omega) - frequency_response(closed, 0, 0, omega)),
                  1e-12);
}

/// A sampled controller at two rates around a continuous plant.
const std::string sampled = R"m(
model: m
step: 0.01
solver: rk4
inputs: [r]
outputs: [y]
blocks:
  error: {block: Sum, signs: +-}
  hold: {block: ZeroOrderHold, period: 0.02}
  integral: {block: DiscreteIntegrator, gain: 2}
  slow: {block: ZeroOrderHold, period: 0.06}
  gain: {block: Gain, K: 0.7}
  control: {block: Sum}
  plant: {block: StateSpace, A: "[0 1; -3 -0.5]", B: "[0; 1]", C: "[1 0]", D: 0}
connections:
  r: error.u1
  plant: [error.u2, y]
  error: hold
  hold: [integral, slow]
  slow: gain
  gain: control.u1
  integral: control.u2
  control: plant
)m";

TEST(Linearize, MapsACommonPeriodAsRunsOfTheLinearModelDo) {
    const auto system = linear(sampled);
    ASSERT_EQ(system.period, 0.06);
    const int n = static_cast<int>(system.states.size());
    // The model is linear: a run from each state, and with each input held, is a column.
    for (int i = 0; i <= n; ++i) {
        Session session(sampled);
        auto& run = *session.simulation;
        const auto at = [&](int k) -> double& {
            const auto& name = system.states[static_cast<std::size_t>(k)];
            for (int node = 0; node < static_cast<int>(session.diagram.nodes.size()); ++node)
                for (int s = 0; s < static_cast<int>(session.diagram.nodes[static_cast<std::size_t>(node)]
                                                         .block->resolution()
                                                         .slots.size());
                     ++s) {
                    const auto path = session.diagram.end_path({node, s});
                    const auto& slot = session.diagram.slot({node, s});
                    for (int e = 0; is_state(slot.role) && e < slot.size.count(); ++e)
                        if (name == path || name == path + session.diagram.element_text({node, s}, e))
                            return static_cast<double*>(run.context().data(node, s))[e];
                }
            throw std::runtime_error("no state " + name);
        };
        if (i < n)
            at(i) = 1;
        else
            *reinterpret_cast<double*>(run.inputs().front().data) = 1;
        ASSERT_TRUE(run.step());
        EXPECT_NEAR(session("plant"), i < n ? system.C(0, i) : system.D(0, 0), 1e-12);
        for (int k = 1; k < 6; ++k) ASSERT_TRUE(run.step());
        for (int k = 0; k < n; ++k)
            EXPECT_NEAR(at(k), i < n ? system.A(k, i) : system.B(k, 0), 1e-9)
                << system.states[static_cast<std::size_t>(k)];
    }
}

TEST(Linearize, MapsAPeriodOfTenThousandStepsAsPowersDo) {
    const auto system = linear(R"m(
model: m
step: 0.001
inputs: [u]
outputs: [y]
blocks:
  x: {block: UnitDelay, initial: "[0; 0]", period: 0.001}
  A: {block: Gain, multiplication: K*u, K: "[0.9999 -0.001; 0.001 0.9999]"}
  b: {block: Gain, K: "[0.001; 0.002]"}
  next: {block: Sum, signs: ++}
  slow: {block: UnitDelay, initial: "[0; 0]", period: 10}
connections:
  x: [A, slow]
  A: next.u1
  u: b
  b: next.u2
  next: x
  slow: y
)m");
    Matrix step(2, 2), power = Matrix::Identity(2, 2);
    step << 0.9999, -0.001, 0.001, 0.9999;
    Vector b(2), sum = Vector::Zero(2);
    b << 0.001, 0.002;
    for (int k = 0; k < 10000; ++k) {
        sum = step * sum + b;
        power = step * power;
    }
    ASSERT_EQ(system.states, (std::vector<std::string>{"x.x[1]", "x.x[2]", "slow.x[1]", "slow.x[2]"}));
    EXPECT_EQ(system.period, 10);
    EXPECT_LT((system.A.topLeftCorner(2, 2) - power).norm(), 1e-12);
    EXPECT_LT((system.B.col(0).head(2) - sum).norm(), 1e-12 * sum.norm());
    EXPECT_EQ(system.A.bottomLeftCorner(2, 2), Matrix::Identity(2, 2));
    EXPECT_EQ(system.C.rightCols(2), Matrix::Identity(2, 2));
}

TEST(Linearize, SaysOfTheModelItselfWhetherALoopIsStableThatItsCutHolds) {
    // A loop at 100 Hz around an integrator, and a slow path aside of almost no gain.
    const auto text = [](const std::string& slow, const std::string& gain) {
        return "model: m\nstep: 0.01\nsolver: rk4\ninputs: [r]\noutputs: [y]\nblocks:\n"
               "  e: {block: Sum, signs: +-}\n  fast: {block: ZeroOrderHold, period: 0.01}\n"
               "  k: {block: Gain, K: " +
               gain + "}\n  p: {block: Integrator}\n  slow: {block: ZeroOrderHold, period: " + slow +
               "}\n  ks: {block: Gain, K: 0.001}\n  s: {block: Sum, signs: ++}\n"
               "connections: {r: e.u1, e: fast, fast: k, k: s.u1, slow: ks, ks: s.u2, s: p, "
               "p: [e.u2, slow, y]}\n";
    };
    const auto loop = [&](const std::string& slow, const std::string& gain, const char* at) {
        return negative(linear(text(slow, gain), {.from = {at}, .to = {at}, .open = {at}}));
    };
    for (const char* at : {"e", "fast", "k", "s", "p"}) {
        const auto held = loop("1.5", "2", at);
        ASSERT_EQ(held.held.size(), 1u) << at;
        EXPECT_EQ(held.held[0].find(std::string(at) + ": where it is cut it is held over the common period"),
                  0u)
            << held.held[0];
        EXPECT_FALSE(is_stable(closed(held))) << "held so long it would be unstable: " << at;
        EXPECT_TRUE(margins(held).is_stable) << at;
    }
    // From sample to sample p⁺ = (1 - 0.01 K) p.
    EXPECT_TRUE(margins(loop("1.5", "199", "e")).is_stable);
    EXPECT_FALSE(margins(loop("1.5", "201", "e")).is_stable);
    // Where all is sampled at once, or is slow itself, the matrices say it.
    for (const char* at : {"e", "fast", "k"}) {
        const auto one = loop("0.01", "2", at);
        EXPECT_TRUE(one.held.empty()) << at;
        EXPECT_FALSE(one.is_stable_uncut) << at;
        EXPECT_NEAR(margins(one).gain, 100, 0.2) << at;
    }
    EXPECT_TRUE(loop("1.5", "2", "slow").held.empty());
}

TEST(Linearize, OfTheContinuousPartBetweenSampledSignalsIsContinuous) {
    const auto system = linear(sampled, {.from = {"control"}, .open = {"control"}});
    EXPECT_EQ(system.period, 0);
    expect_near(system.A, matrix_of({{0, 1}, {-3, -0.5}}));
}

TEST(Linearize, SeesThatALimitedIntegratorStandsStill) {
    // Where y is at its limit the rule that limits it has found more than that.
    const std::string text = R"m(
model: m
step: 0.1
inputs: [u]
outputs: [y]
blocks:
  one: {block: Constant, value: 1}
  sum: {block: Sum}
  off: {block: Constant, value: 0}
  integral: {block: DiscreteIntegrator, method: trapezoidal, reset: rising, upper: 2}
connections: {u: sum.u1, one: sum.u2, sum: integral.u, off: integral.reset, integral: y}
)m";
    expect_near(linear(text, {}, 1).D, matrix_of({{0.05}}));
    expect_near(linear(text, {}, 5).D, matrix_of({{0}}));
}

TEST(Linearize, GoesOnFromARunAndLeavesItWhereItWas) {
    Session a(oscillator), b(oscillator);
    for (int k = 0; k < 50; ++k) ASSERT_TRUE(a.simulation->step() && b.simulation->step());
    const auto before = a.simulation->snapshot();
    linearize(*a.simulation, {});
    a.simulation->restore(before);
    for (int k = 0; k < 50; ++k) ASSERT_TRUE(a.simulation->step() && b.simulation->step());
    EXPECT_EQ(a.simulation->snapshot(), b.simulation->snapshot());
}

TEST(Linearize, OneLinearizerFindsAtEachPointWhatANewOneFinds) {
    // Which states are on a path, what is held, and where corners are, changes from point to point.
    const Session session(R"m(
model: m
step: 0.1
inputs: [u]
outputs: [y]
blocks:
  f: {block: Fcn, expression: "u^2"}
  limited: {block: Saturate, lower: -1, upper: 1}
  past: {block: UnitDelay, initial: 0.3}
  slow: {block: UnitDelay, initial: 0.2}
  product: {block: Product, operations: "**"}
  sum: {block: Sum, signs: ++}
  both: {block: Mux}
  which: {block: Fcn, expression: 1 + (u > 0)}
  picked: {block: IndexVector}
  on:
    execution: enabled
    inputs: [a]
    outputs: [b]
    blocks: {g: {block: Gain, K: 3}}
    connections: {a: g, g: b}
  total: {block: Sum, signs: +++}
connections:
  u: [f, on.a, on.enable, which]
  f: limited
  limited: [past, sum.u1, both.u1]
  past: [slow, product.u1]
  slow: product.u2
  product: [sum.u2, both.u2]
  both: picked.u
  which: picked.index
  picked: total.u3
  sum: total.u1
  on.b: total.u2
  total: y
)m");
    Simulation run(session.diagram);
    run.start();
    const LinearizeOptions options;
    Linearizer kept(run, options);
    auto* u = static_cast<double*>(
        run.context().data(session.diagram.inputs[0].end.node, session.diagram.inputs[0].end.slot));
    std::set<Eigen::Index> states;
    for (const double value : {0.5, 2.0, 1.0, -0.7, -3.0, 0.1, 0.0, 0.9}) {
        *u = value;
        const auto here = run.snapshot();
        const auto expected = linearize(run, options);
        run.restore(here);
        *u = value;
        const auto found = kept();
        EXPECT_EQ(found.A, expected.A) << value;
        EXPECT_EQ(found.B, expected.B) << value;
        EXPECT_EQ(found.C, expected.C) << value;
        EXPECT_EQ(found.D, expected.D) << value;
        EXPECT_EQ(found.states, expected.states) << value;
        EXPECT_EQ(found.x, expected.x) << value;
        EXPECT_EQ(found.y, expected.y) << value;
        EXPECT_EQ(found.time, expected.time) << value;
        EXPECT_EQ(found.held, expected.held) << value;
        EXPECT_EQ(found.kinks, expected.kinks) << value;
        EXPECT_EQ(found.inputs, expected.inputs) << value;
        states.insert(found.A.rows());
    }
    EXPECT_GT(states.size(), 1u);
}

TEST(Linearize, OfAnEnabledSubsystemIsThatOfItsBlocksWhileAnyElementOfItsEnableIsAboveZero) {
    const auto enabled_by = [](const std::string& enable) {
        return linear(R"m(
model: m
step: 0.1
inputs: [u]
outputs: [y]
blocks:
  enable: {block: Constant, value: ")m" +
                      enable + R"m("}
  side:
    execution: enabled
    inputs: [a]
    outputs: [b]
    blocks: {g: {block: Gain, K: 3}}
    connections: {a: g, g: b}
connections: {u: side.a, enable: side.enable, side.b: y}
)m");
    };
    for (const char* on : {"1", "[2; 0]", "[-1; 0.5]"}) {
        const auto found = enabled_by(on);
        EXPECT_EQ(found.D(0, 0), 3) << on;
        EXPECT_TRUE(found.held.empty()) << on;
    }
    for (const char* off : {"0", "[0; -1]"}) {
        const auto found = enabled_by(off);
        EXPECT_EQ(found.D(0, 0), 0) << off;
        EXPECT_EQ(found.held, std::vector<std::string>{"side: it is disabled"}) << off;
    }
}

TEST(Linearize, RefusesWhatItCannotWithItsPlaceAndRemedy) {
    EXPECT_EQ(refusal(oscillator, {.to = {"positoin"}}),
              "the model has no signal or state 'positoin'; did you mean 'position'?");
    EXPECT_EQ(refusal(oscillator, {.from = {"position.x"}}),
              "'position.x' is a state, to which nothing is added and which nobody reads as a signal; name "
              "an output of "
              "its block, or what it follows from");
    EXPECT_EQ(refusal(oscillator, {.from = {"u[2]"}}), "'u' has a single element, and not [2]");
    EXPECT_EQ(refusal("model: m\nstep: 1\nblocks:\n  a: {block: Constant, value: 1}\n"),
              "the model has no input at its root that is a real number; name signals with --from");
    EXPECT_EQ(refusal(R"m(
model: m
step: 0.1
inputs: [u]
outputs: [y]
blocks:
  root: {block: Sqrt}
connections: {u: root, root: y}
)m"),
              "root: its derivative is not finite at this operating point (as that of a root at 0); choose "
              "another one");
    EXPECT_EQ(refusal(R"m(
model: m
step: 0.1
inputs: [u]
outputs: [y]
blocks:
  past: {block: TransportDelay, delay: 0.3}
connections: {u: past, past: y}
)m",
                      {}, 1),
              "past: its state 'count' changes in this step, and with it the linear system; choose another "
              "time (--at), "
              "or a block that does without, as a Delay instead of a ring of samples");
}

TEST(Linearize, RefusesSamplesThatAreOnTheirWayBeforeTheyArrive) {
    const std::string text = "model: m\nstep: 0.1\nsolver: rk4\ninputs: [r]\noutputs: [y]\nblocks:\n"
                             "  e: {block: Sum, signs: +-}\n  past: {block: TransportDelay, delay: 0.5}\n"
                             "  g: {block: TransferFunction, numerator: 1, denominator: [1 1]}\n"
                             "connections: {r: e.u1, e: past, past: g, g: [e.u2, y]}\n";
    for (const double time : {0.1, 0.3, 0.7})
        EXPECT_EQ(refusal(text, {.from = {"e"}, .to = {"e"}, .open = {"e"}}, time)
                      .find("past: its state 'count' changes in this step"),
                  0u)
            << time;
}

TEST(Linearize, DoesNotLookAtWhatIsOnNoPathFromInputToOutput) {
    // Aside stand a subsystem that iterates, which has no derivative, and a block that has none at 0.
    const std::string text = R"m(
model: m
step: 0.1
solver: rk4
inputs: [u]
outputs: [y, s, r]
blocks:
  g: {block: TransferFunction, numerator: 2, denominator: [1 3]}
  lo:
    execution: for
    iterations: 2
    inputs: [a]
    outputs: [b]
    blocks: {sum: {block: Sum, signs: ++}, z: {block: UnitDelay}}
    connections: {a: sum.u1, z: sum.u2, sum: [z, b]}
  root: {block: Sqrt}
  k: {block: Gain, K: 4}
connections: {u: [g, lo, root], g: y, lo: k, k: s, root: r}
)m";
    const auto system = linear(text, {.to = {"y"}});
    ASSERT_EQ(system.A.rows(), 1);
    EXPECT_DOUBLE_EQ(system.A(0, 0), -3);
    EXPECT_DOUBLE_EQ(system.C(0, 0) * system.B(0, 0), 2);
    EXPECT_EQ(refusal(text, {.to = {"s"}}).find("lo: an iterating subsystem is not linearised"), 0u);
    EXPECT_EQ(refusal(text, {.to = {"r"}}).find("root: its derivative is not finite"), 0u);
    // A cut ends the path.
    EXPECT_EQ(linear(text, {.to = {"s"}, .open = {"lo"}}).D(0, 0), 0);
}

} // namespace bf::analysis::test

// Gradients of runs beside closed forms and central differences of runs.
#include "bf/analysis/gradient.hpp"

#include "bf/analysis/linearize.hpp"
#include "bf/core/differenced.hpp"
#include "bf/core/registry.hpp"

#include "../../engine/test/support.hpp"

#include <gtest/gtest.h>
#include <unsupported/Eigen/MatrixFunctions>

namespace bf::analysis::test {

using Runs = bf::test::Session;

namespace {

/// x' = -a x, from x(0) = b.
std::string lag(const std::string& solver) {
    return "model: lag\nstep: 0.01\nsolver: " + solver + R"m(
blocks:
  x: {block: Integrator, initial: 2}
  a: {block: Gain, K: -0.7}
connections: {a: x, x: a}
)m";
}

/// A pole on a cart near upright under feedback of its state, sampled at 100 Hz, and its quadratic cost.
const std::string balancing_pole = R"m(
model: cart_pole
step: 0.001
solver: rk4
blocks:
  cart: {block: Fcn, expression: "(u1 + 0.1*sin(u2)*(0.5*u3^2 - 9.81*cos(u2))) / (1 + 0.1*sin(u2)^2)"}
  pole: {block: Fcn, expression: "(9.81*sin(u2) - u1*cos(u2)) / 0.5"}
  v: {block: Integrator}
  p: {block: Integrator, initial: 0.1}
  w: {block: Integrator}
  q: {block: Integrator, initial: 0.05}
  x: {block: Mux, inputs: 4}
  sampled: {block: ZeroOrderHold, period: 0.01}
  K: {block: Gain, period: 0.01, multiplication: K*u, K: "[9.21319712 56.31151 9.69488177 12.66011936]"}
  limit: {block: Saturate, period: 0.01, lower: -20, upper: 20}
  weighted: {block: Gain, K: "sqrt([10; 10; 1; 1])"}
  errors: {block: Dot}
  effort: {block: Square}
  cheap: {block: Gain, K: 0.1}
  cost: {block: Sum, signs: ++}
connections:
  q: [cart.u2, pole.u2, x.u2]
  w: [cart.u3, q, x.u4]
  v: [p, x.u3]
  p: x.u1
  cart: [v, pole.u1]
  pole: w
  x: [sampled, weighted]
  sampled: K
  K: limit
  limit: [cart.u1, effort]
  weighted: [errors.u1, errors.u2]
  errors: cost.u1
  effort: cheap
  cheap: cost.u2
)m";

/// A tank that a chart fills and empties: its valve, what it counted and when it closes remember the
/// parameters of other steps.
std::string tank(const std::string& solver, const std::string& period) {
    return "model: tank\nstep: 0.01\nsolver: " + solver + R"m(
blocks:
  plan:
    block: StateMachine
    period: )m" +
           period + R"m(
    p: "[0.8 1.7 0.3]"
    chart:
      inputs: [level]
      parameters: [full, flow, leak]
      variables: {valve: 0, seen: 0, opened: 1}
      outputs: [valve, seen]
      states:
        fill:
          entry: "valve = flow*sqrt(opened); send pause after 0.35"
          during: "valve = valve*(1 - leak*period) + leak*(full - level)^2"
          transitions:
            - {to: drain, if: level > 0.4, do: "seen = seen + level*full"}
            - {on: pause, do: "opened = opened + leak*valve"}
        drain:
          entry: valve = -flow*opened
          during: "seen = seen*full + sin(level)"
          transitions: [{to: fill, after: 0.25}]
  level: {block: Integrator, initial: 0.1}
  out: {block: Gain, K: 0.9}
  change: {block: Sum, signs: "+-"}
  error: {block: Sum, signs: "++"}
  cost: {block: Square}
connections:
  level: [plan.level, out, error.u1]
  plan.valve: change.u1
  out: change.u2
  change: level
  plan.seen: error.u2
  error: cost
)m";
}

/// The cost of a run, as `gradient` has it.
double cost_of_run(Runs& session, double duration) {
    const auto& d = session.diagram;
    double total = 0;
    for (const double cost : session.trace("cost", static_cast<int>(std::lround(duration / d.step))))
        total += d.step * cost;
    return total;
}

/// y = sin(u) by a method, which is no rule.
struct Bend final : Block {
    using Block::Block;
    Input<double> u{this, "u"};
    Output<double> y{this, "y"};
    Status output(Now at, Out out) const noexcept override {
        out[y] = std::sin(at[u]);
        return ok;
    }
};

/// A number outside of the diagram, and one that cannot be saved.
struct Kept {
    double value = 0;
    std::size_t state_size() const { return 1; }
    void save(double* to) const { *to = value; }
    void restore(const double* from) { value = *from; }
};
struct Unsaved {
    double value = 0;
};

/// u of the step before.
template <class T> struct Late : Block {
    using Block::Block;
    OutsideState<T> kept{this, [] { return std::make_shared<T>(); }};
    Input<double> u{this, "u"};
    Output<double> y{this, "y"};
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[kept].value;
        return ok;
    }
    Status update(Now at, Next) const noexcept override {
        at[kept].value = at[u];
        return ok;
    }
};

/// √u by Newton's steps from the last root.
struct Root final : Block, WarmStarted {
    using Block::Block;
    OutsideState<Kept> last{this, [] { return std::make_shared<Kept>(); }};
    Input<double> u{this, "u"};
    Output<double> y{this, "y"};
    Status output(Now at, Out out) const noexcept override {
        double& root = at[last].value;
        if (root <= 0) root = 1;
        for (int i = 0; i < 60; ++i) root = 0.5 * (root + at[u] / root);
        out[y] = root;
        return ok;
    }
};

/// Both ends of a line that is opened once, and read a step later.
struct Line {
    static constexpr const char* resource = "Line";
    using Live = Kept;
    std::shared_ptr<Kept> open() const { return std::make_shared<Kept>(); }
};
struct LineEnd final : Block {
    using Block::Block;
    Provides<Line> line{this, [] { return std::make_shared<const Line>(); }};
    Output<double> y{this, "y"};
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[line].value;
        return ok;
    }
};
struct LineBegin final : Block {
    using Block::Block;
    Requires<Line> line{this, "where it writes to"};
    Input<double> u{this, "u"};
    Output<double> y{this, "y"};
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[line].value = at[u];
        return ok;
    }
};

const Library& outside_blocks() {
    static const Library library = [] {
        Library l("");
        auto& group = l.group("test");
        group.add<Bend>("Bend", "");
        group.add<Late<Kept>>("Late", "");
        group.add<Late<Unsaved>>("Device", "");
        group.add<Root>("Root", "");
        group.add<LineEnd>("LineEnd", "");
        group.add<LineBegin>("LineBegin", "");
        return l;
    }();
    return library;
}

std::string refusal_of(const std::string& text, const GradientOptions& options,
                       const Library* more = nullptr) {
    const Runs session(text, more);
    try {
        gradient(session.diagram, options);
    } catch (const RunError& error) {
        return error.what();
    }
    return {};
}

} // namespace

TEST(Gradient, OfALagIsItsClosedForm) {
    for (const std::string solver : {"rk4", "dormand_prince", "bogacki_shampine"}) {
        const Runs session(lag(solver));
        const auto found = gradient(
            session.diagram,
            {.by = {"a.K", "x.x"}, .cost = "x", .over = GradientOptions::Over::end, .duration = 1.5});
        const double decay = std::exp(-0.7 * 1.5), exact = solver == "bogacki_shampine" ? 1e-6 : 1e-9;
        EXPECT_NEAR(found.cost, 2 * decay, exact);
        EXPECT_EQ(found.names, (std::vector<std::string>{"a.K", "x.x"}));
        EXPECT_EQ(found.at, (Vector(2) << -0.7, 2).finished());
        EXPECT_NEAR(found.slopes[0], 1.5 * 2 * decay, exact) << "by the gain";
        EXPECT_NEAR(found.slopes[1], decay, exact) << "by the initial state";
        EXPECT_FALSE(found.has_corner);
    }
    using Way = GradientOptions::Way;
    for (const std::string solver : {"euler", "heun", "rk4", "dormand_prince", "bogacki_shampine"}) {
        const Runs session(lag(solver));
        GradientOptions options{.by = {"a.K", "x.x", "x.initial"}, .cost = "x", .duration = 1.37};
        for (const auto over : {GradientOptions::Over::all, GradientOptions::Over::end}) {
            options.over = over, options.way = Way::forward;
            const auto forward = gradient(session.diagram, options);
            options.way = Way::adjoint;
            const auto adjoint = gradient(session.diagram, options);
            EXPECT_TRUE(adjoint.is_adjoint && !forward.is_adjoint);
            EXPECT_EQ(adjoint.cost, forward.cost) << solver;
            EXPECT_EQ(adjoint.at, forward.at);
            EXPECT_LT((adjoint.slopes - forward.slopes).cwiseAbs().maxCoeff(), 1e-13) << solver;
        }
    }
    // Euler's steps have a gradient of their own: x(N) = 2 (1 - a h)^N.
    const Runs session(lag("euler"));
    const auto found = gradient(
        session.diagram, {.by = {"a.K"}, .cost = "x", .over = GradientOptions::Over::end, .duration = 1.5});
    EXPECT_NEAR(found.slopes[0], 2 * 150 * 0.01 * std::pow(1 - 0.7 * 0.01, 149), 1e-13);
}

TEST(Gradient, OfASampledClosedLoopIsThatOfCentralDifferencesOfRuns) {
    Runs session(balancing_pole);
    const std::vector<double> gains{9.21319712, 56.31151, 9.69488177, 12.66011936};
    const auto found =
        gradient(session.diagram, {.by = {"K.K", "p.x", "q.initial"}, .cost = "cost", .duration = 1});
    EXPECT_EQ(found.names, (std::vector<std::string>{"K.K[1][1]", "K.K[1][2]", "K.K[1][3]", "K.K[1][4]",
                                                     "p.x", "q.initial"}));
    {
        Runs run(balancing_pole);
        EXPECT_DOUBLE_EQ(found.cost, cost_of_run(run, 1)) << "it makes the steps of a run";
    }
    for (int i = 0; i < 6; ++i) {
        const double step = 1e-6;
        double costs[2];
        for (const int side : {0, 1}) {
            Runs run(balancing_pole);
            auto other = gains;
            const double by = side == 0 ? -step : step;
            if (i < 4) {
                other[static_cast<std::size_t>(i)] += by;
                run.simulation->set_parameter("K.K", other);
            } else {
                run.simulation->set_parameter(i == 4 ? "p.initial" : "q.initial",
                                              {(i == 4 ? 0.1 : 0.05) + by});
                run.simulation->start();
            }
            costs[side] = cost_of_run(run, 1);
        }
        const double difference = (costs[1] - costs[0]) / (2 * step);
        EXPECT_NEAR(found.slopes[i], difference, 1e-6 * (1 + std::abs(difference)))
            << found.names[static_cast<std::size_t>(i)];
    }
}

TEST(Gradient, GoesBackThroughSampledClosedLoopsAsItGoesForward) {
    const Runs session(balancing_pole);
    GradientOptions options{.by = {"K.K", "p.x", "q.initial", "limit.upper", "weighted.K", "cheap.K"},
                            .cost = "cost",
                            .duration = 0.997, // no whole number of stretches
                            .way = GradientOptions::Way::forward};
    const auto forward = gradient(session.diagram, options);
    options.way = GradientOptions::Way::adjoint;
    const auto adjoint = gradient(session.diagram, options);
    EXPECT_EQ(adjoint.names, forward.names);
    EXPECT_EQ(adjoint.cost, forward.cost);
    for (Eigen::Index i = 0; i < forward.slopes.size(); ++i)
        EXPECT_NEAR(adjoint.slopes[i], forward.slopes[i], 1e-11 * (1 + std::abs(forward.slopes[i])))
            << forward.names[static_cast<std::size_t>(i)];
}

TEST(Gradient, GoesBothWaysThroughWhatAChartRemembersAsCentralDifferencesOfRunsDo) {
    using Way = GradientOptions::Way;
    using Over = GradientOptions::Over;
    constexpr double duration = 2.03, h = 1e-6;
    const std::vector<std::string> names{"plan.p", "out.K", "level.initial"};
    const std::vector<std::vector<double>> values{{0.8, 1.7, 0.3}, {0.9}, {0.1}};
    for (const auto& [solver, period] : {std::pair("rk4", "0.05"), {"euler", "0.01"}, {"heun", "0.02"}}) {
        const auto text = tank(solver, period);
        const auto final_and_whole = [&](std::size_t which, std::size_t element, double by) {
            Runs run(text);
            auto other = values[which];
            other[element] += by;
            run.simulation->set_parameter(names[which], other);
            run.simulation->start();
            const auto trace = run.trace("cost", static_cast<int>(std::lround(duration / 0.01)) + 1);
            double total = 0;
            for (std::size_t k = 0; k + 1 < trace.size(); ++k) total += 0.01 * trace[k];
            return std::pair(trace.back(), total);
        };
        const Runs session(text);
        for (const auto over : {Over::all, Over::end}) {
            GradientOptions options{
                .by = names, .cost = "cost", .over = over, .duration = duration, .way = Way::forward};
            const auto forward = gradient(session.diagram, options);
            options.way = Way::adjoint;
            const auto adjoint = gradient(session.diagram, options);
            ASSERT_TRUE(adjoint.is_adjoint && !forward.is_adjoint);
            EXPECT_EQ(adjoint.cost, forward.cost);
            Eigen::Index i = 0;
            for (std::size_t which = 0; which < names.size(); ++which)
                for (std::size_t e = 0; e < values[which].size(); ++e, ++i) {
                    const auto up = final_and_whole(which, e, h), down = final_and_whole(which, e, -h);
                    const double difference = over == Over::end ? (up.first - down.first) / (2 * h)
                                                                : (up.second - down.second) / (2 * h);
                    const auto& name = forward.names[static_cast<std::size_t>(i)];
                    EXPECT_GT(std::abs(difference), 1e-3) << name << ": it says nothing";
                    EXPECT_NEAR(forward.slopes[i], difference, 1e-6 * (1 + std::abs(difference)))
                        << solver << " " << name;
                    EXPECT_NEAR(adjoint.slopes[i], forward.slopes[i],
                                1e-11 * (1 + std::abs(forward.slopes[i])))
                        << solver << " " << name;
                }
        }
    }
}

TEST(Gradient, GoesBackWhereThatIsCheaperWhichIsWithManyParameters) {
    // x_k+1 = A x_k with A = a I and J = h Σ_k |x_k|², 32 states: dJ/dA = 2 h Σ_k Σ_j<k a^(2k-1) x_0 x_0ᵀ.
    constexpr int n = 32, steps = 50;
    constexpr double a = 0.9, h = 0.1;
    const Runs session("model: m\nstep: 0.1\nblocks:\n"
                       "  x: {block: UnitDelay, initial: (1:32)'/32, period: 0.1}\n"
                       "  A: {block: Gain, multiplication: K*u, K: 0.9*eye(32)}\n"
                       "  b: {block: Gain, K: 1}\n"
                       "  J: {block: Dot}\n"
                       "connections: {x: [A, b], A: x, b: [J.u1, J.u2]}\n");
    const auto found = gradient(session.diagram, {.by = {"A.K"}, .cost = "J", .duration = steps * h});
    EXPECT_TRUE(found.is_adjoint);
    double sum = 0;
    for (int k = 1; k < steps; ++k) sum += 2 * h * k * std::pow(a, 2 * k - 1);
    Vector x0(n);
    for (int i = 0; i < n; ++i) x0[i] = (i + 1.0) / n;
    const Matrix exact = sum * x0 * x0.transpose();
    ASSERT_EQ(found.slopes.size(), n * n);
    for (int c = 0; c < n; ++c)
        for (int r = 0; r < n; ++r)
            EXPECT_NEAR(found.slopes[c * n + r], exact(r, c), 1e-12 * (1 + exact(r, c)));
    EXPECT_FALSE(gradient(session.diagram, {.by = {"b.K"}, .cost = "J", .duration = 1}).is_adjoint);
}

TEST(Gradient, IsZeroAtTheRegulatorThatRiccatisEquationGivesOfTheLinearisedDiagram) {
    // The plant alone, sampled with its input held.
    const Runs session(balancing_pole);
    const auto plant = linearize(session.diagram, {.from = {"limit"}, .to = {"x"}, .open = {"limit"}});
    ASSERT_EQ(plant.period, 0) << "continuous";
    const auto n = plant.A.rows();
    ASSERT_EQ(n, 4);
    // At the origin, where the model itself does not begin.
    auto upright = balancing_pole;
    upright.replace(upright.find("initial: 0.1"), 12, "initial: 0.0");
    upright.replace(upright.find("initial: 0.05"), 13, "initial: 0.00");
    const Runs resting(upright);
    const auto system = linearize(resting.diagram, {.from = {"limit"}, .to = {"x"}, .open = {"limit"}});
    Matrix block = Matrix::Zero(5, 5);
    block.topLeftCorner(4, 4) = system.A * 0.01;
    block.topRightCorner(4, 1) = system.B * 0.01;
    const Matrix flow = block.exp();
    // In the order of x, the output.
    const Matrix T = system.C, A = T * flow.topLeftCorner(4, 4) * T.inverse(),
                 B = T * flow.topRightCorner(4, 1);
    const Matrix Q = Eigen::Vector4d(10, 10, 1, 1).asDiagonal();
    Matrix P = Q, K;
    for (int k = 0; k < 5000; ++k) {
        K = (Matrix::Constant(1, 1, 0.1) + B.transpose() * P * B).inverse() * B.transpose() * P * A;
        P = Q + A.transpose() * P * (A - B * K);
    }
    // Gains of examples/cart_pole, which were computed elsewhere; here F = +K x, as θ falls against F.
    const Eigen::RowVector4d known(9.21319712, 56.31151, 9.69488177, 12.66011936);
    EXPECT_LT((-K - known).cwiseAbs().maxCoeff(), 1e-5) << K;
    // Near upright, where a run costs just what Riccati's equation has in mind.
    auto near = balancing_pole;
    const auto replace = [&](const std::string& from, const std::string& to) {
        near.replace(near.find(from), from.size(), to);
    };
    replace("step: 0.001", "step: 0.01");
    replace("initial: 0.1", "initial: 0.001");
    replace("initial: 0.05", "initial: 0.0005");
    const GradientOptions by_gains{.by = {"K.K"}, .cost = "cost", .duration = 10};
    const Runs best(near);
    replace("[9.21319712 56.31151 9.69488177 12.66011936]", "[8 50 9 11]");
    const Runs worse(near);
    const auto there = gradient(best.diagram, by_gains), beside = gradient(worse.diagram, by_gains);
    EXPECT_LT(there.slopes.cwiseAbs().maxCoeff(), 1e-4 * beside.slopes.cwiseAbs().maxCoeff());
    EXPECT_LT(there.cost, beside.cost);
}

TEST(Gradient, ByAnInitialStateAndItsParameterCountsBoth) {
    // x' = sin(0.9 x).
    Runs session("model: m\nstep: 0.1\nblocks:\n  x: {block: UnitDelay, initial: 0.5}\n"
                 "  a: {block: Gain, K: 0.9}\n  bend: {block: Bend}\n"
                 "connections: {x: a, a: bend, bend: x}\n",
                 &outside_blocks());
    const auto found = gradient(
        session.diagram,
        {.by = {"x.initial", "x.x"}, .cost = "x", .over = GradientOptions::Over::end, .duration = 0.5});
    double x = 0.5, slope = 1;
    for (int k = 0; k < 5; ++k) {
        slope *= 0.9 * std::cos(0.9 * x);
        x = std::sin(0.9 * x);
    }
    EXPECT_NEAR(found.cost, x, 1e-14);
    EXPECT_NEAR(found.slopes[0], slope, 1e-9);
    EXPECT_NEAR(found.slopes[1], slope, 1e-9);
    EXPECT_EQ(found.differenced, std::vector<std::string>{"bend"});
}

TEST(Gradient, RefusesStatesOutsideOfTheDiagramOnTheWayToTheCost) {
    const auto model = [](const std::string& block) {
        return "model: m\nstep: 0.1\nblocks:\n  one: {block: Constant, value: 2}\n"
               "  a: {block: Gain, K: 2}\n  bend: {block: Bend}\n  other: {block: Gain, K: 3}\n"
               "  outside: {block: " +
               block +
               "}\n  sum: {block: Sum, signs: ++}\n"
               "connections: {one: [a, other], a: [outside, sum.u1], outside: sum.u2, other: bend}\n";
    };
    for (const std::string block : {"Late", "Device"}) {
        EXPECT_NE(
            refusal_of(model(block), {.by = {"a.K"}, .cost = "sum"}, &outside_blocks())
                .find("outside: its state lives outside of the diagram, and no derivative of it is known"),
            std::string::npos)
            << block;
        // Beside the way it does no harm.
        EXPECT_EQ(refusal_of(model(block), {.by = {"other.K"}, .cost = "bend"}, &outside_blocks()), "");
        EXPECT_EQ(refusal_of(model(block), {.by = {"other.K"}, .cost = "sum"}, &outside_blocks()), "");
    }
    // Of a solver that begins at its last solution the derivative is that of what it solves: 4 + √4.
    Runs solver(model("Root"), &outside_blocks());
    const auto found = gradient(
        solver.diagram, {.by = {"a.K"}, .cost = "sum", .over = GradientOptions::Over::end, .duration = 0.3});
    EXPECT_NEAR(found.cost, 6, 1e-12);
    EXPECT_NEAR(found.slopes[0], 2 + 2 / (2 * std::sqrt(4.0)), 1e-9);
    // What is shared goes from one block to another without a wire.
    const std::string line = "model: m\nstep: 0.1\nblocks:\n  one: {block: Constant, value: 2}\n"
                             "  a: {block: Gain, K: 2}\n  begin: {block: LineBegin}\n"
                             "  end: {block: LineEnd}\nconnections: {one: a, a: begin}\n";
    EXPECT_NE(refusal_of(line, {.by = {"a.K"}, .cost = "end"}, &outside_blocks())
                  .find("end: its state lives outside of the diagram"),
              std::string::npos);
}

TEST(Gradient, RefusesByNameWhatIsNotDifferentiated) {
    const GradientOptions options{.by = {"a.K"}, .cost = "x"};
    const auto expect = [](const std::string& text, const std::string& part) {
        EXPECT_NE(text.find(part), std::string::npos) << text;
    };
    expect(refusal_of(lag("dormand_prince45"), options), "give the model one of fixed steps, as solver: rk4");
    expect(refusal_of(lag("rk4"), {.by = {"b.K"}, .cost = "x"}),
           "the model has no parameter, state or input 'b.K'; did you mean 'a.K'");
    expect(refusal_of(lag("rk4"), {.by = {"a.K"}, .cost = "z"}), "the model has no signal 'z'");
    expect(refusal_of(lag("rk4"), {.by = {}, .cost = "x"}), "name parameters by which");
    expect(refusal_of(lag("rk4"), {.by = {"a.K[2]"}, .cost = "x"}), "'a.K' has no element [2]; it has 1");
    expect(refusal_of(lag("rk4"), {.by = {"a.K"}, .cost = "x", .duration = -1}), "a run lasts at least 0 s");
    expect(refusal_of(balancing_pole, {.by = {"K.K"}, .cost = "x"}), "the cost 'x' has 4 elements");
    expect(refusal_of("model: m\nstep: 0.1\nblocks:\n  a: {block: Gain, K: 2}\n  b: {block: Sum, signs: +-}\n"
                      "  one: {block: Constant}\nalgebraic_loops: solve\n"
                      "connections: {one: b.u1, a: b.u2, b: a}\n",
                      {.by = {"a.K"}, .cost = "b"}),
           "the equations of an algebraic loop are not differentiated over a run");
    const std::string remedy =
        ", which is not differentiated over a run; differentiate a model without that, or by "
        "differences of runs";
    EXPECT_EQ(refusal_of("model: m\nstep: 0.1\nsolver: rk4\nblocks:\n  a: {block: Gain, K: -2}\n"
                         "  relay: {block: Relay}\n  x: {block: Integrator, initial: 3}\n"
                         "connections: {x: a, a: relay, relay: x}\n",
                         options),
              "'relay' has events" + remedy);
    EXPECT_EQ(
        refusal_of(
            "model: m\nstep: 0.1\nblocks:\n  x: {block: Constant, value: 2}\n"
            "  a: {block: Gain, K: 2}\n  often: {block: Pulse, period: 0.4}\n"
            "  t: {execution: triggered, inputs: [u], outputs: [y], blocks: {g: {block: Gain}},\n"
            "      connections: {u: g, g: y}}\n"
            "  w: {execution: for, iterations: 3, inputs: [u], outputs: [y], blocks: {g: {block: Gain}},\n"
            "      connections: {u: g, g: y}}\n"
            "connections: {x: a, a: [t.u, w.u], often: t.trigger}\n",
            options),
        "'t' is triggered, 'w' iterates" + remedy);
}

} // namespace bf::analysis::test

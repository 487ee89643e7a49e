#include "bf/analysis/linearize.hpp"
#include "bf/analysis/trim.hpp"

#include "../../engine/test/support.hpp"

#include <cstdio>
#include <gtest/gtest.h>

namespace bf::analysis::test {

using bf::test::Session;

namespace {

/// A pendulum with friction that a torque holds: ω' = u - 9.81 sin θ - 0.1 ω.
const std::string pendulum = R"m(
model: pendulum
step: 0.01
solver: rk4
inputs: [u]
outputs: [angle]
blocks:
  alpha: {block: Fcn, expression: u1 - 9.81*sin(u2) - 0.1*u3}
  omega: {block: Integrator}
  theta: {block: Integrator, initial: 0.3}
connections:
  u: alpha.u1
  theta: [alpha.u2, angle]
  omega: [alpha.u3, theta]
  alpha: omega
)m";

double number(const std::vector<NamedNumber>& all, const std::string& name) {
    for (const auto& [known, value] : all)
        if (known == name) return value;
    throw std::runtime_error("no " + name);
}

std::string refusal(const std::string& text, const TrimOptions& options) {
    Session session(text);
    try {
        trim(*session.simulation, options);
    } catch (const RunError& error) {
        return error.what();
    }
    return "";
}

} // namespace

TEST(Trim, FindsTheTorqueThatHoldsAPendulum) {
    Session session(pendulum);
    const auto found = trim(*session.simulation, {.free = {"u"}, .target = {{"angle", 0.5}}});
    EXPECT_NEAR(number(found.free, "u"), 9.81 * std::sin(0.5), 1e-9);
    EXPECT_NEAR(number(found.free, "theta.x"), 0.5, 1e-9);
    EXPECT_NEAR(number(found.residuals, "omega.x"), 0, 1e-9);
    // The run stays there.
    ASSERT_TRUE(session.simulation->run_until(5));
    EXPECT_NEAR(session("theta"), 0.5, 1e-6);
}

TEST(Trim, HoldsStatesAndKeepsBounds) {
    Session session(pendulum);
    const auto held = trim(*session.simulation, {.free = {"u"}, .hold = {{"theta.x", -0.2}}});
    EXPECT_NEAR(number(held.free, "u"), 9.81 * std::sin(-0.2), 1e-9);
    // Two angles have that torque; the bounds tell which.
    const auto upper = trim(*session.simulation, {.hold = {{"u", 5}}, .bounds = {{"theta.x", 2, 3}}});
    EXPECT_NEAR(number(upper.free, "theta.x"), M_PI - std::asin(5 / 9.81), 1e-7);
}

TEST(Trim, ABoundIsKeptAndLeavesTheNearestRestWhereItIs) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    // x' = u - sin x rests at every multiple of π; the nearest one is found.
    for (const auto& [initial, rest] : {std::pair(3.3, 1.0), {6.1, 2.0}}) {
        char text[300];
        std::snprintf(text, sizeof text,
                      "model: m\nstep: 0.1\nsolver: rk4\ninputs: [u]\noutputs: [y]\nblocks:\n"
                      "  f: {block: Fcn, expression: u1 - sin(u2)}\n"
                      "  x: {block: Integrator, initial: %g}\n"
                      "connections: {u: f.u1, x: [f.u2, y], f: x}\n",
                      initial);
        for (const auto& [lower, upper] : {std::pair(-inf, inf), {-0.5, inf}, {-inf, 9.0}}) {
            Session session(text);
            const auto found = trim(*session.simulation, {.bounds = {{"x.x", lower, upper}}});
            EXPECT_NEAR(number(found.free, "x.x"), rest * M_PI, 1e-8) << lower << " " << upper;
        }
    }
    // A run that stands on a bound or beyond comes to the nearest rest within it.
    const double angle = std::asin(5 / 9.81);
    for (const auto& [u, lower, upper, rest] : {std::tuple(5.0, 2.0, inf, M_PI - angle),
                                                {-5.0, -inf, -0.1, -angle},
                                                {5.0, 0.0, inf, angle},
                                                {-5.0, -inf, 0.0, -angle},
                                                {5.0, 0.1, 1.5, angle},
                                                {5.0, 0.0, 60.0, angle}}) {
        Session session(pendulum);
        const auto found =
            trim(*session.simulation, {.hold = {{"u", u}}, .bounds = {{"theta.x", lower, upper}}});
        EXPECT_NEAR(number(found.free, "theta.x"), rest, 1e-8) << lower << " " << upper;
    }
}

TEST(Trim, NeedsNoTargetWhateverTheRootHas) {
    // A second torque, against the first, and a second output.
    auto text = pendulum;
    const auto put = [&](const std::string& old, const std::string& with) {
        text.replace(text.find(old), old.size(), with);
    };
    put("inputs: [u]", "inputs: [u, w]");
    put("outputs: [angle]", "outputs: [angle, rate]");
    put("u1 -", "u1 - 2*u4 -");
    put("[alpha.u3, theta]", "[alpha.u3, theta, rate]\n  w: alpha.u4");
    Session session(text);
    const auto rests = trim(*session.simulation, {});
    EXPECT_NEAR(number(rests.free, "theta.x"), 0, 1e-9);
    // Of the inputs that are free and held, only the others are found.
    for (const std::string held : {"u", "w"}) {
        const std::string other = held == "u" ? "w" : "u";
        Session again(text);
        const auto found =
            trim(*again.simulation, {.free = {"u", "w"}, .hold = {{held, 1}, {"theta.x", 0.5}}});
        const double torque = 9.81 * std::sin(0.5);
        EXPECT_NEAR(number(found.free, other), held == "u" ? (1 - torque) / 2 : torque + 2, 1e-9);
    }
}

TEST(Trim, OfASampledSystemIsItsFixedPoint) {
    Session session(R"m(
model: m
step: 0.1
inputs: [u]
outputs: [y]
blocks:
  sum: {block: Sum}
  x: {block: UnitDelay, period: 0.2}
  k: {block: Gain, K: 0.5}
connections: {u: sum.u1, k: sum.u2, sum: x, x: [k, y]}
)m");
    const auto found = trim(*session.simulation, {.free = {"u"}, .target = {{"y", 4}}});
    EXPECT_NEAR(number(found.free, "u"), 2, 1e-9);
}

TEST(Trim, DoesNotTakeAnAsymptoteForARest) {
    // x' = u - atan x never rests where u is above π/2.
    const std::string text = "model: m\nstep: 0.1\nsolver: rk4\ninputs: [u]\noutputs: [y]\nblocks:\n"
                             "  rate: {block: Fcn, expression: u1 - atan(u2)}\n  x: {block: Integrator}\n"
                             "connections: {u: rate.u1, rate: x, x: [rate.u2, y]}\n";
    EXPECT_NE(refusal(text, {.hold = {{"u", 5}}}).find("'x.x' still moves, per second by "),
              std::string::npos);
    Session session(text);
    EXPECT_NEAR(number(trim(*session.simulation, {.hold = {{"u", 1.5}}}).free, "x.x"), std::tan(1.5), 1e-5);
}

TEST(Trim, RefusesASampleTimeWithAnOffsetByName) {
    const auto text = [](const std::string& offset) {
        return "model: m\nstep: 0.01\nsolver: rk4\ninputs: [r]\noutputs: [y]\nblocks:\n"
               "  e: {block: Sum, signs: +-}\n  h: {block: ZeroOrderHold, period: 0.1" +
               offset +
               "}\n  g: {block: TransferFunction, numerator: 2, denominator: [1 1]}\n"
               "connections: {r: e.u1, e: h, h: g, g: [e.u2, y]}\n";
    };
    Session session(text(""));
    EXPECT_NEAR(number(trim(*session.simulation, {.hold = {{"r", 1}}}).free, "g.x"), 1.0 / 3, 1e-9);
    EXPECT_EQ(refusal(text(", offset: 0.03"), {.hold = {{"r", 1}}}),
              "h: its sample time has an offset, and no step shows what it and all others do next; leave the "
              "offset out");
}

TEST(Trim, LeavesOutWhatOnlyLooksOn) {
    // A check counts its samples, and never rests.
    auto text = pendulum;
    text.replace(text.find("connections:"), 0, "  largest: {block: Check, kind: maximum}\n");
    text.replace(text.find("theta: [alpha"), 8, "theta: [largest, ");
    Session session(text);
    const auto found = trim(*session.simulation, {.free = {"u"}, .target = {{"angle", 0.5}}});
    EXPECT_NEAR(number(found.free, "u"), 9.81 * std::sin(0.5), 1e-9);
}

TEST(Trim, SetsWhatIsHeldWhereNothingIsLeftToFind) {
    Session session("model: m\nstep: 0.1\ninputs: [u]\noutputs: [y]\nblocks:\n"
                    "  f: {block: Fcn, expression: u1^2}\nconnections: {u: f.u1, f: y}\n");
    EXPECT_TRUE(trim(*session.simulation, {.hold = {{"u", 3}}}).free.empty());
    EXPECT_EQ(linearize(*session.simulation, {}).D(0, 0), 6) << "of u² at 3";
}

TEST(Trim, KnowsElementsByTheirNumbersToo) {
    Session session(pendulum);
    const auto found =
        trim(*session.simulation,
             {.free = {"u[1]"}, .target = {{"angle[1]", 0.5}}, .bounds = {{"theta.x[1]", 0, 1}}});
    EXPECT_NEAR(number(found.free, "u"), 9.81 * std::sin(0.5), 1e-9);
}

TEST(Trim, SaysWhichVariableIsInTheWay) {
    EXPECT_EQ(refusal(pendulum, {.free = {"u"}}),
              "there are 3 free numbers (omega.x, theta.x, u) for 2 equations (that omega.x, theta.x rest); "
              "free an input "
              "or give a target, or hold a state, for each that is missing");
    const auto bounded =
        refusal(pendulum, {.free = {"u"}, .target = {{"angle", 0.5}}, .bounds = {{"u", -1, 1}}});
    EXPECT_EQ(bounded.find("no operating point was found: '"), 0u);
    EXPECT_NE(bounded.find("'u' is at its bound; widen it, or ask for less"), std::string::npos) << bounded;
    // 20 is more than gravity ever gives.
    const auto none = refusal(pendulum, {.hold = {{"u", 20}}});
    EXPECT_NE(none.find("'omega.x' still moves, per second by "), std::string::npos) << none;
    EXPECT_EQ(refusal(pendulum, {.free = {"v"}}), "there is no input of the root 'v'; did you mean 'u'?");
    EXPECT_EQ(refusal(pendulum, {.free = {"u"}, .bounds = {{"u", 1, 1}}}),
              "the bounds of 'u' leave nothing between them");
    EXPECT_EQ(refusal(pendulum, {.free = {"u"}, .target = {{"angle", std::nan("")}}}),
              "'angle' cannot come to nan; give a finite number");
    EXPECT_EQ(refusal(pendulum, {.hold = {{"u", -INFINITY}}}),
              "'u' cannot come to -inf; give a finite number");
}

TEST(Trim, NamesWhatStandsAtALimitOnTheWay) {
    // x' = sat(u) - x/2 rests at 2 at most.
    const std::string limited = "model: m\nstep: 0.1\nsolver: rk4\ninputs: [u]\noutputs: [y]\nblocks:\n"
                                "  limit: {block: Saturate, lower: -1, upper: 1}\n"
                                "  loss: {block: Gain, K: 0.5}\n  s: {block: Sum, signs: +-}\n"
                                "  x: {block: Integrator}\n  z: {block: Gain, K: 0}\n"
                                "connections: {u: [limit, z], limit: s.u1, x: [loss, y], loss: s.u2, "
                                "s: x}\n";
    EXPECT_EQ(
        refusal(limited, {.free = {"u"}, .target = {{"y", 3}}}),
        "no operating point was found: 'x.x' still moves, per second by -0.500000, and 'limit' passes no "
        "small change on of what is free: it stands at a limit, has steps, or its gain is 0; ask for less, "
        "widen the limit, or begin elsewhere");
}

TEST(Trim, FindsARestOfWhateverIsSlow) {
    for (const double rate : {1e-9, 1e-11, 1e-15}) {
        char text[400];
        std::snprintf(text, sizeof text,
                      "model: m\nstep: 0.1\nsolver: rk4\ninputs: [u]\noutputs: [y]\nblocks:\n"
                      "  f: {block: Fcn, expression: %g*(u1 - u2^3)}\n  x: {block: Integrator, initial: 1}\n"
                      "connections: {u: f.u1, x: [f.u2, y], f: x}\n",
                      rate);
        Session session(text);
        EXPECT_NEAR(number(trim(*session.simulation, {.hold = {{"u", 8}}}).free, "x.x"), 2, 1e-12) << rate;
    }
}

TEST(Trim, TakesTheWholeStepThatLeadsThere) {
    // x' = u - x³: at x = 100 u is 1e6, and on the way there nothing rests.
    const auto cubic = [](const std::string& expression) {
        return "model: m\nstep: 0.1\nsolver: rk4\ninputs: [u]\noutputs: [y]\nblocks:\n"
               "  f: {block: Fcn, expression: \"" +
               expression +
               "\"}\n  x: {block: Integrator}\n"
               "connections: {u: f.u1, x: [f.u2, y], f: x}\n";
    };
    Session session(cubic("u1 - u2^3"));
    const auto found = trim(*session.simulation, {.free = {"u"}, .target = {{"y", 100}}});
    EXPECT_NEAR(number(found.free, "u"), 1e6, 1e-4);
    // A diode behind a resistor: SciPy's brentq gives 0.6330… at 100.
    Session diode(cubic("(u1 - u2)/1000 - 1e-12*(exp(u2/0.025) - 1)"));
    const double x = number(trim(*diode.simulation, {.hold = {{"u", 100}}}).free, "x.x");
    EXPECT_NEAR((100 - x) / 1000, 1e-12 * std::expm1(x / 0.025), 1e-10);
}

TEST(Trim, BringsToRestWhatMayStandAnywhere) {
    // x' = v, v' = u - 3 v: no equation says where.
    const std::string cart =
        "model: m\nstep: 0.1\nsolver: rk4\ninputs: [u]\noutputs: [y]\nblocks:\n"
        "  f: {block: Fcn, expression: u1 - 3*u2}\n  v: {block: Integrator, initial: 1}\n"
        "  x: {block: Integrator, initial: 0.3}\n"
        "connections: {u: f.u1, v: [f.u2, x], f: v, x: y}\n";
    Session session(cart);
    const auto found = trim(*session.simulation, {});
    EXPECT_NEAR(number(found.free, "v.x"), 0, 1e-12);
    EXPECT_NEAR(number(found.free, "x.x"), 0.3, 1e-12) << "it stays where it is";
    EXPECT_NE(refusal(cart, {.hold = {{"u", 2}, {"v.x", 0}}, .target = {{"y", 1}}}), "");
}

TEST(Trim, RefusesTwoValuesForOneNumber) {
    EXPECT_EQ(refusal(pendulum, {.hold = {{"u", 1}, {"u[1]", 2}}}),
              "'u' is held at 1 and 2; give one of them");
    EXPECT_EQ(refusal(pendulum, {.free = {"u"}, .target = {{"angle", 0.5}, {"angle", 0.6}}}),
              "'angle' is to be 0.5 and 0.6; give one of them");
}

TEST(Trim, SaysWhatIsHeldThoughItMayMove) {
    auto text = pendulum;
    text.replace(text.find("connections:"), 0, R"m(
  off: {block: Constant, value: 0}
  side:
    execution: enabled
    inputs: [a]
    outputs: [b]
    blocks: {i: {block: Integrator}}
    connections: {a: i, i: b}
  seen: {block: Gain, K: 1}
)m");
    text.replace(text.find("theta: [alpha"), 8, "side: seen\n  off: side.enable\n  theta: [side.a, ");
    Session session(text);
    const auto found = trim(*session.simulation, {.hold = {{"u", 0}}});
    ASSERT_EQ(found.held.size(), 1u);
    EXPECT_EQ(found.held[0], "side: it is disabled");
}

} // namespace bf::analysis::test

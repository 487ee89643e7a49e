// Each line of the pseudocode in simulation.hpp has a test named after it.
#include "support.hpp"

#include "bf/kernels/elementwise.hpp"
#include "bf/model/builder.hpp"

#include <cmath>
#include <gtest/gtest.h>

namespace bf::test {
namespace {

/// What devices did, in order.
std::vector<std::string>& events() {
    static std::vector<std::string> list;
    return list;
}

/// A device that tells when it is opened and closed, and fails when it is told to.
class Device final : public Block {
  public:
    using Block::Block;
    Argument<std::string> id{this, "id", {.initial = "d"}};
    Argument<int> fails_at{this, "fails_at", {.initial = -1}};
    Argument<bool> is_absent{this, "is_absent", {.initial = false}};
    Output<double> y{this, "y", {}};
    DiscreteState<double> x{this, "x", {}};
    void start(Now) const override {
        if (*is_absent) throw std::runtime_error("device " + *id + " is absent; plug it in");
        events().push_back("start " + *id);
    }
    Status output(Now at, Out out) const noexcept override {
        if (at.step() == *fails_at) return Status::failure("broke at step {}", static_cast<int>(at.step()));
        out[y] = at[x];
        return ok;
    }
    Status update(Now at, Next next) const noexcept override {
        next[x] = at[x] + 1;
        return ok;
    }
    void stop(Now) const noexcept override { events().push_back("stop " + *id); }
};

const Library& devices() {
    static const Library library = [] {
        Library l("");
        l.group("test").add<Device>("Device", "");
        return l;
    }();
    return library;
}

const std::string counting = R"m(
model: m
step: 0.5
blocks:
  one: {block: Constant, value: 1}
  add: {block: Sum}
  x: {block: UnitDelay, initial: 10}
connections:
  one: add.u1
  x: add.u2
  add: x
)m";

TEST(Start, StatesHaveTheirInitialValues) { EXPECT_EQ(Session(counting).trace("x", 1), (Values{10})); }

TEST(Start, OutputsAreZeroAndRootInputsKeepWhatWasWritten) {
    model::Builder b{"m"};
    b.step(1);
    const auto u = b.input("u");
    b.add("g", "Gain", {{"K", 2}});
    b.connect(u, model::End{"g"});
    Session run(b.build());
    const auto input = run.diagram.inputs.at(0).end;
    auto& value = *static_cast<double*>(run.simulation->context().data(input.node, input.slot));
    value = 3;
    run.simulation->start();
    EXPECT_EQ(value, 3);
    EXPECT_EQ(run("g"), 0);
    EXPECT_EQ(run.trace("g", 1), Values{6});
    run.simulation->start();
    EXPECT_EQ(run("g"), 0);
    EXPECT_EQ(value, 3);
}

TEST(Start, BlocksAreResetAfterTheirStatesHaveTheirInitialValues) {
    class Doubled final : public Block {
      public:
        using Block::Block;
        DiscreteState<double> x{this, "x", {.initial = {7}}};
        Output<double> y{this, "y"};
        Status reset(Now at, After after) const noexcept override {
            after[x] = 2 * at[x];
            return ok;
        }
        Status output(Now at, Out to) const noexcept override {
            to[y] = at[x];
            return ok;
        }
    };
    Library library("");
    library.group("test").add<Doubled>("Doubled", "");
    EXPECT_EQ(Session("model: m\nstep: 1\nblocks:\n  d: {block: Doubled}\n", &library).trace("d", 1),
              Values{14});
}

TEST(Start, BeginsAgainFromTheInitialValues) {
    Session run(counting);
    run.trace("x", 5);
    run.simulation->start();
    EXPECT_EQ(run.simulation->time(), 0);
    EXPECT_EQ(run.trace("x", 2), (Values{10, 11}));
}

TEST(Start, OutputsOfARateWithOffsetAreZeroUntilTheirFirstHit) {
    Session run("model: m\nstep: 0.1\nblocks:\n  c: {block: Clock, period: 0.2, offset: 0.1}\n");
    EXPECT_EQ(run.trace("c", 4), (Values{0, 0.1, 0.1, 3 * 0.1}));
    run.simulation->start();
    EXPECT_EQ(run.trace("c", 1), (Values{0}));
}

TEST(Start, DevicesOpenInOrderAndStopLastFirst) {
    events().clear();
    Session run("model: m\nstep: 1\nblocks:\n  a: {block: Device, id: a}\n  b: {block: Device, id: b}\n",
                &devices());
    run.trace("a", 1);
    run.simulation->stop();
    EXPECT_EQ(events(), (std::vector<std::string>{"start a", "start b", "stop b", "stop a"}));
    run.simulation->stop();
    EXPECT_EQ(events().size(), 4u);
}

TEST(Start, ADeviceThatIsAbsentClosesThoseThatAreOpen) {
    events().clear();
    try {
        Session run("model: m\nstep: 1\nblocks:\n  a: {block: Device, id: a}\n  b: {block: Device, id: b, "
                    "is_absent: true}\n"
                    "  c: {block: Device, id: c}\n",
                    &devices());
        FAIL();
    } catch (const RunError& error) {
        EXPECT_STREQ(error.what(), "b: device b is absent; plug it in");
    }
    EXPECT_EQ(events(), (std::vector<std::string>{"start a", "stop a"}));
}

TEST(Start, ConstantOutputsAreComputedOnce) {
    Session run("model: m\nstep: 1\nblocks:\n  c: {block: Constant, value: 2}\n  g: {block: Gain, K: "
                "3}\nconnections: {c: g}\n");
    EXPECT_TRUE(run.diagram.plan.outputs.size() == 1 && run.diagram.plan.outputs[0].rate == constant_rate);
    EXPECT_EQ(run("g"), 6);
}

TEST(Step, OutputsUseTheStatesBeforeTheStep) {
    EXPECT_EQ(Session(counting).trace("add", 3), (Values{11, 12, 13}));
}

TEST(Step, UpdatesComeAfterAllOutputs) {
    // A chain of delays passes each value on by one place per step, in whatever order the blocks stand.
    Session run(R"m(
model: m
step: 1
blocks:
  c: {block: UnitDelay, initial: 3}
  a: {block: UnitDelay, initial: 1}
  b: {block: UnitDelay, initial: 2}
  t: {block: Clock}
connections: {t: a, a: b, b: c}
)m");
    EXPECT_EQ(run.trace("c", 5), (Values{3, 2, 1, 0, 1}));
}

TEST(Step, NumbersAreDoubleAndIntegersWrapAround) {
    Session run("model: m\nstep: 1\nblocks:\n  one: {block: Constant, value: 1}\n"
                "  large: {block: Constant, value: \"int8([100 27])\"}\n  sum: {block: Sum, signs: ++}\n"
                "connections: {large: [sum.u1, sum.u2]}\n");
    EXPECT_EQ(run.diagram.slot(run.diagram.find_signal("one")).type, Type::float64);
    EXPECT_EQ(run.diagram.slot(run.diagram.find_signal("sum")).type, Type::int8);
    EXPECT_EQ(run.values("sum"), (Values{200 - 256, 54}));
}

TEST(Step, TimeIsTheNumberOfStepsTimesTheStep) {
    Session run("model: m\nstep: 0.1\nblocks:\n  c: {block: Clock}\n");
    const auto t = run.trace("c", 1000);
    for (int k = 0; k < 1000; ++k) ASSERT_EQ(t[static_cast<std::size_t>(k)], k * 0.1);
}

/// Notes what a recording would hold.
struct Notes final : Simulation::Observer {
    void observe(const bf::Run& run) noexcept override {
        const auto& s = static_cast<const Simulation&>(run);
        times.push_back(s.time());
        const auto x = s.diagram().find_signal(state), y = s.diagram().find_signal(output);
        states.push_back(read_value(s.context().data(x.node, x.slot), Type::float64, 0));
        outputs.push_back(read_value(s.context().data(y.node, y.slot), Type::float64, 0));
    }
    std::string state, output;
    Values times, states, outputs;
};

TEST(Step, ObserversSeeTimeOutputsAndTheStatesBeforeTheStep) {
    Session run(counting);
    Notes notes;
    notes.state = "x.x";
    notes.output = "add";
    run.simulation->add_observer(notes);
    run.trace("x", 3);
    EXPECT_EQ(notes.times, (Values{0, 0.5, 1}));
    EXPECT_EQ(notes.states, (Values{10, 11, 12}));
    EXPECT_EQ(notes.outputs, (Values{11, 12, 13}));
}

TEST(Step, AnOutputThatIsNotFiniteNamesItsBlockWhereTheModelAsks) {
    // 1 / (2 - k) in the third of the steps, inside a loop that an enabled subsystem holds.
    const std::string text =
        "blocks:\n  t: {block: Clock, period: 1}\n  s:\n    execution: enabled\n    inputs: [t]\n"
        "    outputs: [y]\n    blocks:\n      loop:\n        execution: for\n        iterations: 2\n"
        "        inputs: [t]\n        outputs: [y]\n        blocks:\n          left: {block: Bias, bias: "
        "-2}\n"
        "          inverse: {block: Reciprocal}\n        connections: {t: left, left: inverse, inverse: y}\n"
        "    connections: {t: loop.t, loop: y}\n  on: {block: Constant, value: true}\n"
        "connections: {t: s.t, on: s.enable}\n";
    Session free("model: m\nstep: 1\n" + text);
    EXPECT_EQ(free.trace("s.y", 4), (Values{-0.5, -1, std::numeric_limits<double>::infinity(), 1}));
    Session strict("model: m\nstep: 1\nnon_finite: error\n" + text);
    EXPECT_EQ(strict.trace("s.y", 2), (Values{-0.5, -1}));
    EXPECT_FALSE(strict.simulation->step());
    EXPECT_EQ(strict.simulation->failure(),
              "s.loop.inverse: its output y is not finite: look at the block's inputs in this step for a "
              "division by zero or a value out of range");
}

TEST(Step, AFailingOutputEndsTheRunAndObserversKeepWhatTheySaw) {
    events().clear();
    Session run("model: m\nstep: 1\nblocks:\n  a: {block: Device, fails_at: 3}\n  b: {block: Device}\n",
                &devices());
    Notes notes;
    notes.state = "a.x";
    notes.output = "a.y";
    run.simulation->add_observer(notes);
    int steps = 0;
    while (run.simulation->step()) ++steps;
    EXPECT_EQ(steps, 3);
    EXPECT_EQ(run.simulation->failure(), "a: broke at step 3");
    EXPECT_EQ(notes.times, (Values{0, 1, 2}));
    EXPECT_EQ(run("b"), 2); // nothing after the failed block ran
    EXPECT_FALSE(run.simulation->step());
    EXPECT_EQ(run.simulation->steps(), 3);
    run.simulation->stop();
    EXPECT_EQ(events().size(), 4u);
}

TEST(Step, AFailingAssertionCompletesItsStep) {
    Session run(R"m(
model: m
step: 1
blocks:
  t: {block: Clock}
  small: {block: CompareToConstant, operator: "<", constant: 2}
  must: {block: Assertion}
connections: {t: small, small: must}
)m");
    Notes notes;
    notes.state = notes.output = "t";
    run.simulation->add_observer(notes);
    while (run.simulation->step()) {
    }
    EXPECT_EQ(notes.times, (Values{0, 1, 2}));
    EXPECT_EQ(run.simulation->failure().substr(0, 6), "must: ");
}

TEST(Step, ANaNThatEntersAStateNamesItsBlock) {
    Session run(R"m(
model: m
step: 1
blocks:
  t: {block: Clock}
  one: {block: Constant, value: "[1 -1 1]"}
  root: {block: Sqrt}
  product: {block: Product}
  fine: {block: UnitDelay}
  state: {block: UnitDelay}
connections:
  t: [product.u1, fine]
  one: product.u2
  product: root
  root: state
)m");
    EXPECT_TRUE(run.simulation->step());
    EXPECT_FALSE(run.simulation->step());
    EXPECT_EQ(run.simulation->failure(),
              "state: a state became NaN: look at the block's inputs in this step for a "
              "division by zero or a value out of range");
}

TEST(Parameters, ChangeBetweenStepsAndConstantsFollow) {
    Session run(
        "model: m\nstep: 1\nblocks:\n  c: {block: Constant, value: [1, 2]}\n  g: {block: Gain, K: 3}\n  "
        "t: {block: Clock}\n"
        "  h: {block: Gain, K: 1}\nconnections: {c: g, t: h}\n");
    run.simulation->set_parameter("c.value", {5});
    EXPECT_EQ(run.values("g"), (Values{15, 15}));
    run.simulation->set_parameter("c.value", {1, 4});
    EXPECT_EQ(run.values("g"), (Values{3, 12}));
    run.trace("h", 2);
    run.simulation->set_parameter("h.K", {10});
    EXPECT_EQ(run.trace("h", 1), (Values{20}));
}

TEST(Parameters, WrongChangesAreRefused) {
    Session run("model: m\nstep: 1\nblocks:\n  c: {block: Constant, value: [1, 2]}\n");
    const auto refused = [&](const std::string& path, const Values& values) -> std::string {
        try {
            run.simulation->set_parameter(path, values);
        } catch (const RunError& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(
        refused("c.valeu", {1}),
        "there is no parameter 'c.valeu'; did you mean 'c.value'?; parameters are called block.parameter");
    EXPECT_EQ(refused("c.value", {1, 2, 3}), "parameter 'c.value' has 2 elements, not 3");
    EXPECT_EQ(refused("c.value", {}), "parameter 'c.value' has 2 elements, not 0");
    EXPECT_EQ(refused("c.value", {1, NAN}), "parameter 'c.value' must be a number, but element 2 is NaN");
    EXPECT_EQ(run.values("c"), (Values{1, 2}));
}

TEST(Parameters, AreHeldToTheirType) {
    Session run("model: m\nstep: 1\nblocks:\n  i: {block: Constant, value: int8(1)}\n  b: {block: Constant, "
                "value: true}\n  s: {block: Constant, value: single(1)}\n");
    const auto refused = [&](const std::string& path, double value) -> std::string {
        try {
            run.simulation->set_parameter(path, {value});
        } catch (const RunError& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(refused("i.value", -128), "");
    EXPECT_EQ(refused("i.value", 128),
              "parameter 'i.value' must be a whole number from -128 to 127, but is 128");
    EXPECT_EQ(refused("i.value", 0.5),
              "parameter 'i.value' must be a whole number from -128 to 127, but is 0.5");
    EXPECT_EQ(refused("b.value", 2), "parameter 'b.value' must be 0 or 1, but is 2");
    EXPECT_EQ(
        refused("s.value", 1e40),
        "parameter 's.value' must be a number of at most 3.4028234663852886e+38 in magnitude, but is 1e+40");
    EXPECT_EQ(refused("s.value", HUGE_VAL), "");
    EXPECT_EQ(run("i"), -128);
}

TEST(Parameters, AreHeldToTheirLimits) {
    Session run("model: m\nstep: 1\nblocks:\n  p: {block: Pulse, cycle: [2, 4], width: 50}\n"
                "  c: {block: Constant, value: 3}\n");
    const auto refused = [&](const std::vector<ParameterValue>& changes) -> std::string {
        try {
            auto change = run.simulation->prepare(changes);
            EXPECT_TRUE(run.simulation->apply(change));
        } catch (const RunError& error) {
            return error.what();
        }
        return {};
    };
    EXPECT_EQ(refused({{"c.value", {5}}, {"p.cycle", {0}}}),
              "parameter 'p.cycle' must be greater than 0, but is 0");
    EXPECT_EQ(refused({{"c.value", {5}}, {"p.cycle", {1, -2}}}),
              "parameter 'p.cycle' must be greater than 0, but element 2 is -2");
    EXPECT_EQ(refused({{"c.value", {5}}, {"p.width", {100.5}}}),
              "parameter 'p.width' must be from 0 to 100, but is 100.5");
    EXPECT_EQ(run("c"), 3) << "nothing is changed";
    EXPECT_EQ(refused({{"c.value", {5}}, {"p.width", {100}}}), "") << "the ends belong to it";
    EXPECT_EQ(run("c"), 5);
}

TEST(Parameters, OfWhichOneMustBeAtLeastAnotherAreJudgedTogether) {
    Session run("model: m\nstep: 1\nblocks:\n  c: {block: Constant, value: 9}\n"
                "  s: {block: Saturate, lower: -1, upper: [1, 2]}\nconnections: {c: s}\n");
    const auto refused = [&](const std::vector<ParameterValue>& changes) -> std::string {
        auto change = run.simulation->prepare(changes);
        const Status status = run.simulation->apply(change);
        return status ? "" : change.why_refused(status);
    };
    EXPECT_EQ(refused({{"c.value", {5}}, {"s.upper", {1, -2}}}),
              "parameter 's.upper' must be at least 'lower', but -2 is below -1 (element 2)");
    EXPECT_EQ(refused({{"s.lower", {3}}}),
              "parameter 's.upper' must be at least 'lower', but 1 is below 3 (element 1)");
    EXPECT_EQ(run("c"), 9) << "nothing is changed";
    EXPECT_EQ(refused({{"s.lower", {3}}, {"s.upper", {4}}}), "");
    EXPECT_EQ(refused({{"s.upper", {-4}}, {"s.lower", {-5}}}), "");
    EXPECT_THROW(run.simulation->set_parameter("s.upper", {-6}), RunError);
    EXPECT_EQ(run.trace("s", 1), Values{-4});
}

/// The first of its quantities is what another one must reach.
struct Band final : Block {
    using Block::Block;
    Parameter<double> low{this, "low", {.initial = {1}}};
    Parameter<double> high{this, "high", {.initial = {2}, .at_least = low.index()}};
};

TEST(Parameters, MustReachAnotherOneWhereverThatStands) {
    Library library("");
    library.group("test").add<Band>("Band", "");
    Session run("model: m\nstep: 1\nblocks:\n  b: {block: Band}\n", &library);
    EXPECT_THROW(run.simulation->set_parameter("b.high", {0.5}), RunError);
    EXPECT_THROW(run.simulation->set_parameter("b.low", {2.5}), RunError);
    run.simulation->set_parameter("b.low", {2});
}

TEST(Parameters, ChangeAllOrNone) {
    Session run("model: m\nstep: 1\nblocks:\n  a: {block: Constant, value: 1}\n  b: {block: Constant, value: "
                "[1, 2]}\n");
    EXPECT_THROW(run.simulation->prepare({{"a.value", {5}}, {"b.value", {1, 2, 3}}}), RunError);
    EXPECT_THROW(run.simulation->prepare({{"a.value", {5}}, {"a.value", {6}}}), RunError);
    EXPECT_EQ(run("a"), 1);
    auto change = run.simulation->prepare({{"a.value", {5}}, {"b.value", {6}}});
    EXPECT_EQ(run("a"), 1) << "not before it is applied";
    EXPECT_TRUE(run.simulation->apply(change));
    EXPECT_EQ(run("a"), 5);
    EXPECT_EQ(run.values("b"), (Values{6, 6}));
    EXPECT_TRUE(run.simulation->apply(change)) << "the old values again";
    EXPECT_EQ(run("a"), 1);
}

TEST(Checks, ReportTheFinalValues) {
    Session run(R"m(
model: m
step: 1
blocks:
  t: {block: Clock}
  peak: {block: Check, kind: maximum, at_most: 3}
connections: {t: peak}
)m");
    run.trace("t", 4);
    const auto checks = run.simulation->checks();
    ASSERT_EQ(checks.size(), 2u);
    EXPECT_EQ(checks[0].name, "peak");
    EXPECT_EQ(checks[0].value, 3);
    EXPECT_EQ(checks[1].name, "peak.passed");
    EXPECT_EQ(checks[1].value, 1);
    EXPECT_TRUE(checks[1].is_boolean);
}

TEST(Checks, TheLongLoopGivesThePeersValue) {
    model::Builder b{"loop"};
    b.step(0.001);
    b.add("one", "Constant", {{"value", 1}});
    model::End last = {"d9"};
    for (int i = 0; i < 500; ++i) {
        const auto gain = b.add("g" + std::to_string(i), "Gain", {{"K", 0.999}});
        const auto sum = b.add("s" + std::to_string(i), "Sum");
        b.connect(last, gain);
        b.connect(gain, sum["u1"]);
        b.connect({"one"}, sum["u2"]);
        last = sum;
    }
    for (int i = 0; i < 10; ++i) {
        const auto delay = b.add("d" + std::to_string(i), "UnitDelay");
        b.connect(last, delay);
        last = delay;
    }
    Session run(b.build());
    run.simulation->start();
    const auto y = run.trace("s499", 100);
    EXPECT_NEAR(y[14], 632.304575229, 1e-9);
    EXPECT_NEAR(y[99], 993.278888040133, 1e-12 * 993);
}

} // namespace
} // namespace bf::test

// Programs dealt out to a task for each period, as text, and what stands against it.
#include "bf/program/program.hpp"

#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/formats/yaml.hpp"

#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace bf::program {
namespace {

struct Tasks {
    std::vector<std::string> problems;
    std::string text;                     ///< of the tasks
    std::vector<std::vector<int>> writes; ///< blocks by task
    std::vector<std::string> callers;     ///< by procedure: its name and the period of its task
};

Tasks tasks_of(const std::string& model) {
    Registry registry;
    registry.add(standard_library());
    const Diagram diagram =
        elaborate(formats::read_yaml_text("model: m\nstep: 0.1\n" + model, "m.yaml"), registry);
    Program program = lower(diagram);
    Tasks tasks;
    tasks.problems = split(program);
    const std::string text = text_of(program);
    const auto begin = std::min(text.find("\nhits at "), text.find("\noutputs at "));
    if (begin != std::string::npos) tasks.text = text.substr(begin + 1);
    for (const auto& task : program.tasks) tasks.writes.push_back(task.nodes);
    for (const auto& procedure : program.procedures)
        if (procedure.task >= 0)
            tasks.callers.push_back(procedure.name + " at " + period_text(diagram, procedure.task));
    return tasks;
}

TEST(Split, BlocksThatChangeTheRateRunAtTheHitsOfTheSlowSideWithinTheFastOne) {
    const Tasks tasks =
        tasks_of("blocks:\n  fast: {block: Sine, period: 0.1}\n"
                 "  sample: {block: ZeroOrderHold, period: 0.2}\n  slow: {block: Gain}\n"
                 "  wait: {block: UnitDelay, period: 0.2}\n  add: {block: Sum}\n"
                 "connections: {fast: [sample, add.u1], sample: slow, slow: wait, wait: add.u2}\n");
    EXPECT_EQ(tasks.text, R"(hits at hit(0.1 s):
    count hit(0.2 s) in hit(0.1 s)

outputs at hit(0.1 s):
    output fast
    if hit(0.2 s) in hit(0.1 s)
        output sample
        output wait
    output add

outputs at hit(0.2 s):
    output slow

update at hit(0.2 s):
    update wait
    commit wait
)");
    EXPECT_EQ(tasks.problems, std::vector<std::string>());
    EXPECT_EQ(tasks.writes, (std::vector<std::vector<int>>{{0, 1, 3, 4}, {2}}));
}

TEST(Split, HitsOfAnOffsetAreThoseOfAFasterTaskWithTheSameOffset) {
    EXPECT_EQ(tasks_of("blocks:\n  z: {block: UnitDelay, period: 0.4, offset: 0.1}\n"
                       "  b: {block: ZeroOrderHold, period: 0.4, offset: 0.1}\n"
                       "  x: {block: UnitDelay, period: 0.2, offset: 0.1}\n"
                       "  a: {block: ZeroOrderHold, period: 0.2, offset: 0.1}\n"
                       "  fast: {block: Clock, period: 0.1}\nconnections: {fast: a, a: x, x: b, b: z}\n")
                  .text,
              R"(hits at hit(0.1 s):
    count hit(0.2 s + 0.1 s) in hit(0.1 s)

outputs at hit(0.1 s):
    output fast
    if hit(0.2 s + 0.1 s) in hit(0.1 s)
        output a

hits at hit(0.2 s + 0.1 s):
    count hit(0.4 s + 0.1 s) in hit(0.2 s + 0.1 s)

outputs at hit(0.2 s + 0.1 s):
    output x
    if hit(0.4 s + 0.1 s) in hit(0.2 s + 0.1 s)
        output b

update at hit(0.2 s + 0.1 s):
    update x
    commit x

outputs at hit(0.4 s + 0.1 s):
    output z

update at hit(0.4 s + 0.1 s):
    update z
    commit z
)");
}

TEST(Split, ContinuousStatesBelongToTheTaskOfTheBaseStep) {
    EXPECT_EQ(
        tasks_of("solver: rk4\ninputs: [u]\nblocks:\n  x: {block: Integrator}\n"
                 "  hold: {block: ZeroOrderHold, period: 0.2}\n  slow: {block: UnitDelay, period: 0.2}\n"
                 "  back: {block: RateTransition, period: 0.2, mode: delay}\n"
                 "  sum: {block: Sum, signs: \"+-\"}\n"
                 "connections: {u: sum.u1, sum: x, x: hold, hold: slow, slow: back, back: sum.u2}\n")
            .text,
        R"(hits at hit(0.1 s):
    count hit(0.2 s) in hit(0.1 s)

outputs at hit(0.1 s):
    output x
    if hit(0.2 s) in hit(0.1 s)
        output hold
        output back
    output sum

update at hit(0.1 s):
    integrate to the end of the step

outputs at hit(0.2 s):
    output slow

update at hit(0.2 s):
    update slow
    update back
    commit slow
    commit back
)");
}

TEST(Split, AnInputOfTheModelIsWrittenAtThePeriodThatReadsItFirst) {
    // Both delays sample u at 0.2 s, whichever of them stands first in the model.
    const std::string a = "  a: {block: UnitDelay, period: 0.4}\n",
                      b = "  b: {block: UnitDelay, period: 0.2}\n";
    for (const auto& blocks : {a + b, b + a}) {
        const Tasks tasks = tasks_of("inputs: [u]\nblocks:\n" + blocks + "connections: {u: [a, b]}\n");
        EXPECT_EQ(tasks.problems, std::vector<std::string>());
        EXPECT_EQ(tasks.writes.size(), 1u) << tasks.text;
        EXPECT_NE(tasks.text.find("hits at hit(0.2 s):\n    count hit(0.4 s) in hit(0.2 s)\n"),
                  std::string::npos)
            << tasks.text;
    }
}

TEST(Split, ATriggeredSubsystemAndItsTestBelongToThePeriodThatDecidesAboutIt) {
    const Tasks tasks = tasks_of(R"(blocks:
  fast: {block: Clock, period: 0.1}
  u: {block: Clock, period: 0.2}
  part:
    execution: enabled
    inputs: [u]
    outputs: [y]
    blocks:
      inner:
        execution: triggered
        inputs: [u]
        outputs: [y]
        blocks: {d: {block: UnitDelay}}
        connections: {u: d, d: y}
    connections: {u: [inner.u, inner.trigger], inner: y}
connections: {u: [part.u, part.enable]}
)");
    EXPECT_EQ(tasks.problems, std::vector<std::string>());
    EXPECT_EQ(tasks.callers, (std::vector<std::string>{"disable part at 0.2 s", "disable part.inner at 0.2 s",
                                                       "test part at 0.2 s", "test part.inner at 0.2 s"}));
    EXPECT_EQ(tasks.text.substr(0, tasks.text.find("\ndisable part:")), R"(outputs at hit(0.1 s):
    output fast

outputs at hit(0.2 s):
    output u
    test part
    if part.enabled
        test part.inner
    if part.inner.triggered
        output part.inner.d
        output part.inner.y
    if part.enabled
        output part.y

update at hit(0.2 s):
    if part.inner.triggered
        update part.inner.d
    if part.inner.triggered
        commit part.inner.d
    part.inner.fired := false
    part.inner.triggered := false
)");
}

TEST(Split, ADelayThatEnablesAFasterSubsystemIsWrittenAtTheFasterPeriod) {
    const Tasks tasks =
        tasks_of("blocks:\n  slow: {block: Clock, period: 0.2}\n  wait: {block: UnitDelay, period: 0.2}\n"
                 "  u: {block: Clock, period: 0.1}\n  part:\n    execution: enabled\n    inputs: [u]\n"
                 "    outputs: [y]\n    blocks: {g: {block: Gain}}\n    connections: {u: g, g: y}\n"
                 "connections: {slow: wait, wait: part.enable, u: part.u}\n");
    EXPECT_EQ(tasks.problems, std::vector<std::string>());
    EXPECT_EQ(tasks.text.substr(0, tasks.text.find("\n\noutputs at hit(0.2 s)")), R"(hits at hit(0.1 s):
    count hit(0.2 s) in hit(0.1 s)

outputs at hit(0.1 s):
    if hit(0.2 s) in hit(0.1 s)
        output wait
    output u
    test part
    if part.enabled
        output part.g
        output part.y)");
}

TEST(Split, WhatATriggerEndsBelongsToItsTaskAmongManyConditions) {
    std::string model = "blocks:\n  fast: {block: Clock, period: 0.1}\n  slow: {block: Clock, period: 0.2}\n"
                        "  part:\n    execution: triggered\n    inputs: [u]\n    outputs: [y]\n"
                        "    blocks: {d: {block: UnitDelay}}\n    connections: {u: d, d: y}\n";
    for (const std::string name : {"a", "b", "c", "e", "f"})
        model += "  " + name +
                 ":\n    execution: enabled\n    inputs: [u]\n    outputs: [y]\n"
                 "    blocks: {g: {block: Gain}}\n    connections: {u: g, g: y}\n";
    const std::string wires = "connections: {slow: [part.u, part.trigger], fast: [a.u, a.enable, b.u, "
                              "b.enable, c.u, c.enable, e.u, "
                              "e.enable, f.u, f.enable]}\n";
    const Tasks tasks = tasks_of(model + wires);
    EXPECT_EQ(tasks.problems, std::vector<std::string>());
    const auto at = tasks.text.find("update at hit(0.2 s):\n");
    ASSERT_NE(at, std::string::npos) << tasks.text;
    EXPECT_EQ(tasks.text.substr(at, tasks.text.find("\n\n", at) - at), R"(update at hit(0.2 s):
    if part.triggered
        update part.d
    if part.triggered
        commit part.d
    part.fired := false
    part.triggered := false)");
}

struct Refusal {
    const char* name;
    const char* model;
    std::vector<std::string> problems;
};
void PrintTo(const Refusal& refusal, std::ostream* to) { *to << refusal.name; }

class SplitRefuses : public testing::TestWithParam<Refusal> {};

TEST_P(SplitRefuses, EachPlaceWithItsReasonAndMakesNoTask) {
    const Tasks tasks = tasks_of(GetParam().model);
    EXPECT_EQ(tasks.problems, GetParam().problems);
    EXPECT_EQ(tasks.text, "");
}

INSTANTIATE_TEST_SUITE_P(
    Models, SplitRefuses,
    testing::Values(
        Refusal{"a wire to a slower and to a faster reader",
                "blocks:\n  a: {block: Clock, period: 0.1}\n  b: {block: Gain, period: 0.2}\n"
                "  c: {block: Gain, period: 0.1}\nconnections: {a: b, b: c}\n",
                {"b: at 0.2 s it reads a.y at 0.1 s; put a RateTransition with period 0.2 s in between, or "
                 "say `rate_transitions: inserted`",
                 "c: at 0.1 s it reads b.y at 0.2 s; put a RateTransition with period 0.2 s and `mode: "
                 "delay` in between, or say `rate_transitions: inserted`"}},
        Refusal{"a wire from and to a continuous block",
                "solver: rk4\nblocks:\n  x: {block: TransferFunction, numerator: [1], denominator: [1, 1]}\n"
                "  g: {block: Gain, period: 0.2}\nconnections: {x: g, g: x}\n",
                {"x: at 0.1 s it reads g.y at 0.2 s; put a RateTransition with period 0.2 s and `mode: "
                 "delay` in between, or say `rate_transitions: inserted`",
                 "g: at 0.2 s it reads x.y at 0.1 s; put a RateTransition with period 0.2 s in between, or "
                 "say `rate_transitions: inserted`"}},
        Refusal{"offsets of which one is not hit with the other",
                "blocks:\n  one: {block: Clock, period: 0.2, offset: 0.1}\n"
                "  two: {block: Gain, period: 0.2}\nconnections: {one: two}\n",
                {"two: at 0.2 s it reads one.y at 0.2 s + 0.1 s, and neither is hit whenever the other is; "
                 "pass the signal through a block of a period that both are multiples of"}},
        Refusal{"an offset within another",
                "blocks:\n  one: {block: Clock, period: 0.2, offset: 0.1}\n"
                "  two: {block: Gain, period: 0.4, offset: 0.3}\n"
                "  three: {block: Gain, period: 0.4, offset: 0.2}\nconnections: {one: [two, three]}\n",
                {"two: at 0.4 s + 0.3 s it reads one.y at 0.2 s + 0.1 s; put a RateTransition with period "
                 "0.4 s + 0.3 s in between, or say `rate_transitions: inserted`",
                 "three: at 0.4 s + 0.2 s it reads one.y at 0.2 s + 0.1 s, and neither is hit whenever the "
                 "other is; pass the signal through a block of a period that both are multiples of"}},
        Refusal{"a subsystem that a faster signal enables",
                "blocks:\n  on: {block: Clock, period: 0.1}\n  u: {block: Clock, period: 0.2}\n  part:\n"
                "    execution: enabled\n    inputs: [u]\n    outputs: [y]\n"
                "    blocks: {a: {block: Gain, period: 0.2}}\n    connections: {u: a, a: y}\n"
                "connections: {on: part.enable, u: part.u}\n",
                {"part: at 0.2 s it reads on.y at 0.1 s; put a RateTransition with period 0.2 s in between, "
                 "or say `rate_transitions: inserted`"}},
        Refusal{"a loop of which a faster reader needs the delay inside",
                "blocks:\n  u: {block: Clock, period: 0.2}\n  part:\n    execution: for\n    iterations: 3\n"
                "    inputs: [u]\n    outputs: [y]\n    blocks: {a: {block: UnitDelay, period: 0.2}}\n"
                "    connections: {u: a, a: y}\n  other: {block: Gain, period: 0.1}\n"
                "connections: {u: part.u, part.y: other}\n",
                {"part.a: runs at 0.1 s in 'part', which is decided about at 0.2 s; give all of that "
                 "subsystem one period, and change rates outside of it"}},
        Refusal{"what answers crossings",
                "solver: rk4\ninputs: [u]\nblocks: {x: {block: LimitedIntegrator}}\nconnections: {u: x}\n",
                {"x: answers zero crossings, after which blocks of all periods may compute again; generate "
                 "one function for all periods"}}));

} // namespace
} // namespace bf::program

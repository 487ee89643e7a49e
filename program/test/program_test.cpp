// Small models and the programs that they become, as text.
#include "bf/program/program.hpp"

#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/program/step.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <string>

namespace bf::program {
namespace {

std::string program_of(const std::string& model, Integrator integrator = Integrator::own) {
    Registry registry;
    registry.add(standard_library());
    const Diagram diagram =
        elaborate(formats::read_yaml_text("model: m\nstep: 0.1\n" + model, "m.yaml"), registry);
    return text_of(lower(diagram, integrator));
}

/// The lines under a heading that begins so.
std::string section(const std::string& text, const std::string& heading) {
    const auto at = ("\n" + text).find("\n" + heading);
    if (at == std::string::npos) return "there is none";
    const auto begin = text.find('\n', at) + 1;
    return text.substr(begin, std::min(text.find("\n\n", begin), text.size() - 1) + 1 - begin);
}

TEST(Program, RunsWhatIsHitThenUpdatesThenCommits) {
    EXPECT_EQ(program_of("non_finite: error\nblocks:\n  u: {block: Sine, period: 0.1}\n"
                         "  slow: {block: Gain, period: 0.2, offset: 0.1}\n  past: {block: UnitDelay}\n"
                         "connections: {u: slow, slow: past}\n"),
              R"(start:
    past.x := past.initial
    start all blocks
    constants

step:
    count hit(0.1 s)
    count hit(0.2 s + 0.1 s)
    outputs, first

outputs:
    output u
    if hit(0.2 s + 0.1 s)
        output slow
        output past

update:
    fail unless u.y is finite
    if hit(0.2 s + 0.1 s)
        fail unless slow.y is finite
        fail unless past.y is finite
    if hit(0.2 s + 0.1 s)
        update past
    if hit(0.2 s + 0.1 s)
        commit past
)");
}

constexpr const char* const conditional = R"(solver: @
inputs: [on, go]
blocks:
  two: {block: Constant, value: 2}
  wave: {block: Sine}
  shown: {block: Sum}
  outer:
    execution: enabled
    states: reset
    reset: level_hold
    inputs: [u, go]
    outputs: {y: {initial: 2, when_disabled: reset}}
    blocks:
      x: {block: Integrator}
      inner:
        execution: triggered
        inputs: [u]
        outputs: [y]
        blocks: {sum: {block: UnitDelay}}
        connections: {u: sum, sum: y}
    connections: {u: [x, inner.u], x: y, go: inner.trigger}
connections: {two: shown.u1, wave: [shown.u2, outer.u, outer.reset], on: outer.enable, go: outer.go}
)";
std::string with_solver(const std::string& solver) {
    std::string text = conditional;
    return program_of(text.replace(text.find('@'), 1, solver));
}

TEST(Program, StartsWithStatesThenDevicesThenConstantsThenInitialOutputs) {
    const std::string text = with_solver("rk4");
    EXPECT_EQ(section(text, "constants"), "    output two\n");
    EXPECT_EQ(section(text, "start"), R"(    outer.x.x := outer.x.initial
    outer.inner.sum.x := outer.inner.sum.initial
    start all blocks
    constants
    outer.y.y := 2
    outer.inner.y.y := 0
)");
}

TEST(Program, TestsAConditionBeforeItsBlocksAndEndsTheConditionsInsideWithIt) {
    const std::string text = with_solver("rk4");
    EXPECT_EQ(section(text, "outputs"), R"(  f i    output wave
  f      test outer
  f i    if outer.enabled
  f i        output outer.x
  f i        output outer.y
  f          test outer.inner
  f      output shown
  f      if outer.inner.triggered
  f          output outer.inner.sum
  f          output outer.inner.y
)");
    EXPECT_EQ(section(text, "test outer:"), R"(    is_on := on.y > 0
    resets := wave.y > 0
    if not is_on and outer.enabled
        disable outer
    starts := is_on and not outer.enabled
    if resets
        starts := true
    outer.enabled := is_on
    if outer.enabled and starts
        outer.x.x := outer.x.initial
        outer.inner.sum.x := outer.inner.sum.initial
)");
    EXPECT_EQ(section(text, "disable outer:"), R"(    outer.enabled := false
    outer.y.y := 2
    rest outer.x
    if outer.inner.enabled
        disable outer.inner
)");
    EXPECT_EQ(section(text, "test outer.inner:"), R"(    fires := outer.inner.fired
    if not fires
        fires := go.y rises
    outer.inner.enabled := true
    outer.inner.triggered := outer.inner.enabled and fires
    if outer.inner.triggered and not outer.inner.fired
        clock of outer.inner.fired goes on
        outer.inner.fired := true
)");
    EXPECT_EQ(section(text, "update:"), R"(    if outer.inner.triggered
        update outer.inner.sum
    if outer.inner.triggered
        commit outer.inner.sum
    outer.inner.fired := false
    outer.inner.triggered := false
    integrate to the end of the step
)");
    EXPECT_EQ(section(text, "derivatives"), "    if outer.enabled\n        derivative of outer.x\n");
    EXPECT_EQ(section(text, "event"), "there is none") << "fixed steps locate nothing";
}

TEST(Program, ComputesAgainAndUpdatesWhereAnAdaptiveSolverStopsAtACrossing) {
    const std::string text = with_solver("dormand_prince45");
    EXPECT_EQ(section(text, "arrive"), "    outputs, inside the step\n");
    EXPECT_EQ(section(text, "event"), R"(    outputs, inside the step
    inside a step := true
    outputs, again
    take the crossings that the solver found
    answer crossings
    if outer.inner.triggered
        update outer.inner.sum
    if outer.inner.triggered
        commit outer.inner.sum
    outer.inner.fired := false
    outer.inner.triggered := false
    inside a step := false
)");
    EXPECT_EQ(section(text, "answer crossings:"), R"(    restart the solver
    fired := false
    if outer.inner.fired
        fired := true
    if not answered and inside a step and fired
        observe the event
)");
    EXPECT_NE(text.find("    ends := inside a step and wave.y was > 0\n"), std::string::npos) << text;
    EXPECT_NE(text.find("    if outer.enabled and starts\n        restart the solver\n"), std::string::npos)
        << text;
}

TEST(Program, LooksAnewForTriggersInEachIterationAndFailsWhereThereIsNoEnd) {
    const std::string text = program_of(R"(blocks:
  u: {block: Sine, period: 0.1}
  s:
    execution: while
    inputs: [u]
    outputs: [y]
    blocks:
      k: {block: Iteration}
      more: {block: CompareToConstant, operator: "<", constant: 3}
      again: {block: While, most: 7}
      part: {execution: triggered, inputs: [u], outputs: [y], blocks: {d: {block: UnitDelay}}, connections: {u: d, d: y}}
    connections: {u: part.u, k: [more, part.trigger], more: again.condition, part: y}
connections: {u: s.u}
)");
    EXPECT_EQ(section(text, "outputs"), R"(    output u
    s.part.ran := false
    s.k.number := 1
    repeat while s.more.y > 0, at most 7 times
        s.part.fired := false
        s.part.triggered := false
        output s.k
        output s.more
        test s.part
        if s.part.triggered
            output s.part.d
            output s.part.y
        update s.k
        if s.part.triggered
            update s.part.d
        commit s.k
        if s.part.triggered
            commit s.part.d
        if s.part.fired
            s.part.ran := true
    otherwise
        fail at s.again: the while loop around it did not end within 7 iterations: look at the condition of its While, or let it allow more
    s.part.fired := s.part.ran
)");
}

TEST(Program, LoopsAroundALoopLookAnewForItsTriggersAndTellWhatRanInAny) {
    const std::string text = program_of(R"(inputs: [u]
blocks:
  aside: {execution: triggered, inputs: [u], blocks: {d: {block: UnitDelay}}, connections: {u: d}}
  o:
    execution: for
    iterations: 2
    inputs: [u]
    blocks:
      i:
        execution: for
        iterations: 3
        inputs: [u]
        blocks:
          k: {block: Iteration}
          part: {execution: triggered, inputs: [u], blocks: {d: {block: UnitDelay}}, connections: {u: d}}
        connections: {u: part.u, k: part.trigger}
    connections: {u: i.u}
connections: {u: [o.u, aside.u, aside.trigger]}
)");
    EXPECT_EQ(section(text, "outputs"), R"(    test aside
    o.i.part.ran := false
    repeat 2 times
        o.i.part.fired := false
        o.i.part.triggered := false
        o.i.part.ran := false
        o.i.k.number := 1
        repeat 3 times
            o.i.part.fired := false
            o.i.part.triggered := false
            output o.i.k
            test o.i.part
            if o.i.part.triggered
                output o.i.part.d
            update o.i.k
            if o.i.part.triggered
                update o.i.part.d
            commit o.i.k
            if o.i.part.triggered
                commit o.i.part.d
            if o.i.part.fired
                o.i.part.ran := true
        o.i.part.fired := o.i.part.ran
        if o.i.part.fired
            o.i.part.ran := true
    o.i.part.fired := o.i.part.ran
    if aside.triggered
        output aside.d
)") << "each loop has a flag of its own";
}

TEST(Program, AnswersCrossingsUntilNothingMoreCrosses) {
    const std::string text =
        program_of("blocks:\n  one: {block: Constant, value: 1}\n"
                   "  a: {block: LimitedIntegrator, upper: 0.45}\nconnections: {one: a}\n");
    EXPECT_EQ(section(text, "step"), R"(    count hit(0.1 s)
    count hit(continuous)
    outputs, first
    look for crossings of guards
    if crossed
        answer crossings
)");
    EXPECT_EQ(section(text, "answer crossings:"), R"(    repeat while crossed, at most 1001 times
        observe the event
        if a crossed
            event of a
        outputs, again
        look for crossings of guards
    otherwise
        if a crossed
            fail at a: its zero crossings answer one another without end: 1000 times at one instant; give one of the blocks a dead band or hysteresis
)");
}

TEST(Program, WatchesGuardsOfRulesUnderTheirConditionAndAnswersWhereABlockCan) {
    const std::string text = program_of(R"(solver: dormand_prince45
inputs: [u]
blocks:
  x: {block: LimitedIntegrator, upper: 1}
  sign: {block: Sign}
  part:
    execution: enabled
    inputs: [u]
    outputs: [y]
    blocks: {d: {block: LimitedIntegrator, upper: 2}}
    connections: {u: d, d: y}
connections: {u: [x, part.u], x: [sign, part.enable]}
)");
    EXPECT_EQ(section(text, "guards"), R"(    guards of x
    guards of x (2)
    guards of x (3)
    guards of sign
    if part.enabled
        guards of part.d
        guards of part.d (2)
        guards of part.d (3)
)");
    EXPECT_EQ(section(text, "answer crossings:"), R"(    restart the solver
    fired := false
    if not answered and inside a step and fired
        observe the event
    if answered
        repeat while crossed, at most 1001 times
            observe the event
            if x crossed
                event of x
            if part.d crossed
                event of part.d
            outputs, again
            look for crossings of guards
        otherwise
            if x crossed
                fail at x: its zero crossings answer one another without end: 1000 times at one instant; give one of the blocks a dead band or hysteresis
            if part.d crossed
                fail at part.d: its zero crossings answer one another without end: 1000 times at one instant; give one of the blocks a dead band or hysteresis
        if inside a step
            observe the event
)");
}

TEST(Program, BetweenFixedStepsWatchesOnlyWhatAnswers) {
    const std::string text = program_of("solver: rk4\ninputs: [u]\nblocks:\n  sign: {block: Sign}\n"
                                        "  x: {block: LimitedIntegrator}\nconnections: {u: [sign, x]}\n");
    EXPECT_EQ(section(text, "guards"), "    guards of x\n    guards of x (2)\n")
        << "the third counts, and would only stop a solver";
}

TEST(Program, LeavesOutOfTheSolversStagesWhatItDoesNotNeed) {
    EXPECT_EQ(section(program_of("solver: rk4\nblocks:\n  before: {block: Gain}\n  u: {block: Sine}\n"
                                 "  x: {block: Integrator}\n  shown: {block: Gain}\n"
                                 "connections: {u: [before, x], x: shown}\n"),
                      "outputs"),
              "  f i    output u\n  f i    output x\n  f      output before\n  f      output shown\n");
}

TEST(Program, CountsAFunctionCallOnceInAStep) {
    const std::string text = program_of(R"(solver: dormand_prince45
blocks:
  wave: {block: Sine}
  part:
    execution: triggered
    trigger: function_call
    inputs: [u]
    outputs: [y]
    blocks: {d: {block: UnitDelay}}
    connections: {u: d, d: y}
  x: {block: Integrator}
connections: {wave: [part.u, part.trigger], part: x}
)");
    EXPECT_EQ(section(text, "test part:"), R"(    fires := part.fired
    if not fires and not inside a step
        fires := wave.y > 0
    part.enabled := true
    part.triggered := part.enabled and fires
    if part.triggered and not part.fired
        clock of part.fired goes on
        part.fired := true
)");
}

TEST(Program, SolvesAlgebraicLoopsAndRepeatsAsOftenAsASignalSays) {
    EXPECT_EQ(section(program_of("algebraic_loops: solve\ninputs: [u]\nblocks:\n"
                                 "  a: {block: Sum, signs: \"+-\"}\n  b: {block: Gain, K: 0.5}\n"
                                 "connections: {u: a.u1, a: b, b: a.u2}\n"),
                      "outputs"),
              "    solve the loop through a\n        output a\n        output b\n");
    const std::string loops = R"(inputs: [u, n]
blocks:
  s:
    execution: for
    inputs: [u]
    outputs: [y]
    blocks: {i: {block: Iteration}, d: {block: UnitDelay}}
    connections: {i: d, d: y}
  w:
    execution: while
    inputs: [u]
    outputs: [y]
    blocks: {more: {block: While, most: 5}, g: {block: Gain}}
    connections: {u: [g, more.condition, more.initial], g: y}
connections: {u: [s.u, w.u], n: s.iterations}
)";
    EXPECT_EQ(section(program_of(loops), "outputs"), R"(    s.i.number := 1
    repeat n.y times
        output s.i
        output s.d
        update s.i
        update s.d
        commit s.i
        commit s.d
    if u.y > 0
        repeat while u.y > 0, at most 5 times
            output w.g
        otherwise
            fail at w.more: the while loop around it did not end within 5 iterations: look at the condition of its While, or let it allow more
)") << "without states: reset only the counter begins anew";
}

TEST(Program, ChecksEachFloatingOutputOnceAlsoInLoops) {
    const std::string text = program_of(R"(non_finite: error
inputs: [u]
blocks:
  one: {block: Constant, value: 1}
  s:
    execution: for
    iterations: 2
    inputs: [u]
    outputs: [y]
    blocks: {g: {block: Gain}, yes: {block: CompareToZero}, f: {block: Convert, type: single}}
    connections: {u: g, g: [yes, f], f: y}
  split: {block: Demux}
  pair: {block: Mux}
connections: {u: [s.u, pair.u1], one: pair.u2, pair: split}
)");
    EXPECT_EQ(section(text, "update"),
              "    fail unless s.g.y is finite\n    fail unless s.f.y is finite\n"
              "    fail unless pair.y is finite\n"
              "    fail unless split.y1 is finite\n    fail unless split.y2 is finite\n");
}

TEST(Program, OfACallersSolverTestsConditionsInStepsAndEventsAlone) {
    const std::string text = program_of(R"(solver: rk4
blocks:
  x: {block: Integrator, initial: 1}
  sign: {block: Sign}
  down: {block: Constant, value: -1}
  part:
    execution: triggered
    blocks: {count: {block: UnitDelay}}
    connections: {count: count}
connections: {down: x, x: [sign, part.trigger]}
)",
                                        Integrator::caller);
    EXPECT_EQ(section(text, "outputs"), R"(  faib    output x
  fa      test part
  fa b    output sign
  fa      if part.triggered
  fa          output part.count
)");
    EXPECT_EQ(section(text, "guards"), "there is none");
    EXPECT_EQ(section(text, "marks"), "    guards of sign\n");
    EXPECT_EQ(section(text, "event inside a step"), R"(    inside a step := true
    outputs, again
    if part.triggered
        update part.count
    if part.triggered
        commit part.count
    part.fired := false
    part.triggered := false
    inside a step := false
)");
}

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

TEST(Edges, RiseFromZeroOrBelowAndNeedALookBefore) {
    EXPECT_TRUE(is_edge(Edge::rising, 0, 1) && is_edge(Edge::either, -1, 1) && is_edge(Edge::falling, 1, 0));
    EXPECT_FALSE(is_edge(Edge::rising, 1, 2) || is_edge(Edge::either, 0, -1) ||
                 is_edge(Edge::falling, 0, -1));
    EXPECT_FALSE(is_edge(Edge::rising, unknown, 1) || is_edge(Edge::falling, unknown, 0));
    EXPECT_TRUE(is_edge(Edge::level, unknown, 1) && !is_edge(Edge::level, 1, 0));
}

TEST(Crossings, AreNoneWhereAGuardLeavesZeroOrDidNotRun) {
    EXPECT_EQ(crossing(-1, 0), 1);
    EXPECT_EQ(crossing(1, 0), -1);
    EXPECT_EQ(crossing(-1, 1), 1);
    EXPECT_EQ(crossing(0, 1) + crossing(0, -1) + crossing(unknown, 1.0) + crossing(-1.0, unknown), 0);
}

TEST(Clocks, OfATriggerTellTheTimeSinceItRanBefore) {
    Clock<double> clock;
    fire(clock, 2.0);
    EXPECT_EQ(clock.period, 0);
    fire(clock, 2.5);
    EXPECT_EQ(clock.period, 0.5);
    EXPECT_EQ(clock.time, 2.5);
    EXPECT_EQ(clock.trigger, 1);
    EXPECT_EQ(clock.step, 1);
}

} // namespace
} // namespace bf::program

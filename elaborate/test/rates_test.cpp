// Claims about sample times: which block runs when.
#include "support.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

std::string text_of(const SampleRate& rate) {
    if (rate.trigger > 0) return "trigger " + std::to_string(rate.trigger);
    return std::to_string(rate.ticks) + "+" + std::to_string(rate.offset) +
           (rate.is_continuous ? " continuous" : "");
}

TEST(Rates, AreWholeMultiplesOfABaseStepThatDividesAllPeriods) {
    const auto m = elaborate_text("model: m\nblocks:\n  a: {block: Clock, period: 0.6}\n"
                                  "  b: {block: Clock, period: 0.4, offset: 0.2}\n  c: {block: Constant}\n");
    EXPECT_DOUBLE_EQ(m.diagram.step, 0.2);
    EXPECT_EQ(text_of(m.rate("a")), "3+0");
    EXPECT_EQ(text_of(m.rate("b")), "2+1");
    EXPECT_EQ(m.node("c").rate, constant_rate);
}

TEST(Rates, AreInheritedFromAllThatABlockReadsInWhateverOrder) {
    for (const char* order :
         {"a: s.u1, b: s.u2, c: s.u3", "c: s.u1, b: s.u2, a: s.u3", "b: s.u1, a: s.u2, c: s.u3"}) {
        const auto m =
            elaborate_text("model: m\nstep: 0.1\nblocks:\n  a: {block: Clock, period: 0.2}\n"
                           "  b: {block: Clock, period: 0.4}\n  c: {block: Clock, period: 0.6}\n"
                           "  s: {block: Sum, signs: +++}\n  k: {block: Constant}\n  g: {block: Gain}\n"
                           "  t: {block: Gain}\nconnections: {" +
                           std::string(order) + ", k: g, s: t}\n");
        EXPECT_EQ(text_of(m.rate("s")), "2+0") << order;
        EXPECT_EQ(text_of(m.rate("t")), "2+0") << order;
        EXPECT_EQ(m.node("g").rate, constant_rate) << "what reads constants alone is one";
    }
}

TEST(Rates, OfContinuousSourcesAreContinuous) {
    const auto m =
        elaborate_text("model: m\nstep: 0.1\nblocks:\n  i: {block: Integrator}\n  g: {block: Gain}\n"
                       "  d: {block: UnitDelay, period: 0.2}\n  h: {block: Gain}\n"
                       "connections: {i: [g, d], g: i, d: h}\n");
    EXPECT_EQ(text_of(m.rate("i")), "1+0 continuous");
    EXPECT_EQ(text_of(m.rate("g")), "1+0 continuous");
    EXPECT_EQ(text_of(m.rate("h")), "2+0");
}

const char* const triggered =
    "model: m\nstep: 0.1\nblocks:\n  on: {block: Pulse, cycle: 2, period: 0.4}\n"
    "  fire: {block: Pulse, cycle: 1, period: 0.2}\n  s:\n"
    "    execution: enabled_and_triggered\n    outputs: {y: {when_disabled: RESET}}\n"
    "    blocks:\n      t: {block: Clock}\n      inner:\n        execution: enabled\n"
    "        inputs: [u]\n        outputs: [y]\n        blocks: {g: {block: Gain}}\n"
    "        connections: {u: g, g: y}\n      c: {block: CompareToConstant}\n"
    "    connections: {t: [inner.u, c], c: inner.enable, inner.y: y}\n"
    "  after: {block: Gain}\nconnections: {on: s.enable, fire: s.trigger, s.y: after}\n";

Elaborated triggered_with(const std::string& when_disabled) {
    std::string text = triggered;
    text.replace(text.find("RESET"), 5, when_disabled);
    return elaborate_text(text);
}

TEST(Rates, InTriggeredSubsystemsAreThoseOfTheirTrigger) {
    const auto m = triggered_with("held");
    const auto rate = text_of(m.rate("s.t"));
    EXPECT_TRUE(rate.starts_with("trigger "));
    for (const char* path : {"s.c", "s.inner.g", "s.inner.y", "s.y"})
        EXPECT_EQ(text_of(m.rate(path)), rate) << path;
    EXPECT_EQ(text_of(m.rate("after")), "2+0") << "others see it as often as its trigger is looked at";
    for (std::size_t c = 1; c < m.diagram.conditions.size(); ++c) {
        const Condition& condition = m.diagram.conditions[c];
        EXPECT_EQ(text_of(m.diagram.rates[static_cast<std::size_t>(condition.rate)]),
                  condition.path == "s" ? "2+0" : rate)
            << condition.path;
    }
}

TEST(Rates, OfWhatDisablingResetsAreThoseAtWhichItsSubsystemIsLookedAt) {
    const auto m = triggered_with("reset");
    EXPECT_EQ(text_of(m.rate("s.y")), "2+0");
    EXPECT_TRUE(text_of(m.rate("s.inner.y")).starts_with("trigger "));
}

const char* const two_rates =
    "model: m\nstep: 0.1\nrate_transitions: HOW\nblocks:\n"
    "  slow: {block: Clock, period: 0.2}\n  fast: {block: Clock, period: 0.1}\n"
    "  to_fast: {block: Sum, signs: ++, period: 0.1}\n"
    "  to_slow: {block: Sum, signs: ++, period: 0.2}\n"
    "  one: {block: Gain, period: 0.2}\n  other: {block: Gain, period: 0.2}\n"
    "connections: {slow: [to_fast.u1, to_slow.u1], fast: [to_fast.u2, to_slow.u2, one, "
    "other]}\n";

Elaborated with_transitions(const std::string& how) {
    std::string text = two_rates;
    text.replace(text.find("HOW"), 3, how);
    return elaborate_text(text);
}

TEST(Rates, TransitionsAreInsertedOnceForEachSignalAndReadersRate) {
    const auto allowed = with_transitions("allowed"), inserted = with_transitions("inserted");
    EXPECT_EQ(inserted.diagram.nodes.size(), allowed.diagram.nodes.size() + 2);
    const auto source_of = [&](const char* path, const char* input) {
        const auto& node = inserted.node(path);
        return node.sources[static_cast<std::size_t>(node.block->resolution().find(input))].node;
    };
    EXPECT_EQ(source_of("one", "u"), source_of("other", "u"));
    EXPECT_EQ(source_of("one", "u"), source_of("to_slow", "u2"));
    EXPECT_NE(source_of("to_fast", "u1"), inserted.diagram.find_node("slow"));
    EXPECT_EQ(source_of("to_fast", "u2"), inserted.diagram.find_node("fast"));
    EXPECT_EQ(source_of("to_slow", "u1"), inserted.diagram.find_node("slow"));
}

TEST(Rates, TransitionsThatAreCheckedAreNamedWithBothPeriods) {
    try {
        with_transitions("checked");
        FAIL();
    } catch (const std::exception& error) {
        const std::string text = error.what();
        EXPECT_NE(text.find("to_fast: input 'u1' at 0.1 s reads slow.y at 0.2 s"), std::string::npos) << text;
        EXPECT_NE(text.find("to_slow: input 'u2' at 0.2 s reads fast.y at 0.1 s"), std::string::npos) << text;
        EXPECT_NE(text.find("one: input 'u' at 0.2 s reads fast.y at 0.1 s"), std::string::npos) << text;
        EXPECT_EQ(text.find("input 'u2' at 0.1 s"), std::string::npos) << text;
    }
}

} // namespace
} // namespace bf::test

#include "support.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

using Names = std::vector<std::string>;

/// A vector whose elements have the names given as an argument.
class Source final : public Block {
  public:
    using Block::Block;
    Argument<Names> names{this, "names", {.initial = {"hip", "knee"}}};
    Dim n{this, "n", [this] { return Dim::Names(*names); }};
    Output<Vector> y{this, "y", {.shape = {n}, .unit = any_unit}};
};

/// Takes a vector of two joints.
class Sink final : public Block {
  public:
    using Block::Block;
    Dim n{this, "n", [] { return Dim::Names(Names{"hip", "knee"}); }};
    Input<Vector> u{this, "u", {.shape = {n}, .unit = any_unit}};
};

const Library& library() {
    static const Library all = [] {
        Library made("Named");
        made.group("test").add<Source>("Source", "").add<Sink>("Sink", "");
        return made;
    }();
    return all;
}

/// What the elements of each signal of a model are called, "a.y" having "hip knee", "-" for none.
struct Model {
    Elaborated elaborated;
    explicit Model(const std::string& blocks, const std::string& more = "")
        : elaborated(elaborate_text("model: m\nstep: 1\nblocks:\n" + blocks + more, {}, &library())) {}
    std::string operator()(const std::string& signal) const {
        const Diagram& d = elaborated.diagram;
        const auto end = d.find_signal(signal);
        if (end.node < 0) return "no such signal";
        std::string text;
        for (const auto& name : d.element_names(end))
            text += (text.empty() ? "" : " ") + (name.empty() ? "-" : name);
        return text;
    }
};

TEST(ElementNames, GoThroughBlocksThatKeepElementsApart) {
    const Model names(
        "  s: {block: Named/Source}\n  gain: {block: Gain, K: \"[2 3]\"}\n  sum: {block: Sum}\n"
        "  delay: {block: UnitDelay}\n  limit: {block: Saturate}\n  abs: {block: Abs}\n"
        "  filter: {block: DiscreteTransferFunction}\n  one: {block: Constant}\n  in: {block: Integrator}\n",
        "connections: {s: gain, gain: [sum.u1, abs], one: sum.u2, sum: delay, delay: limit, limit: filter, "
        "filter: in}\n");
    for (const char* signal : {"s.y", "gain", "sum", "delay", "limit", "abs", "filter", "in", "delay.x"})
        EXPECT_EQ(names(signal), "hip knee") << signal;
    EXPECT_EQ(names("one"), "") << "one number for both";
}

TEST(ElementNames, GoThroughPortsConditionsAndLoops) {
    const Model names(
        "  s: {block: Named/Source}\n  on: {block: Constant}\n"
        "  part:\n    execution: enabled\n    inputs: [u]\n    outputs: [y]\n"
        "    blocks: {g: {block: Gain}}\n    connections: {u: g, g: y}\n"
        "  each:\n    execution: for_each\n    iterations: 2\n    inputs: {u: {each: true}}\n    outputs: "
        "[y]\n"
        "    blocks: {g: {block: Gain}}\n    connections: {u: g, g: y}\n"
        "  add: {block: Sum}\n  back: {block: UnitDelay}\n",
        "connections: {s: [part.u, each.u, add.u1], on: part.enable, add: back, back: add.u2}\n");
    EXPECT_EQ(names("part.y"), "hip knee");
    EXPECT_EQ(names("each.y"), "hip knee");
    EXPECT_EQ(names("add"), "hip knee");
    EXPECT_EQ(names("back"), "hip knee");
}

TEST(ElementNames, AreJoinedSplitAndPicked) {
    const Model names(
        "  s: {block: Named/Source}\n  arm: {block: Named/Source, names: \"{'elbow', 'wrist', 'hand'}\"}\n"
        "  one: {block: Constant}\n  mux: {block: Mux, inputs: 3}\n"
        "  pick: {block: Selector, indices: \"[5 1 3]\"}\n  parts: {block: Demux, sizes: \"[2 4]\"}\n"
        "  put: {block: Assign, indices: 2}\n  sorted: {block: Sort}\n  again: {block: Mux}\n  end: {block: "
        "Terminator}\n",
        "connections: {s: [mux.u1, again.u1, again.u2], one: [mux.u2, put.u], arm: mux.u3, "
        "mux: [pick, parts, put.base, sorted], parts.y1: end}\n");
    EXPECT_EQ(names("mux"), "hip knee - elbow wrist hand");
    EXPECT_EQ(names("pick"), "wrist hip -");
    EXPECT_EQ(names("parts.y1"), "hip knee");
    EXPECT_EQ(names("parts.y2"), "- elbow wrist hand");
    EXPECT_EQ(names("put"), "hip knee - elbow wrist hand");
    EXPECT_EQ(names("sorted.y"), "") << "in another order";
    EXPECT_EQ(names("sorted.index"), "");
    EXPECT_EQ(names("again"), "") << "what occurs twice names nothing";
}

TEST(ElementNames, ReferencesAreCalledAsWhatTheyAreUsedFor) {
    const Model names(
        "  s: {block: Named/Source}\n  goal: {block: Constant, value: \"[1 2]\"}\n  smooth: {block: "
        "UnitDelay}\n"
        "  error: {block: Sum, signs: \"+-\"}\n  torque: {block: Constant, value: \"[0 0]\"}\n"
        "  motors: {block: Named/Sink}\n  other: {block: Gain}\n",
        "connections: {goal: [smooth, other], smooth: error.u1, s: error.u2, torque: motors}\n");
    EXPECT_EQ(names("goal"), "hip knee");
    EXPECT_EQ(names("smooth"), "hip knee");
    EXPECT_EQ(names("other"), "hip knee");
    EXPECT_EQ(names("torque"), "hip knee");
}

TEST(ElementNames, ThatContradictAreDroppedWhereTheyMeet) {
    const Model names("  a: {block: Named/Source}\n  b: {block: Named/Source, names: \"{'hip', 'ankle'}\"}\n "
                      " sum: {block: Sum}\n"
                      "  of_a: {block: Gain}\n  of_sum: {block: Gain}\n",
                      "connections: {a: [sum.u1, of_a], b: sum.u2, sum: of_sum}\n");
    EXPECT_EQ(names("a.y"), "hip knee");
    EXPECT_EQ(names("b.y"), "hip ankle");
    EXPECT_EQ(names("of_a"), "hip knee");
    EXPECT_EQ(names("sum"), "hip -");
    EXPECT_EQ(names("of_sum"), "hip -");
}

TEST(ElementNames, AreRefusedInAnotherOrder) {
    const auto wrong = [](const std::string& names, const std::string& between, const std::string& wires) {
        return errors_of("model: m\nstep: 1\nblocks:\n  a: {block: Named/Source, names: \"{" + names +
                             "}\"}\n  motors: {block: Named/Sink}\n" + between + "connections: {" + wires +
                             "}\n",
                         {}, &library());
    };
    const std::string gain = "  g: {block: Gain, K: 2}\n";
    EXPECT_EQ(
        wrong("'knee', 'hip'", gain, "a: g, g: motors"),
        "m.yaml:5:3: motors: element 1 of input 'u' is 'hip', but that of g.y is 'knee': both have the same "
        "elements in another order; give both blocks one order, or put a Selector in between");
    EXPECT_EQ(wrong("'hip', 'knee'", gain, "a: g, g: motors"), "");
    EXPECT_EQ(wrong("'knee', 'hip'", "  g: {block: Selector, indices: [2, 1]}\n", "a: g, g: motors"), "");
    EXPECT_EQ(wrong("'knee', 'ankle'", gain, "a: g, g: motors"), "") << "of another robot";
}

TEST(ElementNames, ThatCouldBeMistakenAreNone) {
    const Model names("  s: {block: Named/Source, names: \"{'12', 'a[1]', 'a,b', '', 'l knee', 'j2'}\"}\n");
    EXPECT_EQ(names("s.y"), "- - - - l knee j2");
    const Diagram& d = names.elaborated.diagram;
    const auto end = d.find_signal("s.y");
    EXPECT_EQ(d.element_text(end, 0), "[1]");
    EXPECT_EQ(d.element_text(end, 4), "[l knee]");
    EXPECT_EQ(d.element_lines(end), "\n\n\n\nl knee\nj2\n");
}

TEST(ElementNames, AreNoneWhereNoBlockGivesAny) {
    const Model names("  a: {block: Constant, value: \"[1 2]\"}\n  g: {block: Gain}\n",
                      "connections: {a: g}\n");
    EXPECT_EQ(names("g"), "");
    EXPECT_EQ(names.elaborated.diagram.element_text(names.elaborated.diagram.find_signal("g"), 1), "[2]");
}

} // namespace
} // namespace bf::test

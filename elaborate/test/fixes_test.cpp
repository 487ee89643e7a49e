// A fix is an operation that leaves nothing of the mistake.
#include "support.hpp"

#include "bf/model/operation.hpp"

#include <gtest/gtest.h>

namespace bf::test {
namespace {

std::vector<model::Diagnostic> wrong(const model::Model& m) {
    Registry registry;
    registry.add(standard_library());
    return examine(m, registry).diagnostics;
}

/// Titles of what is offered for the only mistake; each fix is tried, and must leave none.
std::vector<std::string> titles(const std::string& text) {
    const model::Model m = formats::read_yaml_text(text);
    const auto mistakes = wrong(m);
    EXPECT_EQ(mistakes.size(), 1u);
    std::vector<std::string> all;
    if (mistakes.empty()) return all;
    for (const auto& [title, operation] : mistakes.front().fixes) {
        model::Model mended = m;
        model::edit(mended, model::operation_from_json(operation));
        for (const auto& left : wrong(mended)) ADD_FAILURE() << title << " leaves " << left.text();
        all.push_back(title);
    }
    return all;
}
using Titles = std::vector<std::string>;

TEST(Fixes, RenameASettingToTheOneThatWasMeantWithItsValue) {
    EXPECT_EQ(titles("model: m\nstep: 1\nblocks:\n  c: {block: Constant, valu: [1 2]}\n"),
              Titles{"Rename 'valu' to 'value'"});
}

TEST(Fixes, MakeABlockOneThatThereIs) {
    EXPECT_EQ(titles("model: m\nstep: 1\nblocks:\n  c: {block: Constnt}\n"), Titles{"Make it a Constant"});
}

TEST(Fixes, ConnectToThePortThatWasMeant) {
    EXPECT_EQ(titles("model: m\nstep: 1\nblocks:\n  c: {block: Constant}\n  s: {block: Sum, signs: +}\n"
                     "connections:\n  c: s.uu\n"),
              Titles{"Connect 'c' to 's.u1'"});
}

TEST(Fixes, RecordAndPlotTheSignalThatWasMeant) {
    EXPECT_EQ(titles("model: m\nstep: 1\nblocks:\n  clock: {block: Clock}\nplots:\n  t: [clock.z]\n"),
              Titles{"Show 'clock.y' instead"});
}

TEST(Fixes, InsertATransitionBetweenRates) {
    EXPECT_EQ(titles("model: m\nstep: 0.1\nrate_transitions: checked\nblocks:\n"
                     "  quick: {block: RandomUniform, period: 0.1}\n  slow: {block: Gain, period: 0.2}\n"
                     "connections:\n  quick: slow\n"),
              (Titles{"Insert a RateTransition", "Insert all rate transitions of the model"}));
}

std::string of_types(const std::string& blocks, const std::string& wires) {
    return "model: m\nstep: 0.1\nblocks:\n  near: {block: Constant, value: true}\n"
           "  far: {block: Constant, value: false}\n  level: {block: Clock}\n"
           "  small: {block: Constant, value: int8(3)}\n" +
           blocks + "connections:\n" + wires;
}

TEST(Fixes, ConvertInTheWireWhoseTypeIsNarrower) {
    EXPECT_EQ(titles(of_types("  all: {block: Mux, inputs: 2}\n", "  level: all.u1\n  near: all.u2\n")),
              (Titles{"Convert to double before u2", "Convert to boolean before u1"}));
    EXPECT_EQ(titles(of_types("  all: {block: Mux, inputs: 3}\n",
                              "  near: all.u1\n  far: all.u3\n  level: all.u2\n")),
              (Titles{"Convert to double before u1, u3", "Convert to boolean before u2"}));
    EXPECT_EQ(titles(of_types("  all: {block: Sum}\n  convert: {block: Clock}\n",
                              "  small: all.u1\n  convert: all.u2\n")),
              (Titles{"Convert to double before u1", "Convert to int8 before u2"}))
        << "under a name that is free";
}

TEST(Fixes, ConvertWhatABlockDoesNotWorkOn) {
    EXPECT_EQ(titles(of_types("  sine: {block: Trigonometry}\n", "  small: sine\n")),
              Titles{"Convert to double before u"});
    EXPECT_EQ(titles(of_types("  k: {block: Gain, K: 0.5}\n", "  small: k\n")),
              Titles{"Convert to double before u"});
    EXPECT_EQ(titles(of_types("  part:\n    inputs: [x]\n    blocks: {sine: {block: Trigonometry}}\n"
                              "    connections: {x: sine}\n",
                              "  small: part\n")),
              Titles{"Convert to double before u"})
        << "in the subsystem where the block stands";
}

TEST(Fixes, ConvertToTheOneTypeThatAnInputHas) {
    EXPECT_EQ(titles(of_types("  latch: {block: SRFlipFlop}\n", "  small: latch.s\n  near: latch.r\n")),
              Titles{"Convert to boolean before s"});
}

} // namespace
} // namespace bf::test

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

} // namespace
} // namespace bf::test

#include "bf/model/compare.hpp"

#include "bf/model/builder.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"

#include <gtest/gtest.h>

namespace bf::model {
namespace {

using namespace operations;
using Lines = std::vector<std::string>;

Model small_loop() {
    Builder m{"loop"};
    m.step(0.01).record({"plant.y"}).plot("Position", {"plant.y"});
    m.variable("k", 2.0);
    const End plant = m.add("plant", "Gain", {{"K", "k"}});
    SystemBuilder controller = m.subsystem("controller");
    const End q = controller.input("q"), tau = controller.output("tau");
    const End pd = controller.add("pd", "Gain", {{"K", 3}});
    controller.connect(q, pd);
    controller.connect(pd, tau);
    m.connect(plant, controller["q"]);
    m.connect(controller["tau"], plant);
    Model model = m.build();
    model.layout.blocks = {{.path = "plant", .at = {1, 2}}, {.path = "controller.pd", .at = {3, 4}}};
    return model;
}

Lines lines(const Model& before, const Model& after) {
    Lines all;
    for (const Distinction& distinction : compare(before, after)) all.push_back(text_of(distinction));
    return all;
}

Lines after(std::initializer_list<Operation> operations) {
    const Model before = small_loop();
    Model changed = before;
    for (const Operation& operation : operations) edit(changed, operation);
    return lines(before, changed);
}

TEST(Compare, NothingIsSaidOfEqualModels) {
    Model spelt_otherwise = small_loop();
    spelt_otherwise.root.blocks[0].comments.trailing = "# a remark";
    EXPECT_EQ(lines(small_loop(), spelt_otherwise), Lines());
}

TEST(Compare, SaysEachChangeInTheWordsOfTheDocument) {
    EXPECT_EQ(after({Set{"controller.pd", "K", "4"}}), Lines({"~ controller.pd: setting K: 3 -> 4"}));
    EXPECT_EQ(after({Set{"controller.pd", "period", "0.1"}}),
              Lines({"~ controller.pd: period: none -> 0.1"}));
    EXPECT_EQ(after({Set{"", "step", "0.02"}}), Lines({"~ step: 0.01 -> 0.02"}));
    EXPECT_EQ(after({Set{"controller", "execution", "atomic"}}),
              Lines({"~ controller: execution: virtual -> atomic"}));
    EXPECT_EQ(after({Set{"controller.q", "unit", "rad"}}), Lines({"~ controller.q: unit: none -> rad"}));
    EXPECT_EQ(after({SetVariable{"", "k", Variable{.name = "k", .value = {"5"}}}}),
              Lines({"~ variable k: 2 -> 5"}));
    EXPECT_EQ(after({SetVariable{"", "m", Variable{.name = "m", .value = {"1"}}}}),
              Lines({"+ variable m: 1"}));
    EXPECT_EQ(after({Add{"", {.name = "c", .type = "Constant"}}}), Lines({"+ c: Constant"}));
    EXPECT_EQ(after({Disconnect{.system = "", .to = "plant"}}), Lines({"- plant: wire from controller.tau"}));
    EXPECT_EQ(after({Record{"controller.tau"}}), Lines({"+ recorded signal controller.tau"}));
    EXPECT_EQ(after({Plot{"Position", std::vector<std::string>{"plant.y", "controller.tau"}}}),
              Lines({"~ plot Position: plant.y -> plant.y, controller.tau"}));
    EXPECT_EQ(after({Reorder{"plant", 1}}),
              Lines({"~ order of each block: plant, controller -> controller, plant"}));
    EXPECT_EQ(after({Move{"plant", {9, 9}}}), Lines({"~ layout in 1 place"}));
}

TEST(Compare, ARemovedBlockTakesItsWiresAlong) {
    EXPECT_EQ(after({Remove{"controller.pd"}}),
              Lines({"- controller.pd: Gain {K: 3}", "- controller.pd: wire from q",
                     "- controller.tau: wire from pd", "~ layout in 1 place"}));
}

TEST(Compare, ABlockOfAnotherNameAloneIsRenamedAndWhatRefersToItIsNot) {
    EXPECT_EQ(after({Rename{"plant", "motor"}, Rename{"controller.pd", "law"}}),
              Lines({"~ motor: renamed from plant", "~ controller.law: renamed from pd"}));
    EXPECT_EQ(after({Rename{"controller.pd", "law"}, Rename{"controller", "control"}}),
              Lines({"~ control: renamed from controller", "~ control.law: renamed from pd"}));
    EXPECT_EQ(after({Rename{"plant", "motor"}, Set{"motor", "K", "7"}}),
              Lines({"~ motor: renamed from plant", "~ motor: setting K: k -> 7"}));
    EXPECT_EQ(
        after({Rename{"plant", "motor"}, Set{"motor", "K", "7"}, Add{"", {.name = "c", .type = "Gain"}}}),
        Lines({"- plant: Gain {K: k}", "+ motor: Gain {K: 7}", "+ c: Gain", "- controller.q: wire from plant",
               "- plant: wire from controller.tau", "+ controller.q: wire from motor",
               "+ motor: wire from controller.tau", "- recorded signal plant.y", "+ recorded signal motor.y",
               "~ plot Position: plant.y -> motor.y", "~ layout in 2 places"}));
    const Model model = small_loop();
    Model renamed = model;
    edit(renamed, Rename{"controller.pd", "law"});
    edit(renamed, Rename{"controller", "control"});
    EXPECT_EQ(earlier_path("control.law.u", compare(model, renamed)), "controller.pd.u");
}

TEST(Compare, LooksIntoReferencedFiles) {
    Model before = small_loop();
    Model part{.name = "part"};
    part.root.blocks.push_back({.name = "g", .type = "Gain"});
    Block block{.name = "arm"};
    block.reference = Reference{.file = "arm.yaml", .model = std::make_shared<const Model>(part)};
    before.root.blocks.push_back(block);
    Model changed = before;
    part.root.blocks[0].settings.push_back({"K", {"2"}});
    changed.root.blocks.back().reference->model = std::make_shared<const Model>(part);
    EXPECT_EQ(lines(before, changed), Lines({"+ arm.g: setting K: 2"}));
    changed.root.blocks.back().reference->file = "leg.yaml";
    EXPECT_EQ(lines(before, changed).front(), "~ arm: block: arm.yaml -> leg.yaml");
}

/// Differences are what their absence is not: models are equal exactly where nothing is said, layout
/// included.
TEST(Compare, EveryOperationOnADrawingIsNoticed) {
    for (const char* json : {R"({"do": "flip", "path": "plant"})",
                             R"({"do": "bend", "path": "plant", "points": [{"x": 1, "y": 2}]})",
                             R"({"do": "annotate", "name": "n", "note": {"name": "n", "text": "t"}})",
                             R"({"do": "group", "system": "", "blocks": ["plant"], "name": "s"})",
                             R"({"do": "dissolve", "path": "controller"})"}) {
        EXPECT_FALSE(after({operation_from_json(json)}).empty()) << json;
    }
}

} // namespace
} // namespace bf::model

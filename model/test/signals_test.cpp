// Names of signals, what is recorded of them, and fields of structs that subsystems are given.
#include "bf/model/edit.hpp"
#include "bf/model/operation.hpp"
#include "edits.hpp"
#include "loop.hpp"

#include <gtest/gtest.h>
#include <memory>

namespace bf::model {
namespace {

using namespace operations;

std::string refusal(const Operation& operation) { return refusal(operation, drawn_loop()); }

/// The drawn loop with names of its signals.
Model named_loop() {
    Model model = after(drawn_loop(), NameSignal{"", "plant.y", "position"});
    model = after(model, NameSignal{"controller", "pd", "law"});
    model = after(model, NameSignal{"controller", "q", "angle"});
    for (const char* path : {"position", "controller.law", "controller.angle"}) edit(model, Record{path});
    return model;
}
/// "name: source" of each named signal of the system.
Texts names(const Model& model, const std::string& system = "") {
    Texts all;
    for (const NamedSignal& signal : (system.empty() ? model.root : *find(model, system)->content()).signals)
        all.push_back(signal.name + ": " + signal.of.text());
    return all;
}

TEST(NamedSignal, FollowsItsSourceAndIsFollowedByWhatIsRecorded) {
    Model model = after(named_loop(), Rename{"plant", "robot"});
    model = after(model, Rename{"controller.pd", "pid"});
    model = after(model, Rename{"controller.q", "measured"});
    model = after(model, Rename{"controller", "brain"});
    model = after(model, Rename{"brain.law", "torque"});
    EXPECT_EQ(names(model), (Texts{"position: robot.y"}));
    EXPECT_EQ(names(model, "brain"), (Texts{"torque: pid", "angle: measured"}));
    EXPECT_EQ(paths(model.record),
              (Texts{"robot.y", "brain.pid.u", "brain", "position", "brain.torque", "brain.angle"}));
    model = after(model, NameSignal{"", "brain.tau", "position"});
    EXPECT_EQ(names(model), (Texts{"position: brain.tau"})) << "a name that is there is given away";
}

TEST(NamedSignal, GoesWithItsSourceAndByItself) {
    Model model = after(named_loop(), Remove{"controller.angle"});
    EXPECT_EQ(names(model, "controller"), (Texts{"law: pd"}));
    EXPECT_EQ(wires(model, "controller"), (Texts{"q -> pd.q", "pd -> tau"})) << "the wire stays";
    model = after(model, Remove{"controller.pd"});
    EXPECT_EQ(names(model, "controller"), Texts());
    EXPECT_EQ(paths(model.record), (Texts{"plant.y", "controller", "position"}));
    model = after(named_loop(), Remove{"controller.q"});
    EXPECT_EQ(names(model, "controller"), (Texts{"law: pd"}));
}

TEST(NamedSignal, MovesWithItsSourceIntoASubsystemAndOut) {
    Model model = after(named_loop(), Group{"controller", {"pd"}, "inner"});
    EXPECT_EQ(names(model, "controller"), (Texts{"angle: q"}));
    EXPECT_EQ(names(model, "controller.inner"), (Texts{"law: pd"}));
    EXPECT_EQ(paths(model.record).at(4), "controller.inner.law");
    model = after(model, NameSignal{"controller.inner", "q", "inside"});
    model = after(model, NameSignal{"controller", "inner", "outside"});
    edit(model, Record{"controller.inner.inside"});
    model = after(model, Dissolve{"controller.inner"});
    EXPECT_EQ(names(model, "controller"), (Texts{"angle: q", "outside: pd", "law: pd", "inside: q"}));
    EXPECT_EQ(paths(model.record), (Texts{"plant.y", "controller.pd.u", "controller", "position",
                                          "controller.law", "controller.angle", "controller.inside"}));
}

TEST(NamedSignal, IsRefusedWhereItsNameIsTakenOrItsSourceIsNone) {
    EXPECT_EQ(refusal(NameSignal{"", "plant.y", "on"}), "the name 'on' is taken; use another");
    EXPECT_EQ(refusal(NameSignal{"controller", "pd", "a.b"}).substr(0, 44),
              "controller: 'a.b' is no name for a signal; a");
    EXPECT_EQ(refusal(NameSignal{"", "plamt", "x"}), "there is no 'plamt' to connect; did you mean 'plant'?");
    EXPECT_EQ(refusal(Rename{"position", "plant"}, named_loop()), "the name 'plant' is taken; use another");
    EXPECT_EQ(refusal(Rename{"plant", "position"}, named_loop()),
              "the name 'position' is taken; use another");
}

TEST(Record, PutsSignalsIntoPlotsAndTakesThemOut) {
    Model model = after(drawn_loop(), Record{"on", true, "Position"});
    EXPECT_EQ(paths(model.plots[0].signals), (Texts{"plant", "controller.*", "on"}));
    EXPECT_EQ(paths(model.record).size(), 3u) << "what is plotted is recorded, too";
    model = after(model, Record{"on", true, "Switch"});
    EXPECT_EQ(model.plots[1].title, "Switch");
    model = after(model, Record{"on", false, "Switch"});
    EXPECT_EQ(model.plots.size(), 1u) << "a panel goes with its last signal";
    EXPECT_EQ(refusal(Record{"controller.pd", false, "Position"}, model),
              "'controller.pd' is not in the plot 'Position' by itself; change the pattern, or `all`, by "
              "which it may be");
    EXPECT_EQ(refusal(Record{"on", false}, model),
              "'on' is not recorded by itself; change the pattern, or `all`, by which it may be");
}

TEST(Set, ReachesFieldsOfStructsThatASubsystemHas) {
    Model model = drawn_loop();
    edit(model, SetVariable{"controller", "Gain.Kp", Variable{.name = {}, .value = {.text = "1"}}});
    edit(model, SetVariable{"controller", "Gain.Kd", Variable{.name = {}, .value = {.text = "2"}}});
    model = after(model, Set{"controller", "Gain.Kd", "3"});
    const System& controller = *find(std::as_const(model), "controller")->content();
    EXPECT_EQ(find_variable(controller.variables, "Gain.Kd")->value.text, "3");
    EXPECT_EQ(find_variable(controller.variables, "Gain.Kp")->value.text, "1");
    EXPECT_EQ(refusal(Set{"controller", "Gain", "3"}, model).substr(0, 40),
              "controller: there is no 'Gain' to set he");

    auto part = std::make_shared<Model>(Model{.name = "part"});
    part->root.variables = controller.variables;
    Model user{.name = "m"};
    user.root.blocks.push_back({.name = "b"});
    user.root.blocks[0].reference.emplace(Reference{.file = "part.yaml", .model = part});
    const ReadReference read = [&](const std::string&) { return part; };
    const Model given = after(user, Set{"b", "Gain.Kd", "4"}, read);
    const auto& with = find(std::as_const(given), "b")->reference->with;
    EXPECT_EQ(with.at(0).fields.size(), 1u) << "the other field stays that of the file";
    EXPECT_EQ(find_variable(with, "Gain.Kd")->value.text, "4");
    const Model back = after(given, Set{"b", "Gain.Kd"}, read);
    EXPECT_TRUE(find(std::as_const(back), "b")->reference->with.empty());
    const Model inlined = after(given, Inline{"b"}, read);
    EXPECT_EQ(find_variable(find(inlined, "b")->system->variables, "Gain.Kp")->value.text, "1");
}

} // namespace
} // namespace bf::model

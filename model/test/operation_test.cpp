#include "bf/model/operation.hpp"

#include "../src/json.hpp"
#include "bf/model/builder.hpp"
#include "bf/model/check.hpp"
#include "bf/model/edit.hpp"
#include "edits.hpp"
#include "loop.hpp"

#include <cmath>
#include <fstream>
#include <gtest/gtest.h>
#include <set>

namespace bf::model {
namespace {

using namespace operations;

std::string refusal(const Operation& operation) { return refusal(operation, drawn_loop()); }

TEST(ModelValue, IsCopiedAndComparedInDepth) {
    const Model model = drawn_loop();
    Model copy = model;
    EXPECT_TRUE(copy == model);
    find(copy, "controller.pd")->settings[0].value.text = "11*k";
    EXPECT_FALSE(copy == model);
    EXPECT_EQ(find(model, "controller.pd")->settings[0].value.text, "10*k");
    copy = model;
    copy.layout.blocks[0].at.x = 2;
    EXPECT_FALSE(copy == model);
    copy = model;
    copy.root.blocks[0].where.line = 7;
    copy.root.blocks[0].comments.trailing = "  # of the cart";
    copy.root.blocks[0].settings[1].value = {.text = "k", .quotes = Quotes::single};
    EXPECT_TRUE(copy == model) << "spelling does not count";
}

TEST(Rename, FollowsABlockEverywhere) {
    Model model = after(drawn_loop(), Rename{"plant", "robot"});
    model = after(model, Rename{"controller", "brain"});
    model = after(model, Rename{"brain.pd", "law"});
    EXPECT_EQ(wires(model),
              (Texts{"robot.y -> brain.q scope", "brain.tau -> robot.u", "on -> brain.enable"}));
    EXPECT_EQ(wires(model, "brain"), (Texts{"q -> law.q", "law -> tau"}));
    EXPECT_EQ(paths(model.record), (Texts{"robot.y", "brain.law.u", "brain"}));
    EXPECT_EQ(paths(model.plots[0].signals), (Texts{"robot", "brain.*"}));
    EXPECT_EQ(paths(model.layout.blocks), (Texts{"robot", "brain.law"}));
    EXPECT_EQ(paths(model.layout.wires), (Texts{"robot.u", "brain.law.q"}));
    EXPECT_EQ(model.layout.notes[0].system, "brain");
}

TEST(Rename, FollowsAPortInsideAndOutside) {
    Model model = drawn_loop();
    edit(model, Record{"controller.tau"});
    model = after(model, Rename{"controller.tau", "torque"});
    model = after(model, Rename{"controller.q", "angle"});
    EXPECT_EQ(wires(model, "controller"), (Texts{"angle -> pd.q", "pd -> torque"}));
    EXPECT_EQ(wires(model)[0], "plant.y -> controller.angle scope");
    EXPECT_EQ(wires(model)[1], "controller.torque -> plant.u");
    EXPECT_EQ(model.record.back().path, "controller.torque");
}

TEST(Rename, RefusesWhatWouldBreakTheModel) {
    EXPECT_EQ(refusal(Rename{"plamt", "p"}), "there is no block or port 'plamt'; did you mean 'plant'?");
    EXPECT_EQ(refusal(Rename{"controller.dp", "p"}),
              "controller: there is no block or port 'dp'; did you mean 'pd'?");
    EXPECT_EQ(
        refusal(Rename{"plant", "a.b"}),
        "'a.b' is no name for a block; a name has 1 to 200 bytes, no '.' or '*', no control character and "
        "no blank at its ends");
    EXPECT_EQ(refusal(Rename{"plant", "scope"}), "the name 'scope' is taken; use another");
    EXPECT_EQ(refusal(operation_from_json(R"({"do": "bend"})")),
              "'bend' needs the end of a wire; give its 'path', such as \"controller.pd.q\"");
    EXPECT_EQ(refusal(Rename{"controller.pd", "q"}), "controller: the name 'q' is taken; use another");
}

std::vector<std::string> offered(const Model& model, const std::string& path) {
    std::vector<std::string> names;
    for (const auto& property : properties(model, path)) names.push_back(property.name);
    return names;
}

TEST(Properties, AreThoseThatActAsASystemIsExecuted) {
    Model model{.name = "m"};
    model.root.blocks.push_back({.name = "part", .system = std::make_unique<System>()});
    const auto of_root = offered(model, "");
    for (const char* idle : {"execution", "states", "trigger", "reset", "iterations", "icon"})
        EXPECT_EQ(std::ranges::count(of_root, idle), 0) << idle << " is of a subsystem";
    EXPECT_EQ(std::ranges::count(of_root, "solver"), 1);
    model.root.execution = Execution::enabled;
    EXPECT_EQ(std::ranges::count(offered(model, ""), "execution"), 1) << "what is given can be taken back";
    model.root.execution = Execution::plain;
    model.root.outputs.push_back({.name = "y"});
    EXPECT_EQ(std::ranges::count(offered(model, ""), "execution"), 1) << "other models may refer to it";

    using Names = std::vector<std::string>;
    const Names always = {"doc", "when", "period", "offset"};
    const auto of_part = [&](Execution execution) {
        model.root.blocks[0].system->execution = execution;
        Names names = offered(model, "part");
        std::erase_if(names, [&](const auto& name) { return std::ranges::count(always, name) > 0; });
        return names;
    };
    EXPECT_EQ(of_part(Execution::plain), (Names{"execution", "reset", "icon"}));
    EXPECT_EQ(of_part(Execution::enabled), (Names{"execution", "states", "reset", "icon"}));
    EXPECT_EQ(of_part(Execution::triggered), (Names{"execution", "states", "trigger", "reset", "icon"}));
    EXPECT_EQ(of_part(Execution::for_each), (Names{"execution", "states", "iterations", "icon"}));
}

TEST(Add, PutsABlockInItsPlace) {
    Block gain{.name = "gain", .type = "Gain"};
    set(gain, "K", "2*k");
    const Model model =
        after(drawn_loop(), Add{.system = "controller", .block = gain, .index = 0, .at = Point{1, 2}});
    EXPECT_EQ(find(model, "controller")->system->blocks[0].name, "gain");
    EXPECT_EQ(model.layout.blocks.back().path, "controller.gain");
    EXPECT_EQ(
        to_json(Add{.system = "", .block = gain}),
        R"({"do":"add","block":{"name":"gain","type":"Gain","settings":[{"name":"K","value":"2*k"}]}})");
    EXPECT_EQ(refusal(Add{.system = "plant", .block = gain}),
              "plant: the block is no subsystem; group blocks to have one");
    EXPECT_EQ(
        refusal(Add{.system = "", .block = {.name = "empty"}}),
        "empty: the block is neither of a library, nor a subsystem, nor in a file; give it exactly one of "
        "`block`, `blocks` and `file`");
}

TEST(Remove, TakesWiresSignalsAndDrawingAlong) {
    const Model model = after(drawn_loop(), Remove{"controller"});
    EXPECT_EQ(wires(model), (Texts{"plant.y -> scope"}));
    EXPECT_EQ(paths(model.record), (Texts{"plant.y"}));
    EXPECT_EQ(paths(model.plots[0].signals), (Texts{"plant"}));
    EXPECT_EQ(paths(model.layout.blocks), (Texts{"plant"}));
    EXPECT_EQ(paths(model.layout.wires), (Texts{"plant.u"}));
    EXPECT_TRUE(model.layout.notes.empty());
    const Model port = after(drawn_loop(), Remove{"controller.tau"});
    EXPECT_EQ(wires(port), (Texts{"plant.y -> controller.q scope", "on -> controller.enable"}));
    EXPECT_EQ(wires(port, "controller"), (Texts{"q -> pd.q"}));
    EXPECT_EQ(paths(port.record), (Texts{"plant.y", "controller.pd.u"}));
}

TEST(Connect, ExtendsTheConnectionOfTheSource) {
    Model model = after(drawn_loop(), Disconnect{.system = "", .to = "scope"});
    EXPECT_EQ(wires(model)[0], "plant.y -> controller.q");
    model = after(model, Connect{"", "plant.y", "scope"});
    EXPECT_EQ(wires(model)[0], "plant.y -> controller.q scope");
    model = after(model, Disconnect{.system = "controller", .from = "pd", .to = "tau"});
    EXPECT_EQ(wires(model, "controller"), (Texts{"q -> pd.q"}));
    model = after(model, Disconnect{.system = "", .to = "plant.u"});
    EXPECT_EQ(paths(model.layout.wires), (Texts{"controller.pd.q"})) << "the bends go with the wire";
    EXPECT_EQ(refusal(Connect{"", "on", "plant.u"}), "'plant.u' is connected twice; an input has one source");
    EXPECT_EQ(refusal(Connect{"", "on", "scop"}), "there is no 'scop' to connect; did you mean 'scope'?");
    EXPECT_EQ(refusal(Disconnect{.system = "", .to = "plant.w"}),
              "'plant.w' is not connected; did you mean 'plant.u'?");
}

TEST(Set, KnowsWhatTheDocumentSaysByThatName) {
    Model model = after(drawn_loop(), Set{"plant", "A", "1"});
    EXPECT_EQ(find(model, "plant")->find_setting("A")->value.text, "1");
    model = after(model, Set{"plant", "A"});
    EXPECT_EQ(find(model, "plant")->find_setting("A"), nullptr);
    model = after(model, Set{"plant", "period", "2*T"});
    EXPECT_EQ(find(model, "plant")->period->text, "2*T");
    EXPECT_EQ(refusal(Set{"controller", "execution", "triggered"}),
              "subsystem 'controller' has no input 'enable'; known are 'q', 'trigger'");
}

TEST(Add, RefusesKeysOfBlocksAmongTheSettings) {
    for (const std::string name : {"doc", "when", "period", "offset", "block", "blocks"}) {
        Block block{.name = "q", .type = "Clock"}, around{.name = "s"};
        block.settings.push_back({.name = name, .value = {"1"}});
        around.system = std::make_unique<System>();
        around.system->blocks.push_back(block);
        const std::string why = "'" + name + "' is no setting; give it beside the settings";
        EXPECT_EQ(refusal(Add{"", block}), "q: " + why);
        EXPECT_EQ(refusal(Add{"", around}), "s.q: " + why);
    }
}

TEST(Set, RefusesWhatIsNot) {
    Model model = after(drawn_loop(), Set{"controller", "reset", "level_hold"});
    EXPECT_EQ(find(model, "controller")->system->reset, Edge::level);
    model = after(model, Set{"controller.tau", "unit", "N*m"});
    EXPECT_EQ(find(model, "controller")->system->outputs[0].unit, "N*m");
    model = after(model, Set{"", "stop", "10"});
    model = after(model, Set{"", "non_finite", "error"});
    EXPECT_EQ(model.stop->text, "10");
    EXPECT_EQ(model.non_finite, NonFinite::error);
    EXPECT_EQ(
        refusal(Set{"controller", "reset", "up"}),
        "the operation's 'reset' is not as it must be; it is one of rising, falling, either, level_hold");
    EXPECT_EQ(refusal(Set{"plant", "B"}), "plant: the block has no setting 'B'; did you mean 'A'?");
    EXPECT_EQ(refusal(Set{"controller", "Kp", "1"}),
              "controller: there is no 'Kp' to set here; known are 'doc', 'when', 'period', 'offset', "
              "'execution', 'states', 'reset', 'icon'");
    EXPECT_EQ(refusal(Set{"", "stpo", "1"}), "there is no 'stpo' to set here; did you mean 'stop'?");
}

TEST(Set, TakesTruthAsItIsWritten) {
    Model model{.name = "m"};
    System part;
    part.execution = Execution::for_each;
    part.iterations = Expression{.text = "2"};
    part.inputs.push_back({.name = "u"});
    model.root.blocks.push_back({.name = "s", .system = std::make_unique<System>(part)});
    const auto port = [](const Model& m) { return find(m, "s")->system->inputs[0]; };
    const Model each = after(model, Set{"s.u", "each", "true"});
    EXPECT_TRUE(port(each).each);
    EXPECT_FALSE(port(after(each, Set{"s.u", "each", "false"})).each);
    EXPECT_FALSE(port(after(each, Set{"s.u", "each"})).each) << "left out, it is as usual";
    EXPECT_EQ(refusal(Set{"s.u", "each", "yes"}, model),
              "the operation's 'each' is not as it must be; it is true or false");
}

TEST(SetVariable, ReachesFieldsOfStructs) {
    const Variable one{.name = "Kp", .value = {.text = "1"}}, other{.name = "Ki", .value = {.text = "2"}};
    Model model = after(drawn_loop(), SetVariable{"", "Gain", Variable{.name = {}, .fields = {one, other}}});
    const auto gain = [&]() -> const Variable& { return model.root.variables.back(); };
    model = after(model, SetVariable{"", "Gain.Kp", Variable{.name = {}, .value = {.text = "3"}}});
    EXPECT_EQ(gain().fields[0].value.text, "3");
    EXPECT_EQ(gain().fields[1].value.text, "2");
    model = after(model, SetVariable{"", "Gain.Kd", Variable{.name = {}, .value = {.text = "4"}}});
    EXPECT_EQ(gain().fields[2].name, "Kd");
    model = after(model, SetVariable{"", "Gain.Ki"});
    EXPECT_EQ(gain().fields.size(), 2u);
    EXPECT_EQ(gain().name, "Gain");
    EXPECT_EQ(refusal(SetVariable{"", "k.x", Variable{.name = {}, .value = {.text = "1"}}}),
              "there is no struct 'k' for 'k.x'; use a name without '.', or another one before it");
}

TEST(SetVariable, DeclaresAStructByItsFirstFieldAndRemovesItWithItsLast) {
    const Model before = drawn_loop();
    const Variable one{.name = {}, .value = {.text = "1"}};
    Model model = after(before, SetVariable{"", "Tank.pump.K", one});
    const Variable& tank = model.root.variables.back();
    EXPECT_EQ(tank.name, "Tank");
    ASSERT_EQ(tank.fields.size(), 1u);
    EXPECT_EQ(tank.fields[0].name, "pump");
    EXPECT_EQ(tank.fields[0].fields.at(0).name, "K");
    model = after(model, SetVariable{"", "Tank.A1", one});
    model = after(model, SetVariable{"", "Tank.pump.K"});
    ASSERT_EQ(model.root.variables.back().fields.size(), 1u);
    EXPECT_EQ(model.root.variables.back().fields[0].name, "A1");
    model = after(model, SetVariable{"", "Tank.A1"});
    EXPECT_EQ(model.root.variables.size(), before.root.variables.size());
    EXPECT_EQ(refusal(SetVariable{"", "Tank.A1"}),
              "there is no struct 'Tank' for 'Tank.A1'; use a name without '.', or another one before it");
}

TEST(RenameVariable, KnowsNamesFromWhatLooksLikeThem) {
    const auto renamed = [](const std::string& text) {
        Model model =
            after(drawn_loop(), SetVariable{"", "z", Variable{.name = {}, .value = {.text = text}}});
        model = after(model, RenameVariable{"", "k", "K"});
        return model.root.variables.back().value.text;
    };
    const std::vector<std::pair<const char*, const char*>> all{
        {"k*k'", "K*K'"},
        {"kk + k2 + k_ + 2*k", "kk + k2 + k_ + 2*K"},
        {"s.k + k.s", "s.k + K.s"},
        {"[1 k]' + k.'", "[1 K]' + K.'"},
        {"{'it''s k', k}", "{'it''s k', K}"},
        {"{\"a \"\"k\"\" b\", k}", "{\"a \"\"k\"\" b\", K}"},
        {"k % of k", "K % of k"},
        {"[k, 'k' k]", "[K, 'k' K]"},
        {"1e3 + 0x1k + k", "1e3 + 0x1k + K"},
        {"'k", "'k"},
        {"1..k + a.k + [.k k]", "1..K + a.k + [.k K]"},
        {"a.k..k", "a.k..K"},
    };
    for (const auto& [text, wanted] : all) EXPECT_EQ(renamed(text), wanted);
}

TEST(RenameVariable, FollowsExpressionsButNoTextsFieldsOrShadows) {
    Model model = after(drawn_loop(), RenameVariable{"", "k", "spring"});
    EXPECT_EQ(find(model, "plant")->find_setting("A")->value.text, "[0 1; -spring 0]");
    EXPECT_EQ(find(model, "plant")->find_setting("name")->value.text, "'k'");
    EXPECT_EQ(find(model, "controller.pd")->find_setting("filter")->value.text, "s.k + spring'");
    model = after(model, RenameVariable{"", "T", "period"});
    EXPECT_EQ(model.step->text, "period");
    EXPECT_EQ(model.root.variables[1].value.text, "3.5*period");
    model = after(model, SetVariable{"controller", "spring", Variable{.name = {}, .value = {.text = "1"}}});
    model = after(model, RenameVariable{"", "spring", "k"});
    EXPECT_EQ(find(model, "controller.pd")->find_setting("Kp")->value.text, "10*spring");
    EXPECT_EQ(refusal(RenameVariable{"", "k", "s"}), "'s' has a meaning in 's.k + k''; use another name");
    EXPECT_EQ(refusal(RenameVariable{"", "k", "T"}), "'T' has a meaning in '3.5*T'; use another name");
    EXPECT_EQ(refusal(RenameVariable{"", "kk", "c"}), "there is no variable 'kk'; did you mean 'k'?");
}

TEST(Layout, TurnsBlocksAndPutsPortsOnOtherSides) {
    Model model = after(drawn_loop(), Rotate{"plant"});
    EXPECT_EQ(model.layout.blocks[0].rotated, Rotation::quarter);
    for (int i = 0; i < 3; ++i) model = after(model, Rotate{"plant"});
    EXPECT_EQ(model.layout.blocks[0].rotated, Rotation::none);
    model = after(model, PlacePort{"controller", "tau", Side::top});
    model = after(model, PlacePort{"controller", "q", Side::bottom});
    model = after(model, PlacePort{"controller", "q", Side::right});
    const auto sides = [&] { return model.layout.blocks.back().sides; };
    ASSERT_EQ(sides().size(), 2u);
    EXPECT_EQ(sides()[1].side, Side::right);
    model = after(model, Rename{"controller.q", "angle"});
    EXPECT_EQ(sides()[1].port, "angle") << "a port keeps its side with another name";
    model = after(model, Remove{"controller.angle"});
    EXPECT_EQ(sides().size(), 1u);
    model = after(model, PlacePort{"controller", "tau"});
    EXPECT_TRUE(sides().empty());
    EXPECT_EQ(refusal(PlacePort{"plant", "", Side::top}),
              "plant: 'place_port' needs the name of a port; give its 'port'");
    EXPECT_EQ(refusal(Rotate{"plan"}), "there is no block or port 'plan'; did you mean 'plant'?");
}

TEST(Layout, IsChangedInPlace) {
    Model model = after(drawn_loop(), Move{"plant", {20, 30}});
    model = after(model, Resize{"plant", Point{80, 40}});
    model = after(model, Flip{"plant"});
    model = after(model, Move{"controller.q", {1, 1}});
    model = after(model, Bend{"plant.u", {{1, 1}, {2, 2}}});
    model = after(model, Annotate{"n", Note{.text = "other", .at = {1, 1}, .size = Point{90, 30}}});
    model = after(model, Annotate{"n", Note{.name = "m", .text = "other", .at = {1, 1}}});
    EXPECT_EQ(model.layout.blocks[0].at, (Point{20, 30}));
    EXPECT_EQ(model.layout.blocks[0].size, (Point{80, 40}));
    EXPECT_TRUE(model.layout.blocks[0].flipped);
    EXPECT_EQ(paths(model.layout.blocks), (Texts{"plant", "controller.pd", "controller.q"}));
    EXPECT_EQ(model.layout.wires[0].points.size(), 2u);
    EXPECT_EQ(model.layout.notes[0].name, "m");
    EXPECT_EQ(model.layout.notes[0].size, (Point{90, 30})); // it was moved and renamed, not resized
    model = after(model, Bend{"plant.u"});
    model = after(model, Annotate{"m"});
    EXPECT_EQ(model.layout.wires.size(), 1u);
    EXPECT_TRUE(model.layout.notes.empty());
    EXPECT_EQ(refusal(Move{"plan", {0, 0}}), "there is no block or port 'plan'; did you mean 'plant'?");
    EXPECT_EQ(refusal(Move{"plant", {0, 1.0 / 0.0}}),
              "plant: it is drawn at [0, inf]; coordinates lie between -1000000 and 1000000");
    EXPECT_EQ(refusal(Resize{"plant", Point{0, 1}}),
              "plant: it is drawn 0 wide and 1 high; sizes are greater than 0 and at most 1000000");
    const double far = 1e308;
    EXPECT_EQ(refusal(Add{.system = "", .block = {.name = "new", .type = "Gain"}, .at = Point{far, 0}}),
              "new: it is drawn at [1e+308, 0]; coordinates lie between -1000000 and 1000000");
    EXPECT_EQ(refusal(Bend{"plant.u", {{0, 0}, {0, -far}}}),
              "plant.u: a corner of the wire is drawn at [0, -1e+308]; coordinates lie between -1000000 and "
              "1000000");
    EXPECT_EQ(
        refusal(Annotate{"n", Note{.name = {}, .text = "t", .system = "controller", .at = {0, 1000001}}}),
        "controller: the note 'n' is drawn at [0, 1000001]; coordinates lie between -1000000 and 1000000");
}

TEST(Layout, GivesAWireLabelsOrCorners) {
    Model model = after(drawn_loop(), Label{"plant.u", true});
    EXPECT_TRUE(model.layout.wires[0].as_labels);
    EXPECT_TRUE(model.layout.wires[0].points.empty());
    EXPECT_EQ(after(model, Rename{"plant", "motor"}).layout.wires[0].path, "motor.u");
    EXPECT_FALSE(after(model, Bend{"plant.u", {{1, 1}}}).layout.wires[0].as_labels);
    EXPECT_EQ(after(model, Label{"plant.u"}).layout.wires.size(), model.layout.wires.size() - 1);
    EXPECT_EQ(refusal(Label{"plant.v", true}), "plant.v: no wire leads there; did you mean 'plant.u'?");
}

TEST(Layout, RefusesPortsAndWiresThatAreNotThere) {
    EXPECT_EQ(refusal(PlacePort{"controller", "tao", Side::top}),
              "controller: there is no port 'tao'; did you mean 'tau'?");
    EXPECT_EQ(refusal(PlacePort{"controller.tau", "u", Side::top}),
              "controller.tau: this is a port, which has none itself; name a block");
    EXPECT_EQ(refusal(Bend{"plant.v", {{1, 2}}}), "plant.v: no wire leads there; did you mean 'plant.u'?");
    EXPECT_EQ(refusal(Bend{"plant.v"}), "plant.v: no wire leads there; did you mean 'plant.u'?");
    Model model = drawn_loop();
    model.layout.wires.push_back({.path = "gone.u", .points = {{1, 2}}});
    EXPECT_EQ(after(model, Bend{"gone.u"}).layout.wires.size(), model.layout.wires.size() - 1)
        << "what is left of a wire is removed";
}

TEST(Layout, HoldsDisplaysWhoseSignalsFollowWhatIsRenamed) {
    Model model = after(drawn_loop(),
                        Watch{"angle", Display{.name = {}, .signals = {{"plant.q"}, {"controller.tau"}}}});
    model =
        after(model, Watch{"angle", Display{.name = "phase", .shows = Shows::xy, .signals = {{"plant.q"}}}});
    model = after(model, Watch{"other", Display{.name = {}}});
    model = after(model, Rename{"plant", "arm"});
    ASSERT_EQ(model.layout.displays.size(), 2u);
    EXPECT_EQ(model.layout.displays[0].name, "phase");
    EXPECT_EQ(model.layout.displays[0].shows, Shows::xy);
    EXPECT_EQ(paths(model.layout.displays[0].signals), Texts{"arm.q"});
    model = after(model, Remove{"arm"});
    EXPECT_TRUE(model.layout.displays[0].signals.empty());
    const auto refused = [&](const Watch& watch) {
        try {
            edit(model, watch);
        } catch (const Errors& errors) {
            return errors.diagnostics().front().text();
        }
        return std::string();
    };
    EXPECT_EQ(refused(Watch{"phas"}), "there is no display 'phas'; did you mean 'phase'?");
    EXPECT_EQ(refused(Watch{"other", Display{.name = "phase"}}),
              "there is a display 'phase' already; use another name");
    model = after(model, Watch{"phase"});
    EXPECT_EQ(model.layout.displays.size(), 1u);
}

TEST(Layout, KeepsToSizesThatCanBeDrawn) {
    const auto size = [](double x, double y) { return refusal(Resize{"plant", Point{x, y}}); };
    for (const auto& [x, y] : {std::pair(80., 40.), {0.5, 0.5}, {1, 1}}) EXPECT_EQ(size(x, y), "accepted");
    for (const auto& [x, y] : {std::pair(0., 40.), {80, 0}, {-1, 40}, {80, -1}, {HUGE_VAL, 1}, {1, NAN}})
        EXPECT_NE(size(x, y), "accepted") << x << ", " << y;
}

TEST(Group, MakesAPortPerSourceAndDissolvesAgain) {
    const Model grouped = after(drawn_loop(), Group{"", {"plant", "on"}, "world"});
    EXPECT_EQ(wires(grouped), (Texts{"world.y -> controller.q scope", "controller.tau -> world.u",
                                     "world.y2 -> controller.enable"}));
    EXPECT_EQ(wires(grouped, "world"), (Texts{"plant.y -> y", "u -> plant.u", "on -> y2"}));
    EXPECT_EQ(grouped.root.blocks[0].name, "world");
    EXPECT_EQ(paths(grouped.record), (Texts{"world.plant.y", "controller.pd.u", "controller"}));
    EXPECT_EQ(paths(grouped.layout.wires), (Texts{"world.plant.u", "controller.pd.q"}));
    EXPECT_EQ(grouped.layout.blocks.back().path, "world");
    const Model dissolved = after(grouped, Dissolve{"world"});
    EXPECT_EQ(wires(dissolved), (Texts{"plant.y -> controller.q scope", "controller.tau -> plant.u",
                                       "on -> controller.enable"}));
    EXPECT_EQ(paths(dissolved.record), paths(drawn_loop().record));
    EXPECT_EQ(paths(dissolved.layout.blocks), (Texts{"plant", "controller.pd"}));
    EXPECT_EQ(paths(dissolved.layout.wires), paths(drawn_loop().layout.wires));
    EXPECT_EQ(refusal(Group{"", {}, "g"}), "there are no blocks to group; name some");
    EXPECT_EQ(refusal(Group{"", {"plant"}, "scope"}), "the name 'scope' is taken; use another");
}

TEST(Dissolve, FollowsOutputsAndMakesNamesUnique) {
    Builder m{"names"};
    const End a = m.add("a", "Gain"), b = m.add("b", "Gain");
    SystemBuilder s = m.subsystem("s");
    const End u = s.input("u"), through = s.output("through"), y = s.output("y");
    const End inner = s.add("a", "Gain");
    s.connect(u, {inner, through});
    s.connect(inner, y);
    m.connect(a, s["u"]);
    m.connect(s["through"], b);
    m.connect(s["y"], m.add("c", "Gain"));
    m.record({"s.y", "s.a", "s.through"});
    const Model model = after(m.build(), Dissolve{"s"});
    EXPECT_EQ(wires(model), (Texts{"a -> s_a b", "s_a -> c"}));
    EXPECT_EQ(paths(model.record), (Texts{"s_a", "s_a", "a"}));
    EXPECT_EQ(
        refusal(Dissolve{"controller"}),
        "controller: the subsystem decides when its blocks run, which would be lost; make it virtual first: "
        "set `execution`, `period`, `offset`, `reset`");
}

TEST(Dissolve, RefusesWhateverWouldBeLost) {
    const auto with = [](auto&& change) {
        Model model{.name = "m"};
        Block block{.name = "s", .system = std::make_unique<System>()};
        block.system->inputs.push_back({.name = "u"});
        block.system->outputs.push_back({.name = "y"});
        change(block);
        model.root.blocks.push_back(std::move(block));
        return refusal(Dissolve{"s"}, std::move(model));
    };
    const std::string runs =
        "s: the subsystem decides when its blocks run, which would be lost; make it virtual "
        "first: set `execution`, `period`, `offset`, `reset`";
    EXPECT_EQ(with([](Block&) {}), "accepted");
    EXPECT_EQ(with([](Block& s) { s.system->execution = Execution::atomic; }), runs);
    EXPECT_EQ(with([](Block& s) { s.period = Expression{.text = "1"}; }), runs);
    EXPECT_EQ(with([](Block& s) { s.offset = Expression{.text = "1"}; }), runs);
    EXPECT_EQ(with([](Block& s) { s.system->reset = Edge::rising; }), runs);
    EXPECT_EQ(with([](Block& s) { s.when = Expression{.text = "true"}; }),
              "s: the subsystem is a variant, which would be lost; remove its `when` first");
    const std::string variables =
        "s: the subsystem has variables, which would be lost; declare them outside first";
    EXPECT_EQ(with([](Block& s) { s.system->variables.push_back({.name = "k", .value = {.text = "1"}}); }),
              variables);
    EXPECT_EQ(with([](Block& s) { s.system->enumerations.push_back({.name = "Mode"}); }), variables);
    for (const bool is_input : {true, false}) {
        const auto port = [&](auto&& change) {
            return with([&](Block& s) { change((is_input ? s.system->inputs : s.system->outputs)[0]); });
        };
        EXPECT_NE(port([](Port& p) { p.shape = Expression{.text = "[3]"}; }), "accepted") << is_input;
        EXPECT_NE(port([](Port& p) { p.type = "int8"; }), "accepted") << is_input;
        EXPECT_NE(port([](Port& p) { p.initial = Expression{.text = "1"}; }), "accepted") << is_input;
    }
}

TEST(Reference, IsExtractedAndInlinedAgain) {
    const Model extracted = after(drawn_loop(), Extract{"controller", "parts/controller.yaml"});
    const Block& block = *find(extracted, "controller");
    ASSERT_TRUE(block.reference && block.reference->model);
    EXPECT_EQ(block.reference->file, "parts/controller.yaml");
    const Model& part = *block.reference->model;
    EXPECT_TRUE(check(part).empty());
    EXPECT_EQ(part.root.execution, Execution::enabled);
    EXPECT_EQ(paths(part.layout.blocks), (Texts{"pd"}));
    EXPECT_EQ(paths(part.layout.wires), (Texts{"pd.q"}));
    EXPECT_EQ(part.layout.notes[0].system, "");
    EXPECT_EQ(paths(extracted.layout.wires), (Texts{"plant.u"}));
    const ReadReference read = [&](const std::string&) { return block.reference->model; };
    EXPECT_TRUE(*after(extracted, Inline{"controller"}, read).root.blocks[1].system ==
                *drawn_loop().root.blocks[1].system);
    EXPECT_EQ(
        refusal(Set{"controller.pd", "Kp", "1"}, extracted),
        "controller: the block stands in the file 'parts/controller.yaml'; edit that file, or inline it");
}

TEST(Reference, BringsThePluginsOfItsBlocks) {
    Model model = drawn_loop();
    model.plugins = {{.name = "Filters"}};
    const Model extracted = after(model, Extract{"controller", "part.yaml"});
    const Model& part = *find(extracted, "controller")->reference->model;
    ASSERT_EQ(part.plugins.size(), 1u);
    EXPECT_EQ(part.plugins[0].name, "Filters");
}

TEST(Inline, PutsOverridesInPlaceAndRefusesHiddenNames) {
    auto part = std::make_shared<Model>(Model{.name = "part"});
    part->root.variables = {{.name = "n", .value = {.text = "1"}},
                            {.name = "g", .value = {.text = "2"}, .minimum = Expression{.text = "0"}}};
    Model model{.name = "m"};
    model.root.blocks.push_back({.name = "b"});
    auto& reference = model.root.blocks[0].reference.emplace(Reference{.file = "part.yaml", .model = part});
    reference.with = {{.name = "g", .value = {.text = "3*x"}}};
    const ReadReference read = [&](const std::string&) { return part; };
    const Model inlined = after(model, Inline{"b"}, read);
    EXPECT_EQ(find(inlined, "b")->system->variables[1].value.text, "3*x");
    EXPECT_EQ(find(inlined, "b")->system->variables[1].minimum->text, "0");
    reference.with[0].value.text = "3*n";
    EXPECT_EQ(
        refusal(Inline{"b"}, model),
        "b: 'g' is overridden with '3*n', and 'n' means something else in 'part.yaml'; rename one of the two "
        "variables");
}

TEST(Inline, BringsPluginsOfTheFileOnce) {
    auto part = std::make_shared<Model>(Model{.name = "part"});
    part->plugins = {{.name = "Known"}, {.name = "New"}};
    Model model{.name = "m"};
    model.plugins = {{.name = "Known"}};
    model.root.blocks.push_back({.name = "b"});
    model.root.blocks[0].reference.emplace(Reference{.file = "part.yaml", .model = part});
    const Model inlined = after(model, Inline{"b"}, [&](const std::string&) { return part; });
    std::vector<std::string> names;
    for (const auto& plugin : inlined.plugins) names.push_back(plugin.name);
    EXPECT_EQ(names, (Texts{"Known", "New"}));
}

TEST(Patch, ChangesOnlyWhatDiffers) {
    // The inverse of one new unit names that unit alone, however deep it stands.
    Model model = drawn_loop();
    const std::string back = to_json(Operation(edit(model, Set{"controller.tau", "unit", "N*m"})));
    EXPECT_NE(back.find("/unit"), std::string::npos) << back;
    EXPECT_EQ(back.find("pd"), std::string::npos) << back;
    EXPECT_EQ(back.find("plant"), std::string::npos) << back;
}

TEST(Batch, IsAllOrNothing) {
    const Operation both = Batch{{Rename{"plant", "robot"}, Move{"robot", {1, 1}}}};
    EXPECT_EQ(find(after(drawn_loop(), both), "robot")->type, "StateSpace");
    EXPECT_EQ(refusal(Batch{{Rename{"plant", "robot"}, Rename{"plant", "other"}}}),
              "there is no block or port 'plant'; known are 'robot', 'controller', 'on', 'scope'");
}

TEST(OperationText, IsRefusedWhereItIsNone) {
    const auto wrong = [](const std::string& text) -> std::string {
        try {
            return to_json(operation_from_json(text));
        } catch (const Errors& errors) {
            return errors.what();
        }
    };
    EXPECT_EQ(wrong("{"), R"(the operation is no JSON; write {"do": "rename", "path": ..., ...})");
    EXPECT_EQ(wrong(R"({"do": "renam"})"), "there is no operation 'renam'; did you mean 'rename'?");
    EXPECT_EQ(wrong(R"({"do": "rename", "path": 3})"),
              "the operation's 'path' is not as it must be; it is a text");
    EXPECT_EQ(wrong(R"({"do": "rename", "to": "x"})"),
              "the operation's 'to' is not as it must be; it is not known: remove it");
    EXPECT_EQ(wrong(R"({"do": "add", "block": {"settings": [{"nam": ""}]}})"),
              "the operation's 'block.settings.nam' is not as it must be; it is not known: remove it");
    EXPECT_EQ(wrong(R"({"do": "reorder", "index": -1})"),
              "the operation's 'index' is not as it must be; it is a whole number, not negative");
    std::string deep;
    for (int i = 0; i < 100000; ++i) deep += R"({"do":"batch","operations":[)";
    EXPECT_NE(wrong(deep), "");
    for (int i = 0; i < 100000; ++i) deep += "]}";
    EXPECT_NE(wrong(deep).find("nested"), std::string::npos);
}

TEST(Patch, IsRefusedWhereItDoesNotFit) {
    EXPECT_EQ(
        refusal(Patch{{{.at = "root/blocks/9/name", .value = "\"x\""}}}),
        "the patch does not fit the model at 'root/blocks/9/name'; apply it to the model that the operation "
        "left behind");
    for (const Change& change :
         {Change{"root/blocks/1", 9, "[]"}, Change{"root/none", {}, "1"}, Change{"", 1, "{}"},
          Change{"root/blocks/x", 0, "[]"}, Change{"name", {}, "{"}})
        EXPECT_NE(refusal(Patch{{change}}), "accepted") << change.at;
}

TEST(History, UndoesAndRepeats) {
    Model model = drawn_loop();
    History history;
    EXPECT_FALSE(history.undo(model));
    history.edit(model, Rename{"plant", "robot"});
    history.edit(model, Remove{"robot"});
    EXPECT_TRUE(history.undo(model) && history.undo(model));
    EXPECT_TRUE(model == drawn_loop());
    EXPECT_TRUE(history.redo(model));
    EXPECT_NE(find(model, "robot"), nullptr);
    history.edit(model, Rename{"robot", "other"});
    EXPECT_FALSE(history.redo(model));
}

TEST(History, HasNothingToUndoOfAnEditThatChangesNothing) {
    Model model = drawn_loop();
    History history;
    EXPECT_TRUE(history.edit(model, Set{"controller.pd", "Kp", "3"}));
    EXPECT_TRUE(history.undo(model));
    EXPECT_FALSE(history.edit(model, Rename{"plant", "plant"}));
    EXPECT_FALSE(history.edit(model, Batch{{Rename{"plant", "robot"}, Rename{"robot", "plant"}}}));
    EXPECT_TRUE(history.redo(model));
    EXPECT_FALSE(history.edit(model, Set{"controller.pd", "Kp", "3"}));
    EXPECT_TRUE(history.undo(model));
    EXPECT_TRUE(model == drawn_loop());
}

/// "from to" of each move.
std::vector<std::string> texts(const std::optional<std::vector<Moved>>& moved) {
    std::vector<std::string> all;
    if (!moved) return {"unknown"};
    for (const auto& [from, to] : *moved) all.push_back(from + " " + to);
    return all;
}

TEST(History, KnowsWhichBlocksAreTheSameOnesUnderOtherPaths) {
    using Texts = std::vector<std::string>;
    Model model = drawn_loop();
    History history;
    history.edit(model, Set{"controller.pd", "Kp", "3"});
    EXPECT_EQ(texts(history.moved()), Texts());
    history.edit(model, Rename{"controller", "law"});
    EXPECT_EQ(texts(history.moved()), Texts{"controller law"}) << "with what is inside";
    history.edit(model, Rename{"law.tau", "torque"});
    EXPECT_EQ(texts(history.moved()), Texts()) << "a port is no block";
    history.edit(model, Batch{{Rename{"plant", "tmp"}, Rename{"on", "plant"}, Rename{"tmp", "on"}}});
    EXPECT_EQ(texts(history.moved()), (Texts{"plant on", "on plant"}));
    history.edit(model, Group{"", {"on", "scope"}, "on"});
    EXPECT_EQ(texts(history.moved()), (Texts{"on on.on", "scope on.scope"}));
    EXPECT_EQ(path_before(*history.moved(), "on.on"), "on");
    EXPECT_EQ(path_before(*history.moved(), "on"), std::nullopt) << "the subsystem is new";
    EXPECT_EQ(path_before(*history.moved(), "law.pd"), "law.pd");
    history.edit(model, Add{"on", {.name = "extra", .type = "Gain"}});
    EXPECT_EQ(texts(history.moved()), Texts());
    EXPECT_TRUE(history.undo(model) && history.undo(model));
    EXPECT_EQ(texts(history.moved()), (Texts{"on.on on", "on.scope scope"}));
    EXPECT_TRUE(history.redo(model) && history.undo(model) && history.undo(model) && history.redo(model));
    EXPECT_EQ(texts(history.moved()), (Texts{"plant on", "on plant"}));
    history.replace(model, drawn_loop());
    EXPECT_EQ(texts(history.moved()), Texts{"unknown"});
}

TEST(Moved, LeadsFromPathsToPathsAtOnce) {
    const std::vector<Moved> moves{{"a", "b"}, {"b", "a"}, {"s", "t.s"}, {"s.x", "x"}};
    EXPECT_EQ(path_before(moves, "b.y"), "a.y");
    EXPECT_EQ(path_after(moves, "a.y delayed"), "b.y delayed");
    EXPECT_EQ(path_after(moves, "a(1).x"), "b(1).x");
    EXPECT_EQ(path_after(moves, "ab"), "ab");
    EXPECT_EQ(path_after(moves, "s.x.u"), "x.u");
    EXPECT_EQ(path_after(moves, "s.y"), "t.s.y");
    EXPECT_EQ(path_before(moves, "t.s"), "s");
    EXPECT_EQ(path_before(moves, "s.y"), std::nullopt);
    EXPECT_EQ(path_after(moves, "x"), std::nullopt) << "something else has come there";
}

TEST(Operation, ThePageOfOperationsHasALineOfEachWithAllMembersAndNoOthers) {
    std::ifstream page(BF_SOURCE_DIRECTORY "/docs/how-to/edit_a_model.md");
    std::set<std::size_t> kinds;
    for (std::string line; std::getline(page, line);) {
        if (!line.starts_with("{\"do\": ")) continue;
        const Operation operation = operation_from_json(line); // refuses members that are not known
        const Json json = Json::parse(line);
        EXPECT_EQ(Json::parse(to_json(operation)), json) << line;
        kinds.insert(operation.index());
        std::visit(
            [&]<class T>(const T&) {
                for_each_field<T>([&](const auto& field) { EXPECT_TRUE(json.contains(field.name)) << line; });
            },
            operation);
    }
    EXPECT_EQ(kinds.size(), std::variant_size_v<Operation>);
}

} // namespace
} // namespace bf::model

#include "bf/model/builder.hpp"
#include "bf/model/check.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/suggest.hpp"

#include <gtest/gtest.h>

namespace bf::model {
namespace {

Model loop() {
    Builder m{"loop"};
    m.step(0.001).stop(10).record({"plant.y", "controller.pd.u"}).plot("Position", {"plant", "controller.*"});
    m.variable("k", 3.5);
    const End plant = m.add("plant", "StateSpace", {{"A", "[0 1; -k 0]"}, {"D", 0}});
    SystemBuilder controller = m.enabled_subsystem("controller");
    const End q = controller.input("q"), tau = controller.output("tau");
    const End pd = controller.add("pd", "PD", {{"Kp", "10"}, {"filter", true}});
    controller.connect(q, pd["q"]);
    controller.connect(pd, tau);
    const End on = m.add("on", "Constant", {{"value", 0.1}});
    m.connect(plant["y"], {controller["q"], m.add("scope", "Scope")});
    m.connect(controller, plant["u"]);
    m.connect(on, controller["enable"]);
    return m.build();
}

std::vector<std::string> texts(const std::vector<Diagnostic>& diagnostics) {
    std::vector<std::string> all;
    for (const Diagnostic& d : diagnostics) all.push_back(d.text());
    return all;
}

using Texts = std::vector<std::string>;

TEST(Builder, WritesTheModelInTheOrderOfItsCalls) {
    const Model model = loop();
    Texts paths;
    walk(model, [&](const std::string& path, const Block& block) {
        EXPECT_EQ(find(model, path), &block);
        paths.push_back(path);
    });
    EXPECT_EQ(paths, (Texts{"plant", "controller", "controller.pd", "on", "scope"}));
    EXPECT_EQ(find(model, "controller")->content()->execution, Execution::enabled);
    EXPECT_EQ(find(model, "on")->find_setting("value")->value.text, "0.1");
    EXPECT_EQ(find(model, "controller.pd")->find_setting("filter")->value.text, "true");
    EXPECT_EQ(model.step->text, "0.001");
    EXPECT_EQ(model.stop->text, "10");
    ASSERT_EQ(model.root.connections.size(), 3u);
    EXPECT_EQ(model.root.connections[0].to[0].text(), "controller.q");
    EXPECT_EQ(find(model, "controller")->system->connections[1].to[0].text(), "tau");
}

TEST(Builder, ReportsAllErrorsAtOnce) {
    Builder m{"wrong"};
    m.add("gain", "Gain");
    m.add("gain", "Gain");
    m.connect(End{"gian"}, End{"gain"});
    try {
        m.build();
        FAIL() << "nothing was thrown";
    } catch (const Errors& errors) {
        EXPECT_EQ(texts(errors.diagnostics()),
                  (Texts{"a second block 'gain'; rename one of them",
                         "there is no block 'gian' to connect 'gian'; did you mean 'gain'?"}));
        EXPECT_STREQ(errors.what(), "a second block 'gain'; rename one of them\n"
                                    "there is no block 'gian' to connect 'gian'; did you mean 'gain'?");
    }
}

TEST(System, HasTheControlPortsOfItsExecution) {
    const auto ports = [](Execution execution, bool resets = false, bool counts = false) {
        System system;
        system.execution = execution;
        if (resets) system.reset = Edge::rising;
        if (counts) system.iterations = Expression{.text = "3"};
        std::string all;
        for (const auto port : control_ports(system)) all += std::string(port) + " ";
        return all;
    };
    EXPECT_EQ(ports(Execution::atomic), "");
    EXPECT_EQ(ports(Execution::enabled), "enable ");
    EXPECT_EQ(ports(Execution::triggered), "trigger ");
    EXPECT_EQ(ports(Execution::enabled_and_triggered, true), "enable trigger reset ");
    EXPECT_EQ(ports(Execution::atomic, true), "reset ");
    EXPECT_EQ(ports(Execution::for_loop), "iterations ");
    EXPECT_EQ(ports(Execution::for_loop, true, true), "reset ");
    EXPECT_EQ(ports(Execution::for_each, true), "");
}

TEST(Builder, AtomicSubsystemsKeepTheirPeriod) {
    Builder m{"atomic"};
    m.atomic_subsystem("slow", "0.01");
    m.atomic_subsystem("inherited");
    const Model model = m.build();
    EXPECT_EQ(find(model, "slow")->period->text, "0.01");
    EXPECT_EQ(find(model, "slow")->system->execution, Execution::atomic);
    EXPECT_FALSE(find(model, "inherited")->period);
}

TEST(Edit, SetChangesOrAddsASetting) {
    Model model = loop();
    Block& plant = *find(model, "plant");
    set(plant, "A", "[1 2]");
    set(plant, "E", "3");
    EXPECT_EQ(plant.find_setting("A")->value.text, "[1 2]");
    EXPECT_EQ(plant.find_setting("E")->value.text, "3");
    EXPECT_EQ(plant.settings.size(), 3u);
}

TEST(Check, SaysWhatIsWrongWithEachConnection) {
    Builder m{"connections"};
    SystemBuilder two = m.enabled_subsystem("two"), none = m.subsystem("none");
    two.input("first"), two.input("second");
    two.output("sum");
    two.output("difference");
    const End gain = m.add("gain", "Gain");
    m.connect(two["smu"], gain["a"]);
    m.connect(two, gain["b"]);
    m.connect(none, gain["c"]);
    m.connect(gain, two["third"]);
    m.connect(gain, {two["first"], two["first"]});
    m.connect(gain, {});
    m.connect(gain, End{"", "out"});
    two.connect(End{"", "sum"}, End{"", "difference"});
    two.connect(End{"", "enable"}, End{"", "first"});
    try {
        m.build();
        FAIL() << "nothing was thrown";
    } catch (const Errors& errors) {
        EXPECT_EQ(texts(errors.diagnostics()),
                  (Texts{"subsystem 'two' has no output 'smu'; did you mean 'sum'?",
                         "subsystem 'two' has several outputs; name the one that is meant: 'two.sum'",
                         "subsystem 'none' has no output; declare it in the `outputs` of 'none'",
                         "subsystem 'two' has no input 'third'; known are 'first', 'second', 'enable'",
                         "'two.first' is connected twice; an input has one source",
                         "'gain' is connected to nothing; name a destination, or remove the connection",
                         "there is no 'out' to connect; known are 'two', 'none', 'gain'",
                         "two: 'sum' is an output of this subsystem, which inside it is no source; "
                         "connect what computes it",
                         "two: 'first' is an input of this subsystem, which inside it is no destination; "
                         "connect what is to receive it"}));
    }
}

TEST(Check, SaysWhatIsWrongWithNames) {
    Model model{.name = "names"};
    model.root.variables.push_back({.name = "2nd", .value = {.text = "1"}});
    model.root.variables.push_back({.name = "x", .value = {.text = "1"}});
    model.root.variables.push_back({.name = "x", .value = {.text = "2"}});
    model.root.blocks.push_back({.name = "a.b", .type = "Gain"});
    model.root.blocks.push_back({.name = "u", .type = "Gain"});
    model.root.blocks.push_back({.name = "nothing"});
    model.root.blocks.push_back({.name = "shifted", .type = "Gain", .offset = Expression{.text = "1"}});
    model.root.inputs.push_back({.name = "u"});
    model.root.inputs.push_back({.name = "enable"});
    model.root.execution = Execution::enabled;
    EXPECT_EQ(
        texts(check(model)),
        (Texts{"'a.b' is no name for a block; a name has 1 to 200 bytes, no '.' or '*', no control character "
               "and no blank at its ends",
               "'u' names both a block and a port of the subsystem; rename one of them, so that connections "
               "are clear",
               "the subsystem has its input 'enable' already; remove it from `inputs`",
               "'2nd' is no name for a variable; use a letter followed by letters, digits and '_'",
               "a second variable 'x'; rename one of them",
               "nothing: the block is neither of a library, nor a subsystem, nor in a file; give it exactly "
               "one of `block`, `blocks` and `file`",
               "shifted: `offset` without `period`; an offset shifts a sample time: give both"}));
}

TEST(Check, APluginIsANameAndNoPath) {
    Model model{.name = "m"};
    model.plugins = {{.name = "Filters"}, {.name = "/opt/Filters"}, {.name = "a/b"}};
    const std::string remedy =
        "' is a path; give its name only, and its folder as `bf --plugin-path FOLDER` or in "
        "BLOCKFACTORY_PLUGIN_PATH";
    EXPECT_EQ(texts(check(model)), (Texts{"the plugin '/opt/Filters" + remedy, "the plugin 'a/b" + remedy}));
}

TEST(Check, FindsSignalsThatDoNotExist) {
    Model model = loop();
    model.record = {{.path = "controler.tau"}, {.path = "controller.dp"}, {.path = "c*.x"}, {.path = "all"}};
    EXPECT_EQ(
        texts(check(model)),
        (Texts{"there is no signal 'controler.tau'; did you mean 'controller'?",
               "there is no signal 'controller.dp'; did you mean 'pd'?",
               "there is no signal 'all'; every signal is recorded by `record: all`, without brackets"}));
}

TEST(Check, RefusesTooDeepNestingWithoutDescending) {
    Model model{.name = "deep"};
    System* system = &model.root;
    for (int level = 0; level < max_depth + 5; ++level) {
        system->blocks.push_back({.name = "s", .system = std::make_unique<System>()});
        system = system->blocks[0].system.get();
    }
    const std::vector<Diagnostic> found = check(model);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].message, "subsystems are nested more than 100 deep");
}

TEST(Check, OverridesNameVariablesOfTheReferencedModel) {
    auto inner = std::make_shared<Model>();
    inner->root.variables.push_back({.name = "gain", .value = {.text = "1"}});
    Model model{.name = "outer"};
    model.root.blocks.push_back({.name = "b"});
    model.root.blocks[0].reference =
        Reference{.file = "inner.yaml", .with = {{.name = "gian", .value = {.text = "2"}}}, .model = inner};
    EXPECT_EQ(texts(check(model)),
              Texts{"b: 'inner.yaml' has no variable 'gian' to override; did you mean 'gain'?"});
}

TEST(Suggest, PrefersFewEditsAndKeepsSilentOtherwise) {
    const std::vector<std::string> known = {"blocks", "block", "Gain"};
    EXPECT_EQ(name_remedy("gian", known), "did you mean 'Gain'?");
    EXPECT_EQ(name_remedy("something", known), "known are 'blocks', 'block', 'Gain'");
    EXPECT_EQ(name_remedy("x", {}), "");
}

TEST(Diagnostic, TextHasPlacePathMessageAndRemedy) {
    const auto file = std::make_shared<const std::string>("m.yaml");
    const Location where{file, 3, 7};
    const Diagnostic d{where, "a.b", "wrong", "do this"};
    EXPECT_EQ(d.text(), "m.yaml:3:7: a.b: wrong; do this");
    EXPECT_EQ((Diagnostic{{}, "", "wrong", ""}.text()), "wrong");
}

TEST(Expression, SingleQuotesAreMatlabs) {
    EXPECT_EQ((Expression{.text = "it's", .quotes = Quotes::single}.matlab()), "'it''s'");
    EXPECT_EQ((Expression{.text = "2*pi", .quotes = Quotes::twofold}.matlab()), "2*pi");
}

} // namespace
} // namespace bf::model

#include "bf/library/stand_ins.hpp"

#include "bf/engine/simulation.hpp"
#include "bf/formats/yaml.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace bf {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// What blocks of a subsystem share: the names of its joints.
struct Joints {
    static constexpr const char* resource = "Joints";
    std::vector<std::string> names;
    struct Live {};
    std::shared_ptr<Live> open() const { return std::make_shared<Live>(); }
};

class Arm final : public Block {
  public:
    using Block::Block;
    Argument<std::vector<std::string>> names{this, "names", {.initial = {"a", "b"}, .doc = "of the joints"}};
    Provides<Joints> joints{this, [this] { return std::make_shared<const Joints>(Joints{*names}); }};
};

/// q [rad] of each joint of the arm around; with `speed` also its rate.
class Encoders final : public Block {
  public:
    using Block::Block;
    Argument<bool> speed{this, "speed", {.initial = false, .doc = "also the rate"}};
    Requires<Joints> joints{this, "whose joints"};
    Dim n{this, "n", [this]() -> Dim::Names { return joints->names; }};
    Output<Vector> q{this, "q", {.shape = {n}, .unit = unit<"rad">, .doc = "angles"}};
    Output<Vector> dq{this, "dq", {.shape = {n}, .unit = unit<"rad/s">, .doc = "rates", .present = *speed}};
    Status output(Now, Out) const noexcept override { return ok; }
};

/// Of any size, and of the type of its input; y depends on x alone.
class Past final : public Block {
  public:
    using Block::Block;
    Dim n{this, "n"};
    Input<Vector> u{this, "u", {.shape = {n}, .unit = any_unit, .doc = "signal", .feedthrough = false}};
    Output<Vector> y{this, "y", {.shape = {n}, .unit = any_unit, .doc = "what it was"}};
    Parameter<double> a{this, "a", {.initial = {0.5}, .minimum = 0, .maximum = 1, .doc = "pole"}};
    DiscreteState<Vector> x{this, "x", {.shape = {n}, .unit = any_unit, .doc = "past"}};
    Status output(Now, Out) const noexcept override { return ok; }
    Status update(Now, Next) const noexcept override { return ok; }
};

/// As many outputs as its argument says.
class Taps final : public Block {
  public:
    using Block::Block;
    Argument<int> count{this, "count", {.initial = 1, .minimum = 1, .doc = "of taps"}};
    Dim n{this, "n", [this] { return *count; }};
    Output<Vector> y{this, "y", {.shape = {n}, .doc = "of each tap"}};
    Status output(Now, Out) const noexcept override { return ok; }
};

class StandIns : public ::testing::Test {
  protected:
    StandIns() {
        std::string name = (fs::temp_directory_path() / "bf_stand_ins_XXXXXX").string();
        folder_ = ::mkdtemp(name.data());
    }
    ~StandIns() override {
        fs::remove_all(folder_);
        ::unsetenv("BLOCKFACTORY_PLUGIN_PATH");
    }

    LoadedModel loaded(const std::string& text) {
        const fs::path file = folder_ / "m.yaml";
        std::ofstream(file) << text;
        LoadedModel model{make_registry(), {file, {}, {}}, {}};
        Library library("Arms");
        library.group("arms")
            .add<Arm>("Arm", "An arm.")
            .add<Encoders>("Encoders", "Angles.")
            .add<Past>("Past", "What was.")
            .add<Taps>("Taps", "Several.");
        model.registry->add(library);
        model.diagram =
            elaborate(formats::read_yaml(file, model.source.texts), *model.registry, {{}, folder_.string()});
        return model;
    }
    std::map<std::string, std::string> declared(const LoadedModel& model) {
        return declarations_of(model.diagram, *model.registry);
    }

    fs::path folder_;
};

const std::string arm_model = R"(model: m
plugins: [Arms]
step: 0.01
blocks:
  arm: {block: Arms/Arm, names: [hip, knee, ankle]}
  sensors: {block: Arms/Encoders, period: 0.02}
  both: {block: Arms/Encoders, speed: true}
  long: {block: Arms/Past, a: 0.9}
  short: {block: Arms/Past}
  small: {block: Constant, value: "[1 2]"}
  loop: {block: Sum, signs: "+-"}
connections:
  sensors: loop.u1
  long: loop.u2
  loop: long
  small: short
record: [long.y, short.y, both.dq]
)";

TEST_F(StandIns, AModelIsTheSameWithThem) {
    const LoadedModel model = loaded(arm_model);
    const auto declarations = declared(model);
    ASSERT_EQ(declarations.size(), 1u);
    EXPECT_EQ(block_that_differs(model, declarations), "");
}

TEST_F(StandIns, PortsOfTheModelAndOfItsSubsystemsAreOfNoLibrary) {
    const LoadedModel model = loaded(R"(model: m
plugins: [Arms]
step: 0.01
inputs: [u]
outputs: [y]
blocks:
  one: {block: Constant}
  past: {block: Arms/Past}
  e: {execution: enabled, inputs: [u], outputs: [y], blocks: {g: {block: Gain}}, connections: {u: g, g: y}}
  t: {execution: triggered, inputs: [u], outputs: [y], blocks: {g: {block: Gain}}, connections: {u: g, g: y}}
  f: {execution: for, iterations: 2, inputs: [u], outputs: [y], blocks: {g: {block: Gain}}, connections: {u: g, g: y}}
  p: {execution: for_each, iterations: 1, inputs: {u: {each: true}}, outputs: [y], blocks: {g: {block: Gain}}, connections: {u: g, g: y}}
connections: {one: [e.enable, t.trigger], u: [e.u, t.u, f.u, past], past: y, e: p.u}
)");
    const auto declarations = declared(model);
    ASSERT_EQ(declarations.size(), 1u);
    EXPECT_EQ(Json::parse(declarations.at("Arms"))["blocks"].size(), 1u);
    EXPECT_EQ(block_that_differs(model, declarations), "");
}

TEST_F(StandIns, StandForAPluginWhoseDeclarationsAreInTheSearchPathAndRefuseToStart) {
    const LoadedModel model = loaded(arm_model);
    std::ofstream(folder_ / (std::string("Arms") + declarations_ending)) << declared(model).at("Arms");
    ::setenv("BLOCKFACTORY_PLUGIN_PATH", folder_.c_str(), 1);
    const LoadedModel other = load(folder_ / "m.yaml");
    const int both = other.diagram.find_node("both"), slow = other.diagram.find_node("long");
    const Block& block = *other.diagram.nodes[static_cast<std::size_t>(both)].block;
    EXPECT_EQ(block.declaration().slots[1].doc, "rates");
    EXPECT_EQ(block.declaration().slots[1].unit.text, "rad/s");
    EXPECT_EQ(block.declaration().slots[1].unit, unit<"rad/s">);
    EXPECT_EQ(other.diagram.element_text(other.diagram.find_signal("long.y"), 1), "[knee]");
    const Slot& a = other.diagram.slot(other.diagram.find_parameter("long.a"));
    EXPECT_EQ(a.initial, std::vector{0.9});
    EXPECT_EQ(a.limits.maximum, 1);
    EXPECT_EQ(other.diagram.slot({slow, 0}).size.rows, 3);
    Simulation run(other.diagram);
    try {
        run.start();
        FAIL() << "it runs";
    } catch (const std::exception& error) {
        EXPECT_NE(std::string(error.what()).find("run the model where its plugin is"), std::string::npos)
            << error.what();
    }
}

TEST_F(StandIns, ABlockOfOtherArgumentsIsRefusedByItsPath) {
    LoadedModel model = loaded(arm_model);
    std::ofstream(folder_ / (std::string("Arms") + declarations_ending)) << declared(model).at("Arms");
    ::setenv("BLOCKFACTORY_PLUGIN_PATH", folder_.c_str(), 1);
    std::string text = arm_model;
    text.replace(text.find("knee, "), 6, "");
    std::ofstream(folder_ / "m.yaml") << text;
    const ExaminedModel found = examine(folder_ / "m.yaml");
    ASSERT_EQ(found.diagnostics.size(), 1u);
    EXPECT_EQ(found.diagnostics[0].path, "arm");
    EXPECT_EQ(
        found.diagnostics[0].message,
        "the plugin of this block is not here, and nothing says what the block is with these arguments");
}

TEST_F(StandIns, NumbersOfArgumentsTellBlocksApart) {
    const LoadedModel model = loaded(R"(model: m
plugins: [Arms]
step: 0.01
blocks: {two: {block: Arms/Taps, count: 2}, three: {block: Arms/Taps, count: 3}}
)");
    EXPECT_EQ(block_that_differs(model, declared(model)), "");
}

TEST_F(StandIns, WhatNeitherArgumentsNorWiresTellApartIsNamed) {
    const LoadedModel model = loaded(R"(model: m
plugins: [Arms]
step: 0.01
blocks:
  left: {blocks: {arm: {block: Arms/Arm}, sensors: {block: Arms/Encoders}}}
  right: {blocks: {arm: {block: Arms/Arm, names: [a]}, sensors: {block: Arms/Encoders}}}
)");
    EXPECT_EQ(block_that_differs(model, declared(model)), "left.sensors");
}

TEST_F(StandIns, TextsThatAreNoDeclarationsAreRefusedAndWrongOnesDoNoHarm) {
    for (const char* text :
         {"", "{}", "[]", "null", "{\"plugin\": 3, \"blocks\": []}", "{\"plugin\": \"A\", \"blocks\": [{}]}"})
        EXPECT_THROW(static_cast<void>(stand_ins(text)), PluginError) << text;

    const LoadedModel model = loaded(arm_model);
    const Json right = Json::parse(declared(model).at("Arms"));
    const Json flat = right.flatten();
    int refused = 0;
    for (const auto& [place, value] : flat.items())
        for (const Json& other :
             {Json(), Json(-1), Json(1000000000), Json("x"), Json::array(), Json(Json::object())}) {
            Json wrong = right;
            wrong[Json::json_pointer(place)] = other;
            try {
                Registry registry;
                registry.add(stand_ins(wrong.dump()));
                for (const auto& known : registry.classes()) static_cast<void>(known->make({}));
                std::map<std::string, std::string> texts{{"Arms", wrong.dump()}};
                static_cast<void>(block_that_differs(model, texts));
            } catch (const PluginError&) {
                ++refused;
            }
        }
    EXPECT_GT(refused, 1000);
}

} // namespace
} // namespace bf

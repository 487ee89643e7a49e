// Each case runs natively, as an old engine sees it, and hosted again from there: equal bit for bit. The old
// engine is the one of generated code; the life cycle is walked in the orders that engines use.
#include "../../blocks/test/run_block.hpp"
#include "BlockFactory/Core/FactorySingleton.h"
#include "bf/boundary/as_legacy_block.hpp"
#include "bf/boundary/hosted_block.hpp"
#include "legacy_class.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <random>
#include <set>

namespace bf::boundary {
namespace {

namespace core = blockfactory::core;
using test::RunBlock;

/// A block with its arguments, parameters and the sizes of its inputs.
struct Case {
    std::string plugin, block;
    Arguments arguments;
    std::vector<std::pair<std::string, std::vector<double>>> parameters;
    std::vector<Size> inputs;
};
std::ostream& operator<<(std::ostream& to, const Case& c) { return to << c.plugin << "/" << c.block; }

const Size vector3 = test::vector_size(3);
Matrix row(std::initializer_list<double> x) {
    return Eigen::Map<const Matrix>(x.begin(), 1, static_cast<Eigen::Index>(x.size()));
}
const std::vector<Case> cases{
    {"NativePlugin", "Accumulate", {}, {{"factor", {2}}, {"bias", {1, 2, 3}}}, {vector3, vector3}},
    {"NativePlugin", "Clocked", {{"mode", "double"}, {"negate", true}}, {}, {test::matrix_size(2, 3)}},
    {"WholeBodyToolbox", "MinimumJerkTrajectoryGenerator", {}, {}, {vector3}},
    {"WholeBodyToolbox", "MassMatrix", {}, {}, {test::matrix_size(4, 4), {}}},
    {"WholeBodyToolbox", "ForwardKinematics", {{"frame", "l_sole"}}, {}, {test::matrix_size(4, 4), {}}},
};
const std::vector<std::string> legs{"l_hip_pitch", "l_hip_roll", "l_hip_yaw", "l_knee"};

/// Outputs of one step, all ports one after the other.
using Outputs = std::vector<std::vector<double>>;
constexpr double period = 0.01;
constexpr int steps = 20;

/// Inputs of step k: smooth, and a rigid transform where a pose is wanted.
std::vector<double> input(const Size& size, int step, std::size_t port) {
    if (size == test::matrix_size(4, 4)) {
        const double c = std::cos(0.1 * step), s = std::sin(0.1 * step);
        return {c, s, 0, 0, -s, c, 0, 0, 0, 0, 1, 0, 0.1 * step, 0.2, 0.6, 1};
    }
    std::vector<double> values;
    for (int i = 0; i < size.count(); ++i)
        values.push_back(0.3 + std::abs(std::sin(0.7 * i + static_cast<double>(port) + 0.05 * step)));
    return values;
}

std::string file_of(const std::string& plugin) {
    return plugin == "WholeBodyToolbox" ? BF_BINARY_DIRECTORY "/lib/blockfactory/WholeBodyToolbox.so"
                                        : std::string(BF_TEST_PLUGINS) + "/" + plugin + ".so";
}

struct Conformance : testing::TestWithParam<Case> {
    Registry registry;
    Case c = GetParam();
    bool is_robotic = false;
    std::vector<int> out_slots;

    void SetUp() override {
        core::Log::getSingleton().clear();
        registry.load_plugin(file_of(c.plugin));
        is_robotic = !of(c.block).make({})->declaration().requirements.empty();
        for (auto& size : c.inputs)
            if (size.is_scalar()) size = test::vector_size(static_cast<int>(legs.size()));
    }
    const BlockClass& of(const std::string& name) { return registry.find(c.plugin + "/" + name); }

    /// Steps of the block in its own engine, with the robot's description beside it when it needs one.
    std::vector<Outputs> native() {
        Instance block(of(c.block), c.arguments);
        std::unique_ptr<Instance> robot;
        if (is_robotic) {
            robot = std::make_unique<Instance>(of("Configuration"), Arguments{{"joints", legs}});
            robot->open();
            block.require(0, robot->resolution().provided[0], [&] { return robot->object(0); });
        }
        for (const auto& [name, value] : c.parameters)
            block.give(block.declaration().find(name, Role::parameter),
                       Value(Matrix(Eigen::Map<const Eigen::RowVectorXd>(
                           value.data(), static_cast<Eigen::Index>(value.size())))));
        std::vector<int> in, out;
        for (int i = 0; i < static_cast<int>(block.resolution().slots.size()); ++i) {
            if (block.slot(i).role == Role::input && !block.slot(i).optional) {
                block.wire(i, c.inputs[in.size()]);
                in.push_back(i);
            }
            if (block.slot(i).role == Role::output) out.push_back(i);
        }
        block.open();
        EXPECT_TRUE(block.reset());
        std::vector<Outputs> all;
        for (int k = 0; k < steps; ++k) {
            block.clock() = {k * period, period, k};
            for (std::size_t i = 0; i < in.size(); ++i)
                write_values(block.data(in[i]), Type::float64, c.inputs[i].count(), input(c.inputs[i], k, i));
            EXPECT_TRUE(block.run(Phase::output));
            Outputs now;
            for (const int slot : out) {
                const auto* data = static_cast<const double*>(block.data(slot));
                now.emplace_back(data, data + block.slot(slot).size.count());
            }
            EXPECT_NE(now[0], std::vector<double>(now[0].size(), 0.0));
            all.push_back(now);
            EXPECT_TRUE(block.run(Phase::update));
            block.commit();
        }
        return all;
    }

    Arguments legacy_arguments() const {
        Arguments all = c.arguments;
        for (const auto& [name, value] : c.parameters)
            all.emplace_back(name, value.size() == 1
                                       ? Value(value[0])
                                       : Value(Matrix(Eigen::Map<const Matrix>(
                                             value.data(), 1, static_cast<Eigen::Index>(value.size())))));
        // The old interface has no defaults: what the case leaves open is given as declared.
        const auto declare = [&](const Block& block) {
            for (const auto& argument : block.declaration().arguments)
                if (std::none_of(all.begin(), all.end(),
                                 [&](const auto& a) { return a.first == argument.name; }))
                    all.emplace_back(argument.name,
                                     argument.name == "joints" ? Value(legs) : argument.initial);
            for (const auto& slot : block.resolution().slots)
                if (slot.role == Role::parameter &&
                    std::none_of(all.begin(), all.end(), [&](const auto& a) { return a.first == slot.name; }))
                    all.emplace_back(slot.name, Value(slot.initial.empty() ? 0.0 : slot.initial[0]));
        };
        auto& self = const_cast<Conformance&>(*this);
        declare(*self.of(c.block).make({}));
        if (is_robotic) declare(*self.of("Configuration").make({}));
        all.emplace_back("sample_time", period);
        return all;
    }
};

/// Ports with the sizes of a case; open outputs are asked of the native run.
core::Port::Info port(std::size_t index, const Size& size) {
    if (size.is_matrix) return {index, {size.rows, size.cols}, core::Port::DataType::DOUBLE};
    return {index, {size.rows}, core::Port::DataType::DOUBLE};
}

TEST_P(Conformance, AsLegacyEqualsNative) {
    const auto expected = native();
    auto legacy = std::make_shared<const LegacyClass>(file_of(c.plugin), c.plugin, c.block);
    LegacyObject sized(legacy, legacy_arguments()), object(legacy, legacy_arguments());
    ASSERT_TRUE(sized.call("configureSizeAndPorts", [](core::Block& block, HostInformation& information) {
        std::set<unsigned> indices;
        const bool good = block.configureSizeAndPorts(&information);
        for (const auto& metadata : information.declared()) indices.insert(metadata.index);
        EXPECT_EQ(block.numberOfParameters(), indices.size());
        return good;
    })) << sized.message();
    ASSERT_EQ(sized.information.inputs().size(), c.inputs.size());
    ASSERT_EQ(sized.information.outputs().size(), expected[0].size());

    std::vector<core::Port::Info> in, out;
    std::vector<std::vector<double>> in_memory, out_memory;
    for (const auto& size : c.inputs) {
        in.push_back(port(in.size(), size));
        in_memory.emplace_back(static_cast<std::size_t>(size.count()));
    }
    for (const auto& declared : sized.information.outputs()) {
        auto info = declared;
        const auto count = expected[0][out.size()].size();
        if (width(info) == core::Port::DynamicSize)
            info.dimension = c.inputs[0].is_matrix && info.dimension.size() == 2
                                 ? std::vector<int>{c.inputs[0].rows, c.inputs[0].cols}
                                 : std::vector<int>{static_cast<int>(count)};
        EXPECT_EQ(static_cast<std::size_t>(width(info)), count);
        out.push_back(info);
        out_memory.emplace_back(count);
    }
    object.information.run_on(in, out);
    for (std::size_t i = 0; i < in.size(); ++i) object.information.point(false, i, in_memory[i].data());
    for (std::size_t i = 0; i < out.size(); ++i) object.information.point(true, i, out_memory[i].data());

    // Not legal before initialize: refused, and the process survives.
    EXPECT_FALSE(object.call("output", [](core::Block& b, HostInformation& i) { return b.output(&i); }));
    EXPECT_NE(std::string(object.message()).find("the block was not initialised"), std::string::npos);
    EXPECT_FALSE(
        object.call("terminate", [](core::Block& b, HostInformation& i) { return b.terminate(&i); }));
    EXPECT_FALSE(object.call("initializeInitialConditions", [](core::Block& b, HostInformation& i) {
        return b.initializeInitialConditions(&i);
    }));
    for (int again = 0; again < 3; ++again) {
        // Once as after the start, once after a second initialize, once after a reset of the conditions only.
        if (again < 2) {
            ASSERT_TRUE(object.call("initialize", [](core::Block& b, HostInformation& i) {
                return b.initialize(&i);
            })) << object.message();
        }
        ASSERT_TRUE(object.call("initializeInitialConditions", [](core::Block& b, HostInformation& i) {
            return b.initializeInitialConditions(&i);
        }));
        for (int k = 0; k < steps; ++k) {
            for (std::size_t i = 0; i < in.size(); ++i) in_memory[i] = input(c.inputs[i], k, i);
            for (std::size_t i = 0; i < in.size(); ++i)
                object.information.point(false, i, in_memory[i].data());
            ASSERT_TRUE(object.call("output", [](core::Block& b, HostInformation& i) {
                return b.output(&i) && b.updateDiscreteState(&i);
            })) << object.message();
            for (std::size_t i = 0; i < out.size(); ++i)
                EXPECT_EQ(0,
                          std::memcmp(out_memory[i].data(), expected[static_cast<std::size_t>(k)][i].data(),
                                      out_memory[i].size() * sizeof(double)))
                    << "output " << i << ", step " << k << ", round " << again;
        }
    }
    const auto terminate = [](core::Block& b, HostInformation& i) { return b.terminate(&i); };
    EXPECT_TRUE(object.call("terminate", terminate));
    EXPECT_FALSE(object.call("terminate", terminate));
    EXPECT_FALSE(object.call("output", [](core::Block& b, HostInformation& i) { return b.output(&i); }));
    EXPECT_TRUE(
        object.call("initialize", [](core::Block& b, HostInformation& i) { return b.initialize(&i); }));
}

TEST_P(Conformance, HostedEqualsNative) {
    const auto expected = native();
    auto legacy = std::make_shared<const LegacyClass>(file_of(c.plugin), c.plugin, c.block);
    const BlockClass hosted{c.plugin,
                            c.block,
                            "",
                            "",
                            [legacy](const Arguments& a) { return std::make_unique<HostedBlock>(legacy, a); },
                            methods_of<HostedBlock>()};
    RunBlock run(hosted, legacy_arguments());
    for (std::size_t i = 0; i < c.inputs.size(); ++i) run.wire("u" + std::to_string(i + 1), c.inputs[i]);
    run.start();
    run.context().start(0);
    for (int again = 0; again < 2; ++again, run.reset())
        for (int k = 0; k < steps; ++k) {
            for (std::size_t i = 0; i < c.inputs.size(); ++i)
                run.set("u" + std::to_string(i + 1), input(c.inputs[i], k, i));
            const Status status = run.step();
            ASSERT_TRUE(status) << status.text();
            for (std::size_t i = 0; i < expected[0].size(); ++i) {
                const Matrix y = run.get("y" + std::to_string(i + 1));
                const auto& wanted = expected[static_cast<std::size_t>(k)][i];
                ASSERT_EQ(static_cast<std::size_t>(y.size()), wanted.size());
                EXPECT_EQ(0, std::memcmp(y.data(), wanted.data(), wanted.size() * sizeof(double)))
                    << "output " << i << ", step " << k;
            }
        }
    run.context().stop(0);
}

INSTANTIATE_TEST_SUITE_P(Boundary, Conformance, testing::ValuesIn(cases),
                         [](const auto& named) { return named.param.plugin + "_" + named.param.block; });

TEST(Conformance, OldAndNewBlockOfOneRuleAgree) {
    Registry registry;
    registry.add_search_path(BF_TEST_PLUGINS);
    const Arguments arguments{{"factor", 2.0}, {"bias", row({1, 2, 3})}};
    RunBlock old(registry.find("LegacyPlugin/Accumulate"), arguments);
    old.wire("u1", vector3).wire("u2", vector3).start();
    old.context().start(0);
    RunBlock native(registry.find("NativePlugin/Accumulate"));
    native.wire("u1", vector3).wire("u2", vector3).start();
    native.set("factor", std::vector<double>{2}).set("bias", std::vector<double>{1, 2, 3});
    for (int k = 0; k < steps; ++k) {
        for (auto* run : {&old, &native}) {
            run->set("u1", input(vector3, k, 0)).set("u2", input(vector3, k, 1));
            ASSERT_TRUE(run->step());
        }
        EXPECT_EQ(old.get("y1"), native.get("y1"));
    }
}

TEST(AsLegacy, EveryBlockOfTheToolboxHasAFactory) {
    Registry registry;
    registry.load_plugin(file_of("WholeBodyToolbox"));
    ASSERT_GT(registry.classes().size(), 10u);
    for (const auto& known : registry.classes()) {
        core::ClassFactorySingleton::ClassFactory factory(file_of("WholeBodyToolbox").c_str(),
                                                          known->name.c_str());
        ASSERT_TRUE(factory.isValid()) << known->name << ": " << factory.getError();
        core::Block* block = factory.create();
        EXPECT_NE(block, nullptr);
        factory.destroy(block);
    }
}

TEST(AsLegacy, EveryBlockOfThePluginsIsExportedThroughTheOldSymbols) {
    Registry registry;
    registry.load_plugin(file_of("WholeBodyToolbox"));
    const auto names_of = [](const auto& classes) {
        std::vector<std::string> names;
        for (const auto& known : classes) names.push_back(known->name);
        std::sort(names.begin(), names.end());
        return names;
    };
    EXPECT_EQ(legacy_labels(file_of("WholeBodyToolbox")), names_of(registry.classes()));

    const std::string standard = BF_BINARY_DIRECTORY "/lib/blockfactory/legacy/standard.so";
    Registry standard_blocks;
    standard_blocks.load_plugin(standard);
    ASSERT_GT(standard_blocks.classes().size(), 50u);
    EXPECT_EQ(legacy_labels(standard), names_of(standard_blocks.classes()));
}

TEST(AsLegacy, TheOldSymbolsAreThoseOfTheList) {
    EXPECT_EQ(legacy_labels(file_of("NativePlugin")),
              (std::vector<std::string>{"Accumulate", "Clocked", "Continuous", "Nothing"}));
}

TEST(AsLegacy, SaysWhatTheOldInterfaceCannotDo) {
    auto continuous =
        std::make_shared<const LegacyClass>(file_of("NativePlugin"), "NativePlugin", "Continuous");
    LegacyObject object(continuous, {{"sample_time", 0.01}});
    const auto configure = [](core::Block& b, HostInformation& i) { return b.configureSizeAndPorts(&i); };
    EXPECT_FALSE(object.call("configureSizeAndPorts", configure));
    const std::string text = object.message();
    EXPECT_NE(
        text.find(
            "plugin 'NativePlugin', block 'Continuous', configureSizeAndPorts: it has continuous states, "
            "which this interface cannot integrate"),
        std::string::npos)
        << text;

    auto clocked = std::make_shared<const LegacyClass>(file_of("NativePlugin"), "NativePlugin", "Clocked");
    LegacyObject wrong(clocked, {{"mode", "triple"}, {"negate", false}, {"sample_time", 0.01}});
    EXPECT_FALSE(wrong.call("configureSizeAndPorts", configure));
    EXPECT_NE(std::string(wrong.message()).find("'mode' is 'triple', but must be one of 'plain', 'double'"),
              std::string::npos)
        << wrong.message();

    auto quantize = std::make_shared<const LegacyClass>(
        BF_BINARY_DIRECTORY "/lib/blockfactory/legacy/standard.so", "standard", "Quantize");
    LegacyObject outside(quantize, {{"interval", 0.0}, {"sample_time", 0.01}});
    EXPECT_FALSE(outside.call("configureSizeAndPorts", configure));
    EXPECT_NE(std::string(outside.message()).find("parameter 'interval' must be greater than 0, but is 0"),
              std::string::npos)
        << outside.message();

    // A failing step carries the block's own words.
    LegacyObject negative(clocked, {{"mode", "plain"}, {"negate", false}, {"sample_time", 0.01}});
    double u = -1, y = 0;
    negative.information.run_on({{0, {1, 1}, core::Port::DataType::DOUBLE}},
                                {{0, {1, 1}, core::Port::DataType::DOUBLE}});
    negative.information.point(false, 0, &u);
    negative.information.point(true, 0, &y);
    ASSERT_TRUE(negative.call("initialize", [](core::Block& b, HostInformation& i) {
        return b.initialize(&i);
    })) << negative.message();
    EXPECT_FALSE(negative.call("output", [](core::Block& b, HostInformation& i) { return b.output(&i); }));
    EXPECT_NE(std::string(negative.message()).find("block 'Clocked', output: element (0, 0) is negative"),
              std::string::npos)
        << negative.message();
}

} // namespace
} // namespace bf::boundary

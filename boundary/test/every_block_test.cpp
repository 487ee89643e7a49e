// Every standard block natively, as an old engine runs it, and hosted again from there: equal bit for bit.
#include "../../tests/conformance/contract.hpp"
#include "bf/blocks/standard.hpp"
#include "bf/boundary/hosted_block.hpp"
#include "bf/boundary/positional.hpp"
#include "data_type.hpp"
#include "legacy_class.hpp"

#include <algorithm>
#include <fstream>
#include <gtest/gtest.h>
#include <random>
#include <unistd.h>

namespace bf::boundary {
namespace {

namespace core = blockfactory::core;
using conformance::detail::bytes_of;
using test::RunBlock;

const std::string plugin = BF_BINARY_DIRECTORY "/lib/blockfactory/legacy/standard.so";

/// Values as old engines give them: matrices column by column.
Arguments values_of(const BlockClass& type, const Arguments& given, double period) {
    Arguments values;
    for (const auto& wanted : positional_values(type)) {
        const auto found =
            std::find_if(given.begin(), given.end(), [&](const auto& a) { return a.first == wanted.name; });
        Value value = found == given.end() ? wanted.initial : found->second;
        if (wanted.goal == PositionalValue::Goal::period) value = Value(period);
        if (value.kind == Value::Kind::number) {
            value.rows = value.data.empty() ? 0 : 1;
            value.cols = static_cast<int>(value.data.size());
        }
        values.emplace_back(argument_name(wanted.metadata.name), value);
    }
    return values;
}

/// The native block and what it is compared with; `step` runs one step of the other and gives its outputs.
int compare(RunBlock& native, const std::vector<int>& inputs, const std::vector<int>& outputs, auto&& step) {
    std::mt19937 random(11);
    native.reset();
    native.context().start(0);
    int agreed = 0;
    for (int k = 0; k < 6; ++k) {
        conformance::detail::randomise(native, random);
        // Old engines know no optional inputs: these keep their declared values.
        for (std::size_t i = 0; i < native.resolution().slots.size(); ++i)
            if (const Slot& slot = native.resolution().slots[i]; slot.optional)
                write_values(native.context().data(0, static_cast<int>(i)), slot.type, slot.size.count(),
                             slot.initial);
        std::vector<std::vector<std::byte>> in, expected;
        for (const int slot : inputs) in.push_back(bytes_of(native, slot));
        const Status output = native.output();
        for (const int slot : outputs) expected.push_back(bytes_of(native, slot));
        const bool good = bool(output) && bool(native.update());
        const auto found = step(in, good);
        ++agreed;
        if (!good) break;
        native.commit();
        EXPECT_EQ(found, expected) << "step " << k;
    }
    native.context().stop(0);
    return agreed;
}

core::Port::Info port_of(std::size_t index, const Slot& slot) {
    core::Port::Dimensions dimension{slot.size.rows};
    if (slot.size.is_matrix) dimension.push_back(slot.size.cols);
    return {index, dimension, legacy(slot.type)};
}

class EveryStandardBlock : public testing::TestWithParam<std::string> {};

TEST_P(EveryStandardBlock, IsTheSameInOldEngines) {
    Registry registry;
    registry.load_plugin(plugin);
    const BlockClass& type = registry.find("standard/" + GetParam());
    Arguments arguments;
    if (type.name == "SignalFromFile") {
        const std::string file = testing::TempDir() + "legacy_signal_" + std::to_string(getpid()) + ".csv";
        std::ofstream(file) << "0,1,2\n0.02,3,4\n";
        arguments = {{"file", file}};
    }
    const RunBlock described(type, arguments);
    int count = 0;
    for (const auto& slot : described.resolution().slots) count += slot.role == Role::input;
    const std::vector<Size> sizes{{}, {3, 1, false}, {3, 3, true}, {4, 1, false}, {4, 4, true}};
    std::vector<std::vector<Size>> wirings;
    if (count <= 3)
        wirings = conformance::detail::combinations(sizes, count);
    else
        for (const auto& size : sizes) wirings.emplace_back(static_cast<std::size_t>(count), size);

    const auto old = std::make_shared<const LegacyClass>(plugin, "standard", type.name);
    const BlockClass hosted_class{"",
                                  type.name,
                                  "",
                                  "",
                                  [old](const Arguments& a) { return std::make_unique<HostedBlock>(old, a); },
                                  methods_of<HostedBlock>()};
    const Arguments values = values_of(type, arguments, 0.01);
    int accepted = 0;
    for (const auto& wiring : wirings) {
        RunBlock native(type, arguments);
        const auto symbols_of = static_cast<std::size_t>(native.declaration().types);
        const std::vector<Type> double_symbols(symbols_of, Type::float64),
            boolean_symbols(symbols_of, Type::boolean), integer_symbols(symbols_of, Type::uint8);
        bool is_wired = conformance::detail::wire(native, {wiring, double_symbols});
        for (const auto* symbols : {&boolean_symbols, &integer_symbols})
            if (!is_wired) {
                native = RunBlock(type, arguments);
                is_wired = conformance::detail::wire(native, {wiring, *symbols});
            }
        if (!is_wired) continue;
        SCOPED_TRACE(conformance::detail::text({wiring, {}}));
        const auto& slots = native.resolution().slots;
        std::vector<int> inputs, outputs;
        bool is_continuous = false;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            if (slots[i].role == Role::input && !slots[i].optional) inputs.push_back(static_cast<int>(i));
            if (slots[i].role == Role::output) outputs.push_back(static_cast<int>(i));
            is_continuous = is_continuous || slots[i].role == Role::continuous_state;
        }
        LegacyObject object(old, values);
        HostInformation::Ports in, out;
        std::vector<std::vector<std::byte>> in_memory, out_memory;
        for (const int i : inputs) in.push_back(port_of(in.size(), slots[static_cast<std::size_t>(i)]));
        for (const int i : outputs) out.push_back(port_of(out.size(), slots[static_cast<std::size_t>(i)]));
        for (const int i : inputs) in_memory.push_back(bytes_of(native, i));
        for (const int i : outputs) out_memory.push_back(bytes_of(native, i));
        object.information.run_on(in, out);
        for (std::size_t i = 0; i < in.size(); ++i) object.information.point(false, i, in_memory[i].data());
        for (std::size_t i = 0; i < out.size(); ++i) object.information.point(true, i, out_memory[i].data());
        const bool is_good =
            object.call("initialize", [](core::Block& b, HostInformation& i) { return b.initialize(&i); });
        if (is_continuous) {
            EXPECT_FALSE(is_good);
            EXPECT_NE(
                std::string(object.message()).find("it has continuous states, which this interface cannot"),
                std::string::npos)
                << object.message();
            return;
        }
        ASSERT_TRUE(is_good) << object.message();
        const auto conditions = [](core::Block& b, HostInformation& i) {
            return b.initializeInitialConditions(&i);
        };
        ASSERT_TRUE(object.call("initializeInitialConditions", conditions)) << object.message();
        EXPECT_GT(compare(native, inputs, outputs,
                          [&](const auto& given, bool good) {
                              for (std::size_t i = 0; i < given.size(); ++i)
                                  std::copy(given[i].begin(), given[i].end(), in_memory[i].begin());
                              EXPECT_EQ(
                                  object.call("output", [](core::Block& b,
                                                           HostInformation& i) { return b.output(&i); }),
                                  good)
                                  << object.message();
                              return out_memory;
                          }),
                  0);

        ++accepted;
        // Where a block leaves shape or type open, the old interface says: a vector of doubles.
        const auto is_vector = [&](int i) {
            const Slot& slot = slots[static_cast<std::size_t>(i)];
            return (slot.shape.symbol < 0 || !slot.size.is_matrix) &&
                   (slot.type_symbol < 0 || slot.type == Type::float64);
        };
        if (!std::all_of(inputs.begin(), inputs.end(), is_vector) ||
            !std::all_of(outputs.begin(), outputs.end(), is_vector))
            continue;
        RunBlock hosted(hosted_class, values);
        for (std::size_t i = 0; i < inputs.size(); ++i) {
            const Slot& slot = slots[static_cast<std::size_t>(inputs[i])];
            hosted.wire("u" + std::to_string(i + 1), slot.size, slot.type);
        }
        for (std::size_t i = 0; i < outputs.size(); ++i) {
            const Slot& slot = slots[static_cast<std::size_t>(outputs[i])];
            hosted.wire("y" + std::to_string(i + 1), slot.size, slot.type);
        }
        hosted.start();
        hosted.context().start(0);
        EXPECT_GT(
            compare(native, inputs, outputs,
                    [&](const auto& given, bool good) {
                        for (std::size_t i = 0; i < given.size(); ++i)
                            std::memcpy(hosted.context().data(0, hosted.index("u" + std::to_string(i + 1))),
                                        given[i].data(), given[i].size());
                        const Status status = hosted.step();
                        EXPECT_EQ(bool(status), good) << status.text();
                        std::vector<std::vector<std::byte>> found;
                        for (std::size_t i = 0; i < outputs.size(); ++i)
                            found.push_back(bytes_of(hosted, hosted.index("y" + std::to_string(i + 1))));
                        return found;
                    }),
            0);
        hosted.context().stop(0);
        if (accepted >= 2) return;
    }
    EXPECT_GT(accepted, 0);
}

std::vector<std::string> names() {
    std::vector<std::string> all;
    const Library library = standard_library();
    for (const auto& block_class : library.classes()) all.push_back(block_class.name);
    return all;
}
INSTANTIATE_TEST_SUITE_P(Boundary, EveryStandardBlock, testing::ValuesIn(names()),
                         [](const auto& instance) { return instance.param; });

} // namespace
} // namespace bf::boundary

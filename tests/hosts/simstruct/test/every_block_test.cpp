// Every block in Simulink's order of calls, compared bit for bit with a run of our own.
#include "../../../conformance/contract.hpp"
#include "bf/blocks/standard.hpp"
#include "bf/boundary/positional.hpp"
#include "simstruct/model.hpp"

#include <algorithm>
#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <unistd.h>

extern "C" const SimStructMethods simstruct_methods;

namespace bf::simulink {
namespace {

using conformance::Wiring;
using simstruct::Model;
using test::RunBlock;

mxArray* array_of(const Value& value) {
    if (value.kind == Value::Kind::text) return simstruct::text(value.text);
    if (value.kind == Value::Kind::texts) return simstruct::texts(value.texts);
    if (value.type == Type::boolean && value.data.size() == 1) return simstruct::logical(value.data[0] != 0);
    return simstruct::matrix(value.rows, value.cols, value.data);
}

/// 'Class', 'Library', then each value as given or as declared.
std::vector<mxArray*> parameters(const BlockClass& type, const Arguments& given, double period) {
    std::vector<mxArray*> all{simstruct::text(type.name),
                              simstruct::text(type.library.empty() ? "standard" : type.library)};
    for (const auto& value : boundary::positional_values(type)) {
        const auto found =
            std::find_if(given.begin(), given.end(), [&](const auto& a) { return a.first == value.name; });
        if (value.goal == boundary::PositionalValue::Goal::period)
            all.push_back(simstruct::number(period));
        else
            all.push_back(array_of(found == given.end() ? value.initial : found->second));
    }
    return all;
}

DTypeId id_of(Type type) { return static_cast<DTypeId>(type); }
static_assert(static_cast<int>(Type::float64) == SS_DOUBLE && static_cast<int>(Type::boolean) == SS_BOOLEAN &&
              static_cast<int>(Type::uint16) == SS_UINT16);

/// Runs the wired block here and there with the same random inputs. Returns how many steps agreed.
int compare(const BlockClass& type, const Arguments& arguments, RunBlock& run) {
    constexpr int steps = 6;
    const Resolution& r = run.resolution();
    const bool is_continuous = std::any_of(r.slots.begin(), r.slots.end(),
                                           [](const Slot& s) { return s.role == Role::continuous_state; });
    Model model(simstruct_methods, run.period);
    const int block = model.add("model/block", parameters(type, arguments, -1));
    std::vector<int> sources, in, out;
    for (std::size_t i = 0; i < r.slots.size(); ++i) {
        const Slot& slot = r.slots[i];
        if (slot.role == Role::output) out.push_back(static_cast<int>(i));
        if (slot.role != Role::input) continue;
        in.push_back(static_cast<int>(i));
        sources.push_back(
            model.add_input(slot.size.rows, slot.size.is_matrix ? slot.size.cols : 0, id_of(slot.type)));
        model.connect(sources.back(), 0, block, static_cast<int>(in.size()) - 1);
    }
    model.compile();
    for (std::size_t i = 0; i < out.size(); ++i) {
        const Slot& slot = r.slots[static_cast<std::size_t>(out[i])];
        EXPECT_EQ(model.output_type(block, static_cast<int>(i)), id_of(slot.type));
        EXPECT_EQ(model.output_dimensions(block, static_cast<int>(i)),
                  slot.size.is_matrix ? (std::vector<int>{slot.size.rows, slot.size.cols})
                                      : std::vector<int>{slot.size.rows});
    }
    model.start();
    if (is_continuous) run.period = 0;
    run.reset();
    run.context().start(0);
    std::mt19937 random(3);
    int agreed = 0;
    for (int k = 0; k < steps; ++k) {
        conformance::detail::randomise(run, random);
        for (std::size_t i = 0; i < in.size(); ++i) {
            const auto bytes = conformance::detail::bytes_of(run, in[i]);
            std::memcpy(model.input(sources[i]), bytes.data(), bytes.size());
        }
        run.context().clock(0).time = k * model.step_size();
        const Status output = run.output();
        std::vector<std::vector<std::byte>> expected;
        for (const int slot : out) expected.push_back(conformance::detail::bytes_of(run, slot));
        const Status update = output ? run.update() : output;
        try {
            model.step();
        } catch (const simstruct::Error& error) {
            EXPECT_FALSE(bool(output) && bool(update)) << error.what();
            EXPECT_NE(std::string(error.what()).find(output ? update.text() : output.text()),
                      std::string::npos)
                << error.what();
            ++agreed;
            break;
        }
        EXPECT_TRUE(bool(output) && bool(update)) << "only our own run failed: " << update.text();
        for (std::size_t i = 0; i < out.size(); ++i)
            EXPECT_EQ(0, std::memcmp(model.output(block, static_cast<int>(i)), expected[i].data(),
                                     expected[i].size()))
                << "output " << r.slots[static_cast<std::size_t>(out[i])].name << ", step " << k;
        run.commit();
        if (is_continuous) {
            // x + h dx, as the host does, in the same order
            for (int i = 0; i < run.context().activities(0, Phase::derivative); ++i)
                EXPECT_TRUE(run.context().task(0, Phase::derivative, i)());
            for (std::size_t i = 0; i < r.slots.size(); ++i)
                if (r.slots[i].role == Role::continuous_state)
                    for (int e = 0; e < r.slots[i].size.count(); ++e)
                        static_cast<double*>(run.context().data(0, static_cast<int>(i)))[e] +=
                            model.step_size() * static_cast<const double*>(run.context().frame(0).rate[i])[e];
        }
        for (std::size_t i = 0; i < r.slots.size(); ++i)
            if (r.slots[i].role == Role::discrete_state && r.slots[i].size.count() > 0) {
                const auto wanted = conformance::detail::bytes_of(run, static_cast<int>(i));
                EXPECT_EQ(0, std::memcmp(model.state(block, r.slots[i].name), wanted.data(), wanted.size()))
                    << "state " << r.slots[i].name << ", step " << k;
            }
        ++agreed;
    }
    run.context().stop(0);
    return agreed;
}

class EveryStandardBlock : public testing::TestWithParam<std::string> {};

TEST_P(EveryStandardBlock, RunsInSimulinkAsHere) {
    const Library library = standard_library();
    const auto type = std::find_if(library.classes().begin(), library.classes().end(),
                                   [](const auto& c) { return c.name == GetParam(); });
    ASSERT_NE(type, library.classes().end());
    Arguments arguments;
    if (type->name == "SignalFromFile") {
        const std::string file = testing::TempDir() + "sfunction_signal_" + std::to_string(getpid()) + ".csv";
        std::ofstream(file) << "0,1,2\n0.02,3,4\n";
        arguments = {{"file", file}};
    }
    const RunBlock described(*type, arguments);
    int inputs = 0;
    for (const auto& slot : described.resolution().slots) inputs += slot.role == Role::input;
    const std::vector<Size> sizes{{}, {3, 1, false}, {3, 3, true}, {4, 1, false}, {4, 4, true}};
    std::vector<std::vector<Size>> wirings;
    if (inputs <= 3)
        wirings = conformance::detail::combinations(sizes, inputs);
    else
        for (const auto& size : sizes) wirings.emplace_back(static_cast<std::size_t>(inputs), size);
    std::vector<Type> types;
    for (int i = 0; i < type_count; ++i) types.push_back(static_cast<Type>(i));
    const auto all_types = conformance::detail::combinations(types, described.declaration().types);
    int accepted = 0;
    for (const auto& wiring : wirings)
        for (const auto& choice : all_types) {
            RunBlock run(*type, arguments);
            if (inputs == 0) { // where nothing decides, Simulink makes a scalar
                give_defaults(run.instance().block().resolution());
                settle_sizes(run.instance().block());
            }
            if (!conformance::detail::wire(run, {wiring, choice})) continue;
            SCOPED_TRACE(conformance::detail::text({wiring, choice}));
            EXPECT_GT(compare(*type, arguments, run), 0);
            if (++accepted >= 4) return;
            break;
        }
    EXPECT_GT(accepted, 0);
}

std::vector<std::string> names() {
    std::vector<std::string> all;
    const Library library = standard_library();
    for (const auto& block_class : library.classes()) all.push_back(block_class.name);
    return all;
}
INSTANTIATE_TEST_SUITE_P(SFunction, EveryStandardBlock, testing::ValuesIn(names()),
                         [](const auto& instance) { return instance.param; });

} // namespace
} // namespace bf::simulink

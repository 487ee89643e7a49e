// Snapshots as files.
#include "bf/core/hash.hpp"
#include "bf/run/snapshot.hpp"
#include "support.hpp"

#include <cstring>
#include <gtest/gtest.h>
#include <span>

namespace bf::test {
namespace {

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
}

Values everything(Session& run, int steps) {
    Values all;
    for (int k = 0; k < steps; ++k)
        for (const char* signal : {"slow", "fast", "plant", "s.i", "gain"}) {
            if (std::string(signal) == "slow" && !run.simulation->step())
                throw std::runtime_error(run.simulation->failure());
            for (const double x : run.values(signal)) all.push_back(x);
        }
    return all;
}

std::string refusal(const std::string& text, const std::vector<std::byte>& snapshot) {
    Session run(text);
    try {
        restore_snapshot(*run.simulation, snapshot, "s.bin");
    } catch (const RunError& error) {
        return error.what();
    }
    return "accepted";
}

TEST(SnapshotFile, GoesOnBitForBitInAnotherSimulation) {
    for (const int instant : {0, 1, 7, 23}) {
        Session one(multirate), other(multirate);
        one.simulation->run_until(0.1 * instant);
        const auto file = make_snapshot(*one.simulation);
        everything(other, 5);
        restore_snapshot(*other.simulation, file, "s.bin");
        EXPECT_EQ(other.simulation->steps(), instant);
        EXPECT_EQ(everything(one, 40), everything(other, 40)) << instant;
    }
}

TEST(SnapshotFile, GoesOnBitForBitInsideALongStepOfAnAdaptiveSolver) {
    for (const std::string solver : {"dormand_prince45", "cvode_bdf", "cvode_adams"}) {
        const std::string model = "model: m\nstep: 0.01\nstop: 8\nsolver: " + solver +
                                  "\nblocks:\n"
                                  "  slow: {block: TransferFunction, denominator: [1, 0.3, 1]}\n"
                                  "  one: {block: Constant, value: 1}\nconnections: {one: slow}\n";
        const auto trace = [](Session& run) {
            Values all;
            for (int k = 0; k < 100 && run.simulation->step(); ++k) all.push_back(run.values("slow").front());
            return all;
        };
        for (const double instant : {0.31, 1.0, 2.57, 4.0}) {
            Session one(model), other(model);
            one.simulation->run_until(instant);
            restore_snapshot(*other.simulation, make_snapshot(*one.simulation), "s.bin");
            EXPECT_EQ(trace(one), trace(other)) << solver << instant;
        }
    }
}

TEST(SnapshotFile, KeepsParametersThatTheRunHadChanged) {
    Session one(multirate), other(multirate);
    one.simulation->set_parameter("gain.K", {5});
    one.simulation->run_until(1);
    restore_snapshot(*other.simulation, make_snapshot(*one.simulation), "s.bin");
    EXPECT_EQ(everything(one, 10), everything(other, 10));
}

TEST(SnapshotFile, KeepsVariablesThatTheRunHadChanged) {
    const std::string model =
        "model: m\nstep: 0.1\nvariables: {a: 1, b: 2*a}\nblocks:\n"
        "  c: {block: Constant, value: b}\n  d: {block: Constant, value: 3*a}\n"
        "  e: {block: Terminator}\n  f: {block: Terminator}\nconnections: {c: e, d: f}\n";
    const auto change = [](Session& session, const std::string& name, double value) {
        const std::vector<ParameterValue> asked{{name, {value}}};
        for (const auto& [path, values] : session.simulation->follow(asked))
            session.simulation->set_parameter(path, values);
        session.simulation->accept(asked);
    };
    const auto variables = [](Session& session) {
        std::vector<double> all;
        for (const auto& variable : session.simulation->variables()) all.push_back(variable.values[0]);
        return all;
    };
    Session one(model), other(model), later(replaced(model, "a: 1", "a: 7"));
    const auto untouched = make_snapshot(*one.simulation);
    change(one, "d.value", 100);
    change(one, "a", 5);
    const auto changed = make_snapshot(*one.simulation);
    change(one, "a", 6);
    for (Session* session : {&one, &other}) {
        restore_snapshot(*session->simulation, changed, "s.bin");
        EXPECT_EQ(variables(*session), (std::vector<double>{5, 10}));
        EXPECT_EQ(session->simulation->follow({{"a", {6}}}).size(), 1u) << "d.value was given";
        restore_snapshot(*session->simulation, untouched, "s.bin");
        EXPECT_EQ(variables(*session), (std::vector<double>{1, 2}));
        EXPECT_EQ(session->simulation->follow({{"a", {6}}}).size(), 2u);
    }
    restore_snapshot(*later.simulation, untouched, "s.bin");
    EXPECT_EQ(variables(later), (std::vector<double>{7, 14})) << "as the model says by now";
}

TEST(SnapshotFile, TakesParametersThatTheModelHasChanged) {
    Session one(multirate), other(replaced(multirate, "K: 2", "K: 4"));
    one.simulation->run_until(1);
    restore_snapshot(*other.simulation, make_snapshot(*one.simulation), "s.bin");
    one.simulation->set_parameter("gain.K", {4});
    EXPECT_EQ(everything(one, 10), everything(other, 10));
}

TEST(SnapshotFile, OfAnotherModelIsRefusedByName) {
    Session one(multirate);
    const auto file = make_snapshot(*one.simulation);
    EXPECT_EQ(refusal("model: other\nstep: 1\nblocks:\n  c: {block: Clock}\n", file),
              "the snapshot 's.bin' belongs to the model 'm', not to 'other'");
    EXPECT_EQ(refusal("model: a\nstep: 1\nblocks:\n  c: {block: Clock}\n", file),
              "the snapshot 's.bin' belongs to the model 'm', not to 'a'");
    for (const auto& [from, to] : {std::pair{"period: 0.3", "period: 0.2"},
                                   {"[3 5]", "[3 5 6]"},
                                   {"fast:", "quick:"},
                                   {"gain: [slow", "sine: [slow"}}) {
        std::string text = replaced(multirate, from, to);
        if (std::string(from) == "fast:") text = replaced(text, "fast, ", "quick, ");
        if (std::string(to) == "sine: [slow")
            text = replaced(replaced(text, "sine: [gain", "on: [gain"), ", on: [s", ", gain: [s");
        EXPECT_NE(refusal(text, file).find("belongs to another version of 'm'"), std::string::npos)
            << to << ": " << refusal(text, file);
    }
    EXPECT_EQ(refusal(multirate, file), "accepted");
}

TEST(SnapshotFile, OfOtherArgumentsIsRefusedByBlockAndArgument) {
    const auto model = [](const std::string& arguments) {
        return "model: m\nstep: 0.1\nblocks:\n  c: {block: Clock}\n  s:\n    inputs: [u]\n    outputs: [y]\n"
               "    blocks:\n      f: {block: DiscreteIntegrator" +
               arguments + "}\n    connections: {u: f, f: y}\nconnections: {c: s}\n";
    };
    Session one(model(", method: trapezoidal, gain: 2"));
    const auto file = make_snapshot(*one.simulation);
    const std::string begin = "the snapshot 's.bin' belongs to another version of 'm': argument 'method' of "
                              "'s.f' was 'trapezoidal' and is ",
                      end = "; only values of parameters may differ";
    EXPECT_EQ(refusal(model(", method: backward, gain: 2"), file), begin + "'backward'" + end);
    EXPECT_EQ(refusal(model(", method: trapezoidal, gain: 3"), file), "accepted");
    // What a block does by itself in one model, it is told in the other.
    EXPECT_EQ(
        refusal(model(", method: trapezoidal, initial_source: internal"), file),
        "the snapshot 's.bin' belongs to another version of 'm': argument 'initial_source' of 's.f' was "
        "not given and is 'internal'" +
            end);
}

TEST(SnapshotFile, CutOrDamagedAnywhereIsRefused) {
    Session one(multirate);
    const auto file = make_snapshot(*one.simulation);
    for (std::size_t size = 0; size < file.size(); ++size) {
        const std::vector<std::byte> cut(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size));
        ASSERT_THROW(restore_snapshot(*one.simulation, cut, "s.bin"), RunError) << size;
    }
    for (std::size_t at = 0; at < file.size(); ++at) {
        auto damaged = file;
        damaged[at] ^= std::byte{0x10};
        ASSERT_THROW(restore_snapshot(*one.simulation, damaged, "s.bin"), RunError) << at;
    }
    auto longer = file;
    longer.push_back(std::byte{0});
    EXPECT_THROW(restore_snapshot(*one.simulation, longer, "s.bin"), RunError);
    EXPECT_EQ(refusal(multirate, {}), "the snapshot 's.bin' is no snapshot: it does not begin as one; bf run "
                                      "--snapshot writes them");
}

TEST(SnapshotFile, BeforeTheFirstStepIsRefusedThoughItsChecksumIsRight) {
    Session one(multirate);
    const std::int64_t steps = 4321, before = -4321;
    while (one.simulation->steps() < steps) ASSERT_TRUE(one.simulation->step());
    auto file = make_snapshot(*one.simulation);
    int found = 0;
    for (std::size_t at = 0; at + sizeof steps <= file.size(); ++at) {
        if (std::memcmp(&file[at], &steps, sizeof steps) != 0) continue;
        std::memcpy(&file[at], &before, sizeof before);
        ++found;
    }
    ASSERT_GE(found, 1);
    constexpr std::size_t checksum_at = 20, content_at = 36;
    const auto checksum = fnv1a(std::span(file).subspan(content_at));
    std::memcpy(&file[checksum_at], &checksum, sizeof checksum);
    const std::string text = refusal(multirate, file);
    EXPECT_NE(text.find("the snapshot 's.bin' is damaged: "), std::string::npos) << text;
}

TEST(SnapshotFile, NamesVersionAndByteOrderThatItCannotRead) {
    Session one(multirate);
    auto file = make_snapshot(*one.simulation);
    std::swap(file[12], file[15]);
    EXPECT_NE(refusal(multirate, file).find("another byte order"), std::string::npos);
    std::swap(file[12], file[15]);
    file[16] = std::byte{9};
    EXPECT_NE(refusal(multirate, file).find("has version 9"), std::string::npos);
}

} // namespace
} // namespace bf::test

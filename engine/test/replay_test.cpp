// The same run twice, and from a snapshot, is the same bit for bit; models of chance never crash.
#include "support.hpp"

#include "bf/model/builder.hpp"

#include <cstring>
#include <gtest/gtest.h>
#include <random>

namespace bf::test {
namespace {

/// All signals and states of the next steps, bit for bit.
std::vector<std::byte> follow(Simulation& simulation, int steps) {
    std::vector<std::byte> bytes;
    for (int k = 0; k < steps; ++k) {
        const bool is_ok = static_cast<bool>(simulation.step());
        for (std::size_t n = 0; n < simulation.diagram().nodes.size(); ++n) {
            const auto& slots = simulation.diagram().nodes[n].block->resolution().slots;
            for (std::size_t i = 0; i < slots.size(); ++i) {
                if (slots[i].role != Role::output && slots[i].role != Role::discrete_state) continue;
                const auto* data = static_cast<const std::byte*>(
                    simulation.context().data(static_cast<int>(n), static_cast<int>(i)));
                bytes.insert(bytes.end(), data, data + slots[i].size.count() * bf::bytes(slots[i].type));
            }
        }
        if (!is_ok) break;
    }
    return bytes;
}

const std::string mixed = R"m(
model: m
step: 0.1
blocks:
  on: {block: Pulse, delay: 0.2}
  sine: {block: Sine, frequency: "[3 5]"}
  slow: {block: DiscreteIntegrator, period: 0.3, offset: 0.1}
  s:
    execution: enabled
    states: reset
    inputs: [u]
    outputs: {y: {when_disabled: reset, initial: 3}}
    blocks:
      i: {block: DiscreteIntegrator}
      count: {block: Counter, period: 0.2}
      one: {block: Constant, value: true}
    connections: {u: i, i: y, one: count.u}
  after: {block: Delay, steps: 4}
connections: {on: s.enable, sine: [slow, s.u], s: after}
)m";

TEST(Snapshot, GoesOnBitForBitFromAnyInstant) {
    for (int instant = 0; instant < 40; ++instant) {
        Session one(mixed), other(mixed);
        follow(*one.simulation, instant);
        const auto snapshot = one.simulation->snapshot();
        const auto expected = follow(*one.simulation, 50);
        other.simulation->restore(snapshot);
        EXPECT_EQ(other.simulation->steps(), instant);
        ASSERT_EQ(follow(*other.simulation, 50), expected) << instant;
        one.simulation->restore(snapshot);
        ASSERT_EQ(follow(*one.simulation, 50), expected) << instant;
    }
}

/// A plant between a relay's thresholds, with jumps at sample hits too.
const auto switched = [](const std::string& solver) {
    return "model: m\nstep: 0.1\nsolver: " + solver +
           "\nblocks:\n  pulse: {block: Pulse, cycle: 0.4, period: 0.2}\n"
           "  relay: {block: Relay, on_point: 0.3, off_point: -0.2, on_value: -2, off_value: 1.5}\n"
           "  sum: {block: Sum}\n  x: {block: Integrator, initial: 0.1}\n  lag: {block: TransferFunction}\n"
           "connections: {pulse: sum.u1, relay: sum.u2, sum: x, x: [relay, lag]}\n";
};

TEST(Snapshot, OfASolverThatChoosesItsStepsGoesOnBitForBitFromAnyInstant) {
    for (int instant = 0; instant < 12; ++instant) {
        Session one(switched("dormand_prince45"));
        const auto before = follow(*one.simulation, instant);
        const auto snapshot = one.simulation->snapshot();
        const auto expected = follow(*one.simulation, 12);
        one.simulation->restore(snapshot);
        ASSERT_EQ(follow(*one.simulation, 12), expected) << instant;
        Session undisturbed(switched("dormand_prince45"));
        ASSERT_EQ(follow(*undisturbed.simulation, instant), before) << instant;
        ASSERT_EQ(follow(*undisturbed.simulation, 12), expected) << "a snapshot changes nothing, " << instant;
    }
}

TEST(Snapshot, RestoresTheRestOfDisabledStates) {
    // Only from 0.5 s on x' = 1.
    Session run("model: m\nstep: 0.1\nblocks:\n  on: {block: Step, time: 0.5, period: 0.1}\n  s:\n"
                "    execution: enabled\n    outputs: [y]\n    blocks:\n      u: {block: Constant}\n"
                "      x: {block: Integrator}\n    connections: {u: x, x: y}\nconnections: {on: s.enable}\n");
    run.trace("s.y", 2);
    const auto snapshot = run.simulation->snapshot();
    const Values expected = run.trace("s.y", 7);
    EXPECT_GT(expected.back(), 0);
    run.simulation->restore(snapshot);
    EXPECT_EQ(run.trace("s.y", 7), expected);
}

TEST(Start, ASecondOneRunsAsTheFirst) {
    for (const auto* solver : {"rk4", "dormand_prince45", "cvode_bdf", "cvode_adams"}) {
        Session run(switched(solver));
        const auto first = follow(*run.simulation, 25);
        run.simulation->start();
        EXPECT_EQ(follow(*run.simulation, 25), first) << solver;
    }
}

TEST(Snapshot, OfAnotherModelIsRefused) {
    Session one(mixed), other("model: m\nstep: 1\nblocks:\n  c: {block: Clock}\n");
    try {
        other.simulation->restore(one.simulation->snapshot());
        FAIL();
    } catch (const RunError& error) {
        EXPECT_NE(std::string(error.what()).find("it belongs to another model"), std::string::npos);
    }
}

/// A device whose state cannot be saved.
class Lamp final : public Block {
  public:
    struct Wire {};
    using Block::Block;
    OutsideState<Wire> wire{this, [] { return std::make_shared<Wire>(); }};
};

TEST(Snapshot, IsRefusedByNameWhereStateLivesOutside) {
    Library library("");
    library.group("test").add<Lamp>("Lamp", "");
    Session run("model: m\nstep: 1\nblocks:\n  s: {blocks: {lamp: {block: Lamp}}}\n", &library);
    try {
        run.simulation->snapshot();
        FAIL();
    } catch (const RunError& error) {
        EXPECT_STREQ(error.what(), "s.lamp: its state lives outside and cannot be saved");
    }
}

model::Model chance(std::uint32_t seed) {
    std::mt19937 random(seed);
    const auto one_of = [&](std::initializer_list<const char*> list) {
        return *(list.begin() + random() % list.size());
    };
    model::Builder b{"chance"};
    b.step(0.01);
    const std::uint32_t blocks = 2 + random() % 6;
    const auto name = [](std::uint32_t i) { return "b" + std::to_string(i); };
    std::vector<std::string> types;
    for (std::uint32_t i = 0; i < blocks; ++i) {
        const std::string& type =
            types.emplace_back(one_of({"Constant", "Gain", "Sum", "UnitDelay", "Clock", "Sine", "Saturate",
                                       "Mux", "DiscreteIntegrator", "Product", "Counter", "Delay"}));
        if (type == "Constant")
            b.add(name(i), type, {{"value", one_of({"1", "[1 2 3]", "true", "int8(4)", "eye(2)", "[]"})}});
        else if (type == "Gain")
            b.add(name(i), type, {{"K", one_of({"2", "[1 2 3]", "0.5", "nothing"})}});
        else if (type == "UnitDelay")
            b.add(name(i), type, {{"initial", one_of({"0", "[1 2 3]", "true"})}});
        else
            b.add(name(i), type);
    }
    // Nearly every input is wired, mostly to a block before; now and then to a port that is not there.
    for (std::uint32_t i = 0; i < types.size(); ++i) {
        std::vector<std::string> ports{"u"};
        if (types[i] == "Sum" || types[i] == "Product" || types[i] == "Mux") ports = {"u1", "u2"};
        if (types[i] == "Constant" || types[i] == "Clock" || types[i] == "Sine") ports.clear();
        if (random() % 50 == 0) ports.push_back("u7");
        for (const auto& port : ports)
            if (random() % 40 != 0)
                b.connect({name(random() % (i > 0 && random() % 8 ? i : types.size()))},
                          model::End{name(i), port});
    }
    return b.build();
}

TEST(Chance, ModelsAreRefusedWithReasonsOrRunAlikeTwice) {
    int accepted = 0, refused = 0;
    for (std::uint32_t seed = 0; seed < 400; ++seed) {
        try {
            Session one(chance(seed)), other(chance(seed));
            one.simulation->start();
            other.simulation->start();
            ASSERT_EQ(follow(*one.simulation, 5), follow(*other.simulation, 5)) << seed;
            const auto snapshot = one.simulation->snapshot();
            const auto expected = follow(*one.simulation, 5);
            one.simulation->restore(snapshot);
            if (one.simulation->steps() == 5) {
                ASSERT_EQ(follow(*one.simulation, 5), expected) << seed;
            }
            ++accepted;
        } catch (const model::Errors& errors) {
            ASSERT_FALSE(errors.diagnostics().empty());
            for (const auto& d : errors.diagnostics()) ASSERT_FALSE(d.message.empty());
            ++refused;
        }
    }
    EXPECT_GT(refused, 50);
    EXPECT_GT(accepted, 50);
    RecordProperty("accepted", accepted);
}

/// Blocks of which some are wired rightly on purpose.
TEST(Chance, RightModelsRunAlikeTwice) {
    for (std::uint32_t seed = 0; seed < 200; ++seed) {
        std::mt19937 random(seed);
        const auto build = [](std::mt19937 r) {
            model::Builder b{"right"};
            b.step(0.01);
            b.add("b0", "Sine", {{"frequency", "[1 2 3]"}});
            for (int i = 1; i < 15; ++i) {
                const std::string name = "b" + std::to_string(i);
                const auto before = [&] {
                    return model::End{"b" + std::to_string(r() % static_cast<unsigned>(i))};
                };
                switch (r() % 4) {
                case 0:
                    b.add(name, "Gain", {{"K", 0.9}});
                    b.connect(before(), model::End{name});
                    break;
                case 1:
                    b.add(name, "UnitDelay");
                    b.connect(before(), model::End{name});
                    break;
                case 2:
                    b.add(name, "DiscreteIntegrator");
                    b.connect(before(), model::End{name, "u"});
                    break;
                default:
                    b.add(name, "Sum");
                    b.connect(before(), model::End{name, "u1"});
                    b.connect(before(), model::End{name, "u2"});
                }
            }
            return b.build();
        };
        Session one(build(random)), other(build(random));
        one.simulation->start();
        other.simulation->start();
        const int instant = static_cast<int>(random() % 20);
        ASSERT_EQ(follow(*one.simulation, instant), follow(*other.simulation, instant)) << seed;
        other.simulation->restore(one.simulation->snapshot());
        ASSERT_EQ(follow(*one.simulation, 20), follow(*other.simulation, 20)) << seed;
    }
}

} // namespace
} // namespace bf::test

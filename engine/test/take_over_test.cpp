// A run that takes the place of another one, beside which it was made.
#include "bf/engine/handover.hpp"
#include "support.hpp"

#include <atomic>
#include <gtest/gtest.h>
#include <memory>
#include <thread>

namespace bf::test {
namespace {

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
}

/// What happened to lines, in order.
std::vector<std::string>& happened() {
    static std::vector<std::string> list;
    return list;
}

/// A connection: it is neither saved nor opened twice.
struct OpenWire {
    explicit OpenWire(std::string n) : name(std::move(n)) { happened().push_back("open " + name); }
    ~OpenWire() { happened().push_back("close " + name); }
    OpenWire(const OpenWire&) = delete;
    OpenWire& operator=(const OpenWire&) = delete;
    std::string name;
    double sent = 0;
};
struct OpenLine {
    static constexpr const char* resource = "Line";
    using Live = OpenWire;
    std::string name;
    std::shared_ptr<OpenWire> open() const { return std::make_shared<OpenWire>(name); }
};

class LinePort final : public Block {
  public:
    using Block::Block;
    Argument<std::string> name{this, "name", {.initial = "a"}};
    Provides<OpenLine> line{this, [this] { return std::make_shared<OpenLine>(OpenLine{*name}); }};
    Output<double> y{this, "y", {}};
    void start(Now at) const override { happened().push_back("start " + at[line].name); }
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[line].sent;
        return ok;
    }
    void stop(Now at) const noexcept override { happened().push_back("stop " + at[line].name); }
};

/// Counts on the line.
class Sender final : public Block {
  public:
    using Block::Block;
    Requires<OpenLine> line{this, "the line"};
    Parameter<double> step{this, "step", {.initial = {1}}};
    Output<double> y{this, "y", {}};
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[line].sent;
        return ok;
    }
    Status update(Now at, Next) const noexcept override {
        at[line].sent += at[step];
        return ok;
    }
};

/// Begins with what the line has sent.
class Begun final : public Block {
  public:
    using Block::Block;
    Requires<OpenLine> line{this, "the line"};
    DiscreteState<double> x{this, "x", {}};
    Output<double> y{this, "y", {}};
    Status reset(Now at, After after) const noexcept override {
        after[x] = 100 + at[line].sent;
        return ok;
    }
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[x];
        return ok;
    }
};

/// Counts in an object that can be saved.
struct Count {
    double value = 0;
    std::size_t state_size() const { return 1; }
    void save(double* to) const { *to = value; }
    void restore(const double* from) { value = *from; }
};
class Counter final : public Block {
  public:
    using Block::Block;
    Argument<double> by{this, "by", {.initial = 1}};
    OutsideState<Count> count{this, [] { return std::make_shared<Count>(); }};
    Output<double> y{this, "y", {}};
    Status output(Now at, Out out) const noexcept override {
        out[y] = at[count].value;
        return ok;
    }
    Status update(Now at, Next) const noexcept override {
        at[count].value += *by;
        return ok;
    }
};

const Library& lines() {
    static const Library library = [] {
        Library l("");
        auto& group = l.group("test");
        group.add<LinePort>("Port", "");
        group.add<Sender>("Sender", "");
        group.add<Begun>("Begun", "");
        group.add<Counter>("Counting", "");
        return l;
    }();
    return library;
}

/// A run of a model that takes another one's place.
struct Next {
    Next(const std::string& text, Simulation& before, const Origin& origin = {}) {
        registry.add(standard_library());
        registry.add(lines());
        diagram = elaborate(formats::read_yaml_text(text, "m.yaml"), registry);
        simulation.emplace(diagram, before, origin);
        simulation->start();
    }
    Simulation& run() { return *simulation; }
    double operator()(const std::string& path) const { return find(simulation->signals(), path)[0]; }
    Values trace(const std::string& path, int steps) {
        Values all;
        for (const Quantity signal = find(simulation->signals(), path); steps > 0; --steps) {
            if (!simulation->step()) throw std::runtime_error(simulation->failure());
            for (const double x : signal.values()) all.push_back(x);
        }
        return all;
    }
    Registry registry;
    Diagram diagram;
    std::optional<Simulation> simulation;
};

const std::string simple = R"m(
model: m
step: 0.1
blocks:
  port: {block: Port}
  send: {block: Sender}
  begun: {block: Begun}
  count: {block: Counting}
)m";

TEST(TakeOver, EqualsGoingOnBitForBit) {
    const std::string more = replaced(multirate, "K: 2", "K: 3");
    for (const int instant : {0, 1, 2, 3, 5, 8, 13})
        for (const char* signal : {"slow.y", "fast.y", "plant.y", "s.i.y", "t.j.y", "gain.y"}) {
            Session run(multirate);
            run.simulation->run_until(0.1 * instant);
            Next next(more, *run.simulation);
            Session other(more);
            other.simulation->go_on_from(*run.simulation);
            next.run().take_over();
            EXPECT_EQ(next.run().steps(), instant);
            Values expected;
            for (int k = 0; k < 20; ++k) {
                ASSERT_TRUE(other.simulation->step());
                for (const double x : other.values(signal)) expected.push_back(x);
            }
            EXPECT_EQ(next.trace(signal, 20), expected) << signal << instant;
        }
}

TEST(TakeOver, TellsAllNamesThatAreGoneAsTheStateIsNotKnownBefore) {
    const std::string chart =
                          "model: m\nstep: 0.1\nblocks:\n  c: {block: StateMachine, states: [a, b, c, d], "
                          "transitions: \"[1 2 0 0.2; 2 3 0 0.2; 3 4 0 0.2]\"}\n",
                      fewer = replaced(replaced(chart, "[a, b, c, d]", "[b, c]"),
                                       "[1 2 0 0.2; 2 3 0 0.2; 3 4 0 0.2]", "[1 2 0 0.2]");
    for (const auto& [steps, expected] :
         {std::pair(3, 1.0), {5, 2.0}, {7, 1.0}}) { // b, c, and d, which is gone
        Session run(chart);
        Next next(fewer, *run.simulation);
        EXPECT_EQ(handover(*run.simulation, next.run()).lost,
                  std::vector<std::string>{
                      "'c.x' may be 'a' or 'd', which is no longer there: 'c' then begins anew"});
        run.trace("c.state", steps);
        next.run().take_over();
        EXPECT_EQ(next.trace("c.state", 1), Values{expected}) << steps;
    }
}

TEST(TakeOver, MayBePreparedBesideARunThatSteps) {
    Session run(multirate), alone(multirate);
    std::atomic<bool> is_ready{false};
    std::unique_ptr<Next> next;
    std::thread other([&] {
        next = std::make_unique<Next>(multirate, *run.simulation);
        is_ready = true;
    });
    int steps = 0;
    for (; !is_ready; ++steps) ASSERT_TRUE(run.simulation->step());
    other.join();
    next->run().take_over();
    alone.simulation->run_until(0.1 * steps);
    Values expected;
    for (int k = 0; k < 50; ++k) {
        ASSERT_TRUE(alone.simulation->step());
        for (const double x : alone.values("t.j.y")) expected.push_back(x);
    }
    EXPECT_EQ(next->trace("t.j.y", 50), expected);
}

TEST(TakeOver, WhatIsOpenGoesOnAndIsClosedOnce) {
    happened().clear();
    {
        auto first = std::make_unique<Session>(formats::read_yaml_text(simple, "m.yaml"), &lines());
        first->simulation->start();
        first->simulation->run_until(0.3);
        EXPECT_EQ(happened(), (std::vector<std::string>{"open a", "start a"}));
        Next next(replaced(simple, "blocks:\n", "blocks:\n  new: {block: Sender, step: 10}\n") +
                      "  later: {block: Gain, K: 2}\nconnections: {send: later}\n",
                  *first->simulation);
        EXPECT_EQ(handover(*first->simulation, next.run()).lost, std::vector<std::string>());
        first->simulation->run_until(0.5);
        next.run().take_over();
        first->simulation.reset(); // not its diagram
        EXPECT_EQ(happened(), (std::vector<std::string>{"open a", "start a"}));
        EXPECT_EQ(next.trace("later", 3), (Values{10, 32, 54})) << "both send on the same line";
        EXPECT_EQ(next("count"), 7);
        EXPECT_EQ(next("begun"), 100) << "it begins once";
        // And once more.
        Next third(simple, next.run());
        third.run().take_over();
        next.simulation.reset();
        EXPECT_EQ(third.trace("send", 2), (Values{38, 39}));
        EXPECT_EQ(happened().size(), 2u);
        third.run().stop();
    }
    EXPECT_EQ(happened(), (std::vector<std::string>{"open a", "start a", "stop a", "close a"}));
}

TEST(TakeOver, OneThatIsGivenUpLeavesAllToTheRunBefore) {
    happened().clear();
    Session run(formats::read_yaml_text(simple, "m.yaml"), &lines());
    run.simulation->start();
    { const Next next(simple, *run.simulation); }
    EXPECT_EQ(run.trace("send", 2), (Values{0, 1}));
    EXPECT_EQ(happened(), (std::vector<std::string>{"open a", "start a"}));
}

std::string refusal(const std::string& text) {
    Session run(formats::read_yaml_text(simple, "m.yaml"), &lines());
    run.simulation->start();
    happened().clear();
    try {
        const Next next(text, *run.simulation);
    } catch (const RunError& error) {
        EXPECT_TRUE(happened().empty()) << "nothing is opened for it";
        return error.what();
    }
    return "accepted";
}

TEST(TakeOver, WhatIsOpenNeitherComesNorGoesNorChanges) {
    const std::string begin = "these blocks cannot come or go while the program runs; start it anew:\n  ";
    const std::string port =
        begin + "port: it keeps something open, such as a device, and would be removed or changed";
    EXPECT_EQ(refusal(replaced(simple, "{block: Port}", "{block: Port, name: b}")), port);
    EXPECT_EQ(refusal(replaced(
                  replaced(replaced(simple, "  port: {block: Port}\n", ""), "  send: {block: Sender}\n", ""),
                  "  begun: {block: Begun}\n", "")),
              port);
    EXPECT_EQ(refusal(replaced(simple, "blocks:\n", "blocks:\n  late: {block: Begun}\n")),
              begin + "late: it begins with what 'port' has open, which the run before uses until then");
}

TEST(TakeOver, WhatAChangedBlockKeptOutsideIsLost) {
    Session run(formats::read_yaml_text(simple, "m.yaml"), &lines());
    run.simulation->start();
    run.simulation->run_until(0.3);
    Next next(replaced(simple, "{block: Counting}", "{block: Counting, by: 5}"), *run.simulation);
    EXPECT_EQ(handover(*run.simulation, next.run()).lost,
              std::vector<std::string>{"what 'count' keeps outside of the diagram"});
    next.run().take_over();
    EXPECT_EQ(next.trace("count", 2), (Values{0, 5}));
}

} // namespace
} // namespace bf::test

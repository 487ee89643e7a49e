// Where the time of a run goes.
#include "bf/run/profile.hpp"
#include "support.hpp"

#include <chrono>
#include <gtest/gtest.h>
#include <sstream>
#include <thread>

namespace bf::test {
namespace {

/// Takes that long for its output.
class Slow final : public Block {
  public:
    using Block::Block;
    Output<double> y{this, "y", {}};
    Status output(Now, Out out) const noexcept override {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        out[y] = 1;
        return ok;
    }
};

const std::string profiled_model = R"m(
model: m
step: 0.1
blocks:
  slow: {block: Slow, period: 0.5}
  one: {block: Sine}
  gain: {block: Gain, K: 2}
  sum: {block: DiscreteIntegrator}
connections: {one: gain, gain: sum}
)m";

Library library() {
    Library library("");
    library.group("test").add<Slow>("Slow", "");
    return library;
}

const Profiler::Row& row(const std::vector<Profiler::Row>& rows, const std::string& name) {
    for (const auto& row : rows)
        if (row.name == name) return row;
    throw std::runtime_error("no row " + name);
}

TEST(Profile, CountsCallsAndFindsTheSlowBlockAndRate) {
    const Library blocks = library();
    Session run(profiled_model, &blocks);
    const Profiler profiler(*run.simulation);
    run.trace("gain", 20);
    const auto rows = profiler.blocks();
    EXPECT_EQ(rows.front().name, "slow");
    EXPECT_EQ(rows.front().calls, 4);
    EXPECT_GE(rows.front().seconds, 4 * 0.002 - 1e-4) << "it sleeps 2 ms per call";
    EXPECT_EQ(row(rows, "gain").calls, 20);
    EXPECT_EQ(row(rows, "sum").calls, 60) << "an output and two updates";
    const auto rates = profiler.rates();
    EXPECT_EQ(rates.front().name, "0.5 s");
    EXPECT_EQ(row(rates, "0.1 s").calls, 20 + 20 + 60);
    EXPECT_EQ(profiler.calls(), 4 + 100);
    EXPECT_GT(profiler.timer_seconds(), 0);
}

TEST(Profile, ChangesNoResultAndLeavesNothingBehind) {
    const Library blocks = library();
    Session plain(profiled_model, &blocks), profiled(profiled_model, &blocks);
    {
        const Profiler profiler(*profiled.simulation);
        EXPECT_EQ(plain.trace("sum", 7), profiled.trace("sum", 7));
        plain.simulation->visit_tasks([&, first = true](Task& task, Phase, const std::string&, int) mutable {
            if (std::exchange(first, false)) {
                EXPECT_NE(task.run, nullptr);
            }
        });
    }
    std::vector<Call::Run> runs;
    plain.simulation->visit_tasks(
        [&](Task& task, Phase, const std::string&, int) { runs.push_back(task.run); });
    std::size_t i = 0;
    profiled.simulation->visit_tasks(
        [&](Task& task, Phase, const std::string&, int) { EXPECT_EQ(task.run, runs[i++]); });
    EXPECT_EQ(plain.trace("sum", 7), profiled.trace("sum", 7));
}

TEST(Profile, TraceHoldsTheLastCallsInOrder) {
    const Library blocks = library();
    Session run(profiled_model, &blocks);
    const Profiler profiler(*run.simulation, 8);
    run.trace("gain", 10);
    std::ostringstream text;
    profiler.write_trace(text);
    std::size_t calls = 0;
    double last = -1;
    for (std::size_t at = 0; (at = text.str().find("\"ts\":", at)) != std::string::npos; ++calls, ++at) {
        const double begin = std::stod(text.str().substr(at + 5));
        EXPECT_GE(begin, last);
        last = begin;
    }
    EXPECT_EQ(calls, 8u);
    EXPECT_NE(text.str().find(R"("name":"0.5 s")"), std::string::npos);
}

TEST(Profile, TraceIsJsonWhateverBlocksAreCalled) {
    Session run("model: m\nstep: 0.1\nblocks:\n  'the \"left\" \\ hip': {block: Sine, period: 0.1}\n");
    const Profiler profiler(*run.simulation, 8);
    run.trace("the \"left\" \\ hip", 1);
    std::ostringstream text;
    profiler.write_trace(text);
    EXPECT_NE(text.str().find(R"({"name":"the \"left\" \\ hip","cat":"output",)"), std::string::npos)
        << text.str();
}

} // namespace
} // namespace bf::test

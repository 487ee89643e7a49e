#include "support.hpp"

#include "bf/realtime/server.hpp"
#include "bf/run/recorder.hpp"

#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>

// Interposes the C library's heap to count calls: the loop must make none.
namespace {
thread_local long heap_calls = 0;
}
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void __libc_free(void*);
void* malloc(std::size_t size) { return ++heap_calls, __libc_malloc(size); }
void* calloc(std::size_t count, std::size_t size) { return ++heap_calls, __libc_calloc(count, size); }
void* realloc(void* pointer, std::size_t size) { return ++heap_calls, __libc_realloc(pointer, size); }
void free(void* pointer) { return ++heap_calls, __libc_free(pointer); }
}
#endif

namespace bf::realtime {
namespace {

RunnerOptions ordinary() {
    RunnerOptions options;
    options.thread.locks_memory = false;
    return options;
}

TEST(Server, AnswersAViewerThatIsNotOurs) {
    Loaded loaded(R"m(
model: served
step: 0.001
variables: {k: {value: 3, maximum: 50}, T: 0.01, cycle: 2}
blocks:
  twice: {block: Constant, value: "2*k*[1 1]"}
  clock: {block: Clock}
  gain: {block: Gain, K: k}
  vector: {block: Constant, value: [1, 2]}
  flag: {block: Constant, value: true}
  small: {block: Constant, value: int8(1)}
  slow: {block: Clock, period: T}
  pulse: {block: Pulse, cycle: cycle}
connections: {clock: gain}
)m");
    Simulation simulation(loaded.diagram);
    Runner runner(simulation, ordinary());
    Server server(simulation, simulation.signals(), runner.parameters(), {.port = 0});
    runner.add_observer(server);
    std::atomic<int> code{-1};
    std::thread viewer([&] {
        code = std::system((BF_PYTHON " " BF_SOURCE_DIRECTORY "/realtime/test/check_server.py " +
                            std::to_string(server.port()) + " " + server.token())
                               .c_str());
    });
    runner.run(1e9, [&](const auto&) { return code < 0; });
    viewer.join();
    EXPECT_EQ(code, 0) << "see the text above";
    EXPECT_EQ(server.counts().lost_samples, 0u);
    // Three one by one, and of thousands at once at most one per tick and 100 answers.
    EXPECT_GT(server.counts().changes, 3u);
    EXPECT_LT(server.counts().changes, 3000u);
}

TEST(Server, APortThatIsTakenIsNamed) {
    Loaded loaded("model: m\nstep: 0.001\nblocks:\n  clock: {block: Clock}\n");
    Simulation simulation(loaded.diagram);
    ParameterMailbox mailbox;
    const Server first(simulation, simulation.signals(), mailbox, {.port = 0});
    try {
        const Server second(simulation, simulation.signals(), mailbox, {.port = first.port()});
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_EQ(error.what(), "cannot serve on port " + std::to_string(first.port()) +
                                    ": Address already in use; give another port, or 0 for any free one");
    }
}

TEST(Server, MakesATokenForEachRunUnlessItIsGivenOne) {
    Loaded loaded("model: m\nstep: 0.001\nblocks:\n  clock: {block: Clock}\n");
    Simulation simulation(loaded.diagram);
    ParameterMailbox mailbox;
    const Server one(simulation, {}, mailbox, {.port = 0}), two(simulation, {}, mailbox, {.port = 0}),
        given(simulation, {}, mailbox, {.token = "of-the-service", .port = 0});
    EXPECT_EQ(one.token().size(), 32u);
    EXPECT_NE(one.token(), two.token());
    EXPECT_EQ(given.token(), "of-the-service");
}

TEST(Server, EndsAtOnceWhateverViewersAskFor) {
    Loaded loaded("model: m\nstep: 0.001\nblocks:\n  clock: {block: Clock}\n");
    Simulation simulation(loaded.diagram);
    Runner runner(simulation, ordinary());
    std::thread viewer;
    std::atomic<int> code{-1};
    {
        Server server(simulation, simulation.signals(), runner.parameters(), {.port = 0});
        runner.add_observer(server);
        viewer = std::thread([&, address = std::to_string(server.port()) + " " + server.token()] {
            code =
                std::system((BF_PYTHON " " BF_SOURCE_DIRECTORY "/realtime/test/flood.py " + address).c_str());
        });
        runner.run(1, [&](const auto&) { return true; }); // the viewer floods until it is sent away
    }
    viewer.join();
    EXPECT_EQ(runner.statistics().steps, 1000);
    EXPECT_EQ(code, 0) << "the viewer was sent away";
}

/// Every control output of a run, and how often the loop called the heap.
struct Watched : Simulation::Observer {
    Watched(const Diagram& diagram, int steps) : end(diagram.find_signal("control")) {
        outputs.reserve(static_cast<std::size_t>(steps));
    }
    void observe(const bf::Run& run) noexcept override {
        const auto& simulation = static_cast<const Simulation&>(run);
        outputs.push_back(*static_cast<const double*>(simulation.context().data(end.node, end.slot)));
        if (outputs.size() == 100) calls = heap_calls;
        if (outputs.size() == outputs.capacity()) calls = heap_calls - calls;
    }
    Node::End end;
    std::vector<double> outputs;
    long calls = 0;
};

TEST(Server, ViewersThatReadStallOrDieLeaveTheOutputsAlone) {
    // A loop with an oscillator, and a signal that is large enough to fill every buffer of the network.
    Loaded loaded(R"m(
model: m
step: 0.001
blocks:
  sine: {block: Sine, frequency: 7}
  error: {block: Sum, signs: +-}
  control: {block: Gain, K: 0.3}
  plant: {block: DiscreteIntegrator}
  zeros: {block: Constant, value: "zeros(2000, 1)"}
  large: {block: Sum}
connections: {sine: [error.u1, large.u1], plant: error.u2, error: control, control: plant, zeros: large.u2}
)m");
    constexpr int steps = 3000;
    const auto file =
        std::filesystem::path(testing::TempDir()) / ("crowd_" + std::to_string(getpid()) + ".mcap");
    const auto run = [&](bool is_crowded) {
        Simulation simulation(loaded.diagram);
        Runner runner(simulation, ordinary());
        Recorder recorder(simulation,
                          simulation.quantities({{"control", loaded.diagram.find_signal("control")}}), file,
                          {}, {.drop_when_full = true});
        Server server(simulation, simulation.signals(), runner.parameters(),
                      {.port = 0, .client_bytes = 100'000});
        Watched watched(loaded.diagram, steps);
        for (Simulation::Observer* observer :
             std::initializer_list<Simulation::Observer*>{&recorder, &server, &watched})
            runner.add_observer(*observer);
        std::thread crowd([&] {
            if (!is_crowded) return;
            EXPECT_EQ(std::system((BF_PYTHON " " BF_SOURCE_DIRECTORY "/realtime/test/crowd.py " +
                                   std::to_string(server.port()) + " " + server.token() + " 2.8")
                                      .c_str()),
                      0);
        });
        runner.run(steps * 0.001, [](const auto&) { return true; });
        crowd.join();
        EXPECT_EQ(watched.calls, 0) << "the loop neither allocates nor frees";
        EXPECT_EQ(recorder.dropped(), 0u);
        if (is_crowded) {
            std::fputs(report(runner.statistics()).c_str(), stdout);
            EXPECT_GT(server.counts().lost_messages, 0u) << "the crowd does stall";
        }
        recorder.close();
        return watched.outputs;
    };
    const auto alone = run(false), crowded = run(true);
    ASSERT_EQ(alone.size(), static_cast<std::size_t>(steps));
    EXPECT_TRUE(alone == crowded);
    std::filesystem::remove(file);
}

} // namespace
} // namespace bf::realtime

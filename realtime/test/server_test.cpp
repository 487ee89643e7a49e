#include "heap.hpp"
#include "support.hpp"

#include "bf/realtime/server.hpp"
#include "bf/realtime/unix_socket.hpp"
#include "bf/run/recorder.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <gtest/gtest.h>

namespace bf::realtime {
namespace {

RunnerOptions ordinary() {
    RunnerOptions options;
    options.thread.locks_memory = false;
    return options;
}

/// A loop that makes no step.
struct Still {
    LoopAccess access() { return {parameters, control, statistics}; }
    ParameterMailbox parameters;
    Control control;
    Statistics statistics;
};

std::string port_of(const Server& server) {
    const std::string address = server.address(); // ws://127.0.0.1:PORT/?token=
    const auto colon = address.rfind(':');
    return address.substr(colon + 1, address.find('/', colon) - colon - 1);
}

TEST(Log, IsToldByItsLastTwentyEntries) {
    std::vector<LogEntry> log;
    EXPECT_EQ(log_text(log), "");
    for (int i = 0; i < 21; ++i) log.push_back({0, 0.5 * i, "ada\x1b", "k = " + std::to_string(i)});
    const std::string text = log_text(log);
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 20) << text;
    EXPECT_TRUE(text.starts_with("  t = 0.5 s, ada")) << text;
    EXPECT_TRUE(text.ends_with(": k = 20\n")) << text;
    EXPECT_EQ(text.find('\x1b'), text.npos) << "what a viewer calls itself steers no terminal";
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
    Server server(simulation, simulation.signals(), runner.access(), {.where = "0", .is_controlled = true});
    runner.add_observer(server);
    std::atomic<int> code{-1};
    std::thread viewer([&] {
        code = std::system((BF_PYTHON " " BF_SOURCE_DIRECTORY "/realtime/test/check_server.py " +
                            port_of(server) + " " + server.token())
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

/// Runs a loop that is served, with a viewer of check_control.py; the exit code of that.
int controlled(const std::string& how, RunnerOptions options, ServerOptions served,
               const std::function<void(const Runner&, const Server&, const Simulation&)>& look = {},
               const std::string& failure = "") {
    Loaded loaded(R"m(
model: controlled
step: 0.001
variables: {k: {value: 3, maximum: 50}}
blocks:
  clock: {block: Clock}
  gain: {block: Gain, K: k}
  vector: {block: Constant, value: "zeros(8, 1)"}
  last: {block: UnitDelay, initial: k}
connections: {clock: gain, gain: last}
)m");
    Simulation simulation(loaded.diagram);
    options.thread.locks_memory = false;
    Runner runner(simulation, options);
    Server server(simulation, simulation.signals(), runner.access(), served);
    runner.add_observer(server);
    std::atomic<int> code{-1};
    std::thread viewer([&] {
        code = std::system((BF_PYTHON " " BF_SOURCE_DIRECTORY "/realtime/test/check_control.py " + how +
                            " '" + server.address() + server.token() + "'")
                               .c_str());
    });
    runner.run(1e9, [&](const auto&) { return code < 0; });
    if (how != "emergency") server.end(failure, false); // that one goes on asking after the stop
    viewer.join();
    if (look) look(runner, server, simulation);
    return code;
}

TEST(Server, WhoLooksAloneSeesTheTimingAndChangesNothing) {
    EXPECT_EQ(controlled("look", {}, {.where = "0"}), 0) << "see the text above";
}

TEST(Server, ViewersStartTuneAndStopALoopAndTheLogSaysWho) {
    RunnerOptions options;
    options.waits = true;
    std::vector<std::pair<std::int64_t, std::string>> changes;
    std::vector<std::string> controls;
    ServerOptions served{.where = "0", .is_controlled = true};
    served.on_change = [&](std::int64_t step, const std::vector<ParameterValue>& values,
                           const std::string& who) {
        for (const auto& value : values) changes.emplace_back(step, value.path + " by " + who);
    };
    served.on_control = [&](const LogEntry& entry) { controls.push_back(entry.what + " by " + entry.who); };
    EXPECT_EQ(controlled("control", options, served,
                         [&](const Runner& runner, const Server& server, const Simulation& simulation) {
                             EXPECT_GT(simulation.steps(), 10);
                             EXPECT_EQ(runner.failure(), "");
                             ASSERT_EQ(server.log().size(), 8u);
                             EXPECT_EQ(server.log().back().what, "stop");
                             EXPECT_NEAR(server.log().back().time, simulation.time(), 0.1);
                             EXPECT_EQ(find(simulation.parameters(), "gain.K")[0], 60);
                         }),
              0)
        << "see the text above";
    ASSERT_GT(changes.size(), 50u);
    EXPECT_EQ(changes[0].first, -1) << "before the start";
    EXPECT_EQ(changes[0].second.substr(0, 37), "gain.K by page 1 of ada@desk at 127.0");
    EXPECT_GT(changes[1].first, 0);
    ASSERT_EQ(controls.size(), 2u);
    EXPECT_EQ(controls[0].substr(0, 27), "start by page 1 of ada@desk");
}

TEST(Server, AProgramThatFailsSaysSoAndWhy) {
    EXPECT_EQ(controlled("failure", {}, {.where = "0", .is_controlled = true}, {},
                         "gain: the output is not finite"),
              0)
        << "see the text above";
}

TEST(Server, AnEmergencyStopFollowsAStopAndStaysSo) {
    EXPECT_EQ(controlled("emergency", {}, {.where = "0", .is_controlled = true},
                         [](const Runner&, const Server& server, const Simulation&) {
                             ASSERT_EQ(server.log().size(), 2u);
                             EXPECT_EQ(server.log()[1].what, "emergency stop");
                             EXPECT_EQ(emergency_in(server.log()).substr(0, 27),
                                       "emergency stop by page 3 at");
                         }),
              0);
}

TEST(Server, ListensAtAUnixSocketOfItsOwnerAlone) {
    const auto path =
        std::filesystem::path(testing::TempDir()) / ("live_" + std::to_string(getpid()) + ".sock");
    const ServerOptions at{.where = "unix:" + path.string(), .is_controlled = true};
    EXPECT_EQ(controlled("socket", {}, at,
                         [&](const Runner&, const Server& server, const Simulation&) {
                             EXPECT_EQ(server.address(), at.where + "?token=");
                             EXPECT_EQ(std::filesystem::status(path).permissions(),
                                       std::filesystem::perms::owner_read |
                                           std::filesystem::perms::owner_write);
                         }),
              0);
    EXPECT_FALSE(std::filesystem::exists(path)) << "it goes with the server";
    ::close(listen_at(path)); // as a killed program leaves it
    EXPECT_TRUE(std::filesystem::exists(path));
    Loaded loaded("model: m\nstep: 0.001\nblocks:\n  clock: {block: Clock}\n");
    Simulation simulation(loaded.diagram);
    Still loop;
    const auto refused = [&](const std::string& where) {
        try {
            const Server server(simulation, {}, loop.access(), {.where = where});
            return std::string("none");
        } catch (const std::runtime_error& error) {
            return std::string(error.what());
        }
    };
    const Server first(simulation, {}, loop.access(), at);
    EXPECT_EQ(refused(at.where), "cannot serve at the socket " + path.string() +
                                     ": Address already in use; give the path of another socket");
    EXPECT_EQ(refused("unix:/no/such/folder/s"),
              "cannot serve at the socket /no/such/folder/s: No such file or "
              "directory; give the path of another socket");
    EXPECT_EQ(refused("unix:" + std::string(200, 'x')).substr(227), ": File name too long; give the path of "
                                                                    "another socket");
    EXPECT_EQ(refused("unix:a?token=5"),
              "the path of a socket has no '?', behind which the token stands in its address");
    EXPECT_EQ(refused("unix:"), "unix: needs the path of a socket, e.g. unix:motor.sock");
    for (const char* wrong : {"", "70000", "-1", "8765x", "localhost:8765"})
        EXPECT_EQ(refused(wrong),
                  "'" + std::string(wrong) + "' is neither a port, 0 to 65535, nor unix:PATH");
}

TEST(Server, APortThatIsTakenIsNamed) {
    Loaded loaded("model: m\nstep: 0.001\nblocks:\n  clock: {block: Clock}\n");
    Simulation simulation(loaded.diagram);
    Still loop;
    const Server first(simulation, simulation.signals(), loop.access(), {.where = "0"});
    try {
        const Server second(simulation, simulation.signals(), loop.access(), {.where = port_of(first)});
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_EQ(error.what(), "cannot serve on port " + port_of(first) +
                                    ": Address already in use; give another port, or 0 for any free one");
    }
}

TEST(Server, MakesATokenForEachRunUnlessItIsGivenOne) {
    Loaded loaded("model: m\nstep: 0.001\nblocks:\n  clock: {block: Clock}\n");
    Simulation simulation(loaded.diagram);
    Still loop;
    const Server one(simulation, {}, loop.access(), {.where = "0"}),
        two(simulation, {}, loop.access(), {.where = "0"}),
        given(simulation, {}, loop.access(), {.where = "0", .token = "of-the-service"});
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
        Server server(simulation, simulation.signals(), runner.access(), {.where = "0"});
        runner.add_observer(server);
        viewer = std::thread([&, address = port_of(server) + " " + server.token()] {
            code =
                std::system((BF_PYTHON " " BF_SOURCE_DIRECTORY "/realtime/test/flood.py " + address).c_str());
        });
        runner.run(1, [&](const auto&) { return true; }); // the viewer floods until it is sent away
        server.end("", false);
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
        if (outputs.size() == 100) calls = bf::test::heap_calls();
        if (outputs.size() == outputs.capacity()) calls = bf::test::heap_calls() - calls;
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
        Server server(simulation, simulation.signals(), runner.access(),
                      {.where = "0", .client_bytes = 100'000});
        Watched watched(loaded.diagram, steps);
        for (Simulation::Observer* observer :
             std::initializer_list<Simulation::Observer*>{&recorder, &server, &watched})
            runner.add_observer(*observer);
        std::thread crowd([&] {
            if (!is_crowded) return;
            EXPECT_EQ(std::system((BF_PYTHON " " BF_SOURCE_DIRECTORY "/realtime/test/crowd.py " +
                                   port_of(server) + " " + server.token() + " 2.8")
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

// A loop by the time of a network, which the test tells.
#include "BlockFactory/Core/Log.h"
#include "bf/core/interrupt.hpp"
#include "bf/toolbox/streams.hpp"
#include "running.hpp"

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

namespace bf::toolbox::test::network_time {
namespace {

std::atomic<double> told{0}; ///< s

struct Told final : StreamConnection {
    std::shared_ptr<StreamReader> open_reader(const std::string&, int) override { return nullptr; }
    std::shared_ptr<StreamWriter> open_writer(const std::string&, int) override { return nullptr; }
    std::shared_ptr<SimulatorConnection> open_simulator(const std::string&, const std::string&,
                                                        double) override {
        return nullptr;
    }
    std::shared_ptr<SimulatorServer> serve_simulator(const std::string&, double) override { return nullptr; }
    double now() const noexcept override { return told; }
};
struct ToldNetwork final : StreamNetwork {
    std::shared_ptr<StreamConnection> open() const override { return std::make_shared<Told>(); }
};
class Network final : public Block {
  public:
    using Block::Block;
    Provides<StreamNetwork> network{
        this, []() -> std::shared_ptr<const StreamNetwork> { return std::make_shared<ToldNetwork>(); }};
};

/// Steps of 0.1 s of that time, which begins at 10 s.
struct Loop {
    Loop() : diagram(elaborate(formats::read_yaml_text(text), blocks)), simulation(diagram) {
        told = 10;
        simulation.start();
    }
    bool step() { return bool(simulation.step()); }
    /// A step, meanwhile the time is told by others.
    bool step_while(const std::function<void()>& others) {
        std::thread thread(others);
        const bool is_good = step();
        thread.join();
        return is_good;
    }
    double overruns() const {
        const auto end = diagram.find_signal("x.overruns");
        return read_value(simulation.context().data(end.node, end.slot), diagram.slot(end).type, 0);
    }
    static constexpr const char* text =
        "model: m\nplugins: [Lab]\nstep: 0.1\nblocks:\n  network: {block: Lab/Network}\n  x: {block: "
        "WholeBodyToolbox/RealTimeSynchronizer, clock: network, report: true}\n";
    struct WithNetwork : Blocks {
        WithNetwork() {
            Library lab("Lab");
            lab.add<Network>("Network", "A network whose time is told.");
            add(std::move(lab));
        }
    } blocks;
    Diagram diagram;
    Simulation simulation;
};

void wait(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

TEST(NetworkTime, IsThatOfEachStepWhichIsNotLateWhereItIsDueAtOnce) {
    Loop loop;
    for (int k = 0; k < 5; ++k) {
        told = 10 + 0.1 * k;
        ASSERT_TRUE(loop.step());
        EXPECT_EQ(loop.overruns(), 0) << k;
    }
    EXPECT_TRUE(loop.step_while([] {
        wait(20);
        told = 10.5;
    }));
    EXPECT_EQ(loop.overruns(), 0);
    blockfactory::core::Log::getSingleton().clear();
    loop.simulation.stop();
    EXPECT_EQ(blockfactory::core::Log::getSingleton().getWarnings(), "");
}

TEST(NetworkTime, ThatWentBackEndsTheRun) {
    Loop loop;
    ASSERT_TRUE(loop.step());
    told = 10.05;
    EXPECT_FALSE(loop.step_while([] {
        wait(200);
        told = 0.2;
    }));
    EXPECT_EQ(loop.simulation.failure(),
              "x: the time of the network went back from t = 10.05 s to t = 0.2 s, as where a simulator "
              "begins again; start this run anew");
}

TEST(NetworkTime, ThatStandsStillIsTold) {
    static std::string waits;
    Loop loop;
    ASSERT_TRUE(loop.step());
    listen_to_waits([](const char* what) { waits += std::string(what) + "\n"; });
    told = 10.05;
    EXPECT_TRUE(loop.step_while([] {
        wait(1500);
        told = 10.1;
    }));
    listen_to_waits(nullptr);
    EXPECT_EQ(waits, "the simulated time of the network, which stands still at t = 10.05 s\n") << "once";
}

} // namespace
} // namespace bf::toolbox::test::network_time

// A robot that a thread of the test serves, and diagrams that drive it.
#pragma once

#include "bf/middleware/clock.hpp"
#include "bf/middleware/robot_host.hpp"
#include "running.hpp"

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

namespace bf::middleware::test {

using toolbox::test::Running;

/// Three joints of an iCub that hangs in the air, with a sensor in its foot.
inline const std::string icub = "  robot: {block: WholeBodyToolbox/Configuration, joints: \"{'l_hip_pitch', "
                                "'l_knee', 'l_ankle_roll'}\"}\n";
inline const std::string icub_world =
    "  world: {block: WholeBodyToolbox/MujocoWorld, floating_base: false, floor: false, period: 0.001, "
    "ft_sensors: \"{'l_foot_ft_sensor'}\", torque_gains: [0.1 0 0], gear_ratio: [100]}\n";
inline std::string diagram(const std::string& blocks, const std::string& connections = "",
                           const std::string& plugin = "") {
    return "model: m\nplugins: [WholeBodyToolbox" + (plugin.empty() ? "" : ", " + plugin) +
           "]\nstep: 0.001\nblocks:\n" + blocks + (connections.empty() ? "" : "connections:\n" + connections);
}

/// Reads all that there is and drives the joints by sines, in some mode.
inline std::string controller(const std::string& mode) {
    std::string blocks;
    for (const std::string what :
         {"Joints Position", "Joints Velocity", "Joints Acceleration", "Joints Torque", "Motor Position",
          "Motor Velocity", "Motor Acceleration", "Motor Current", "Motor PWM"}) {
        std::string name = what;
        name[name.find(' ')] = '_';
        blocks += "  " + name + ": {block: WholeBodyToolbox/GetMeasurement, measured_type: " + what + "}\n";
    }
    return blocks +
           "  wrench: {block: WholeBodyToolbox/GetSensor, sensor: l_foot_ft_sensor}\n"
           "  imu: {block: WholeBodyToolbox/GetSensor, kind: imu}\n"
           "  limits: {block: WholeBodyToolbox/GetLimits, limit_type: ControlBoardPosition}\n"
           "  speeds: {block: WholeBodyToolbox/GetLimits, limit_type: ControlBoardVelocity}\n"
           "  gains: {block: WholeBodyToolbox/GetLowLevelPIDs}\n"
           "  torque_gains: {block: WholeBodyToolbox/GetLowLevelPIDs, control_type: Torque}\n"
           "  sine: {block: Sine, amplitude: [0.3 -0.2 0.1], frequency: 6, phase: 0.4}\n"
           "  drive: {block: WholeBodyToolbox/SetReferences, control_type: " +
           mode + "}\n";
}
inline const std::string wires = "  sine: drive\n";

/// What that controller reads.
inline const std::vector<std::string> seen{"Joints_Position.y",
                                           "Joints_Velocity.y",
                                           "Joints_Acceleration.y",
                                           "Joints_Torque.y",
                                           "Motor_Position.y",
                                           "Motor_Velocity.y",
                                           "Motor_Acceleration.y",
                                           "Motor_Current.y",
                                           "Motor_PWM.y",
                                           "wrench.y",
                                           "imu.y",
                                           "limits.minimum",
                                           "limits.maximum",
                                           "speeds.minimum",
                                           "speeds.maximum",
                                           "gains.P",
                                           "gains.I",
                                           "gains.D",
                                           "torque_gains.P"};

/// Serves the one robot of a model, as `bf serve` does.
class Served {
  public:
    Served(std::unique_ptr<RobotEnd> its_end, const std::string& model, HostOptions options = {})
        : running_(model), end(std::move(its_end)) {
        options.goes_on = [this] { return goes_on_.load(); };
        const auto& nodes = running_.diagram().nodes;
        for (std::size_t n = 0; n < nodes.size(); ++n) {
            const auto& declaration = nodes[n].block->declaration();
            for (std::size_t i = 0; i < declaration.objects.size(); ++i)
                if (const int p = declaration.objects[i].provision;
                    p >= 0 && declaration.provisions[static_cast<std::size_t>(p)].type ==
                                  toolbox::RobotDevice::resource) {
                    device = static_cast<const toolbox::RobotDevice*>(
                        nodes[n].block->resolution().find_provided(toolbox::RobotDevice::resource));
                    robot = static_cast<toolbox::RobotConnection*>(
                        running_.simulation.context().frame(static_cast<int>(n)).objects[i]);
                }
        }
        host = std::make_unique<RobotHost>("robot", *device, *robot, *end, options);
        host->start(0.001);
        observer_.host = host.get();
        running_.simulation.add_observer(observer_);
    }
    ~Served() { end_run(); }

    /// In a thread, which has the robot for itself until end_run().
    void run() {
        goes_on_ = true;
        thread_ = std::thread([this] {
            while (goes_on_ && step()) continue;
        });
    }
    void end_run() {
        goes_on_ = false;
        if (thread_.joinable()) thread_.join();
    }
    bool step() {
        const bool goes_on = running_.step();
        time_ = running_.simulation.time();
        return goes_on;
    }
    double scalar(const std::string& path) const { return running_.scalar(path); }
    Matrix get(const std::string& path) const { return running_.get(path); }
    double time() const { return time_; } ///< also while its thread runs

    std::string events() {
        static const char* const names[] = {"came", "left", "died", "silent", "refused", "idle"};
        std::string text;
        for (RobotHost::Event event; host->take_event(event);)
            text += (text.empty() ? "" : " ") + std::string(names[static_cast<int>(event)]);
        return text;
    }

  private:
    struct Observer : Run::Observer {
        RobotHost* host = nullptr;
        void observe(const bf::Run& run) noexcept override {
            host->show(run.time());
            host->step();
        }
    };
    Running running_;
    std::atomic<bool> goes_on_{true};
    std::atomic<double> time_{0};
    std::thread thread_;
    Observer observer_;

  public:
    const toolbox::RobotDevice* device = nullptr;
    toolbox::RobotConnection* robot = nullptr;
    std::unique_ptr<RobotEnd> end;
    std::unique_ptr<RobotHost> host;
};

/// A server of one joint 'a' that is none of ours: a thread shows a state whenever `next` says its time, s.
/// All that is measured is that time.
class Pretended {
  public:
    Pretended(std::unique_ptr<RobotEnd> its_end, std::function<double()> next) : end(std::move(its_end)) {
        RobotDescription robot;
        robot.name = "pretended";
        robot.period = 0.001;
        robot.joints = {"a"};
        robot.measurements = (1U << measurement_count) - 1;
        for (auto* limits :
             {&robot.position_min, &robot.position_max, &robot.velocity_min, &robot.velocity_max})
            limits->setZero(1);
        end->start(robot);
        thread_ = std::thread([this, next = std::move(next), at = RobotLayout(robot)] {
            std::vector<double> state(static_cast<std::size_t>(at.state_size()));
            while (goes_on_) {
                const double time = next();
                std::fill(state.begin() + RobotLayout::state_head, state.end(), time);
                state[RobotLayout::time] = time;
                end->show_state(state.data(), now());
            }
        });
    }
    ~Pretended() {
        goes_on_ = false;
        thread_.join();
    }
    const std::unique_ptr<RobotEnd> end;

  private:
    std::atomic<bool> goes_on_{true};
    std::thread thread_;
};

/// A clock of a server, a millisecond in each, which begins again when it is told to.
struct Again {
    double operator()() {
        usleep(1000);
        if (is_told->exchange(false)) step = 0;
        return 1e-3 * ++step;
    }
    std::shared_ptr<std::atomic<bool>> is_told = std::make_shared<std::atomic<bool>>(false);
    int step = 0;
};

/// A diagram that the clock of such a server leads ends with it, and one with a clock of its own goes on.
inline void expect_end_where_time_goes_back(std::unique_ptr<RobotEnd> end, const std::string& robot,
                                            const std::string& plugin) {
    const Again clock;
    const Pretended pretended(std::move(end), clock);
    for (const std::string own : {"", ", clock: own"}) {
        std::string block = robot;
        Running run(diagram(block.replace(block.rfind('}'), 0, own), "", plugin));
        for (int k = 0; k < 50; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            if (!own.empty()) usleep(1000);
        }
        *clock.is_told = true;
        int steps = 0;
        for (; steps < 200 && run.step(); ++steps) usleep(own.empty() ? 0 : 1000);
        if (own.empty()) {
            EXPECT_LT(steps, 10);
            EXPECT_NE(run.simulation.failure().find(": its time went back from t = 0."), std::string::npos)
                << run.simulation.failure();
        } else {
            EXPECT_EQ(steps, 200) << run.simulation.failure();
            EXPECT_LT(run.scalar("world.drift"), 0);
        }
    }
}

/// Each step has all of one state, the newest, however many come.
inline void expect_the_newest_of_a_flood(std::unique_ptr<RobotEnd> end, const std::string& robot,
                                         const std::string& plugin) {
    const Pretended pretended(std::move(end), [k = 0]() mutable { return 1e-9 * ++k; });
    std::string block = robot;
    Running run(diagram(block.replace(block.rfind('}'), 0, ", clock: own"), "", plugin));
    double last = 0;
    for (int k = 0; k < 500; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const double time = run.scalar("world.time");
        ASSERT_GE(time, last);
        ASSERT_EQ(run.get("world.s")(0), time) << "of one state";
        ASSERT_EQ(run.get("world.tau_measured")(0), time);
        last = time;
    }
    EXPECT_GT(last, 1e-9 * 500) << "more than there are steps";
}

/// A controller is stepped by a multiple of the robot's period: each of its steps sees the state of its time.
/// `world` is the block of the robot that is served, with a period of 0.001 s. The oracle is the same
/// diagram with a world of its own.
inline void expect_each_step_at_its_time(const std::string& world, const std::string& plugin, int ratio) {
    const auto slow = [&](std::string blocks) {
        const std::string each = "period: 0.001", other = "period: 0.00" + std::to_string(ratio);
        return blocks.replace(blocks.find(each), each.size(), other);
    };
    const std::string blocks = slow("  look: {block: WholeBodyToolbox/GetMeasurement, period: 0.001}\n") +
                               slow("  sine: {block: Sine, amplitude: [0.3 -0.2 0.1], frequency: 6, period: "
                                    "0.001}\n") +
                               slow("  drive: {block: WholeBodyToolbox/SetReferences, control_type: Torque, "
                                    "period: 0.001}\n");
    Running direct(diagram(icub + icub_world + blocks, wires));
    std::vector<Matrix> expected;
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(direct.step()) << direct.simulation.failure();
        expected.push_back(direct.get("look.y"));
    }
    EXPECT_GT(expected.back().norm(), 1e-4) << "it moved";
    Running remote(diagram(icub + slow(world) + blocks, wires, plugin)); // alone, so that it has to wait
    for (std::size_t k = 0; k < expected.size(); ++k) {
        ASSERT_TRUE(remote.step()) << remote.simulation.failure();
        if (k % static_cast<std::size_t>(ratio) != 0) continue;
        ASSERT_NEAR(remote.scalar("world.time"), 0.001 * static_cast<double>(k), 1e-12);
        ASSERT_NEAR(remote.scalar("world.drift"), 0, 1e-12);
        ASSERT_EQ(remote.scalar("world.age"), 0) << "the robot's time stands still between two steps";
        ASSERT_EQ(remote.get("look.y"), expected[k]) << "at " << k << " ms";
    }
}

/// What the last step commanded is done to its end, also where the farewell is there before the robot goes
/// on: runs one after the other find the robot where the one before has left it. The oracle is the same
/// diagram with a world of its own.
inline void expect_the_last_step_to_be_done(Served& served, const std::string& world,
                                            const std::string& plugin) {
    Running direct(diagram(icub + icub_world + controller("Torque"), wires));
    ASSERT_TRUE(direct.step());
    const Matrix before = direct.get("world.s");
    ASSERT_TRUE(direct.step());
    ASSERT_NE(direct.get("world.s"), before) << "it moved";
    served.host->show(0);
    {
        Running remote(diagram(icub + world + controller("Torque"), wires, plugin));
        ASSERT_TRUE(remote.step()) << remote.simulation.failure();
        remote.simulation.stop();
    }
    served.run();
    while (served.host->gone() == 0) std::this_thread::yield();
    EXPECT_EQ(served.time(), 0.001);
    served.end_run();
    EXPECT_EQ(served.get("world.s"), direct.get("world.s"));
    EXPECT_EQ(served.events(), "came left");
}

} // namespace bf::middleware::test

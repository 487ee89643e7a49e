// bf serve --yarp: YARP's own clients and command-line programs drive a world that another process runs. The
// oracle is the same world, driven by a diagram of this process.
#include "bf/middleware/served_robot.hpp"
#include "parts.hpp"
#include "serving.hpp"

#include <atomic>
#include <clock_client/ClockServer.h>
#include <dlfcn.h>
#include <memory>
#include <thread>
#include <yarp/dev/ControlBoardInterfaces.h>
#include <yarp/dev/IPidControl.h>
#include <yarp/dev/MultipleAnalogSensorsInterfaces.h>
#include <yarp/os/Bottle.h>
#include <yarp/os/BufferedPort.h>
#include <yarp/os/ConnectionReader.h>
#include <yarp/os/ConnectionWriter.h>
#include <yarp/os/Network.h>
#include <yarp/os/Port.h>
#include <yarp/os/PortReader.h>
#include <yarp/os/Stamp.h>
#include <yarp/sig/Vector.h>

namespace bf::yarp::test {
namespace {

/// Answers every question as a board of YARP's protocol 1.9.
class OldBoard : os::PortReader {
  public:
    OldBoard() {
        question_.setReader(*this);
        if (!question_.open("/old/left_leg/rpc:i") || !command_.open("/old/left_leg/command:i") ||
            !state_.open("/old/left_leg/stateExt:o"))
            throw std::runtime_error("the old board does not open");
    }
    ~OldBoard() {
        for (auto* port : {&question_, &command_, &state_}) port->close();
    }

  private:
    bool read(os::ConnectionReader& reader) override {
        os::Bottle question, answer;
        if (!question.read(reader)) return false;
        answer.fromString("[prot] 1 9 0 [ok]");
        auto* writer = reader.getWriter();
        return writer != nullptr && answer.write(*writer);
    }
    os::Port question_, command_, state_;
};

} // namespace

TEST(YarpParts, AreThoseOfAnICub) {
    const auto text = [](const std::vector<Part>& parts) {
        std::string all;
        for (const auto& part : parts) {
            all += part.name + ":";
            for (const auto& joint : part.joints) all += " " + joint;
            all += "\n";
        }
        return all;
    };
    EXPECT_EQ(text(parts_of({"torso_yaw", "neck_pitch", "l_shoulder_roll", "l_hip_yaw", "r_knee",
                             "r_wrist_yaw", "l_elbow", "eyes_tilt", "left_toe", "spare"})),
              "torso: torso_yaw\nhead: neck_pitch eyes_tilt\nleft_arm: l_shoulder_roll l_elbow\nleft_leg: "
              "l_hip_yaw left_toe\nright_leg: r_knee\nright_arm: r_wrist_yaw\nbody: spare\n");
    EXPECT_EQ(text(read_parts({"a=x", "b=z,y"}, {"x", "y", "z"})), "a: x\nb: z y\n");
    const auto refused = [](const std::vector<std::string>& texts) -> std::string {
        try {
            read_parts(texts, {"knee", "hip"});
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_EQ(refused({"leg"}), "--board 'leg': write it as NAME=JOINT,JOINT,..., such as "
                                "torso=torso_yaw,torso_roll,torso_pitch");
    EXPECT_EQ(refused({"leg=kne"}), "--board 'leg=kne': the robot has no joint 'kne'; did you mean 'knee'?");
    EXPECT_EQ(refused({"a=knee,hip", "b=hip"}), "--board 'b=hip': the joint 'hip' is on two boards");
    EXPECT_EQ(refused({"a=knee"}), "--board: the joint 'hip' is on no board; give each joint a board, or "
                                   "leave --board out");
    EXPECT_EQ(stream_of("l_foot_ft_sensor"), "left_foot/analog:o");
    EXPECT_EQ(stream_of("wrist"), "wrist/analog:o");
}

TEST_F(YarpServe, LetsYarpsClientsStepAWorldByTorques) {
    const auto served = serve();
    ASSERT_TRUE(is_there("/clock/rpc"));
    Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg");
    Client sensors("multipleanalogsensorsclient", "/icubSim/sensors", "/test/sensors");
    os::BufferedPort<os::Bottle> foot, inertial;
    ASSERT_TRUE(foot.open("/test/foot") && inertial.open("/test/inertial") &&
                os::NetworkBase::connect("/icubSim/left_foot/analog:o", "/test/foot") &&
                os::NetworkBase::connect("/icubSim/inertial", "/test/inertial"));
    Running direct(diagram(icub + icub_world +
                               "  tau: {block: Constant, value: [3, -2, 1]}\n"
                               "  drive: {block: WholeBodyToolbox/SetReferences, control_type: Torque}\n"
                               "  s: {block: WholeBodyToolbox/GetMeasurement}\n"
                               "  tau_measured: {block: WholeBodyToolbox/GetMeasurement, measured_type: "
                               "Joints Torque}\n"
                               "  wrench: {block: WholeBodyToolbox/GetSensor, sensor: l_foot_ft_sensor}\n"
                               "  imu: {block: WholeBodyToolbox/GetSensor, kind: imu}\n",
                           "  tau: drive\n"));
    int axes = 0;
    std::string name;
    ASSERT_TRUE(board.as<dev::IEncoders>().getAxes(&axes));
    EXPECT_EQ(axes, 3);
    ASSERT_TRUE(board.as<dev::IAxisInfo>().getAxisName(1, name));
    EXPECT_EQ(name, "l_knee");
    Clock clock;
    EXPECT_EQ(clock.ask("getStepSize"), 0.001);
    EXPECT_TRUE(are_in(board, VOCAB_CM_POSITION)) << "nobody drives it";
    set_modes(board, VOCAB_CM_TORQUE);
    const double torques[3] = {3, -2, 1};
    ASSERT_TRUE(board.as<dev::ITorqueControl>().setRefTorques(torques));
    double taken[3] = {};
    ASSERT_TRUE(waits_until([&] {
        return board.as<dev::ITorqueControl>().getRefTorques(taken) && taken[2] == 1;
    })) << "what is streamed comes in its own time";
    ASSERT_TRUE(direct.step()); // shows the time 0
    for (int k = 1; k <= 20; ++k) {
        clock.ask("stepSimulationAndWait 10");
        for (int i = 0; i < 10; ++i) ASSERT_TRUE(direct.step());
        ASSERT_LT((positions(board, 0.01 * k) - Eigen::Vector3d(direct.get("s.y"))).norm(), 1e-12) << k;
    }
    EXPECT_NEAR(clock.ask("getSimulationTime"), 0.2, 1e-12);
    EXPECT_GT((direct.get("s.y") - Matrix(Eigen::Vector3d::Zero())).norm(), 0.05) << "it moved";
    double measured[3] = {};
    ASSERT_TRUE(board.as<dev::ITorqueControl>().getTorques(measured));
    EXPECT_LT((Eigen::Map<Eigen::Vector3d>(measured) - Eigen::Vector3d(direct.get("tau_measured.y"))).norm(),
              1e-12);
    ::yarp::sig::Vector wrench, rotation;
    double time = 0;
    ASSERT_TRUE(waits_until([&] {
        return sensors.as<dev::ISixAxisForceTorqueSensors>().getSixAxisForceTorqueSensorMeasure(0, wrench,
                                                                                                time) &&
               time > 0.1995;
    }));
    const Eigen::VectorXd expected = direct.get("wrench.y"), imu = direct.get("imu.y");
    EXPECT_LT((Eigen::Map<Eigen::VectorXd>(wrench.data(), 6) - expected).norm(), 1e-9);
    ASSERT_TRUE(sensors.as<dev::IThreeAxisGyroscopes>().getThreeAxisGyroscopeMeasure(0, rotation, time));
    EXPECT_LT((Eigen::Map<Eigen::VectorXd>(rotation.data(), 3) / degrees - imu.segment<3>(6)).norm(), 1e-9);
    const auto streamed = [](os::BufferedPort<os::Bottle>& port) {
        Eigen::VectorXd values;
        os::Bottle* message = nullptr;
        EXPECT_TRUE(waits_until([&] {
            if (auto* newer = port.read(false)) message = newer;
            os::Stamp stamp;
            return message != nullptr && port.getEnvelope(stamp) && stamp.getTime() > 0.1995;
        }));
        if (message == nullptr) return values;
        values.resize(static_cast<Eigen::Index>(message->size()));
        for (std::size_t i = 0; i < message->size(); ++i)
            values[static_cast<Eigen::Index>(i)] = message->get(i).asFloat64();
        return values;
    };
    const Eigen::VectorXd wrench_stream = streamed(foot), imu_stream = streamed(inertial);
    ASSERT_EQ(wrench_stream.size(), 6);
    ASSERT_EQ(imu_stream.size(), 12);
    EXPECT_EQ(wrench_stream, expected);
    EXPECT_LT((imu_stream.head<3>() / degrees - imu.head<3>()).norm(), 1e-9);
    EXPECT_EQ((imu_stream.segment<3>(3)), (imu.segment<3>(3)));
}

TEST_F(YarpServe, LeadsJointsByTrajectoriesOfTheirSpeed) {
    const auto served = serve();
    ASSERT_TRUE(is_there("/clock/rpc"));
    Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg");
    Clock clock;
    auto& position = board.as<dev::IPositionControl>();
    clock.ask("stepSimulationAndWait 100");
    const Eigen::Vector3d start = positions(board, 0.1);
    double speeds[3] = {20, 20, 20};
    ASSERT_TRUE(position.setRefSpeeds(speeds));
    const double targets[3] = {start[0] * degrees + 10, start[1] * degrees - 20, start[2] * degrees};
    ASSERT_TRUE(position.positionMove(targets));
    clock.ask("stepSimulationAndWait 250");
    bool is_done = true;
    ASSERT_TRUE(position.checkMotionDone(&is_done));
    EXPECT_FALSE(is_done);
    const Eigen::Vector3d half = (positions(board, 0.35) - start) * degrees;
    EXPECT_NEAR(half[0], 5, 1.5) << "20 degrees per second, for a quarter of one";
    EXPECT_NEAR(half[1], -5, 1.5);
    // Modes of position are mixed at will.
    ASSERT_TRUE(board.as<dev::IControlMode>().setControlMode(2, VOCAB_CM_VELOCITY));
    ASSERT_TRUE(board.as<dev::IVelocityControl>().velocityMove(2, 10));
    double velocity = 0;
    ASSERT_TRUE(waits_until(
        [&] { return board.as<dev::IVelocityControl>().getRefVelocity(2, &velocity) && velocity == 10; }));
    clock.ask("stepSimulationAndWait 500");
    const Eigen::Vector3d later = positions(board, 0.85);
    clock.ask("stepSimulationAndWait 500");
    const Eigen::Vector3d last = positions(board, 1.35);
    ASSERT_TRUE(position.checkMotionDone(0, &is_done));
    EXPECT_TRUE(is_done);
    EXPECT_NEAR((last - start)[0] * degrees, 10, 1.5);
    EXPECT_NEAR((last - start)[1] * degrees, -20, 1.5);
    EXPECT_NEAR((last - later)[2] * degrees, 5, 0.3) << "10 degrees per second, for half a second";
}

TEST_F(YarpServe, TellsLimitsAndTakesGains) {
    const auto served = serve();
    ASSERT_TRUE(is_there("/clock/rpc"));
    Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg");
    Clock clock;
    Running direct(diagram(icub + icub_world +
                           "  limits: {block: WholeBodyToolbox/GetLimits, limit_type: ControlBoardPosition}\n"
                           "  gains: {block: WholeBodyToolbox/GetLowLevelPIDs}\n"));
    ASSERT_TRUE(direct.step());
    for (int j = 0; j < 3; ++j) {
        double low = 0, high = 0;
        ASSERT_TRUE(board.as<dev::IControlLimits>().getLimits(j, &low, &high));
        EXPECT_NEAR(low / degrees, direct.get("limits.minimum")(j), 1e-12);
        EXPECT_NEAR(high / degrees, direct.get("limits.maximum")(j), 1e-12);
        dev::Pid pid;
        ASSERT_TRUE(board.as<dev::IPidControl>().getPid(dev::VOCAB_PIDTYPE_POSITION, j, &pid));
        EXPECT_EQ(pid.kp, direct.get("gains.P")(j));
        EXPECT_EQ(pid.kd, direct.get("gains.D")(j));
    }
    // Without gains nothing holds the hip.
    dev::Pid none;
    ASSERT_TRUE(board.as<dev::IPidControl>().setPid(dev::VOCAB_PIDTYPE_POSITION, 0, none));
    clock.ask("stepSimulationAndWait 1");
    const Eigen::Vector3d before = positions(board, 0.001);
    clock.ask("stepSimulationAndWait 300");
    EXPECT_GT(std::abs(positions(board, 0.301)[0] - before[0]), 0.01);
    EXPECT_FALSE(board.as<dev::IControlMode>().setControlMode(0, VOCAB_CM_HW_FAULT));
    EXPECT_FALSE(board.as<dev::IControlMode>().setControlMode(7, VOCAB_CM_TORQUE));
}

TEST_F(YarpServe, AnswersYarpsProgramsAndGoesOnlyAsFarAsTold) {
    const auto served = serve();
    ASSERT_TRUE(is_there("/clock/rpc"));
    const auto run = [&](const std::string& command) {
        const std::string all =
            "PATH=" BF_YARP_PREFIX "/bin:$PATH; " + command + " > '" + (folder_ / "out").string() + "' 2>&1";
        EXPECT_NE(std::system(all.c_str()), -1);
        return read("out");
    };
    const auto ask = [&](const std::string& what) {
        return run("echo '" + what + "' | timeout 20 yarp rpc /clock/rpc");
    };
    expect_contains(ask("getStepSize"), "0.001");
    expect_contains(ask("stepSimulationAndWait 50"), "");
    expect_contains(ask("getSimulationTime"), "0.05");
    usleep(200'000);
    expect_contains(ask("getSimulationTime"), "0.05");
    EXPECT_EQ(run("timeout 3 yarp read /reads envelope /icubSim/left_leg/state:o").find("nothing"),
              std::string::npos);
    expect_contains(run("echo 'get encs' | timeout 20 yarp rpc /icubSim/left_leg/rpc:i"), "[is] encs (");
}

/// As a controller does that was written for Gazebo.
TEST_F(YarpServe, IsSteppedByAClientOfYarpsCompiler) {
    const auto served = serve();
    ASSERT_TRUE(is_there("/clock/rpc"));
    os::Port port;
    ASSERT_TRUE(port.open("/WBT_synchronizer/rpc:o") &&
                os::NetworkBase::connect("/WBT_synchronizer/rpc:o", "/clock/rpc"));
    clock_client::ClockServer clock;
    ASSERT_TRUE(clock.yarp().attachAsClient(port));
    EXPECT_EQ(clock.getStepSize(), 0.001);
    clock.pauseSimulation();
    EXPECT_EQ(clock.getSimulationTime(), 0);
    for (int k = 1; k <= 20; ++k) {
        clock.stepSimulationAndWait(10);
        EXPECT_NEAR(clock.getSimulationTime(), 0.01 * k, 1e-12);
    }
    clock.stepSimulation(5);
    EXPECT_TRUE(waits_until([&] { return std::abs(clock.getSimulationTime() - 0.205) < 1e-12; }));
    clock.continueSimulation();
    EXPECT_TRUE(waits_until([&] { return clock.getSimulationTime() > 0.5; })) << "it runs freely";
    clock.pauseSimulation();
    const double time = clock.getSimulationTime();
    usleep(50'000);
    EXPECT_NEAR(clock.getSimulationTime(), time, 0.0015) << "but for the step that it was in";
}

TEST_F(YarpServe, HoldsTheJointsWhenTheirControllerIsKilled) {
    auto served = serve({"--realtime", "--priority", "0", "--once", "--silence", "1"});
    ASSERT_TRUE(is_there("/clock/rpc"));
    Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg");
    set_modes(board, VOCAB_CM_TORQUE); // and nothing more comes
    EXPECT_EQ(served.wait(), 0);
    const std::string said = read("said");
    expect_contains(said, "serves the robot /icubSim (YARP)");
    expect_contains(said, "a controller has come");
    expect_contains(said, "no command for 1 s; its joints hold");
}

TEST_F(YarpServe, IsDrivenInLockstepByADiagram) {
    const std::string blocks =
        "  s: {block: WholeBodyToolbox/GetMeasurement}\n  s_dot: {block: WholeBodyToolbox/GetMeasurement, "
        "measured_type: Joints Velocity}\n"
        "  wrench: {block: WholeBodyToolbox/GetSensor, sensor: l_foot_ft_sensor}\n"
        "  imu: {block: WholeBodyToolbox/GetSensor, sensor: SENSOR, kind: imu}\n"
        "  K: {block: Gain, K: 2}\n  sine: {block: Sine, amplitude: [3 -2 1], frequency: 6}\n"
        "  tau: {block: Sum, signs: +-}\n  drive: {block: WholeBodyToolbox/SetReferences, control_type: "
        "Torque}\n";
    const std::string wires = "  sine: tau.u1\n  s_dot: K\n  K: tau.u2\n  tau: drive\n";
    std::string with_sensor = blocks;
    Running direct(diagram(
        icub + icub_world + with_sensor.replace(with_sensor.find(" sensor: SENSOR,"), 16, ""), wires));
    std::vector<Matrix> expected;
    for (int k = 0; k < 200; ++k) {
        ASSERT_TRUE(direct.step());
        Eigen::VectorXd all(21);
        all << direct.get("s.y"), direct.get("wrench.y"), direct.get("imu.y");
        expected.push_back(all);
    }
    const auto served = serve();
    ASSERT_TRUE(is_there("/clock/rpc"));
    std::string named = blocks;
    Running run(
        diagram(icub +
                    "  world: {block: Yarp/Robot, period: 0.001, boards: \"{'left_leg'}\", simulator: "
                    "/clock/rpc, wrenches: \"{'l_foot_ft_sensor=/icubSim/sensors'}\", imus: "
                    "\"{'imu=/icubSim/inertial'}\"}\n" +
                    named.replace(named.find("SENSOR"), 6, "imu"),
                wires, "Yarp"));
    double worst = 0;
    for (const auto& value : expected) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        ASSERT_EQ(run.scalar("world.age"), 0) << "the simulator stands still between two steps";
        Eigen::VectorXd all(21);
        all << run.get("s.y"), run.get("wrench.y"), run.get("imu.y");
        worst = std::max(worst, (all - Eigen::VectorXd(value)).norm() / (1 + value.norm()));
    }
    EXPECT_LT(worst, 1e-9);
    EXPECT_NEAR(run.scalar("world.time"), 0.199, 1e-9);
    EXPECT_NEAR(run.scalar("world.drift"), 0, 1e-9);
    run.simulation.stop();
}

TEST_F(YarpServe, IsDrivenInLockstepOnTheWorldsOwnWays) {
    for (const std::string mode :
         {"Velocity, reference_acceleration: 4", "Position, reference_speed: 0.8", "Position Direct"}) {
        SCOPED_TRACE(mode);
        const std::string blocks = "  s: {block: WholeBodyToolbox/GetMeasurement}\n"
                                   "  sine: {block: Sine, amplitude: [0.3 -0.2 0.1], frequency: 6}\n"
                                   "  drive: {block: WholeBodyToolbox/SetReferences, control_type: " +
                                   mode + "}\n";
        const auto served = serve();
        ASSERT_TRUE(is_there("/clock/rpc"));
        Running direct(diagram(icub + icub_world + blocks, "  sine: drive\n"));
        Running run(diagram(icub + led_robot("left_leg") + blocks, "  sine: drive\n", "Yarp"));
        double worst = 0, way = 0;
        for (int k = 0; k < 300; ++k) {
            ASSERT_TRUE(direct.step());
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            worst = std::max(worst, (run.get("s.y") - direct.get("s.y")).norm());
            way = std::max(way, direct.get("s.y").norm());
        }
        EXPECT_LT(worst, 1e-9);
        EXPECT_GT(way, 0.01) << "it moved";
        run.simulation.stop();
    }
}

TEST_F(YarpServe, StandsStillAndEndsWhenItsControllerHasLeftInAnyMode) {
    const auto drive = [](const std::string& mode) {
        Running run(diagram(icub + led_robot("left_leg") +
                                "  c: {block: Constant, value: [0.1, -0.1, 0]}\n"
                                "  drive: {block: WholeBodyToolbox/SetReferences, control_type: " +
                                mode + "}\n",
                            "  c: drive\n", "Yarp"));
        for (int k = 0; k < 20 && run.step();) ++k;
        run.simulation.stop();
    };
    for (const std::string mode : {"Position", "Position Direct", "Velocity", "Torque"}) {
        SCOPED_TRACE(mode);
        std::filesystem::remove(folder_ / "said");
        auto served = serve({"--once"});
        ASSERT_TRUE(is_there("/clock/rpc"));
        drive(mode);
        EXPECT_TRUE(served.ends_well(10));
        const std::string said = read("said"), came = "a controller has come";
        EXPECT_EQ(said.find(came), said.rfind(came)) << said;
        expect_contains(said, "the controller has left; its joints hold");
    }
    const auto served = serve();
    ASSERT_TRUE(is_there("/clock/rpc"));
    for (const std::string mode : {"Impedance", "Velocity", "Torque"}) { // the first one is refused
        Clock clock;
        drive(mode);
        const double time = clock.ask("getSimulationTime");
        usleep(200'000);
        EXPECT_EQ(clock.ask("getSimulationTime"), time) << mode;
        EXPECT_LT(time, 0.05);
    }
}

TEST_F(YarpServe, EndsADiagramWhenItStandsStillOrIsKilled) {
    for (const bool is_killed : {true, false}) {
        auto served = serve();
        ASSERT_TRUE(is_there("/clock/rpc"));
        Running run(diagram(icub + led_robot("left_leg") +
                                "  tau: {block: Constant, value: [0, 0, 0]}\n"
                                "  drive: {block: WholeBodyToolbox/SetReferences, control_type: Torque}\n",
                            "  tau: drive\n", "Yarp"));
        for (int k = 0; k < 20; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
        }
        if (is_killed)
            served.end();
        else
            served.halt();
        int steps = 0;
        while (run.step()) {
            ASSERT_LT(++steps, 10);
        }
        expect_contains(run.simulation.failure(), "world: YARP robot 'icubSim': ");
        if (is_killed) expect_contains(run.simulation.failure(), "it does not go on; look at its simulator");
        run.simulation.stop(); // comes back, whatever its thread waits for
        served.end();
    }
}

TEST_F(YarpServe, EndsADiagramWhoseJointsAnotherProgramTakes) {
    const auto served = serve({"--realtime", "--priority", "0", "--watchdog", "0"});
    ASSERT_TRUE(is_there("/clock/rpc"));
    Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg");
    Running run(diagram(icub + "  world: {block: Yarp/Robot, period: 0.001, timeout: 5, silence: 10, boards: "
                               "\"{'left_leg'}\", start_timeout: 20}\n"
                               "  c: {block: Constant, value: [0, 0, 0]}\n"
                               "  drive: {block: WholeBodyToolbox/SetReferences, control_type: Position "
                               "Direct}\n",
                        "  c: drive\n", "Yarp"));
    for (int k = 0; k < 20'000 && !are_in(board, VOCAB_CM_POSITION_DIRECT); ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
    }
    for (int k = 0; k < 2000; ++k) {
        ASSERT_TRUE(run.step()) << "it is left alone: " << run.simulation.failure();
    }
    set_modes(board, VOCAB_CM_POSITION);
    for (int k = 0; run.step(); ++k) {
        ASSERT_LT(k, 20'000);
    }
    expect_contains(run.simulation.failure(), "drive: u[l_hip_pitch] has left its control mode");
}

/// As a simulator's does that is set back.
TEST_F(YarpServe, LeadsADiagramOnWhenItsClockBeginsAgain) {
    struct Nobody final : middleware::RobotEnd {
        void start(const middleware::RobotDescription&) override {}
        void show_state(const double*, double) noexcept override {}
        void show_gains(const double*) noexcept override {}
        bool take_command(double*, middleware::Stamp&) noexcept override { return false; }
        bool take_settings(double*) noexcept override { return false; }
        void wait(double) noexcept override {}
        bool is_gone() noexcept override { return false; }
        const std::string& name() const noexcept override { return its; }
        const std::string its = "nobody";
    };
    middleware::test::Served world(std::make_unique<Nobody>(), diagram(icub + icub_world), {.waits = false});
    void* plugin = dlopen(BF_PLUGIN_DIRECTORY "/Yarp.so", RTLD_LAZY);
    ASSERT_TRUE(plugin) << dlerror();
    const auto make = reinterpret_cast<middleware::ServedRobot* (*)(const middleware::ServeRequest&)>(
        dlsym(plugin, middleware::serve_symbol));
    const std::unique_ptr<middleware::ServedRobot> shown(make({.path = "world",
                                                               .is_alone = true,
                                                               .device = *world.device,
                                                               .robot = *world.robot,
                                                               .options = {{"yarp", {"icubSim"}}},
                                                               .host = {.waits = false, .watchdog = 0}}));
    shown->start(0.001);
    std::atomic<bool> goes_on{true}, is_set_back{false};
    std::thread steps([&] {
        for (double time = 100; goes_on && world.step(); time += 0.001, usleep(1000)) {
            if (is_set_back.exchange(false)) time = 0;
            shown->step(time);
        }
    });
    std::string text =
        diagram(icub + "  world: {block: Yarp/Robot, period: 0.001, boards: \"{'left_leg'}\", "
                       "start_timeout: 20, silence: 10}\n"
                       "  drive: {block: WholeBodyToolbox/SetReferences, control_type: Position "
                       "Direct}\n",
                "  u: drive\n", "Yarp");
    text.replace(text.find("blocks:"), 7, "inputs: {u: {shape: 3}}\nblocks:");
    {
        Running run(text);
        for (const double target : {0.1, -0.1}) {
            run.set("u", Eigen::Vector3d::Constant(target));
            int k = 0;
            while (k < 5000 && std::abs(run.get("world.s")(0) - target) > 0.02 && run.step()) ++k;
            EXPECT_LT(k, 5000) << "it does not come to " << target;
            EXPECT_EQ(run.simulation.failure(), "");
            EXPECT_LT(run.scalar("world.age"), 1);
            is_set_back = true;
        }
    }
    goes_on = false;
    steps.join();
}

TEST_F(YarpServe, IsOfOneVersionOfYarp) {
    OldBoard old;
    expect_contains(
        refusal(diagram(icub + "  world: {block: Yarp/Robot, period: 0.001, robot: old, boards: "
                               "\"{'left_leg'}\", start_timeout: 20}\n",
                        "", "Yarp")),
        "world: YARP robot 'old': its control boards \"/old/left_leg\" do not open; look whether they "
        "have the joints l_hip_pitch l_knee l_ankle_roll, and are of this version of YARP");
}

TEST_F(YarpServe, StreamsGiveTheNewestOfAFlood) {
    os::Port sender;
    ASSERT_TRUE(sender.open("/flood"));
    Running run("model: m\nplugins: [Yarp, WholeBodyToolbox]\nstep: 0.01\nblocks:\n  network: {block: "
                "Yarp/Network}\n  x: {block: WholeBodyToolbox/StreamRead, stream: /flood, size: 2}\n");
    std::atomic<bool> goes_on{true};
    std::thread floods([&] {
        for (double k = 1; goes_on; ++k) {
            os::Bottle message;
            message.addFloat64(k);
            message.addFloat64(k);
            sender.write(message);
        }
    });
    double last = 0;
    bool is_good = true;
    for (int k = 0; k < 300 && is_good; ++k, usleep(1000)) {
        is_good = run.step();
        const Matrix y = run.get("x.y");
        EXPECT_GE(y(0), last);
        EXPECT_EQ(y(0), y(1));
        last = y(0);
    }
    goes_on = false;
    floods.join();
    EXPECT_TRUE(is_good) << run.simulation.failure();
    EXPECT_GT(last, 300) << "more than there are steps";
}

TEST_F(YarpServe, RefusesASecondRobotOfTheNameAndWhatItDoesNotHave) {
    const auto served = serve();
    ASSERT_TRUE(is_there("/clock/rpc"));
    const auto refused = [&](const std::vector<std::string>& more, int code, const std::string& text) {
        std::vector<std::string> words{BF_PROGRAM, "serve", model_};
        words.insert(words.end(), more.begin(), more.end());
        Program other(words, folder_ / "other");
        EXPECT_EQ(other.wait(), code) << text;
        expect_contains(read("other"), text);
    };
    refused({"--yarp", "icubSim"}, 1,
            "robot /icubSim (YARP): another program has the port /icubSim/left_leg/rpc:i; end it, or give "
            "this robot another name");
    refused({"--yarp", "other"}, 1, "another program has the port /clock");
    refused({"--yarp", "/icub"}, 2, "the robot's name is '/icub'; write letters, digits, _ and -");
    refused({"--yarp", "x", "--board", "leg=l_knee"}, 1, "--board: the joint 'l_hip_pitch' is on no board");
    refused({"--yarp", "x", "--shm", "x"}, 2, "--shm");
    refused({"--board", "leg=l_knee"}, 2, "--yarp");
}

} // namespace bf::yarp::test

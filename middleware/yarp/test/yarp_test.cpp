// Diagrams drive YARP's own pretended robot, in one program without a name server; the oracle is YARP's own
// client of the same boards.
#include "alone.hpp"
#include "cycles.hpp"
#include "heap.hpp"
#include "patience.hpp"
#include "running.hpp"

#include <cstring>
#include <dlfcn.h>
#include <functional>
#include <link.h>
#include <string>
#include <unistd.h>
#include <vector>
#include <yarp/dev/ControlBoardInterfaces.h>
#include <yarp/dev/IPidControl.h>
#include <yarp/dev/PolyDriver.h>
#include <yarp/os/Bottle.h>
#include <yarp/os/BufferedPort.h>
#include <yarp/os/Log.h>
#include <yarp/os/Network.h>
#include <yarp/os/Property.h>
#include <yarp/os/RpcClient.h>
#include <yarp/os/Stamp.h>
#include <yarp/os/Time.h>

namespace bf::yarp::test {
namespace {

namespace os = ::yarp::os;
namespace dev = ::yarp::dev;
using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

using YarpRobot = Alone;
using YarpStreams = Alone;

constexpr double radians = M_PI / 180;

/// A control board of YARP that does at once what it is told, and an inertial sensor, for all tests: boards
/// of that kind do not bear to be closed.
class Pretended {
  public:
    Pretended() {
        static const auto* robot = new Robot; // which stays
        if (robot == nullptr) throw std::bad_alloc();
    }

  private:
    struct Robot {
        Robot() {
            os::NetworkBase::setLocalMode(true);
            os::Log::setMinimumPrintLevel(os::Log::FatalType);
            open(board, "device controlboardwrapper2\nsubdevice fakeMotionControl\nname /icubSim/left_leg\n"
                        "period 5\n[GENERAL]\nJoints 3\nAxisName hip knee ankle\n");
            open(rail, "device controlboardwrapper2\nsubdevice fakeMotionControl\nname /icubSim/rail\n"
                       "period 5\n[GENERAL]\nJoints 2\nAxisName wheel slide\n"
                       "AxisType revolute prismatic\n");
            open(imu,
                 "device multipleanalogsensorsserver\nsubdevice fakeIMU\nname /icubSim/imu\nperiod 10\n");
            keep_libraries();
        }
        /// Its threads still run when YARP closes the libraries of devices, at the end of the program.
        static void keep_libraries() {
            std::vector<std::string> devices;
            dl_iterate_phdr(
                [](dl_phdr_info* library, std::size_t, void* names) {
                    if (std::strstr(library->dlpi_name, "/yarp_") != nullptr)
                        static_cast<std::vector<std::string>*>(names)->emplace_back(library->dlpi_name);
                    return 0;
                },
                &devices);
            for (const auto& device : devices) dlopen(device.c_str(), RTLD_LAZY | RTLD_NODELETE);
        }
        static void open(dev::PolyDriver& driver, const char* config) {
            os::Property wanted;
            wanted.fromConfig(config);
            if (!driver.open(wanted)) throw std::runtime_error("the pretended robot does not open");
        }
        os::Network network;
        dev::PolyDriver board, rail, imu;
    };
};

/// YARP's client of the board.
class Look {
  public:
    explicit Look(const std::string& board = "left_leg") {
        os::Property wanted;
        wanted.put("device", "remote_controlboard");
        wanted.put("remote", "/icubSim/" + board);
        wanted.put("local", "/look");
        if (!driver_.open(wanted)) throw std::runtime_error("YARP's client does not open");
    }
    template <class I> I& as() {
        I* view = nullptr;
        if (!driver_.view(view)) throw std::runtime_error("YARP's client has no such view");
        return *view;
    }
    bool is_in(int mode) {
        int modes[3] = {};
        return as<dev::IControlMode>().getControlModes(modes) && modes[0] == mode && modes[1] == mode &&
               modes[2] == mode;
    }

  private:
    dev::PolyDriver driver_;
};

std::string robot(const std::string& settings = ", boards: \"{'left_leg'}\"") {
    return "model: m\nplugins: [Yarp, WholeBodyToolbox]\nstep: 0.005\ninputs: {u: {shape: 3}}\nblocks:\n"
           "  robot: {block: Yarp/Robot, joints: \"{'ankle', 'hip', 'knee'}\", start_timeout: 20, silence: "
           "5" +
           settings + "}\n";
}
std::string driven(const std::string& mode, const std::string& settings = "") {
    return robot(", boards: \"{'left_leg'}\"" + settings) +
           "  s: {block: WholeBodyToolbox/GetMeasurement}\n"
           "  drive: {block: WholeBodyToolbox/SetReferences, control_type: " +
           mode + "}\nconnections: {u: drive}\n";
}

/// Steps until it is so; false: it never was.
bool steps_until(Running& run, const std::function<bool()>& is_so) {
    for (int k = 0; k < 1000; ++k) {
        if (is_so()) return true;
        if (!run.step()) return false;
    }
    return false;
}
bool waits_until(const std::function<bool()>& is_so) {
    for (int k = 0; k < 5000; ++k, usleep(1000))
        if (is_so()) return true;
    return false;
}

const Eigen::Vector3d target(0.1, 0.2, -0.3); ///< ankle, hip, knee

} // namespace

TEST_F(YarpRobot, GoesWhereItIsLed) {
    Pretended pretended;
    Look look;
    Running run(driven("Position Direct"));
    run.set("u", target);
    EXPECT_TRUE(steps_until(run, [&] { return (run.get("s.y") - Matrix(target)).norm() < 1e-9; }))
        << run.simulation.failure() << run.get("s.y");
    EXPECT_GT(run.scalar("robot.time"), 0);
    EXPECT_LT(run.scalar("robot.age"), 1);
    Eigen::Vector3d degrees = Eigen::Vector3d::Zero();
    const Eigen::Vector3d its(0.2, -0.3, 0.1); // the hip, which is the diagram's second joint, comes first
    EXPECT_TRUE(waits_until([&] {
        return look.as<dev::IEncoders>().getEncoders(degrees.data()) &&
               (degrees * radians - its).norm() < 1e-9;
    })) << degrees * radians;
}

/// The pretended robot has no torques and forgets some references, so these are looked at on their way to it.
TEST_F(YarpRobot, IsDrivenInEveryModeByTheUnitsOfIt) {
    for (const auto& each : {std::pair("Position", VOCAB_CM_POSITION),
                             {"Position Direct", VOCAB_CM_POSITION_DIRECT},
                             {"Velocity", VOCAB_CM_VELOCITY},
                             {"Torque", VOCAB_CM_TORQUE},
                             {"PWM", VOCAB_CM_PWM},
                             {"Current", VOCAB_CM_CURRENT}}) {
        const std::string text = each.first;
        const int vocab = each.second;
        Pretended pretended;
        Look look;
        {
            Running run(driven(text, ", local: /tapped"));
            run.set("u", target);
            os::BufferedPort<os::Bottle> tap;
            ASSERT_TRUE(tap.open("/tap"));
            // One listener alone: YARP 3.5 does not bear two threads that write one list.
            const std::string commands = "/tapped/icubSim/left_leg/command:o";
            ASSERT_TRUE(os::NetworkBase::disconnect(commands, "/icubSim/left_leg/command:i"));
            ASSERT_TRUE(os::NetworkBase::connect(commands, "/tap"));
            const bool is_angle = text.starts_with("Position") || text == "Velocity";
            const double factor = is_angle ? 1 / radians : 1;
            std::string given;
            Eigen::Vector3d came(99, 99, 99);
            tap.setStrict(true);
            const auto arrived = [&] {
                if (text == "Position") { // which is asked for, not streamed
                    double degrees[3] = {};
                    look.as<dev::IPositionControl>().getTargetPositions(degrees);
                    return look.is_in(vocab) && std::abs(degrees[0] - 0.2 * factor) < 1e-9 &&
                           std::abs(degrees[1] + 0.3 * factor) < 1e-9;
                }
                while (const auto* message = tap.read(false)) {
                    given = message->toString(); // a command that ends with the joints, and the values
                    const auto *command = message->get(0).asList(), *values = message->get(1).asList();
                    if (command == nullptr || values == nullptr) continue;
                    const auto& joints = command->get(command->size() - 1);
                    for (std::size_t i = 0; i < values->size(); ++i) {
                        const int joint =
                            joints.isList() ? joints.asList()->get(i).asInt32() : joints.asInt32();
                        if (joint >= 0 && joint < 3) came[joint] = values->get(i).asFloat64();
                    }
                }
                return look.is_in(vocab) && (came - factor * Eigen::Vector3d(0.2, -0.3, 0.1)).norm() < 1e-9;
            };
            EXPECT_TRUE(steps_until(run, arrived)) << text << run.simulation.failure() << " " << given;
        }
        EXPECT_TRUE(waits_until([&] { return look.is_in(VOCAB_CM_POSITION); })) << text << " is let go";
    }
}

TEST_F(YarpRobot, EndsTheRunWhenAnotherProgramTakesAJoint) {
    Pretended pretended;
    Look look;
    Running run(driven("Torque"));
    run.set("u", target);
    EXPECT_TRUE(steps_until(run, [&] { return look.is_in(VOCAB_CM_TORQUE); }));
    for (int k = 0; k < 500; ++k) {
        ASSERT_TRUE(run.step()) << "it is left alone: " << run.simulation.failure();
    }
    ASSERT_TRUE(look.as<dev::IControlMode>().setControlMode(0, VOCAB_CM_IDLE));
    EXPECT_FALSE(steps_until(run, [] { return false; }));
    expect_contains(run.simulation.failure(), "drive: u[hip] has left its control mode");
}

TEST_F(YarpRobot, HasTheSpeedsOfItsTrajectoriesBackAfterwards) {
    Pretended pretended;
    Look look;
    double before[3] = {11, 12, 13}, now[3] = {};
    ASSERT_TRUE(look.as<dev::IPositionControl>().setRefSpeeds(before));
    const auto are = [&](double hip) {
        return waits_until([&] {
            return look.as<dev::IPositionControl>().getRefSpeeds(now) && std::abs(now[0] - hip) < 1e-9;
        });
    };
    {
        std::string text = driven("Position");
        text.replace(text.find("control_type: Position"), 22, "reference_speed: 0.5, control_type: Position");
        Running run(text);
        for (int k = 0; k < 40; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
        }
        EXPECT_TRUE(are(0.5 / radians)) << now[0];
    }
    EXPECT_TRUE(are(11)) << now[0];
}

TEST_F(YarpRobot, IsInMetresWhereItsJointsArePrismatic) {
    Pretended pretended;
    Look look("rail");
    Running run("model: m\nplugins: [Yarp, WholeBodyToolbox]\nstep: 0.005\nblocks:\n"
                "  robot: {block: Yarp/Robot, joints: \"{'slide', 'wheel'}\", boards: \"{'rail'}\", "
                "start_timeout: 20, silence: 5}\n"
                "  s: {block: WholeBodyToolbox/GetMeasurement}\n"
                "  u: {block: Constant, value: [0.05, 0.2]}\n"
                "  drive: {block: WholeBodyToolbox/SetReferences, control_type: Position Direct}\n"
                "connections: {u: drive}\n");
    const Eigen::Vector2d target(0.05, 0.2);
    EXPECT_TRUE(steps_until(run, [&] { return (run.get("s.y") - Matrix(target)).norm() < 1e-9; }))
        << run.simulation.failure() << run.get("s.y");
    double theirs[2] = {};
    ASSERT_TRUE(look.as<dev::IEncoders>().getEncoders(theirs));
    EXPECT_NEAR(theirs[0] * radians, 0.2, 1e-9);
    EXPECT_NEAR(theirs[1], 0.05, 1e-9);
}

TEST_F(YarpRobot, TellsLimitsInRadians) {
    Pretended pretended;
    Look look;
    Running run(robot() +
                "  positions: {block: WholeBodyToolbox/GetLimits, limit_type: ControlBoardPosition}\n"
                "  speeds: {block: WholeBodyToolbox/GetLimits, limit_type: ControlBoardVelocity}\n");
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    const int theirs[3] = {2, 0, 1};
    constexpr double none = std::numeric_limits<double>::infinity();
    for (int j = 0; j < 3; ++j)
        for (const auto& [signal, get] : {std::pair("positions", &dev::IControlLimits::getLimits),
                                          {"speeds", &dev::IControlLimits::getVelLimits}}) {
            double minimum = -none, maximum = none;
            double low = 0, high = 0;
            if ((look.as<dev::IControlLimits>().*get)(theirs[j], &low, &high)) {
                minimum = low * radians;
                maximum = high * radians;
            }
            EXPECT_DOUBLE_EQ(run.get(signal + std::string(".minimum"))(j), minimum) << signal;
            EXPECT_DOUBLE_EQ(run.get(signal + std::string(".maximum"))(j), maximum) << signal;
        }
}

TEST_F(YarpRobot, TakesGainsAndMotorParametersAndHasItsOwnBackAfterwards) {
    Pretended pretended;
    Look look;
    dev::Pid before[3], now[3];
    for (int j = 0; j < 3; ++j) before[j].kp = 10 + j;
    before[1].max_int = 77;
    ASSERT_TRUE(look.as<dev::IPidControl>().setPids(dev::VOCAB_PIDTYPE_POSITION, before));
    const auto has = [&](double hip) {
        return look.as<dev::IPidControl>().getPids(dev::VOCAB_PIDTYPE_POSITION, now) && now[0].kp == hip;
    };
    dev::MotorTorqueParameters motor;
    {
        Running run(
            robot() +
            "  pid: {block: WholeBodyToolbox/SetLowLevelPID, P: [100 200 300], I: [0 0 0], D: [1 2 3]}\n"
            "  motors: {block: WholeBodyToolbox/SetMotorParameters, set_P: false, set_k_tau: true, k_tau: [2 "
            "3 4]}\n"
            "  read: {block: WholeBodyToolbox/GetLowLevelPIDs}\n");
        EXPECT_TRUE(steps_until(run, [&] { return has(200); })) << run.simulation.failure();
        EXPECT_EQ(now[2].kp, 100) << "the ankle is the diagram's first joint";
        EXPECT_EQ(now[2].kd, 1);
        EXPECT_EQ(now[1].max_int, 77) << "what the diagram does not set stays";
        EXPECT_EQ(run.get("read.P"), Matrix(Eigen::Vector3d(100, 200, 300)));
        EXPECT_TRUE(steps_until(run, [&] {
            return look.as<dev::ITorqueControl>().getMotorTorqueParams(0, &motor) && motor.ktau == 3;
        })) << motor.ktau;
    }
    EXPECT_TRUE(waits_until([&] { return has(10); })) << now[0].kp;
    EXPECT_TRUE(look.as<dev::ITorqueControl>().getMotorTorqueParams(0, &motor));
    EXPECT_NE(motor.ktau, 3);
}

/// The board without a step for a while: its joints are taken back, and the run is told.
TEST_F(YarpRobot, IsTakenBackFromADiagramThatHangs) {
    Pretended pretended;
    Look look;
    std::string quick = driven("Torque");
    quick.replace(quick.find("silence: 5"), 10, "silence: 0.1");
    Running hanging(quick);
    EXPECT_TRUE(steps_until(hanging, [&] { return look.is_in(VOCAB_CM_TORQUE); }));
    usleep(150'000);
    EXPECT_TRUE(waits_until([&] { return look.is_in(VOCAB_CM_POSITION); }));
    while (hanging.step()) continue;
    expect_contains(hanging.simulation.failure(), "YARP robot 'icubSim': ");
    expect_contains(hanging.simulation.failure(), "its joints were taken back, since no step came for 0.1 s");
}

TEST_F(YarpRobot, TakesNothingFromTheHeapInAStep) {
    if (!bf::test::heap_is_counted()) GTEST_SKIP();
    Pretended pretended;
    Running run(driven("Torque"));
    for (int k = 0; k < 30; ++k) {
        const long before = bf::test::heap_calls();
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        if (k > 0) {
            ASSERT_EQ(bf::test::heap_calls(), before);
        }
    }
}

TEST_F(YarpRobot, ReadsSensorsThatStreamAndThoseOfAServer) {
    Pretended pretended;
    os::BufferedPort<os::Bottle> wrench, inertial;
    ASSERT_TRUE(wrench.open("/icubSim/left_foot/analog:o"));
    ASSERT_TRUE(inertial.open("/icubSim/inertial"));
    Running run(robot(", boards: \"{'left_leg'}\", wrenches: \"{'foot=/icubSim/left_foot/analog:o'}\", imus: "
                      "\"{'imu=/icubSim/inertial', 'sensorName=/icubSim/imu'}\"") +
                "  w: {block: WholeBodyToolbox/GetSensor, sensor: foot}\n"
                "  i: {block: WholeBodyToolbox/GetSensor, kind: imu, sensor: imu}\n"
                "  j: {block: WholeBodyToolbox/GetSensor, kind: imu, sensor: sensorName}\n");
    EXPECT_TRUE(steps_until(run, [&] {
        for (auto& [port, count] : {std::pair(&wrench, 6), {&inertial, 12}}) {
            auto& message = port->prepare();
            message.clear();
            for (int i = 1; i <= count; ++i) message.addFloat64(i);
            port->write(true);
        }
        return run.get("w.y")(5) == 6 && run.get("i.y")(11) == 12 && run.get("j.y").norm() > 0;
    })) << run.simulation.failure();
    EXPECT_EQ(run.get("w.y")(0), 1);
    EXPECT_NEAR(run.get("i.y")(1), 2 * radians, 1e-12) << "angles are degrees there";
    EXPECT_EQ(run.get("i.y")(4), 5);
    EXPECT_NEAR(run.get("i.y")(7), 8 * radians, 1e-12);
    const Matrix server = run.get("j.y");
    EXPECT_TRUE(server.allFinite()) << server;
}

TEST_F(YarpRobot, SaysWhatIsMissing) {
    Pretended pretended;
    expect_contains(refusal(robot("")), "argument 'boards' is empty; name the robot's control boards");
    expect_contains(refusal(middleware::test::waiting(robot(", boards: \"{'right_leg'}\""), "2")),
                    "robot: YARP robot 'icubSim': there is no control board at /icubSim/right_leg within "
                    "start_timeout (2 s); start the robot's interface, or correct robot and boards");
    for (const std::string name : {"", "/x", "x/", "a b", "a//b"}) {
        expect_contains(refusal(robot(", boards: \"{'left_leg'}\", robot: '" + name + "'")),
                        "argument 'robot' is '" + name +
                            "'; write what its ports are called, without / at both ends, of letters, digits "
                            "and _-./, such as icubSim");
        expect_contains(refusal(robot(", boards: \"{'left_leg', '" + name + "'}\"")),
                        "argument 'boards' has '" + name + "'; write what its ports are called");
    }
    std::string wrong = robot();
    wrong.replace(wrong.find("'knee'"), 6, "'nee'");
    expect_contains(refusal(wrong), "robot: YARP robot 'icubSim': its control boards");
    expect_contains(refusal(robot(", boards: \"{'left_leg'}\", wrenches: \"{'foot=/nowhere'}\"")),
                    "the sensor 'foot' at /nowhere: there is no such port, and none at /nowhere/measures:o; "
                    "give sensors as name=/port");
    expect_contains(refusal(robot(", boards: \"{'left_leg'}\", wrenches: \"{'foot'}\"")),
                    "the sensor 'foot' is not given as name=/port");
}

// ---- streams, clock and simulators

namespace {

std::string network(const std::string& blocks, const std::string& connections = "", int inputs = 0) {
    return "model: m\nplugins: [Yarp, WholeBodyToolbox]\nstep: 0.01\n" +
           (inputs > 0 ? "inputs: {u: {shape: " + std::to_string(inputs) + "}}\n" : std::string()) +
           "blocks:\n  network: {block: Yarp/Network}\n" + blocks +
           (connections.empty() ? "" : "connections: {" + connections + "}\n");
}
std::string reading(const std::string& settings) {
    return network("  x: {block: WholeBodyToolbox/StreamRead" + settings + "}\n");
}
/// YARP's end of a stream.
struct Sender {
    explicit Sender(const std::string& name) { port.open(name); }
    void send(const std::vector<double>& values, double time = 0) {
        os::Bottle message;
        for (const double value : values) message.addFloat64(value);
        if (time > 0) {
            os::Stamp stamp(++count, time);
            port.setEnvelope(stamp);
        }
        port.write(message);
    }
    os::Port port;
    int count = 0;
};

} // namespace

TEST_F(YarpStreams, ReadTheNewestMessageWithItsStamp) {
    Pretended pretended;
    Sender sender("/sender");
    Running run(reading(", stream: /sender, size: 2"));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("x.y"), Matrix(Eigen::Vector2d(0, 0))) << "before the first";
    for (int k = 1; k <= 3; ++k) sender.send({1.0 * k, 2.0 * k}, 100 + k);
    EXPECT_TRUE(steps_until(run, [&] { return usleep(1000) == 0 && run.get("x.y")(1) == 6; }))
        << run.simulation.failure();
    EXPECT_EQ(run.get("x.timestamp"), Matrix(Eigen::Vector2d(3, 103)));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.get("x.y")(0), 3) << "without a new one, the last";
    sender.send({1, 2, 3});
    bool goes_on = true;
    for (int k = 0; k < 1000 && goes_on; ++k, usleep(1000)) goes_on = run.step();
    expect_contains(run.simulation.failure(), "x: a message has 3 elements, but argument 'size' is 2");
    Running wrong(reading(", stream: /sender, size: 2, wait_for_data: true, timeout: 20"));
    sender.send({1, std::nan("")});
    EXPECT_FALSE(wrong.step());
    expect_contains(wrong.simulation.failure(), "x: stream '/sender' (YARP port /sender): message ");
    expect_contains(wrong.simulation.failure(),
                    " brings nan as element 2 of 2; look at what its sender computes");
}

TEST_F(YarpStreams, OpenThePortThatNobodyHas) {
    Pretended pretended;
    expect_contains(
        refusal(reading(", stream: /nobody")),
        "x: nobody sends '/nobody'; start the other program first, or set error_on_missing to false");
    Running run(reading(", stream: /ours, autoconnect: false"));
    ASSERT_TRUE(run.step());
    EXPECT_EQ(run.scalar("x.is_connected"), 0);
    Sender sender("/sender");
    ASSERT_TRUE(os::NetworkBase::connect("/sender", "/ours"));
    sender.send({7});
    EXPECT_TRUE(steps_until(run, [&] { return usleep(1000) == 0 && run.scalar("x.is_connected") == 1; }));
    EXPECT_EQ(run.scalar("x.y"), 7);
    expect_contains(refusal(reading(", stream: ours")), "the port 'ours' needs a name that begins with /");
}

TEST_F(YarpStreams, WaitForAMessage) {
    Pretended pretended;
    Sender sender("/sender");
    Running run(reading(", stream: /sender, wait_for_data: true, timeout: 0.05"));
    sender.send({4});
    ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_EQ(run.scalar("x.y"), 4);
    EXPECT_FALSE(run.step());
    expect_contains(run.simulation.failure(),
                    "x: stream '/sender' (YARP port /sender): no message came within the timeout of 0.05 s; "
                    "look whether its sender runs, or raise timeout");
}

TEST_F(YarpStreams, WriteToWhoListens) {
    Pretended pretended;
    os::BufferedPort<os::Bottle> listener;
    listener.setStrict(true);
    ASSERT_TRUE(listener.open("/listener"));
    Running run(network("  x: {block: WholeBodyToolbox/StreamWrite, stream: /listener, autoconnect: true}\n",
                        "u: x", 2));
    for (int k = 1; k <= 3; ++k) {
        run.set("u", Eigen::Vector2d(k, -k));
        const long before = bf::test::heap_calls();
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        if (k > 1) {
            EXPECT_EQ(bf::test::heap_calls(), before);
        }
        os::Bottle* message = nullptr;
        ASSERT_TRUE(waits_until([&] { return (message = listener.read(false)) != nullptr; }));
        ASSERT_EQ(message->size(), 2U);
        EXPECT_EQ(message->get(0).asFloat64(), k);
        EXPECT_EQ(message->get(1).asFloat64(), -k);
        os::Stamp stamp;
        EXPECT_TRUE(listener.getEnvelope(stamp) && stamp.isValid());
    }
    expect_contains(
        refusal(network("  x: {block: WholeBodyToolbox/StreamWrite, stream: /alone, autoconnect: true}\n",
                        "u: x", 2)),
        "x: nobody receives '/alone'; start the other program first");
}

TEST_F(YarpStreams, HaveTheTimeOfYarp) {
    Pretended pretended;
    Running run(network("  t: {block: WholeBodyToolbox/NetworkClock}\n"));
    const double before = os::Time::now();
    ASSERT_TRUE(run.step());
    EXPECT_GE(run.scalar("t.y"), before);
    EXPECT_LE(run.scalar("t.y"), os::Time::now());
}

/// One diagram steps another one, and YARP's own client asks it.
TEST_F(YarpStreams, StepASimulatorAndAreSteppedAsOne) {
    Pretended pretended;
    expect_contains(refusal(network("  s: {block: WholeBodyToolbox/SimulatorSynchronizer, timeout: 0.1}\n")),
                    "s: no simulator answers at '/clock/rpc' within 0.1 s; start the one that serves it");
    Running simulator(
        "model: m\nplugins: [Yarp, WholeBodyToolbox]\nstep: 0.002\nblocks:\n  network: {block: "
        "Yarp/Network}\n  c: {block: WholeBodyToolbox/SimulatorClock}\n  t: {block: Constant}\n");
    std::atomic<bool> goes_on{true};
    std::atomic<int> steps{0};
    std::thread thread([&] {
        while (goes_on && simulator.step()) ++steps;
    });
    {
        Running run(network("  s: {block: WholeBodyToolbox/SimulatorSynchronizer}\n"));
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        int before = steps;
        for (int k = 0; k < 10; ++k) {
            ASSERT_TRUE(run.step()) << run.simulation.failure();
            before += 5;
            EXPECT_NEAR(steps, before, 1) << "10 ms are five steps of 2 ms";
        }
        os::RpcClient client;
        ASSERT_TRUE(client.open("/asks") && os::NetworkBase::connect("/asks", "/clock/rpc"));
        os::Bottle question, answer;
        question.fromString("getStepSize");
        ASSERT_TRUE(client.write(question, answer));
        EXPECT_EQ(answer.get(0).asFloat64(), 0.002);
        question.fromString("getSimulationTime");
        ASSERT_TRUE(client.write(question, answer));
        const double time = answer.get(0).asFloat64();
        question.fromString("stepSimulationAndWait 7");
        ASSERT_TRUE(client.write(question, answer));
        question.fromString("getSimulationTime");
        ASSERT_TRUE(client.write(question, answer));
        EXPECT_NEAR(answer.get(0).asFloat64() - time, 0.014, 1e-9);
        question.fromString("what");
        ASSERT_TRUE(client.write(question, answer));
        EXPECT_NE(answer.toString().find("stepSimulationAndWait N"), std::string::npos);
    }
    const int before = steps;
    EXPECT_TRUE(waits_until([&] { return steps > before + 100; })) << "it runs freely again";
    goes_on = false;
    thread.join();
}

TEST_F(YarpRobot, LeavesNothingBehindHoweverOftenItStarts) {
    Pretended pretended;
    middleware::test::expect_no_leak([] {
        Running run(driven("Position Direct"));
        ASSERT_TRUE(run.step()) << run.simulation.failure();
    });
}

TEST_F(YarpStreams, LeaveNothingBehindHoweverOftenTheyStart) {
    Pretended pretended;
    Sender sender("/sender");
    middleware::test::expect_no_leak([&] {
        Running run(reading(", stream: /sender"));
        sender.send({4});
        ASSERT_TRUE(run.step()) << run.simulation.failure();
    });
}

} // namespace bf::yarp::test

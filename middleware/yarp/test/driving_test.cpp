// Who drives a world of `bf serve --yarp`: in which units, one diagram alone, and until it has left.
#include "bf/middleware/clock.hpp"
#include "patience.hpp"
#include "serving.hpp"

#include <functional>
#include <yarp/dev/IAxisInfo.h>

namespace bf::yarp::test {

/// The joint `cart` is prismatic; behind YARP it is in m, m/s and N, its motor before the gear, too, and the
/// `pole`, which turns, in degrees.
TEST_F(YarpServe, HasPrismaticJointsInMetres) {
    const std::string urdf = write("cart_pole.urdf", R"(<robot name="cart_pole"><link name="rail"/>
  <link name="cart_link"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="rod"><inertial><origin xyz="0 0 0.5"/><mass value="0.1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="cart" type="prismatic"><axis xyz="1 0 0"/><parent link="rail"/><child link="cart_link"/><limit lower="-2" upper="3" effort="100" velocity="5"/></joint>
  <joint name="pole" type="revolute"><axis xyz="0 1 0"/><parent link="cart_link"/><child link="rod"/><limit lower="-1.5" upper="2.5" effort="100" velocity="5"/></joint></robot>)");
    const std::string robot = "  robot: {block: WholeBodyToolbox/Configuration, robot: \"'" + urdf +
                              "'\", joints: \"{'pole', 'cart'}\"}\n",
                      world = "  world: {block: WholeBodyToolbox/MujocoWorld, floating_base: false, floor: "
                              "false, period: 0.001, gear_ratio: [20 10]}\n",
                      model = write("cart_pole.yaml", diagram(robot + world));
    const auto looks = [](const std::string& drive) {
        std::string blocks = drive + "  limits: {block: WholeBodyToolbox/GetLimits, limit_type: "
                                     "ControlBoardPosition}\n";
        for (const std::string what : {"Joints Position", "Joints Velocity", "Joints Acceleration",
                                       "Joints Torque", "Motor Position", "Motor Velocity"}) {
            std::string name = what;
            name[name.find(' ')] = '_';
            blocks +=
                "  " + name + ": {block: WholeBodyToolbox/GetMeasurement, measured_type: " + what + "}\n";
        }
        return blocks;
    };
    const std::string torques = looks("  c: {block: Constant, value: [-0.1 2]}\n  drive: {block: "
                                      "WholeBodyToolbox/SetReferences, control_type: Torque}\n");
    {
        const auto served = serve(model, {});
        ASSERT_TRUE(is_there("/clock/rpc"));
        Client board("remote_controlboard", "/icubSim/body", "/test/body");
        Clock clock;
        const Eigen::Vector2d theirs(degrees, 1); // for one of ours
        dev::JointTypeEnum kinds[2] = {};
        std::string name;
        ASSERT_TRUE(board.as<dev::IAxisInfo>().getJointType(0, kinds[0]) &&
                    board.as<dev::IAxisInfo>().getJointType(1, kinds[1]) &&
                    board.as<dev::IAxisInfo>().getAxisName(1, name));
        EXPECT_EQ(kinds[0], dev::VOCAB_JOINTTYPE_REVOLUTE);
        EXPECT_EQ(kinds[1], dev::VOCAB_JOINTTYPE_PRISMATIC);
        EXPECT_EQ(name, "cart");
        double low[2] = {}, high[2] = {};
        for (int j = 0; j < 2; ++j)
            ASSERT_TRUE(board.as<dev::IControlLimits>().getLimits(j, &low[j], &high[j]));
        EXPECT_EQ(low[1], -2);
        EXPECT_EQ(high[1], 3);
        EXPECT_NEAR(high[0], 2.5 * degrees, 1e-9);

        Running direct(diagram(robot + world + torques, "  c: drive\n"));
        int modes[2] = {VOCAB_CM_TORQUE, VOCAB_CM_TORQUE};
        const double forces[2] = {-0.1, 2};
        double values[2] = {}, stamps[2] = {};
        ASSERT_TRUE(board.as<dev::IControlMode>().setControlModes(modes) &&
                    board.as<dev::ITorqueControl>().setRefTorques(forces));
        ASSERT_TRUE(waits_until(
            [&] { return board.as<dev::ITorqueControl>().getRefTorques(values) && values[1] == 2; }));
        ASSERT_TRUE(direct.step()); // shows the time 0
        clock.ask("stepSimulationAndWait 200");
        for (int k = 0; k < 200; ++k) ASSERT_TRUE(direct.step());
        ASSERT_TRUE(waits_until([&] {
            return board.as<dev::IEncodersTimed>().getEncodersTimed(values, stamps) && stamps[0] > 0.1995;
        }));
        const auto is_as = [&](const std::string& what) {
            const Eigen::Vector2d ours = direct.get(what + ".y");
            EXPECT_GT(std::abs(ours[1]), 1e-3) << what;
            EXPECT_LT((Eigen::Map<Eigen::Vector2d>(values) - ours.cwiseProduct(theirs)).norm(), 1e-9) << what;
        };
        is_as("Joints_Position");
        ASSERT_TRUE(board.as<dev::IEncoders>().getEncoderSpeeds(values));
        is_as("Joints_Velocity");
        ASSERT_TRUE(board.as<dev::IEncoders>().getEncoderAccelerations(values));
        is_as("Joints_Acceleration");
        ASSERT_TRUE(board.as<dev::IMotorEncoders>().getMotorEncoders(values));
        is_as("Motor_Position");
        ASSERT_TRUE(board.as<dev::IMotorEncoders>().getMotorEncoderSpeeds(values));
        is_as("Motor_Velocity");
        ASSERT_TRUE(board.as<dev::ITorqueControl>().getTorques(values));
        EXPECT_LT(
            (Eigen::Map<Eigen::Vector2d>(values) - Eigen::Vector2d(direct.get("Joints_Torque.y"))).norm(),
            1e-9)
            << "in Nm and N";

        // 0.4 m/s for half a second; the pole stays where it is led to.
        ASSERT_TRUE(board.as<dev::IControlMode>().setControlMode(0, VOCAB_CM_POSITION) &&
                    board.as<dev::IControlMode>().setControlMode(1, VOCAB_CM_POSITION) &&
                    board.as<dev::IPositionControl>().setRefSpeed(1, 0.4) &&
                    board.as<dev::IPositionControl>().positionMove(1, 1.5));
        double target = 0;
        ASSERT_TRUE(waits_until([&] {
            return board.as<dev::IPositionControl>().getTargetPosition(1, &target) && target == 1.5;
        }));
        const auto cart = [&](double time) {
            EXPECT_TRUE(waits_until([&] {
                return board.as<dev::IEncodersTimed>().getEncodersTimed(values, stamps) &&
                       stamps[1] > time - 5e-4;
            }));
            return values[1];
        };
        clock.ask("stepSimulationAndWait 500");
        const double before = cart(0.7);
        clock.ask("stepSimulationAndWait 500");
        EXPECT_NEAR(cart(1.2) - before, 0.2, 0.01);
    }
    // A diagram sees and moves it as in a world of its own.
    for (const std::string mode : {"Position, reference_speed: 0.3", "Velocity, reference_acceleration: 2"}) {
        SCOPED_TRACE(mode);
        const std::string blocks = looks(
            "  c: {block: Constant, value: [0.2 0.5]}\n  drive: {block: WholeBodyToolbox/SetReferences, "
            "control_type: " +
            mode + "}\n");
        const auto served = serve(model, {});
        ASSERT_TRUE(is_there("/clock/rpc"));
        Running direct(diagram(robot + world + blocks, "  c: drive\n"));
        Running run(diagram(robot + led_robot("body") + blocks, "  c: drive\n", "Yarp"));
        for (int k = 0; k < 300; ++k) {
            ASSERT_TRUE(direct.step());
            ASSERT_TRUE(run.step()) << run.simulation.failure();
        }
        for (const std::string what : {"Joints_Position.y", "Joints_Velocity.y", "Motor_Position.y",
                                       "Motor_Velocity.y", "limits.minimum", "limits.maximum"}) {
            EXPECT_LT((run.get(what) - direct.get(what)).norm(), 1e-9) << what;
            EXPECT_GT(std::abs(direct.get(what)(1)), 0.05) << what;
        }
        run.simulation.stop();
    }
}

namespace {

std::string driven(const std::string& mode, const std::string& settings, const std::string& joints = "") {
    const std::string values = joints.empty() ? "[0.1 -0.2 0.1]" : "0.1";
    return diagram((joints.empty() ? icub : "") +
                       "  world: {block: Yarp/Robot, period: 0.001, timeout: 5, silence: 10, boards: "
                       "\"{'left_leg'}\"" +
                       (joints.empty() ? "" : ", joints: \"{'" + joints + "'}\"") + settings +
                       "}\n  c: {block: Constant, value: " + values +
                       "}\n  drive: {block: WholeBodyToolbox/SetReferences, control_type: " + mode + "}\n",
                   "  c: drive\n", "Yarp");
}
const std::vector<std::string> by_the_clock{"--realtime", "--priority", "0", "--watchdog",
                                            "0",          "--silence",  "60"};

/// Steps until all joints are in that mode.
bool leads_to(Running& run, const std::function<bool()>& is_so) {
    for (int k = 0; k < 20'000; ++k) {
        if (is_so()) return true;
        if (!run.step()) return false;
    }
    return false;
}

} // namespace

TEST_F(YarpServe, IsLimpOnceAControllerIsLostAndNotBefore) {
    auto limp = by_the_clock;
    limp.insert(limp.end(), {"--on-loss", "limp"});
    const std::vector<std::pair<std::string, int>> modes = {{"Velocity", VOCAB_CM_VELOCITY},
                                                            {"Torque", VOCAB_CM_TORQUE},
                                                            {"Position Direct", VOCAB_CM_POSITION_DIRECT}};
    for (const auto& [mode, its] : modes) {
        SCOPED_TRACE(mode);
        std::filesystem::remove(folder_ / "said");
        const auto served = serve(limp);
        ASSERT_TRUE(is_there("/clock/rpc"));
        Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg");
        EXPECT_TRUE(waits_until([&] { return are_in(board, VOCAB_CM_POSITION); })) << "nobody was lost";
        {
            Running run(driven(mode, ", start_timeout: 60"));
            ASSERT_TRUE(leads_to(run, [&, &its = its] { return are_in(board, its); }))
                << run.simulation.failure();
            const double end = middleware::now() + 1; // the server has seen who drives it
            EXPECT_TRUE(leads_to(run, [&] { return middleware::now() > end; })) << run.simulation.failure();
            run.simulation.stop();
        }
        EXPECT_TRUE(waits_until([&] { return are_in(board, VOCAB_CM_IDLE); }));
        usleep(500'000);
        EXPECT_TRUE(are_in(board, VOCAB_CM_IDLE)) << "what the controller gave back in the end is over";
        const std::string said = read("said"), left = "the controller has left; its joints are limp";
        expect_contains(said, left);
        EXPECT_EQ(said.find(left), said.rfind(left)) << said;
    }
}

TEST_F(YarpServe, IsNotDrivenByTwoDiagrams) {
    const auto served = serve(by_the_clock);
    ASSERT_TRUE(is_there("/clock/rpc"));
    Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg"); // which only looks
    const std::string next = driven("Position Direct", ", start_timeout: 60");
    {
        Running first(driven("Position Direct", ", start_timeout: 60, local: /first"));
        ASSERT_TRUE(leads_to(first, [&] { return are_in(board, VOCAB_CM_POSITION_DIRECT); }))
            << first.simulation.failure();
        middleware::test::expect_refusal_with(
            "YARP robot 'icubSim': the diagram with the port /first/icubSim/left_leg/rpc:o drives its "
            "joint 'l_hip_pitch'; end that one first, or give each diagram joints of its own",
            next);
        EXPECT_TRUE(are_in(board, VOCAB_CM_POSITION_DIRECT)) << "nothing was taken from the first one";
        EXPECT_TRUE(first.step()) << first.simulation.failure();
    }
    {
        Running after(next);
        EXPECT_TRUE(after.step()) << after.simulation.failure();
    }
    // One that was killed is none any more.
    Program killed({BF_PROGRAM, "run", write("drives.yaml", next), "--stop", "600", "--quiet"});
    ASSERT_TRUE(waits_until([&] { return are_in(board, VOCAB_CM_POSITION_DIRECT); }));
    killed.end();
    Running after(next);
    EXPECT_TRUE(after.step()) << after.simulation.failure();
}

TEST_F(YarpServe, IsDrivenByDiagramsThatHaveJointsOfTheirOwn) {
    const auto served = serve(by_the_clock);
    ASSERT_TRUE(is_there("/clock/rpc"));
    Running knee(driven("Position Direct", ", start_timeout: 60", "l_knee")),
        ankle(driven("Position Direct", ", start_timeout: 60", "l_ankle_roll"));
    Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg");
    int modes[3] = {};
    EXPECT_TRUE(leads_to(knee,
                         [&] {
                             return ankle.step() && board.as<dev::IControlMode>().getControlModes(modes) &&
                                    modes[1] == VOCAB_CM_POSITION_DIRECT &&
                                    modes[2] == VOCAB_CM_POSITION_DIRECT;
                         }))
        << knee.simulation.failure() << ankle.simulation.failure();
    EXPECT_EQ(modes[0], VOCAB_CM_POSITION);
}

TEST_F(YarpServe, MovesByWhatIsAskedStopsWhereItIsAndSpeedsUpAsIsAsked) {
    const auto served = serve();
    ASSERT_TRUE(is_there("/clock/rpc"));
    Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg");
    auto& position = board.as<dev::IPositionControl>();
    auto& velocity = board.as<dev::IVelocityControl>();
    Clock clock;
    clock.ask("stepSimulationAndWait 100");
    const Eigen::Vector3d start = positions(board, 0.1) * degrees;
    double target = 0;
    ASSERT_TRUE(position.setRefSpeed(0, 20) && position.setRefSpeed(1, 20) && position.relativeMove(0, 8) &&
                position.relativeMove(1, -20));
    ASSERT_TRUE(position.getTargetPosition(0, &target));
    EXPECT_NEAR(target, start[0] + 8, 1e-6);
    // The third joint has 10 degrees per second after half a second.
    double asked = 0;
    ASSERT_TRUE(board.as<dev::IControlMode>().setControlMode(2, VOCAB_CM_VELOCITY) &&
                velocity.setRefAcceleration(2, 20) && velocity.velocityMove(2, 10));
    ASSERT_TRUE(waits_until([&] { return velocity.getRefVelocity(2, &asked) && asked == 10; }));
    clock.ask("stepSimulationAndWait 500");
    const Eigen::Vector3d half = positions(board, 0.6) * degrees;
    EXPECT_NEAR(half[0] - start[0], 8, 1);
    EXPECT_NEAR(half[1] - start[1], -10, 2.5);
    EXPECT_GT(half[2] - start[2], 0.8);
    EXPECT_LT(half[2] - start[2], 2.6) << "led by a t^2 / 2, and it lags behind";
    ASSERT_TRUE(position.stop());
    ASSERT_TRUE(position.getTargetPosition(1, &target));
    EXPECT_NEAR(target, half[1], 1e-6);
    EXPECT_TRUE(velocity.getRefVelocity(2, &asked));
    EXPECT_EQ(asked, 0);
    clock.ask("stepSimulationAndWait 1000"); // in which the third joint slows down
    const Eigen::Vector3d stopped = positions(board, 1.6) * degrees;
    EXPECT_NEAR(stopped[1], half[1], 1);
    EXPECT_NEAR(stopped[2] - start[2], 5, 0.5);
    ASSERT_TRUE(board.as<dev::IControlMode>().setControlMode(2, VOCAB_CM_POSITION) &&
                position.getTargetPosition(2, &target));
    EXPECT_NEAR(target, stopped[2], 1e-6) << "it stays where it is when it goes over";
}

/// Somebody looks on all the while, whose coming and going is nothing.
TEST_F(YarpServe, NoticesByTheClockThatADiagramHasEndedOrWasKilledInAnyMode) {
    auto words = by_the_clock;
    words.push_back("--once");
    for (const std::string mode : {"Position", "Position Direct", "Velocity", "Torque"})
        for (const bool is_killed : {false, true}) {
            SCOPED_TRACE(mode + (is_killed ? ", killed" : ""));
            std::filesystem::remove(folder_ / "said");
            auto served = serve(words);
            ASSERT_TRUE(is_there("/clock/rpc"));
            auto gone = std::make_unique<Client>("remote_controlboard", "/icubSim/left_leg", "/test/gone");
            Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg");
            Program run({BF_PROGRAM, "run", write("drives.yaml", driven(mode, ", start_timeout: 60")),
                         "--stop", "600", "--quiet"});
            const int vocab = mode == "Position"          ? VOCAB_CM_POSITION
                              : mode == "Position Direct" ? VOCAB_CM_POSITION_DIRECT
                              : mode == "Velocity"        ? VOCAB_CM_VELOCITY
                                                          : VOCAB_CM_TORQUE;
            ASSERT_TRUE(waits_until(
                [&] { return are_in(board, vocab) && read("said").find("has come") != std::string::npos; }));
            gone.reset();
            usleep(300'000);
            EXPECT_EQ(read("said").find("has left"), std::string::npos) << read("said");
            if (is_killed) {
                run.end();
            } else {
                run.interrupt();
                run.wait();
            }
            EXPECT_TRUE(served.ends_well(30));
            expect_contains(read("said"), "the controller has left; its joints hold");
        }
}

TEST_F(YarpServe, NoticesByTheClockThatAProgramOfYarpHasLeft) {
    auto words = by_the_clock;
    words.push_back("--once");
    auto served = serve(words);
    ASSERT_TRUE(is_there("/clock/rpc"));
    {
        Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg");
        set_modes(board, VOCAB_CM_POSITION_DIRECT);
        usleep(300'000);
        EXPECT_EQ(read("said").find("has left"), std::string::npos) << read("said");
    }
    EXPECT_TRUE(served.ends_well(30));
    expect_contains(read("said"), "the controller has left; its joints hold");
}

/// As `echo "set pos 0 20" | yarp rpc /icubSim/left_leg/rpc:i` does.
TEST_F(YarpServe, LetsAJointGoOnToWhereACommandByHandHasSentIt) {
    const auto served = serve(by_the_clock);
    ASSERT_TRUE(is_there("/clock/rpc"));
    Client board("remote_controlboard", "/icubSim/left_leg", "/test/leg");
    {
        os::RpcClient hand;
        os::Bottle question, answer;
        ASSERT_TRUE(hand.open("/test/hand") &&
                    os::NetworkBase::connect("/test/hand", "/icubSim/left_leg/rpc:i"));
        question.fromString("[set] [pos] 0 10");
        ASSERT_TRUE(hand.write(question, answer));
        hand.close();
    }
    double angle = 0;
    EXPECT_TRUE(waits_until([&] {
        return board.as<dev::IEncoders>().getEncoder(0, &angle) && std::abs(angle - 10) < 1;
    })) << angle;
    EXPECT_EQ(read("said").find("has left"), std::string::npos) << read("said");
}

} // namespace bf::yarp::test

#include "BlockFactory/Core/Log.h"
#include "bf/physics/world.hpp"
#include "bf/recording/reader.hpp"
#include "bf/run/recorder.hpp"
#include "running.hpp"

#include <cmath>
#include <limits>
#include <unistd.h>

namespace bf::toolbox::test {
namespace {

const std::string home = "[0.033 0 0 -0.354 0.5 0 0.801 -0.354 0.5 0 0.801 0.208 0.011 -0.002 -0.499 -0.292 "
                         "-0.012 0.208 0.011 -0.002 "
                         "-0.5 -0.292 -0.012]";

const std::string robot =
    "  robot: {block: WholeBodyToolbox/Configuration, joints: \"" + icub_joints + "\"}\n";

std::string world(const std::string& settings = {}) {
    return "  world:\n    block: WholeBodyToolbox/MujocoWorld\n    feet: \"{'l_sole', 'r_sole'}\"\n    "
           "initial_joints: " +
           home + "\n" + settings;
}

/// tau = Kp (home - s) - Kd s_dot by blocks.
std::string pd() {
    return "  target: {block: Constant, value: " + home +
           "}\n"
           "  error: {block: Sum, signs: +-}\n"
           "  stiffness: {block: Gain, K: \"[300*ones(3, 1); 50*ones(8, 1); 400*ones(12, 1)]\"}\n"
           "  damping: {block: Gain, K: \"[6*ones(3, 1); 2*ones(8, 1); 8*ones(12, 1)]\"}\n"
           "  tau: {block: Sum, signs: +-}\n";
}
const std::string pd_lines =
    "  target: error.u1\n  error: stiffness\n  stiffness: tau.u1\n  damping: tau.u2\n";

/// Standing by joint PD, wired by the ports of the world.
const std::string by_ports = "model: m\nstep: 0.001\nblocks:\n" + robot + world() + pd() + "connections:\n" +
                             pd_lines + "  world.s: error.u2\n  world.s_dot: damping\n  tau: world.tau\n";

/// The same through what a real robot offers too.
const std::string by_robot =
    "model: m\nstep: 0.001\nblocks:\n" + robot + world() + pd() +
    "  s: {block: WholeBodyToolbox/GetMeasurement, measured_type: Joints Position}\n"
    "  s_dot: {block: WholeBodyToolbox/GetMeasurement, measured_type: Joints Velocity}\n"
    "  motors: {block: WholeBodyToolbox/SetReferences, control_type: Torque}\n"
    "connections:\n" +
    pd_lines + "  s: error.u2\n  s_dot: damping\n  tau: motors\n";

/// Appends all outputs of the world.
void observe(const Running& run, std::vector<double>& seen) {
    for (const char* output : {"s", "s_dot", "tau_measured", "w_H_b", "v_b", "com", "pose_l_sole",
                               "pose_r_sole", "wrench_l_sole", "wrench_r_sole"}) {
        const Matrix value = run.get("world." + std::string(output));
        seen.insert(seen.end(), value.data(), value.data() + value.size());
    }
}

std::string with_block(const std::string& block, const std::string& world_settings = {}) {
    return "model: m\nstep: 0.001\nblocks:\n" + robot + world(world_settings) +
           "  x: {block: WholeBodyToolbox/" + block + "}\n";
}

} // namespace

TEST(World, StandsUnderJointPdThroughBlocksOnly) {
    Running run(by_ports);
    ASSERT_TRUE(run.step());
    const Matrix start = run.get("world.com");
    for (int k = 0; k < 2000; ++k) ASSERT_TRUE(run.step()) << run.simulation.failure();
    EXPECT_LT((run.get("world.com") - start).norm(), 0.03);
    EXPECT_LT(run.get("world.s_dot").cwiseAbs().maxCoeff(), 0.05);
    // The feet carry the weight: the URDF's masses sum to it.
    const double carried = run.get("world.wrench_l_sole")(2) + run.get("world.wrench_r_sole")(2);
    EXPECT_NEAR(carried, 33.06 * 9.81, 2);
    EXPECT_NEAR(run.get("world.pose_l_sole")(2, 3), 0, 2e-3);
}

TEST(World, TerrainCarriesTheRobotAsTheFloorDoes) {
    // A box whose upper side is the plane z = 0 takes the place of the floor.
    const auto standing = [](const std::string& boxes) {
        const std::string file = temporary_file("terrain.xml", "<world>" + boxes + "</world>");
        std::string text = by_ports;
        text.replace(text.find(world()), world().size(),
                     world("    floor: false\n    terrain: " + file + "\n"));
        auto run = std::make_unique<Running>(text);
        for (int k = 0; k < 1500; ++k) EXPECT_TRUE(run->step()) << run->simulation.failure();
        return run;
    };
    Running floor(by_ports);
    for (int k = 0; k < 1500; ++k) ASSERT_TRUE(floor.step());
    const auto box = standing(R"(<box name="block" size="2 2 0.4" position="0 0 -0.2"/>)");
    EXPECT_LT((box->get("world.com") - floor.get("world.com")).norm(), 1e-4);
    EXPECT_LT((box->get("world.wrench_l_sole") - floor.get("world.wrench_l_sole")).norm(), 1);
    EXPECT_GT(box->get("world.wrench_l_sole")(2, 0), 100);
    const auto lower =
        standing(R"(<steps name="block" count="2" depth="2" width="2" height="0.1" position="-1 0 -0.12"/>)");
    EXPECT_NEAR(lower->get("world.com")(2, 0), floor.get("world.com")(2, 0) - 0.02, 0.003);
}

TEST(World, RefusesTerrainThatIsNone) {
    const auto with = [](const std::string& parts) {
        const std::string file = temporary_file("wrong.xml", "<world>\n" + parts + "</world>");
        return refusal("model: m\nstep: 0.001\nblocks:\n" + robot + world("    terrain: " + file + "\n"));
    };
    expect_contains(
        with(R"(<box name="parcel" mass="1"/>)"),
        "wrong.xml', line 2: object 'parcel': feet touch what is fixed to the world, and it has a mass");
    expect_contains(
        with(R"(<box name="chest"/>)"),
        "wrong.xml', line 2: object 'chest': a link, the world or an object before it has this name");
    expect_contains(with(R"(<box name="a"/><box name="a"/>)"), "object 'a': a link, the world or an object");
    const std::string urdf = temporary_file("wrong.urdf", R"(<robot name="r"><link name="base"/></robot>)");
    expect_contains(
        with("<robot name=\"second\" file=\"" + std::filesystem::path(urdf).filename().string() + "\"/>"),
        "line 2: robot 'second' is no terrain; take it out, or use a World");
    expect_contains(refusal("model: m\nstep: 0.001\nblocks:\n" + robot + world("    terrain: nowhere.xml\n")),
                    "cannot read the world '");
}

TEST(World, WithoutTorqueFalls) {
    Running run("model: m\nstep: 0.001\nblocks:\n" + robot + world());
    ASSERT_TRUE(run.step());
    const double height = run.get("world.com")(2);
    for (int k = 0; k < 1000; ++k) ASSERT_TRUE(run.step());
    EXPECT_LT(run.get("world.com")(2), height - 0.1);
}

TEST(World, MovesBitForBitAlikeByItsPortsAndThroughTheRobotInterface) {
    Running ports(by_ports), interface(by_robot);
    for (int k = 0; k < 300; ++k) {
        ASSERT_TRUE(ports.step()) << ports.simulation.failure();
        ASSERT_TRUE(interface.step()) << interface.simulation.failure();
        std::vector<double> a, b;
        observe(ports, a);
        observe(interface, b);
        ASSERT_EQ(a, b) << k;
    }
}

TEST(World, GivesMeasurementsOfTheStateThatItsPortsShow) {
    const std::string text =
        "model: m\nstep: 0.001\nblocks:\n" + robot + world() + pd() +
        "  torque: {block: WholeBodyToolbox/GetMeasurement, measured_type: Joints Torque}\n"
        "  acceleration: {block: WholeBodyToolbox/GetMeasurement, measured_type: Joints Acceleration}\n"
        "connections:\n" +
        pd_lines + "  world.s: error.u2\n  world.s_dot: damping\n  tau: world.tau\n";
    Running run(text);
    Matrix before;
    for (int k = 0; k < 50; ++k) {
        ASSERT_TRUE(run.step());
        EXPECT_EQ(run.get("torque"), run.get("world.tau_measured"));
        if (k > 1) { // v⁺ ≈ v + h a, but for the implicit part of the integration
            const Matrix change = run.get("world.s_dot") - before, expected = 0.001 * run.get("acceleration");
            EXPECT_LT((change - expected).norm(), 0.2 * expected.norm() + 0.01) << k;
        }
        before = run.get("world.s_dot");
    }
}

TEST(World, RunsUnderASlowerController) {
    // Physics at 1 ms, the controller at 10 ms: torques are held between its steps.
    std::string text = "model: m\nstep: 0.001\nblocks:\n" + robot + world("    armature: 0.1\n") +
                       "  controller:\n    execution: atomic\n    period: 0.01\n    inputs: [s, s_dot]\n    "
                       "outputs: [tau]\n    "
                       "blocks:\n";
    std::string inner = pd();
    inner.replace(inner.find("  tau:"), 6, "  sum:");
    for (std::size_t from = 0; from < inner.size();) {
        const auto to = inner.find('\n', from);
        text += "    " + inner.substr(from, to - from + 1);
        from = to + 1;
    }
    text +=
        "    connections:\n      target: error.u1\n      error: stiffness\n      stiffness: sum.u1\n      "
        "damping: "
        "sum.u2\n      s: error.u2\n      s_dot: damping\n      sum: tau\n"
        "connections:\n  world.s: controller.s\n  world.s_dot: controller.s_dot\n  controller: world.tau\n";
    Running run(text);
    Matrix tau;
    for (int k = 0; k < 2000; ++k) {
        ASSERT_TRUE(run.step()) << run.simulation.failure();
        const Matrix now = run.get("controller.sum.y");
        if (k % 10 != 0) {
            ASSERT_EQ(now, tau) << k;
        }
        tau = now;
    }
    EXPECT_GT(run.get("world.com")(2), 0.45);
}

TEST(World, TakesItsStepFromItsSampleTime) {
    // Free fall by v⁺ = v - g h, z⁺ = z + h v⁺: after k steps z = z0 - g h² k (k + 1) / 2.
    for (const std::string step : {"0.001", "0.002", "0.005"}) {
        Running run("model: m\nstep: " + step + "\nblocks:\n" + robot + world("    floor: false\n"));
        ASSERT_TRUE(run.step());
        const double start = run.get("world.com")(2), h = std::stod(step);
        for (int k = 1; k <= 40; ++k) {
            ASSERT_TRUE(run.step());
            EXPECT_NEAR(run.get("world.com")(2), start - 9.81 * h * h * k * (k + 1) / 2, 1e-5)
                << step << ' ' << k;
        }
    }
}

TEST(World, SinksDeeperIntoSofterGround) {
    const auto height = [](const std::string& settings) {
        std::string text = by_ports;
        text.replace(text.find("    initial_joints"), 0, settings);
        Running run(text);
        for (int k = 0; k < 500; ++k) EXPECT_TRUE(run.step()) << run.simulation.failure();
        return run.get("world.pose_l_sole")(2, 3);
    };
    const double firm = height(""),
                 soft = height("    solref: [0.02 1]\n    solimp: [0.8 0.8 0.001 0.5 2]\n");
    EXPECT_GT(firm, soft + 1e-4);
}

TEST(World, IsPushedByTheWrenchOfItsPort) {
    const std::string text =
        "model: m\nstep: 0.001\ninputs: {push: {shape: 6}}\nblocks:\n" + robot +
        "  world: {block: WholeBodyToolbox/MujocoWorld, floor: false, push_links: \"{'chest'}\"}\n"
        "connections: {push: world.push_chest}\n";
    Running run(text);
    Vector6 push = Vector6::Zero();
    push(1) = 33.06;
    run.set("push", push);
    Vector3 first, last;
    for (int k = 0; k < 101; ++k) {
        ASSERT_TRUE(run.step());
        if (k == 0) first = run.get("world.com");
    }
    last = run.get("world.com");
    EXPECT_NEAR(last(1) - first(1), 0.5 * 1.0 * 0.1 * 0.1, 2e-4) << "a = f/m = 1 m/s2";
    run.set("push", Vector6::Constant(std::numeric_limits<double>::infinity()));
    EXPECT_FALSE(run.step());
    EXPECT_EQ(run.simulation.failure(), "world: push wrench 1 is not finite; look at what computes it");
}

TEST(World, IsPulledByItsDisturbanceAndGoesOnAlikeFromASnapshot) {
    const std::string text = "model: m\nstep: 0.001\nblocks:\n" + robot +
                             "  world: {block: WholeBodyToolbox/MujocoWorld, floor: false}\n";
    Running run(text);
    ASSERT_TRUE(run.step());
    run.simulation.set_parameter("world.disturbance", {1, 0, 0, 0, 0, 33.06, 0});
    const auto snapshot = run.simulation.snapshot();
    const auto fallen = [&] {
        for (int k = 0; k < 101; ++k) EXPECT_TRUE(run.step());
        return Vector3(run.get("world.com"));
    };
    const Vector3 com = fallen();
    EXPECT_NEAR(com(1), 0.5 * 1.0 * 0.1 * 0.1, 5e-4) << "a = f/m = 1 m/s2";
    run.simulation.restore(snapshot);
    EXPECT_EQ(fallen(), com);
    run.simulation.set_parameter("world.disturbance", {-3, 0, 0, 0, 0, 0, 0});
    EXPECT_FALSE(run.step());
    EXPECT_EQ(run.simulation.failure(),
              "world: disturbance[1] is no disturbance; give the number of a body, a point and a force");
}

TEST(World, ReadsItsSensors) {
    const std::string sensors = "    ft_sensors: \"{'l_foot_ft_sensor', 'r_foot_ft_sensor'}\"\n";
    const std::string text = "model: m\nstep: 0.001\nblocks:\n" + robot + world(sensors) + pd() +
                             "  left: {block: WholeBodyToolbox/GetSensor, sensor: l_foot_ft_sensor}\n"
                             "  right: {block: WholeBodyToolbox/GetSensor, sensor: r_foot_ft_sensor}\n"
                             "  imu: {block: WholeBodyToolbox/GetSensor, kind: imu}\n"
                             "connections:\n" +
                             pd_lines + "  world.s: error.u2\n  world.s_dot: damping\n  tau: world.tau\n";
    Running run(text);
    for (int k = 0; k < 2000; ++k) ASSERT_TRUE(run.step());
    // What the legs carry is what the floor gives less the weight of the feet below the sensors.
    const double floor = run.get("world.wrench_l_sole")(2) + run.get("world.wrench_r_sole")(2);
    const double legs = run.get("left").topRows(3).norm() + run.get("right").topRows(3).norm();
    EXPECT_LT(legs, floor);
    EXPECT_GT(legs, floor - 40);
    const Matrix imu = run.get("imu");
    ASSERT_EQ(imu.size(), 12);
    EXPECT_NEAR(imu.block(3, 0, 3, 1).norm(), 9.81, 0.1) << "at rest it measures minus gravity";
    EXPECT_LT(imu.block(6, 0, 3, 1).norm(), 0.05);
    EXPECT_EQ(imu.block(9, 0, 3, 1).norm(), 0);
}

TEST(World, GivesItsLimits) {
    const auto limits = [](const std::string& type) { return with_block("GetLimits, limit_type: " + type); };
    Running model(limits("ModelPosition")), boards(limits("ControlBoardPosition")),
        speeds(limits("ControlBoardVelocity"));
    ASSERT_TRUE(model.step() && boards.step() && speeds.step());
    EXPECT_EQ(model.get("x.minimum"), boards.get("x.minimum"));
    EXPECT_EQ(model.get("x.maximum"), boards.get("x.maximum"));
    EXPECT_EQ(speeds.get("x.maximum"), Matrix::Constant(23, 1, std::numeric_limits<double>::infinity()));
    EXPECT_EQ(speeds.get("x.minimum"), -speeds.get("x.maximum"));
}

TEST(World, RefusesWhatItDoesNotHaveAndNamesTheRemedy) {
    const auto place = "model.yaml:9:3: x: ";
    const auto unknown = refusal(with_block("GetMeasurement, measured_type: Back EMF"));
    expect_contains(unknown, place);
    expect_contains(unknown, "Joints Position");
    const auto sensor = refusal(
        with_block("GetSensor, sensor: l_fot_ft_sensor", "    ft_sensors: \"{'l_foot_ft_sensor'}\"\n"));
    expect_contains(sensor, "has no force/torque sensor 'l_fot_ft_sensor'; did you mean 'l_foot_ft_sensor'?");
    expect_contains(sensor, "sensors: l_foot_ft_sensor; name it in the world's ft_sensors");
    expect_contains(refusal(with_block("GetSensor, sensor: any")),
                    "sensors: none; name it in the world's ft_sensors");
    expect_contains(refusal(with_block("GetSensor, kind: imu, sensor: head")),
                    "inertial sensor is on 'root_link', not on 'head'; name it in the world's imu_frame");
}

TEST(World, RefusesImpossibleArguments) {
    const auto text = [](const std::string& settings) {
        return refusal("model: m\nstep: 0.001\nblocks:\n" + robot +
                       "  world: {block: WholeBodyToolbox/MujocoWorld, " + settings + "}\n");
    };
    for (const auto& [settings, part] : std::vector<std::pair<std::string, std::string>>{
             {"feet: \"{'l_sol'}\"", "l_sol"},
             {"contact_points: [1 2]",
              "argument 'contact_points' has 2 columns; give rows x y z, foot x y z, or foot x y z a b c"},
             {"noise: [1 2]", "argument 'noise' has 2 elements; give three: position, velocity, torque"},
             {"initial_joints: [1 2]", "initial"},
             {"friction: -1", "friction"},
             {"solref: 0.01", "argument 'solref' has 1 elements; give two: time constant, damping ratio"},
             {"solref: [0 1]", "floor.solref is (0 1); time constant and damping ratio must be positive"},
             {"solimp: [0.9 0.95]", "argument 'solimp' has 2 elements; give five: impedance at the surface"},
             {"push_links: \"{'nobody'}\"", "nobody"},
             {"imu_frame: nowhere", "nowhere"}}) {
        expect_contains(text(settings), "model.yaml:5:3: world: ");
        expect_contains(text(settings), part);
    }
}

TEST(World, BlocksOverARobotNeedOne) {
    const auto text = refusal("model: m\nstep: 0.001\nblocks:\n" + robot +
                              "  x: {block: WholeBodyToolbox/GetMeasurement}\n");
    expect_contains(text, "x: needs a robot, and no enclosing subsystem has one");
}

TEST(World, ATorqueThatIsNotFiniteEndsTheRunAndTheRecordingIsReadable) {
    const std::string text =
        "model: m\nstep: 0.001\ninputs: {tau: {shape: 23}}\nblocks:\n" + robot + world() +
        "  motors: {block: WholeBodyToolbox/SetReferences}\nconnections: {tau: motors}\nrecord: "
        "[world.s]\n";
    const std::string file = testing::TempDir() + "toolbox_world_" + std::to_string(getpid()) + ".mcap";
    {
        Running run(text);
        Recorder recorder(run.simulation, run.simulation.quantities(run.diagram().record), file);
        run.simulation.add_observer(recorder);
        Vector tau = Vector::Zero(23);
        for (int k = 0; k < 20; ++k) ASSERT_TRUE(run.set("tau", tau).step());
        tau(4) = std::numeric_limits<double>::quiet_NaN();
        EXPECT_FALSE(run.set("tau", tau).step());
        EXPECT_EQ(run.simulation.failure(),
                  "motors: u[l_shoulder_roll] is not finite; look at what computes it");
        run.simulation.stop();
        recorder.close();
    }
    const auto recording = recording::load(file);
    EXPECT_TRUE(recording.complete) << recording.defect;
    EXPECT_EQ(recording.channel("world.s").samples(), 20u);

    Running ports("model: m\nstep: 0.001\ninputs: {tau: {shape: 23}}\nblocks:\n" + robot + world() +
                  "connections: {tau: world.tau}\n");
    Vector tau = Vector::Zero(23);
    ASSERT_TRUE(ports.step());
    tau(22) = -std::numeric_limits<double>::infinity();
    EXPECT_FALSE(ports.set("tau", tau).step());
    EXPECT_EQ(ports.simulation.failure(), "world: tau[r_ankle_roll] is not finite; look at what computes it");
}

TEST(World, StartsAgainAsTheFirstTime) {
    Running run(by_robot);
    std::vector<double> first, second;
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(run.step());
        observe(run, first);
    }
    run.simulation.stop();
    run.simulation.start();
    for (int k = 0; k < 20; ++k) {
        ASSERT_TRUE(run.step());
        observe(run, second);
    }
    EXPECT_EQ(first, second);
}

TEST(World, LeavesPhysicsUsableAfterItsPluginWasClosed) {
    physics::WorldOptions options;
    options.urdf = BF_SHARE "/iCub/robots/iCubGazeboV2_5/model.urdf";
    options.feet = {{"l_sole"}, {"r_sole"}};
    const double mass = physics::World(options).mass();
    EXPECT_EQ(refusal(by_ports), "");
    EXPECT_EQ(physics::World(options).mass(), mass);
}

TEST(World, HasNoiseOfItsOwnUnlessItIsGivenASeed) {
    const auto measured = [](const std::string& name, const std::string& seed) {
        std::string block = world("    noise: [1e-3 0 0]\n" + seed);
        block.replace(block.find("world:"), 5, name);
        Running run("model: m\nstep: 0.001\nblocks:\n" + robot + block + pd() + "connections:\n" + pd_lines +
                    "  " + name + ".s: error.u2\n  " + name + ".s_dot: damping\n  tau: " + name + ".tau\n");
        EXPECT_TRUE(run.step());
        return run.get(name + ".s");
    };
    EXPECT_EQ(measured("left", ""), measured("left", ""));
    EXPECT_NE(measured("left", ""), measured("right", ""));
    EXPECT_EQ(measured("left", "    seed: 3\n"), measured("right", "    seed: 3\n"));
}

TEST(World, CarriesAllOfARobotThatFallsWhereItIsAskedTo) {
    const auto height_after_a_fall = [](const std::string& settings) {
        Running run("model: m\nstep: 0.001\nblocks:\n" + robot + world(settings) +
                    "  limp: {block: Constant, value: \"zeros(23, 1)\"}\nconnections:\n  limp: world.tau\n");
        for (int k = 0; k < 3000; ++k)
            if (!run.step()) throw std::runtime_error(run.simulation.failure());
        return run.get("world.com")(2, 0);
    };
    EXPECT_LT(height_after_a_fall(""), 0);
    EXPECT_GT(height_after_a_fall("    touching: all\n"), 0.02);
}

TEST(World, WarnsOfASnapshotOfAnotherWorld) {
    using blockfactory::core::Log;
    const auto model = [](const std::string& settings) {
        return "model: m\nstep: 0.001\nblocks:\n" + robot + world(settings);
    };
    Running run(model("    seed: 1\n"));
    ASSERT_TRUE(run.step());
    const auto snapshot = run.simulation.snapshot();
    Log::getSingleton().clear();
    run.simulation.restore(snapshot);
    EXPECT_EQ(Log::getSingleton().getWarnings(), "");
    for (const std::string change : {"    seed: 2\n", "    seed: 1\n    friction: 0.5\n"}) {
        Running other(model(change));
        Log::getSingleton().clear();
        other.simulation.restore(snapshot);
        expect_contains(Log::getSingleton().getWarnings(),
                        "is of another world than its MujocoWorld describes now");
    }
    Log::getSingleton().clear();
}

TEST(World, ContinuesASnapshotWithQpAndFiltersBitForBit) {
    // Noise, a filter on the velocities, a trajectory for the torso, and a QP that bounds the torques.
    const std::string noisy = "    noise: [1e-5 1e-3 0]\n";
    const std::string text =
        "model: m\nstep: 0.001\nblocks:\n" + robot + world(noisy) + pd() +
        "  s: {block: WholeBodyToolbox/GetMeasurement}\n"
        "  filter: {block: WholeBodyToolbox/DiscreteFilter, filter_type: FirstOrderLowPassFilter, "
        "cut_frequency: 50}\n"
        "  smooth: {block: WholeBodyToolbox/MinimumJerkTrajectoryGenerator, settling_time: 0.5}\n"
        "  minus: {block: Gain, K: -1}\n"
        "  H: {block: Constant, value: eye(23), vector_1d: false}\n"
        "  low: {block: Constant, value: \"-15*ones(23, 1)\"}\n"
        "  high: {block: Constant, value: \"15*ones(23, 1)\"}\n"
        "  qp: {block: WholeBodyToolbox/QP, use_ubA: false, use_lb: true, use_ub: true, stop_when_fails: "
        "true}\n"
        "  motors: {block: WholeBodyToolbox/SetReferences}\n"
        "connections:\n"
        "  target: smooth.reference\n  smooth.position: error.u1\n  error: stiffness\n  stiffness: tau.u1\n"
        "  damping: tau.u2\n  s: error.u2\n  world.s_dot: filter\n  filter: damping\n  tau: minus\n  minus: "
        "qp.g\n"
        "  H: qp.H\n  low: qp.lb\n  high: qp.ub\n  qp.x: motors\n";
    const auto go = [](Running& run, int count) {
        std::vector<double> seen;
        for (int k = 0; k < count; ++k) {
            EXPECT_TRUE(run.step()) << run.simulation.failure();
            observe(run, seen);
            const Matrix x = run.get("qp.x");
            seen.insert(seen.end(), x.data(), x.data() + x.size());
        }
        return seen;
    };
    Running run(text), other(text);
    go(run, 150);
    const auto snapshot = run.simulation.snapshot();
    const auto expected = go(run, 100);
    run.simulation.restore(snapshot);
    EXPECT_EQ(run.simulation.steps(), 150);
    EXPECT_EQ(go(run, 100), expected);
    other.simulation.restore(snapshot);
    EXPECT_EQ(go(other, 100), expected) << "another run of the same model goes on from it too";
}

} // namespace bf::toolbox::test

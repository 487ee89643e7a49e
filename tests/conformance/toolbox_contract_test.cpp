// The contract of every block of the Whole-Body Toolbox. Blocks that need a robot are checked in a small
// diagram that has one.
#include "../../toolbox/test/running.hpp"
#include "../../toolbox/test/small_world.hpp"
#include "bf/analysis/gradient.hpp"
#include "bf/analysis/linearize.hpp"
#include "contract.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>
#include <unistd.h>

namespace bf::conformance {
namespace {

using toolbox::test::Blocks;
using toolbox::test::Running;
using toolbox::test::yaml;

/// Model and cost of a double integrator beside other arguments.
Arguments double_integrator(Arguments arguments) {
    const Matrix A = (Matrix(2, 2) << 1, 0.1, 0, 1).finished(), B = Eigen::Vector2d(0, 0.1);
    arguments.emplace_back("A", A);
    arguments.emplace_back("B", B);
    arguments.emplace_back("Q", Matrix(Matrix::Identity(2, 2)));
    arguments.emplace_back("R", Matrix(Matrix::Identity(1, 1)));
    return arguments;
}

/// Arguments of the blocks that stand alone. A QP has no bounds here: with some, a second call starts from
/// the solution of the first and may differ in the last bit.
const std::multimap<std::string, Arguments>& alone() {
    static const std::multimap<std::string, Arguments> all{
        {"QP", {{"use_ubA", false}}},
        {"QP", {{"use_ubA", false}, {"compute_objective", true}, {"stop_when_fails", true}}},
        {"QpOases", {{"use_ubA", false}, {"solver", "daqp"}}},
        {"Holder", {}},
        {"Errors", {}},
        {"MatchSignalSizes", {}},
        {"DampPinv", {}},
        {"TruncPinv", {}},
        {"HierarchicalQP",
         {{"tasks", std::vector<std::string>{"a", "b"}}, {"levels", Matrix(Eigen::RowVector2d(1, 2))}}},
        {"LQR", double_integrator({})},
        {"LQR", double_integrator({{"time", "continuous"}})},
        {"MPC", double_integrator({{"horizon", 4}, {"terminal", "Q"}})},
        {"MPC", double_integrator({{"horizon", 4}, {"form", "sparse"}, {"terminal", "Q"}})},
        {"MPC", double_integrator({{"horizon", 4}, {"limit_rates", true}, {"terminal", "Q"}})},
        {"JointTrajectory", {}},
        {"JointTrajectory", {{"timing", "minimum_jerk"}}},
        {"DiscreteFilter", {}},
        {"DiscreteFilter", {{"filter_type", "FirstOrderLowPassFilter"}, {"y0", 2.0}}},
        {"DiscreteFilter", {{"filter_type", "MedianFilter"}, {"order", 4}}},
        {"MinimumJerkTrajectoryGenerator", {}},
        {"MinimumJerkTrajectoryGenerator", {{"read_initial_value", true}}}};
    return all;
}

/// Arguments of the blocks that need a robot.
const std::multimap<std::string, Arguments>& over_a_robot() {
    using Names = std::vector<std::string>;
    static const std::multimap<std::string, Arguments> all{
        {"Configuration", {}},
        {"ForwardKinematics", {{"frame", "l_sole"}}},
        {"ForwardKinematics", {{"frame", "com"}}},
        {"CenterOfMass", {}},
        {"Jacobian", {{"frame", "l_sole"}}},
        {"Jacobian", {{"frame", "com"}}},
        {"DotJNu", {{"frame", "l_sole"}}},
        {"DotJNu", {{"frame", "com"}}},
        {"MassMatrix", {}},
        {"InverseDynamics", {}},
        {"ForwardDynamics", {}},
        {"ForwardDynamics", {{"frames", Names{"l_sole", "chest"}}}},
        {"GetBiasForces", {}},
        {"GetGravityForces", {}},
        {"GetCoriolisForces", {}},
        {"CoriolisMatrix", {}},
        {"MassMatrixDerivative", {}},
        {"CentroidalMomentum", {}},
        {"CentroidalTotalMomentumMatrix", {}},
        {"DotANu", {}},
        {"RelativeTransform", {{"frame1", "l_sole"}, {"frame2", "chest"}}},
        {"RelativeJacobian", {{"reference", "l_sole"}, {"frame", "chest"}}},
        {"InverseKinematics", {{"pose", Names{"l_sole"}}}},
        {"InverseKinematics",
         {{"position", Names{"l_sole", "chest"}}, {"com", true}, {"posture", true}, {"finds_base", true}}},
        {"CartesianTask", {{"frame", "l_sole"}}},
        {"CartesianTask", {{"frame", "l_sole"}, {"what", "position"}}},
        {"CenterOfMassTask", {}},
        {"MomentumTask", {}},
        {"PostureTask", {}},
        {"RigidContact", {{"frame", "l_sole"}}},
        {"RigidContact", {{"frame", "l_sole"}, {"contact", "point"}}},
        {"ContactLimits", {{"frame", "l_sole"}}},
        {"ContactLimits", {{"frame", "l_sole"}, {"contact", "point"}}},
        {"ContactLimits", {{"frame", "l_sole"}, {"form", "inequalities"}}},
        {"JointPID", {}},
        {"JointPID", {{"derivative", "filtered"}}},
        {"CartesianPID", {}},
        {"CartesianPID", {{"result", "velocity"}}},
        {"CartesianTrajectory", {}},
        {"CartesianTrajectory", {{"path", "screw"}}},
        {"JointImpedance", {}},
        {"JointImpedance", {{"compensation", "gravity"}}},
        {"CartesianImpedance", {{"frame", "l_sole"}}},
        {"MomentumObserver", {{"frames", Names{"l_sole"}}, {"known", Names{"r_sole"}}}},
        {"ContactWrenches",
         {{"sensors", Names{"l_foot_ft_sensor", "l_leg_ft_sensor"}}, {"contacts", Names{"l_sole", "chest"}}}},
        {"LegOdometry", {}},
        {"ContactEKF", {{"imu", "imu_frame"}}},
        {"JointLimits", {}},
        {"FootstepPlanner", {}},
        {"FootstepPlanner", {{"follow", "goal"}, {"preview", 2}, {"first_foot", "right"}}},
        {"DcmPlanner", {}},
        {"SwingFoot", {}},
        {"DcmController", {}},
        {"TaskSpaceInverseDynamics", {}},
        {"GetMeasurement", {}},
        {"GetMeasurement", {{"measured_type", "Joints Torque"}}},
        {"GetSensor", {{"sensor", "l_foot_ft_sensor"}}},
        {"GetSensor", {{"kind", "imu"}}},
        {"GetLimits", {}},
        {"GetLimits", {{"limit_type", "ControlBoardVelocity"}}},
        {"GetMeasurement", {{"measured_type", "Motor PWM"}}},
        {"GetLimits", {{"limit_type", "ModelVelocity"}}},
        {"SetReferences", {}},
        {"SetReferences", {{"control_type", "Position"}}},
        {"SetReferences", {{"control_type", "Velocity"}}},
        {"GetLowLevelPIDs", {}},
        {"SetLowLevelPID",
         {{"joints", Names{"r_knee"}}, {"set_P", false}, {"set_I", false}, {"set_D", false}}},
        {"SetMotorParameters", {{"set_I", true}, {"set_k_tau", true}, {"k_tau", 2.0}}},
        {"MujocoWorld",
         {{"feet", Names{"l_sole", "r_sole"}},
          {"ft_sensors", Names{"l_foot_ft_sensor"}},
          {"push_links", Names{"chest"}}}},
        {"World", {{"file", toolbox::test::small_world()}}},
        {"WorldRobot", {{"robot", "arm"}}},
        {"WorldObject", {{"object", "ball"}}},
        {"WorldActuator", {{"robot", "hand"}, {"actuator", "grip"}}},
        {"WorldPush", {{"robot", "arm"}, {"link", "bob"}}},
        {"WorldRays", {{"body", std::string("arm/bob")}}},
        {"WorldContact", {{"body", std::string("ball")}}},
        {"WorldTactile", {{"body", std::string("ball")}}},
        {"Configuration", {{"world_robot", "arm"}}}};
    return all;
}

/// Arguments of the blocks that need a network of streams, whose outputs depend on what happens outside.
const std::map<std::string, Arguments>& over_a_network() {
    static const std::map<std::string, Arguments> all{
        {"LocalStreams", {}},
        {"StreamRead", {{"size", 3}, {"error_on_missing", false}, {"autoconnect", false}}},
        {"StreamWrite", {}},
        {"NetworkClock", {}},
        {"RealTimeSynchronizer", {{"report", true}, {"clock", "network"}}},
        {"SimulatorClock", {}}};
    return all;
}

/// Blocks whose contract has tests of their own: an approximate solver goes on from where it was, and a
/// synchronizer needs a simulator.
const std::set<std::string> elsewhere{"OSQP", "SimulatorSynchronizer"};

bool arguments_name_a_world(const Arguments& arguments) {
    return std::any_of(arguments.begin(), arguments.end(),
                       [](const auto& a) { return a.first == "world_robot"; });
}

/// The block `x` beside a configuration and a world, its inputs those of the root.
std::string diagram_of(const BlockClass& block_class, const Arguments& arguments) {
    std::string inputs = "inputs:\n", connections = "connections:\n";
    const auto block = block_class.make(arguments);
    for (const auto& slot : block->resolution().slots) {
        if (slot.role != Role::input) continue;
        const bool is_pose = slot.name.starts_with("w_H_"), are_footholds = slot.name == "footholds";
        inputs += "  " + slot.name + ": {" +
                  (is_pose         ? "shape: \"[4 4]\""
                   : are_footholds ? "shape: \"[4 6]\""
                                   : "") +
                  "}\n";
        connections += "  " + slot.name + ": x." + slot.name + "\n";
    }
    const bool has_inputs = connections.size() > 13;
    std::string text = "model: m\nstep: 0.001\n" + (has_inputs ? inputs : "") + "blocks:\n";
    if (block_class.name.starts_with("World") || arguments_name_a_world(arguments)) {
        if (block_class.name != "World") text += yaml("world", "World", over_a_robot().find("World")->second);
    } else if (block_class.name != "Configuration") {
        text += "  robot: {block: WholeBodyToolbox/Configuration, joints: \"{'l_knee', 'r_knee', "
                "'torso_yaw'}\"}\n";
        if (block_class.name != "MujocoWorld")
            text += yaml("world", "MujocoWorld", over_a_robot().find("MujocoWorld")->second);
    }
    return text + yaml("x", block_class.name, arguments) + (has_inputs ? connections : "");
}

void randomise_inputs(Running& run, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-0.3, 0.3);
    for (const auto& port : run.diagram().inputs) {
        const Size size = run.diagram().slot(port.end).size;
        Matrix value = Matrix::NullaryExpr(size.rows, size.cols, [&] { return uniform(random); });
        if (port.path.starts_with("w_H_")) {
            value.topLeftCorner(3, 3).setIdentity();
            value.row(3) << 0, 0, 0, 1;
            if (port.path == "w_H_left") value(1, 3) += 0.7; // beside the right one
        }
        if (port.path == "step") value << 0.3 + uniform(random), 0.2, 0.5, 0.2, 0.5, 1, 3, 0; // of a walk
        run.set(port.path, value);
    }
}

/// Bytes of all outputs and states of a node.
std::vector<std::byte> state_of(const Running& run, int node) {
    std::vector<std::byte> all;
    const auto& slots = run.diagram().nodes[static_cast<std::size_t>(node)].block->resolution().slots;
    for (std::size_t i = 0; i < slots.size(); ++i) {
        if (slots[i].role != Role::output && slots[i].role != Role::discrete_state) continue;
        const auto* data =
            static_cast<const std::byte*>(run.simulation.context().data(node, static_cast<int>(i)));
        all.insert(all.end(), data, data + slots[i].size.count() * bytes(slots[i].type));
    }
    return all;
}

void check_in_diagram(const BlockClass& block_class, const Arguments& arguments) {
    SCOPED_TRACE(yaml(block_class.name, block_class.name, arguments));
    Running run(diagram_of(block_class, arguments));
    const int node = run.diagram().find_node("x");
    auto& context = run.simulation.context();
    const auto& slots = run.diagram().nodes[static_cast<std::size_t>(node)].block->resolution().slots;
    std::mt19937 random(1);
    randomise_inputs(run, random);

    if (context.activities(node, Phase::output) > 0) {
        const Task output = context.task(node, Phase::output, 0);
        std::vector<std::byte> seen[2];
        for (int round = 0; round < 2; ++round) {
            for (std::size_t i = 0; i < slots.size(); ++i)
                if (slots[i].role == Role::output)
                    detail::fill(context.data(node, static_cast<int>(i)), slots[i], detail::patterns[round]);
            const long heap = heap_calls();
            const Status status = output();
            EXPECT_EQ(heap_calls(), heap) << "output uses the heap";
            EXPECT_TRUE(bool(status)) << status.text();
            seen[round] = state_of(run, node);
        }
        EXPECT_EQ(seen[0], seen[1]) << "an output is left unwritten, or depends on something hidden";
    }
    const auto go = [&](unsigned seed) {
        std::mt19937 inputs(seed);
        std::vector<std::vector<std::byte>> seen;
        for (int k = 0; k < 5; ++k) {
            randomise_inputs(run, inputs);
            const long heap = heap_calls();
            const bool good = run.step();
            EXPECT_EQ(heap_calls(), heap) << "the step uses the heap";
            EXPECT_TRUE(good) << run.simulation.failure();
            seen.push_back(state_of(run, node));
        }
        return seen;
    };
    const auto first = go(2);
    const auto snapshot = run.simulation.snapshot();
    const auto went_on = go(3);
    run.simulation.restore(snapshot);
    EXPECT_EQ(go(3), went_on) << "after restoring a snapshot it goes on differently";
    run.simulation.stop();
    run.simulation.start();
    EXPECT_EQ(go(2), first) << "after a new start it runs differently";
}

void check_on_a_network(const std::string& name, const Arguments& arguments) {
    std::string text = "model: m\nstep: 0.001\n";
    if (name == "StreamWrite") text += "inputs: {u: {shape: 3}}\n";
    text += "blocks:\n";
    if (name != "LocalStreams")
        text += yaml("network", "LocalStreams", {{"domain", "contract-" + std::to_string(getpid())}});
    text += yaml("x", name, arguments);
    if (name == "StreamWrite") text += "connections: {u: x}\n";
    Running run(text);
    for (int round = 0; round < 2; ++round) {
        for (int k = 0; k < 5; ++k) {
            const long heap = heap_calls();
            const bool good = run.step();
            EXPECT_EQ(heap_calls(), heap) << "the step uses the heap";
            EXPECT_TRUE(good) << run.simulation.failure();
        }
        EXPECT_THROW(run.simulation.snapshot(), std::exception) << "what is outside cannot be saved";
        run.simulation.stop();
        run.simulation.start();
    }
}

std::vector<std::string> names() {
    Blocks blocks;
    blocks.load_plugin("WholeBodyToolbox");
    std::vector<std::string> all;
    for (const auto& block_class : blocks.classes())
        if (block_class->library == "WholeBodyToolbox") all.push_back(block_class->name);
    return all;
}

class EveryToolboxBlock : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Blocks, EveryToolboxBlock, testing::ValuesIn(names()),
                         [](const auto& instance) { return instance.param; });

TEST_P(EveryToolboxBlock, KeepsTheContract) {
    Blocks blocks;
    const BlockClass& block_class = blocks.find("WholeBodyToolbox/" + GetParam());
    EXPECT_FALSE(block_class.doc.empty());
    Verdict described;
    detail::check_description(test::RunBlock(block_class, {}), GetParam(), described);
    for (const auto& sentence : described.broken) ADD_FAILURE() << sentence;

    const auto [first, last] = alone().equal_range(GetParam());
    for (auto i = first; i != last; ++i)
        for (const auto& sentence : check_contract(block_class, i->second).broken) ADD_FAILURE() << sentence;
    const auto [begin, end] = over_a_robot().equal_range(GetParam());
    for (auto i = begin; i != end; ++i) check_in_diagram(block_class, i->second);
    const auto on_network = over_a_network().find(GetParam());
    if (on_network != over_a_network().end()) check_on_a_network(GetParam(), on_network->second);
    EXPECT_TRUE(first != last || begin != end || on_network != over_a_network().end() ||
                elsewhere.count(GetParam()))
        << "say how the block is wired";
}

/// Derivatives of the block `x` by all inputs of the root, as its declaration has them, beside central
/// differences; names what has none of its own. Each takes a step: where that changes states, it is the same
/// one.
std::vector<std::string> compare_derivatives(Running& run, bool has_states = false) {
    const auto& nodes = run.diagram().nodes;
    const auto& x = nodes[static_cast<std::size_t>(run.diagram().find_node("x"))];
    analysis::LinearizeOptions options{.all_states = true};
    for (const auto& slot : x.block->resolution().slots)
        if (slot.role == Role::output && slot.type == Type::float64) options.to.push_back("x." + slot.name);
    const auto here = has_states ? run.simulation.snapshot() : std::vector<std::byte>();
    const auto exact = analysis::linearize(run.simulation, options);
    if (has_states) run.simulation.restore(here);
    options.by_differences = true;
    const auto differenced = analysis::linearize(run.simulation, options);
    const auto expect_near = [&](const Matrix& a, const Matrix& b) {
        if (a.size() == 0) return;
        const double scale = 1 + b.cwiseAbs().maxCoeff();
        EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-6 * scale) << x.type;
    };
    expect_near(exact.A, differenced.A);
    expect_near(exact.B, differenced.B);
    expect_near(exact.C, differenced.C);
    expect_near(exact.D, differenced.D);
    EXPECT_FALSE(differenced.differenced.empty());
    return exact.differenced;
}

TEST(Derivatives, OfRigidBodyBlocksAreExactOnFloatingAndFixedBases) {
    Blocks blocks;
    int compared = 0;
    for (const std::string base : {"", ", floating_base: false"})
        for (const auto& [name, arguments] : over_a_robot()) {
            const auto& block_class = blocks.find("WholeBodyToolbox/" + name);
            if (block_class.group != "rigid body" || name == "InverseKinematics") continue;
            SCOPED_TRACE(yaml(name, name, arguments) + base);
            std::string text = diagram_of(block_class, arguments);
            const std::string joints = "'torso_yaw'}\"";
            text.insert(text.find(joints) + joints.size(), base);
            if (!base.empty()) text.erase(text.find("  world:"), text.find("  x:") - text.find("  world:"));
            Running run(text);
            std::mt19937 random(3);
            randomise_inputs(run, random);
            for (const auto& port : run.diagram().inputs)
                if (port.path == "w_H_b") {
                    Matrix pose = Matrix::Identity(4, 4);
                    pose.topLeftCorner(3, 3) =
                        Eigen::AngleAxisd(0.7, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
                    pose.topRightCorner(3, 1) = Vector3(0.3, -0.2, 0.6);
                    run.set("w_H_b", pose);
                }
            EXPECT_TRUE(compare_derivatives(run).empty());
            ++compared;
        }
    EXPECT_EQ(compared, 42);
}

TEST(Derivatives, OfMinimumJerkFiltersAreExactFromTheFirstStepOn) {
    for (const std::string arguments : {"", ", read_initial_value: true",
                                        ", compute_first_derivative: false, compute_second_derivative: false",
                                        ", read_external_settling_time: true",
                                        ", read_external_settling_time: true, "
                                        "reset_on_settling_time_change: true"}) {
        SCOPED_TRACE(arguments);
        const bool has_initial = arguments.find("initial") != std::string::npos,
                   has_time = arguments.find("external") != std::string::npos;
        Running run("model: m\nstep: 0.1\ninputs: {u: {shape: 3}" +
                    std::string(has_initial ? ", start: {shape: 3}" : "") + (has_time ? ", T: {}" : "") +
                    "}\nblocks:\n  x: {block: WholeBodyToolbox/MinimumJerkTrajectoryGenerator" + arguments +
                    "}\nconnections: {u: x.reference" + (has_initial ? ", start: x.initial" : "") +
                    (has_time ? ", T: x.settling" : "") + "}\n");
        run.set("u", Vector3(1, -2, 0.5));
        if (has_initial) run.set("start", Vector3(0.2, 0.1, -3));
        if (has_time) run.set("T", 2);
        // In the first step it rests, whatever its states; differences would move the one that tells which it
        // is.
        const auto first = analysis::linearize(run.simulation, {.from = {"u"}, .to = {"x.position"}});
        EXPECT_TRUE(first.differenced.empty());
        if (!has_initial) {
            EXPECT_LT((first.D - Matrix::Identity(3, 3)).norm(), 1e-12);
        }
        EXPECT_TRUE(compare_derivatives(run, true).empty());
        for (int k = 0; k < 4; ++k) ASSERT_TRUE(run.step());
        run.set("u", Vector3(2, 2, -1));
        if (has_time) run.set("T", 1.5);
        EXPECT_TRUE(compare_derivatives(run, true).empty());
    }
}

TEST(Derivatives, OfQuadraticProgramsFollowTheirActiveConstraints) {
    Matrix known;
    for (const std::string block : {"QP", "QpOases", "QP, solver: proxqp"}) {
        SCOPED_TRACE(block);
        Running run("model: m\nstep: 0.1\ninputs:\n  H: {shape: \"[3 3]\"}\n  g: {shape: 3}\n"
                    "  A: {shape: \"[2 3]\"}\n  lbA: {shape: 2}\n  ubA: {shape: 2}\n  ub: {shape: 3}\n"
                    "blocks:\n  x: {block: WholeBodyToolbox/" +
                    block +
                    ", use_lbA: true, use_ub: true, compute_objective: true}\n"
                    "connections: {H: x.H, g: x.g, A: x.A, lbA: x.lbA, ubA: x.ubA, ub: x.ub}\n");
        // The first row of A is met from below, the second is free; the third element of x is at its bound.
        run.set("H", (Matrix(3, 3) << 3, 1, 0, 1, 2, 0.5, 0, 0.5, 1).finished());
        run.set("g", Vector3(1, -1, -4));
        run.set("A", (Matrix(2, 3) << 1, 1, 0, 1, -1, 1).finished());
        run.set("lbA", Eigen::Vector2d(1, -10)).set("ubA", Eigen::Vector2d(9, 10));
        run.set("ub", Vector3(5, 5, 0.5));
        if (block.find("proxqp") == std::string::npos) {
            EXPECT_TRUE(compare_derivatives(run).empty());
            known = analysis::linearize(run.simulation, {.to = {"x.x"}}).D;
        } else { // whose iterations end too early for differences
            const auto found = analysis::linearize(run.simulation, {.to = {"x.x"}});
            EXPECT_TRUE(found.differenced.empty());
            EXPECT_LT((found.D - known).cwiseAbs().maxCoeff(), 1e-4);
        }
        EXPECT_NEAR(run.get("x.x")(2), 0.5, 1e-6);
        EXPECT_NEAR(run.get("x.x")(0) + run.get("x.x")(1), 1, 1e-6);
    }
}

TEST(Derivatives, OfAQuadraticProgramAtACornerAreOneSidedAndNamed) {
    Running run("model: m\nstep: 0.1\ninputs:\n  H: {}\n  g: {}\n  lb: {}\nblocks:\n  x: {block: "
                "WholeBodyToolbox/QP, "
                "use_ubA: false, use_lb: true}\nconnections: {H: x.H, g: x.g, lb: x.lb}\n");
    run.set("H", 1).set("g", 0).set("lb", 0); // the bound is met, and nothing pushes
    const auto at_corner = analysis::linearize(run.simulation, {.to = {"x.x"}});
    EXPECT_EQ(at_corner.kinks, std::vector<std::string>{"x"});
    EXPECT_EQ(at_corner.D, (Matrix(1, 3) << 0, -1, 0).finished()) << "to the side where the bound is left";
    run.set("g", 1);
    const auto at_bound = analysis::linearize(run.simulation, {.to = {"x.x"}});
    EXPECT_TRUE(at_bound.kinks.empty());
    EXPECT_EQ(at_bound.D, (Matrix(1, 3) << 0, 0, 1).finished());
}

/// A pendulum in a physics world under sampled feedback through the robot's interface, and what it costs.
const std::string pendulum_in_a_world = R"m(
model: m
step: 0.002
blocks:
  robot: {block: WholeBodyToolbox/Configuration, robot: "'FILE'", joints: [swing], floating_base: false}
  world: {block: WholeBodyToolbox/MujocoWorld, floor: false, initial_joints: 0.4}
  s: {block: WholeBodyToolbox/GetMeasurement, measured_type: Joints Position, period: 0.01}
  s_dot: {block: WholeBodyToolbox/GetMeasurement, measured_type: Joints Velocity, period: 0.01}
  K: {block: Gain, period: 0.01, K: -3}
  D: {block: Gain, period: 0.01, K: -0.4}
  tau: {block: Sum, signs: ++, period: 0.01}
  act: {block: WholeBodyToolbox/SetReferences, control_type: Torque}
  error: {block: Square}
connections: {s: K, s_dot: D, K: tau.u1, D: tau.u2, tau: act, world.s: error}
)m";

/// What a run costs with these values of parameters.
double cost_of_run(Running& run, const std::string& cost, int steps,
                   const std::vector<std::pair<std::string, std::vector<double>>>& parameters) {
    for (const auto& [name, values] : parameters) run.simulation.set_parameter(name, values);
    run.simulation.start();
    double total = 0;
    const auto end = run.diagram().find_signal(cost);
    struct Look final : Run::Observer {
        std::function<void()> look;
        void observe(const Run&) noexcept override { look(); }
    } seen;
    seen.look = [&] {
        total += run.diagram().step *
                 read_value(run.simulation.context().data(end.node, end.slot), Type::float64, 0);
    };
    run.simulation.add_observer(seen);
    for (int k = 0; k < steps; ++k) EXPECT_TRUE(run.step());
    run.simulation.remove_observer(seen);
    run.simulation.stop();
    return total;
}

TEST(Gradients, GoThroughAPhysicsWorldAndWhatIsMeasuredAndCommandedThroughIt) {
    auto text = pendulum_in_a_world;
    const auto folder = std::filesystem::path(toolbox::test::small_world()).parent_path();
    text.replace(text.find("FILE"), 4, (folder / "arm.urdf").string());
    Running run(text);
    const auto found =
        analysis::gradient(run.simulation, {.by = {"K.K", "D.K"}, .cost = "error", .duration = 0.6});
    EXPECT_FALSE(found.is_adjoint);
    EXPECT_EQ(found.differenced, (std::vector<std::string>{"world", "s", "s_dot", "act"}));
    EXPECT_EQ(found.cost, cost_of_run(run, "error", 300, {}));
    for (int i = 0; i < 2; ++i) {
        const double at = i == 0 ? -3 : -0.4, step = 1e-4;
        const std::string name = i == 0 ? "K.K" : "D.K";
        const double above = cost_of_run(run, "error", 300, {{name, {at + step}}}),
                     below = cost_of_run(run, "error", 300, {{name, {at - step}}});
        cost_of_run(run, "error", 1, {{name, {at}}});
        EXPECT_NEAR(found.slopes[i], (above - below) / (2 * step), 1e-6 * std::abs(found.slopes[i])) << name;
        EXPECT_GT(std::abs(found.slopes[i]), 1e-3);
    }
    // Of a derivative that is exact alone it is refused, by name.
    try {
        analysis::gradient(run.simulation, {.by = {"K.K"}, .cost = "error", .by_rules_alone = true});
        FAIL();
    } catch (const RunError& error) {
        toolbox::test::expect_contains(error.what(), "its derivative is not known step by step");
    }
}

TEST(Gradients, OfABalancingHumanoidGoThroughContactsAndTheQuadraticProgram) {
    Blocks blocks;
    ElaborateOptions pushed; // so that contact forces change by much
    pushed.overrides = {{"scenario", "2"}, {"Push.at_y", "0.05"}};
    const auto diagram = elaborate(
        formats::read_yaml(BF_SOURCE_DIRECTORY "/examples/icub_balancing/balancing.yaml"), blocks, pushed);
    Simulation simulation(diagram);
    const std::string path = "controller.momentum_rate.";
    constexpr double duration = 0.4;
    const auto found = analysis::gradient(
        simulation,
        {.by = {path + "K_p.K[2]", path + "K_d.K[2]"}, .cost = "checks.distance", .duration = duration});
    const auto cost = [&](int i, double by) {
        const std::string name = found.names[static_cast<std::size_t>(i)];
        const auto bracket = name.find('[');
        const auto end = diagram.find_parameter(name.substr(0, bracket));
        auto* const values = static_cast<double*>(simulation.context().data(end.node, end.slot));
        double& value = values[std::stoi(name.substr(name.rfind('[') + 1)) - 1];
        const double before = std::exchange(value, value + by);
        simulation.start();
        double total = 0;
        const auto signal = diagram.find_signal("checks.distance");
        for (int k = 0; k < std::lround(duration / diagram.step); ++k) {
            EXPECT_TRUE(simulation.step());
            total += diagram.step *
                     *static_cast<const double*>(simulation.context().data(signal.node, signal.slot));
        }
        simulation.stop();
        value = before;
        return total;
    };
    EXPECT_NEAR(found.cost, cost(0, 0), 1e-12 * found.cost);
    // Whole runs differ by what contacts make of small changes, too.
    for (int i = 0; i < 2; ++i) {
        const double step = 1e-2 * found.at[i];
        const double difference = (cost(i, step) - cost(i, -step)) / (2 * step);
        EXPECT_NEAR(found.slopes[i], difference, 0.06 * std::abs(difference))
            << found.names[static_cast<std::size_t>(i)];
    }
}

TEST(QP, SolvesWithActiveBoundsWithoutTheHeap) {
    Blocks blocks;
    test::RunBlock run(blocks.find("WholeBodyToolbox/QP"), {{"use_ubA", false}, {"use_lb", true}});
    run.wire("H", test::matrix_size(3, 3))
        .wire("g", test::vector_size(3))
        .wire("lb", test::vector_size(3))
        .start();
    run.set("H", Matrix(Matrix::Identity(3, 3))).set("lb", Matrix(Vector3::Zero()));
    for (int k = 0; k < 5; ++k) {
        run.set("g", Matrix(Vector3(1, -1, k - 2)));
        const long heap = heap_calls();
        ASSERT_TRUE(bool(run.step()));
        EXPECT_EQ(heap_calls(), heap);
        EXPECT_LT((run.get("x") - Vector3(0, 1, std::max(0, 2 - k))).norm(), 1e-12);
    }
}

TEST(Osqp, GoesOnFromASnapshotBitForBitWithoutTheHeap) {
    Blocks blocks;
    test::RunBlock run(blocks.find("WholeBodyToolbox/OSQP"), {{"use_ubA", false}, {"use_lb", true}});
    run.wire("H", test::matrix_size(3, 3))
        .wire("g", test::vector_size(3))
        .wire("lb", test::vector_size(3))
        .start();
    run.set("H", Matrix(Matrix::Identity(3, 3))).set("lb", Matrix(Vector3::Zero()));
    const auto go = [&] {
        std::vector<Matrix> seen;
        for (int k = 0; k < 5; ++k) {
            run.set("g", Matrix(Vector3(1, -1, k - 2)));
            const long heap = heap_calls();
            EXPECT_TRUE(bool(run.step()));
            EXPECT_EQ(heap_calls(), heap);
            seen.push_back(run.get("x"));
            EXPECT_EQ(run.get("status")(0), 1);
            EXPECT_LT((run.get("x") - Vector3(0, 1, std::max(0, 2 - k))).norm(), 2e-2);
        }
        return seen;
    };
    go();
    std::vector<std::byte> saved(run.context().snapshot_size());
    run.context().save(saved.data());
    const auto first = go();
    run.context().restore(saved.data());
    EXPECT_EQ(go(), first);
}

} // namespace
} // namespace bf::conformance

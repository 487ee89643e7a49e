// Every block of the Whole-Body Toolbox in Simulink's order of calls, compared with a diagram of our own.
#include "../../../../toolbox/test/running.hpp"
#include "../../../../toolbox/test/small_world.hpp"
#include "bf/boundary/positional.hpp"
#include "simstruct/model.hpp"

#include <cstring>
#include <map>
#include <random>
#include <set>
#include <unistd.h>

extern "C" const SimStructMethods simstruct_methods;

namespace bf::simulink {
namespace {

using simstruct::Model;
using toolbox::test::Blocks;
using toolbox::test::Running;
using toolbox::test::yaml;

constexpr double step = 0.001;

std::vector<mxArray*> parameters(const BlockClass& type, const Arguments& given) {
    std::vector<mxArray*> all{simstruct::text(type.name), simstruct::text(type.library)};
    for (const auto& wanted : boundary::positional_values(type)) {
        const auto found =
            std::find_if(given.begin(), given.end(), [&](const auto& a) { return a.first == wanted.name; });
        const Value& value = found == given.end() ? wanted.initial : found->second;
        if (wanted.goal == boundary::PositionalValue::Goal::period)
            all.push_back(simstruct::number(-1));
        else if (value.kind == Value::Kind::text)
            all.push_back(simstruct::text(value.text));
        else if (value.kind == Value::Kind::texts)
            all.push_back(simstruct::texts(value.texts));
        else if (value.type == Type::boolean)
            all.push_back(simstruct::logical(value.data.at(0) != 0));
        else
            all.push_back(simstruct::matrix(value.rows, value.cols, value.data));
    }
    return all;
}

Size size_of(const Running& run, const std::string& input) {
    for (const auto& port : run.diagram().inputs)
        if (port.path == input) return run.diagram().slot(port.end).size;
    throw std::runtime_error("no input " + input);
}

const Arguments robot{{"joints", std::vector<std::string>{"l_knee", "r_knee", "torso_yaw"}}};
const Arguments world{{"feet", std::vector<std::string>{"l_sole", "r_sole"}},
                      {"ft_sensors", std::vector<std::string>{"l_foot_ft_sensor"}},
                      {"push_links", std::vector<std::string>{"chest"}}};

const Arguments shared{{"file", toolbox::test::small_world()}};

/// Three states, one input, and a cost beside other arguments.
Arguments linear(Arguments arguments) {
    Matrix A = Matrix::Identity(3, 3);
    A(0, 1) = A(1, 2) = 0.1;
    arguments.emplace_back("A", A);
    arguments.emplace_back("B", Matrix(Vector3(0, 0, 0.1)));
    arguments.emplace_back("Q", Matrix(Matrix::Identity(3, 3)));
    arguments.emplace_back("R", 0.1);
    return arguments;
}

const std::multimap<std::string, Arguments>& cases() {
    static const std::multimap<std::string, Arguments> all{
        {"ForwardKinematics", {{"frame", "l_sole"}}},
        {"CenterOfMass", {}},
        {"Jacobian", {{"frame", "l_sole"}}},
        {"DotJNu", {{"frame", "com"}}},
        {"MassMatrix", {}},
        {"InverseDynamics", {}},
        {"ForwardDynamics", {{"frames", std::vector<std::string>{"l_sole", "r_sole"}}}},
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
        {"InverseKinematics",
         {{"position", std::vector<std::string>{"l_sole"}}, {"com", true}, {"posture", true}}},
        {"GetMeasurement", {{"measured_type", "Joints Velocity"}}},
        {"GetSensor", {{"sensor", "l_foot_ft_sensor"}}},
        {"GetLimits", {}},
        {"GetLimits", {{"limit_type", "ControlBoardVelocity"}}},
        {"SetReferences", {}},
        {"MujocoWorld", world},
        {"Configuration", {}},
        {"World", shared},
        {"WorldRobot", {{"robot", "arm"}}},
        {"WorldObject", {{"object", "ball"}}},
        {"WorldActuator", {{"robot", "hand"}, {"actuator", "grip"}}},
        {"WorldPush", {{"robot", "arm"}, {"link", "bob"}}},
        {"WorldRays", {{"body", std::string("arm/bob")}}},
        {"WorldContact", {{"body", std::string("ball")}}},
        {"WorldTactile", {{"body", std::string("ball")}}},
        {"QP", {}},
        {"QpOases", {}},
        {"OSQP", {}},
        {"GetLowLevelPIDs", {}},
        {"SetLowLevelPID", {{"set_P", false}, {"set_I", false}, {"set_D", false}}},
        {"SetMotorParameters", {{"set_k_tau", true}, {"k_tau", 2.0}}},
        {"LocalStreams", {}},
        {"StreamRead", {{"size", 2}, {"error_on_missing", false}}},
        {"StreamWrite", {}},
        {"RealTimeSynchronizer", {}},
        {"SimulatorClock", {}},
        {"Holder", {}},
        {"Errors", {}},
        {"MatchSignalSizes", {}},
        {"DampPinv", {}},
        {"TruncPinv", {}},
        {"CartesianTask", {{"frame", "l_sole"}, {"what", "position"}}},
        {"CenterOfMassTask", {}},
        {"MomentumTask", {}},
        {"PostureTask", {}},
        {"RigidContact", {{"frame", "l_sole"}}},
        {"ContactLimits", {{"frame", "l_sole"}}},
        {"JointLimits", {}},
        {"HierarchicalQP", {{"tasks", std::vector<std::string>{"a"}}, {"levels", 1.0}}},
        {"TaskSpaceInverseDynamics", {}},
        {"LQR", linear({})},
        {"MPC", linear({{"horizon", 4}, {"u_min", -0.1}})},
        {"JointPID", {{"P", 10.0}}},
        {"CartesianPID", {}},
        {"JointImpedance", {}},
        {"CartesianImpedance", {{"frame", "l_sole"}}},
        {"JointTrajectory", {}},
        {"CartesianTrajectory", {{"path", "screw"}}},
        {"MomentumObserver", {{"frames", std::vector<std::string>{"l_sole"}}}},
        {"ContactWrenches",
         {{"sensors", std::vector<std::string>{"l_foot_ft_sensor"}},
          {"contacts", std::vector<std::string>{"l_sole"}}}},
        {"LegOdometry", {}},
        {"FootstepPlanner", {}},
        {"DcmPlanner", {}},
        {"SwingFoot", {}},
        {"DcmController", {}},
        {"ContactEKF", {{"imu", "imu_frame"}}},
        {"DiscreteFilter", {{"filter_type", "MedianFilter"}}},
        {"MinimumJerkTrajectoryGenerator", {}}};
    return all;
}

/// A network of this test alone; two runs at once have one each, as a stream has one writer.
Arguments network(const char* whose) { return {{"domain", "simstruct-" + std::to_string(getpid()) + whose}}; }

TEST(SFunctionToolbox, RunsEveryBlockAsOurEngine) {
    Blocks blocks;
    blocks.load_plugin("WholeBodyToolbox");
    // A clock never tells the same twice, and a synchronizer needs a simulator that runs beside it.
    std::set<std::string> tried{"NetworkClock", "SimulatorSynchronizer"};
    for (const auto& [name, arguments] : cases()) {
        SCOPED_TRACE(name);
        tried.insert(name);
        const BlockClass& type = blocks.find("WholeBodyToolbox/" + name);
        const bool is_shared = name.starts_with("World"); // or in a world that robots share
        const bool is_world = name == "MujocoWorld" || name == "World";
        const std::string around = is_shared ? "World" : "MujocoWorld";
        const bool needs_network = name.starts_with("Stream") || name.starts_with("Simulator");
        const auto sized = type.make(arguments);
        const auto& slots = sized->resolution().slots;
        // The wired inputs: those of the world stay open.
        std::vector<std::string> inputs, outputs;
        for (const auto& slot : slots) {
            if (slot.role == Role::input && !is_world) inputs.push_back(slot.name);
            if (slot.role == Role::output) outputs.push_back(slot.name);
        }
        std::string text = "model: m\nstep: 0.001\n", wires = "connections:\n";
        if (!inputs.empty()) text += "inputs:\n";
        const std::map<std::string, std::string> shapes{
            {"w_H_b", "[4 4]"}, {"w_H_b_0", "[4 4]"},  {"H", "[2 2]"},          {"g", "[2]"},
            {"A", "[1 2]"},     {"w_H_f", "[4 4]"},    {"w_H_target", "[4 4]"}, {"w_H_0", "[4 4]"},
            {"target", "[3]"},  {"ubA", "[1]"},        {"reference", "[3]"},    {"u", "[3]"},
            {"a", "[2 5]"},     {"w_H_left", "[4 4]"}, {"w_H_right", "[4 4]"},  {"footholds", "[4 4]"}};
        for (const auto& input : inputs) {
            const auto shape = name == "WorldActuator" ? shapes.end() : shapes.find(input); // u is one number
            text += "  " + input + ": {" + (shape == shapes.end() ? "" : "shape: \"" + shape->second + "\"") +
                    "}\n";
            wires += "  " + input + ": tried." + input + "\n";
        }
        text += "blocks:\n";
        if (name != "Configuration" && !is_shared) text += yaml("robot", "Configuration", robot);
        if (!is_world && name != "Configuration") text += yaml("world", around, is_shared ? shared : world);
        if (needs_network) text += yaml("network", "LocalStreams", network("here"));
        text += yaml("tried", name, arguments) + (inputs.empty() ? "" : wires);
        Running here(text);

        Model there(simstruct_methods, step);
        // Blocks find what encloses them whatever the order in which Simulink comes to them.
        const int x = there.add("m/inner/x", parameters(type, arguments));
        if (name != "Configuration" && !is_shared)
            there.add("m/robot", parameters(blocks.find("WholeBodyToolbox/Configuration"), robot));
        int w = x;
        if (!is_world && name != "Configuration")
            w = there.add("m/world",
                          parameters(blocks.find("WholeBodyToolbox/" + around), is_shared ? shared : world));
        if (needs_network)
            there.add("m/network",
                      parameters(blocks.find("WholeBodyToolbox/LocalStreams"), network("there")));
        std::vector<int> sources;
        for (std::size_t i = 0; i < inputs.size(); ++i) {
            const Size size = size_of(here, inputs[i]);
            sources.push_back(there.add_input(size.rows, size.is_matrix ? size.cols : 0, SS_DOUBLE));
            there.connect(sources.back(), 0, x, static_cast<int>(i));
        }
        there.compile();
        there.start();

        std::mt19937 random(4);
        std::uniform_real_distribution<double> uniform(-0.3, 0.3);
        for (int k = 0; k < 5; ++k) {
            for (std::size_t i = 0; i < inputs.size(); ++i) {
                const Size size = size_of(here, inputs[i]);
                Matrix value = Matrix::NullaryExpr(size.rows, size.cols, [&] { return uniform(random); });
                if (inputs[i].starts_with("w_H_")) {
                    value.topLeftCorner(3, 3).setIdentity();
                    value.row(3) << 0, 0, 0, 1;
                    if (inputs[i] == "w_H_left") value(1, 3) += 0.7; // beside the right one
                }
                if (inputs[i] == "H") value = Matrix::Identity(size.rows, size.cols);
                if (inputs[i] == "step") value << 0.1, 0.2, 0.6, 0.2, 0.6, 1, 2, 0; // of a walk
                here.set(inputs[i], value);
                std::memcpy(there.input(sources[i]), value.data(),
                            static_cast<std::size_t>(value.size()) * sizeof(double));
            }
            ASSERT_TRUE(here.step()) << here.simulation.failure();
            ASSERT_NO_THROW(there.step());
            const auto compare = [&](const std::string& block, int number,
                                     const std::vector<std::string>& ports) {
                for (std::size_t i = 0; i < ports.size(); ++i) {
                    const auto wanted = here.diagram().find_signal(block + "." + ports[i]);
                    const Slot& slot = here.diagram().slot(wanted);
                    EXPECT_EQ(0, std::memcmp(there.output(number, static_cast<int>(i)),
                                             here.simulation.context().data(wanted.node, wanted.slot),
                                             static_cast<std::size_t>(slot.size.count() * bytes(slot.type))))
                        << ports[i] << ", step " << k;
                }
            };
            compare("tried", x, outputs);
            // What a block did to the robot shows in the world.
            if (w != x && is_shared) compare("world", w, {"q"});
            if (w != x && !is_shared) compare("world", w, {"s", "s_dot", "tau_measured"});
        }
        if (is_world) {
            mxArray* saved = there.save(x);
            there.step();
            const auto* s = static_cast<const double*>(there.output(x, 0));
            const std::vector<double> went_on(s, s + 3);
            there.step();
            there.restore(x, saved);
            mxDestroyArray(saved);
            there.step();
            EXPECT_EQ(std::vector<double>(s, s + 3), went_on)
                << "the world went on differently after a restore";
        }
    }
    for (const auto& known : blocks.classes()) {
        if (known->library != "WholeBodyToolbox") continue;
        EXPECT_TRUE(tried.count(known->name)) << known->name << " was not tried";
    }
}

TEST(SFunctionToolbox, SaysWhichResourceIsMissing) {
    Blocks blocks;
    const BlockClass& type = blocks.find("WholeBodyToolbox/MassMatrix");
    Model model(simstruct_methods, step);
    model.add("m/M", parameters(type, {}));
    // A robot beside the enclosing subsystem does not enclose the block.
    model.add("m/other/robot", parameters(blocks.find("WholeBodyToolbox/Configuration"), robot));
    try {
        model.compile();
        FAIL();
    } catch (const simstruct::Error& error) {
        EXPECT_NE(std::string(error.what())
                      .find("it needs a robot configuration: put a block that provides one into "
                            "its subsystem or one around it"),
                  std::string::npos)
            << error.what();
    }
}

TEST(SFunctionToolbox, NamesAnUnknownFrameWithThePathOfTheBlock) {
    Blocks blocks;
    Model model(simstruct_methods, step);
    model.add("m/robot", parameters(blocks.find("WholeBodyToolbox/Configuration"), robot));
    model.add("m/J", parameters(blocks.find("WholeBodyToolbox/Jacobian"), {{"frame", "l_sol"}}));
    try {
        model.compile();
        FAIL();
    } catch (const simstruct::Error& error) {
        const std::string text = error.what();
        EXPECT_EQ(text.find("m/J, mdlInitializeSizes: "), 0u) << text;
        EXPECT_NE(text.find("l_sole"), std::string::npos) << text;
    }
}

} // namespace
} // namespace bf::simulink

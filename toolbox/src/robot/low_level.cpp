// Gains of a robot's low-level loops and parameters of its motors.
#include "bf/base/names.hpp"
#include "bf/core/registry.hpp"
#include "robot/device_block.hpp"
#include "robot/robot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace bf::toolbox {

namespace {

constexpr std::array<std::pair<const char*, Loop>, 2> loops{
    {{"Position", Loop::position}, {"Torque", Loop::torque}}};

/// Base of the blocks over one of the loops.
class LoopBlock : public DeviceBlock {
  public:
    using DeviceBlock::DeviceBlock;

  protected:
    static AboutArgument<std::string> about_loop() {
        return {.initial = "Position",
                .doc = "the loop: Position (also behind Position Direct and Velocity) or Torque",
                .choices = choices(loops)};
    }
    static Loop loop_of(const std::string& control_type) {
        const auto* found = find(loops, control_type);
        return found ? *found : Loop::position;
    }
    Scratch<Gains> gains{this, [this] { return Gains(value(n)); }};

    template <class Given>
    static bool changed(Now at, const Given& given, const DiscreteState<Vector>& last) {
        return given.is_present() && at[given] != at[last];
    }

    /// Claims the gains of that letter, of one joint each.
    void claim(Inference& inference, bool is_set, const char* letter, const std::string& control_type,
               const std::vector<std::string>& joints) const {
        for (std::size_t i = 0; is_set && i < joints.size(); ++i)
            inference.claim({robot->identity(), std::string(letter) + " of joint '" + joints[i] +
                                                    "' in its " + control_type + " loop"});
    }
};

class GetLowLevelPIDs final : public LoopBlock {
  public:
    using LoopBlock::LoopBlock;
    Argument<std::string> control_type{this, "control_type", about_loop()};
    Output<Vector> P{this, "P", {.shape = {n}, .unit = any_unit, .doc = "proportional gains"}};
    Output<Vector> I{this, "I", {.shape = {n}, .unit = any_unit, .doc = "integral gains"}};
    Output<Vector> D{this, "D", {.shape = {n}, .unit = any_unit, .doc = "derivative gains"}};

    void infer(Inference&) const override {
        if (robot.is_bound()) robot->check_gains(loop_of(*control_type));
    }
    Status output(Now at, Out out) const noexcept override {
        auto& now = at[gains];
        if (!at[robot].read_gains(loop_of(*control_type), now)) return Status::failure(at[robot].error());
        out[P] = now.P;
        out[I] = now.I;
        out[D] = now.D;
        return ok;
    }
};

class SetLowLevelPID final : public LoopBlock {
  public:
    using LoopBlock::LoopBlock;
    Argument<std::string> control_type{this, "control_type", about_loop()};
    Argument<std::vector<std::string>> joints{this, "joints", {.doc = "whose gains are set; none: all"}};
    Argument<bool> set_P{this, "set_P", {.initial = true, .doc = "parameter P; false: as the robot has it"}};
    Argument<bool> set_I{this, "set_I", {.initial = true, .doc = "parameter I; false: as the robot has it"}};
    Argument<bool> set_D{this, "set_D", {.initial = true, .doc = "parameter D; false: as the robot has it"}};
    Dim m{this, "m", [this]() -> Dim::Names {
              if (!joints->empty()) return *joints;
              if (!robot.is_bound()) return std::nullopt;
              return robot->joint_names();
          }};
    Parameter<Vector> P{this,
                        "P",
                        {.shape = {m},
                         .initial = {std::numeric_limits<double>::infinity()},
                         .unit = any_unit,
                         .doc = "proportional gains, to be given",
                         .present = set_P}};
    Parameter<Vector> I{this,
                        "I",
                        {.shape = {m},
                         .initial = {std::numeric_limits<double>::infinity()},
                         .unit = any_unit,
                         .doc = "integral gains, to be given",
                         .present = set_I}};
    Parameter<Vector> D{this,
                        "D",
                        {.shape = {m},
                         .initial = {std::numeric_limits<double>::infinity()},
                         .unit = any_unit,
                         .doc = "derivative gains, to be given",
                         .present = set_D}};
    DiscreteState<Vector> last_P{this, "last_P", about("P as it was sent", set_P)};
    DiscreteState<Vector> last_I{this, "last_I", about("I as it was sent", set_I)};
    DiscreteState<Vector> last_D{this, "last_D", about("D as it was sent", set_D)};
    DiscreteState<bool> is_sent{this, "is_sent", {.doc = "the gains were sent"}};

    void infer(Inference& inference) const override {
        if (!robot.is_bound()) return;
        robot->check_gains(loop_of(*control_type));
        const auto& known = robot->joint_names();
        rows_.clear();
        for (std::size_t i = 0; i < joints->size(); ++i) {
            const auto& name = (*joints)[i];
            const auto found = std::find(known.begin(), known.end(), name);
            if (found == known.end())
                throw std::runtime_error("there is no joint '" + name + "' to set gains of" +
                                         did_you_mean(name, known));
            if (std::find(joints->begin(), joints->begin() + static_cast<std::ptrdiff_t>(i), name) !=
                joints->begin() + static_cast<std::ptrdiff_t>(i))
                throw std::runtime_error("argument 'joints' names '" + name + "' twice; name it once");
            rows_.push_back(found - known.begin());
        }
        const auto& whose = joints->empty() ? known : *joints;
        claim(inference, set_P, "P", *control_type, whose);
        claim(inference, set_I, "I", *control_type, whose);
        claim(inference, set_D, "D", *control_type, whose);
    }
    Status output(Now at, Out) const noexcept override {
        if (at[is_sent] && !changed(at, P, last_P) && !changed(at, I, last_I) && !changed(at, D, last_D))
            return ok;
        auto& connection = at[robot];
        auto& now = at[gains];
        if (!connection.read_gains(loop_of(*control_type), now)) return Status::failure(connection.error());
        for (const auto& [given, target] :
             {std::pair{&P, &now.P}, std::pair{&I, &now.I}, std::pair{&D, &now.D}}) {
            if (!given->is_present()) continue;
            const auto values = at[*given];
            for (Eigen::Index i = 0; i < values.size(); ++i) {
                if (!std::isfinite(values(i)))
                    return Status::failure("{element} was not given; give the gain, or keep the robot's by "
                                           "set_P, set_I or set_D: false",
                                           *given, static_cast<int>(i));
                (*target)(joints->empty() ? i : rows_[static_cast<std::size_t>(i)]) = values(i);
            }
        }
        return connection.write_gains(loop_of(*control_type), now) ? ok : Status::failure(connection.error());
    }
    Status update(Now at, Next next) const noexcept override {
        if (set_P) next[last_P] = at[P];
        if (set_I) next[last_I] = at[I];
        if (set_D) next[last_D] = at[D];
        next[is_sent] = true;
        return ok;
    }

  private:
    About about(const char* doc, bool present) const {
        return {.shape = {m}, .unit = any_unit, .doc = doc, .present = present};
    }
    mutable std::vector<Eigen::Index> rows_; ///< of the named joints
};

class SetMotorParameters final : public LoopBlock {
  public:
    using LoopBlock::LoopBlock;
    Argument<bool> set_P{this, "set_P", {.initial = true, .doc = "port P"}};
    Argument<bool> set_I{this, "set_I", {.initial = false, .doc = "port I"}};
    Argument<bool> set_D{this, "set_D", {.initial = false, .doc = "port D"}};
    Argument<std::string> control_type{this, "control_type", about_loop()};
    Argument<bool> set_k_tau{this, "set_k_tau", {.initial = false, .doc = "set k_tau"}};
    Argument<std::vector<double>> k_tau{
        this, "k_tau", {.doc = "command per torque, one for all joints or one each, to be given"}};
    Argument<bool> set_bemf{this, "set_bemf", {.initial = false, .doc = "set bemf"}};
    Argument<std::vector<double>> bemf{
        this, "bemf", {.initial = {0}, .doc = "command per joint velocity, one for all joints or one each"}};
    Input<Vector> P{this, "P", about("proportional gains", set_P)};
    Input<Vector> I{this, "I", about("integral gains", set_I)};
    Input<Vector> D{this, "D", about("derivative gains", set_D)};
    DiscreteState<Vector> last_P{this, "last_P", about("P as it was sent", set_P)};
    DiscreteState<Vector> last_I{this, "last_I", about("I as it was sent", set_I)};
    DiscreteState<Vector> last_D{this, "last_D", about("D as it was sent", set_D)};
    DiscreteState<bool> is_sent{this, "is_sent", {.doc = "gains and parameters were sent"}};
    Scratch<MotorParameters> parameters{this, [this] { return MotorParameters(value(n)); }};

    void infer(Inference& inference) const override {
        if (!robot.is_bound()) return;
        if (set_P || set_I || set_D) robot->check_gains(loop_of(*control_type));
        if (set_k_tau || set_bemf) robot->check_motor_parameters();
        check(set_k_tau, "k_tau", *k_tau);
        check(set_bemf, "bemf", *bemf);
        claim(inference, set_P, "P", *control_type, robot->joint_names());
        claim(inference, set_I, "I", *control_type, robot->joint_names());
        claim(inference, set_D, "D", *control_type, robot->joint_names());
        if (set_k_tau) inference.claim({robot->identity(), "k_tau of the robot's motors"});
        if (set_bemf) inference.claim({robot->identity(), "bemf of the robot's motors"});
    }
    Status output(Now at, Out) const noexcept override {
        auto& connection = at[robot];
        if (!at[is_sent] && (set_k_tau || set_bemf)) {
            auto& now = at[parameters];
            if (!connection.read_motor_parameters(now)) return Status::failure(connection.error());
            put(set_k_tau, *k_tau, now.k_tau);
            put(set_bemf, *bemf, now.k_bemf);
            if (!connection.write_motor_parameters(now)) return Status::failure(connection.error());
        }
        const bool is_new =
            !at[is_sent] || changed(at, P, last_P) || changed(at, I, last_I) || changed(at, D, last_D);
        if (!is_new || !(set_P || set_I || set_D)) return ok;
        auto& now = at[gains];
        if (!connection.read_gains(loop_of(*control_type), now)) return Status::failure(connection.error());
        for (const auto& [input, target] :
             {std::pair{&P, &now.P}, std::pair{&I, &now.I}, std::pair{&D, &now.D}}) {
            if (!input->is_present()) continue;
            const auto values = at[*input];
            for (Eigen::Index i = 0; i < values.size(); ++i)
                if (!std::isfinite(values(i)))
                    return Status::failure("{element} is not finite; look at what computes it", *input,
                                           static_cast<int>(i));
            *target = values;
        }
        return connection.write_gains(loop_of(*control_type), now) ? ok : Status::failure(connection.error());
    }
    Status update(Now at, Next next) const noexcept override {
        if (set_P) next[last_P] = at[P];
        if (set_I) next[last_I] = at[I];
        if (set_D) next[last_D] = at[D];
        next[is_sent] = true;
        return ok;
    }

  private:
    About about(const char* doc, bool present) const {
        return {.shape = {n}, .unit = any_unit, .doc = doc, .present = present};
    }
    void check(bool is_set, const char* name, const std::vector<double>& values) const {
        if (!is_set) return;
        if (values.size() != 1 && static_cast<int>(values.size()) != robot->joints())
            throw std::runtime_error(std::string("argument '") + name + "' has " +
                                     std::to_string(values.size()) + " elements, but there are " +
                                     std::to_string(robot->joints()) +
                                     " joints; give one for all or one each");
        const bool has_inverse = std::string(name) == "k_tau";
        for (const double value : values)
            if (!std::isfinite(value) || (has_inverse && value == 0))
                throw std::runtime_error(std::string("argument '") + name + "' has " +
                                         Value(value).describe() + "; give finite numbers" +
                                         (has_inverse ? " other than 0" : ""));
    }
    static void put(bool is_set, const std::vector<double>& values, Vector& to) {
        for (Eigen::Index i = 0; is_set && i < to.size(); ++i)
            to(i) = values[values.size() == 1 ? 0 : static_cast<std::size_t>(i)];
    }
};

} // namespace

void add_low_level(Library& library) {
    library.group("robot")
        .add<GetLowLevelPIDs>("GetLowLevelPIDs",
                              "Gains that the robot's low-level loops have now, n elements each, in the "
                              "robot's units. Of a MujocoWorld: Nm/rad, Nm/(rad s), Nm s/rad for Position; "
                              "PWM per Nm, Nm s and Nm/s for Torque. Errors: a robot that tells no gains.")
        .add<SetLowLevelPID>("SetLowLevelPID",
                             "Sets gains of the robot's low-level loops with the first step, and again where "
                             "a parameter was changed; stopping the run puts the former ones back. command = "
                             "P e + I integral of e + D de/dt with the error e of the loop. Errors: a robot "
                             "without such gains; a joint that it does not have; a gain that is not given.")
        .add<SetMotorParameters>(
            "SetMotorParameters",
            "Sets gains of the robot's low-level loops from signals, whenever one of them changes, and with "
            "the first step what the torque loop knows of the motors: command = k_tau tau + bemf s_dot + the "
            "loop's PID. Stopping the run puts the former ones back. Errors: a robot without such gains or "
            "parameters; k_tau or bemf of another size than the joints; a gain that is not finite ends the "
            "run.");
}

} // namespace bf::toolbox

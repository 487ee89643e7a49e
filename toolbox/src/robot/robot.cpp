#include "robot/robot.hpp"

#include "bf/dynamics/find_urdf.hpp"
#include "bf/toolbox/shared_world.hpp"
#include "robot/device_block.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace bf::toolbox {

namespace {

constexpr std::array<std::pair<const char*, Measurement>, 9> measurements{{
    {"Joints Position", Measurement::joint_position},
    {"Joints Velocity", Measurement::joint_velocity},
    {"Joints Acceleration", Measurement::joint_acceleration},
    {"Joints Torque", Measurement::joint_torque},
    {"Motor Position", Measurement::motor_position},
    {"Motor Velocity", Measurement::motor_velocity},
    {"Motor Acceleration", Measurement::motor_acceleration},
    {"Motor Current", Measurement::motor_current},
    {"Motor PWM", Measurement::motor_pwm},
}};
constexpr std::array<std::pair<const char*, ControlMode>, 7> modes{{
    {"Position", ControlMode::position},
    {"Position Direct", ControlMode::position_direct},
    {"Velocity", ControlMode::velocity},
    {"Torque", ControlMode::torque},
    {"PWM", ControlMode::pwm},
    {"Current", ControlMode::current},
    {"Impedance", ControlMode::impedance},
}};
constexpr std::array<std::pair<const char*, Sensor>, 2> sensors{
    {{"wrench", Sensor::wrench}, {"imu", Sensor::imu}}};

Unit unit_of(Measurement what) {
    switch (what) {
    case Measurement::joint_position:
    case Measurement::motor_position: return unit<"rad">;
    case Measurement::joint_velocity:
    case Measurement::motor_velocity: return unit<"rad/s">;
    case Measurement::joint_acceleration:
    case Measurement::motor_acceleration: return unit<"rad/s2">;
    case Measurement::joint_torque: return unit<"Nm">;
    default: return any_unit;
    }
}

class Configuration final : public Block {
  public:
    explicit Configuration(const Arguments& arguments) : Block(arguments) {
        if (world_robot->empty()) return;
        for (const auto& given : arguments)
            if (given.first != "world_robot")
                problem("argument '" + given.first +
                        "' stands beside world_robot, and the world says it of '" + *world_robot +
                        "'; leave one of the two out");
    }
    Argument<std::string> robot{this,
                                "robot",
                                {.initial = "iCubGazeboV2_5",
                                 .doc = "URDF file, package:// address or name of an installed robot model"}};
    Argument<std::vector<std::string>> joints{
        this,
        "joints",
        {.doc = "controlled joints, order of all n-vectors; none: all movable joints that mimic no other"}};
    Argument<std::string> base_link{
        this,
        "base_link",
        {.doc = "link whose pose is w_H_b and whose velocity is v_b; none: the URDF's root"}};
    Argument<bool> floating_base{
        this,
        "floating_base",
        {.initial = true,
         .doc = "false: the base stands still, and the generalised velocity is that of the n joints"}};
    Argument<std::vector<double>> gravity{
        this, "gravity", {.initial = {0, 0, -9.81}, .doc = "gravity in the world frame, m/s2"}};
    Argument<std::string> world_robot{
        this,
        "world_robot",
        {.doc =
             "a robot of the World around the block, which says its URDF, joints, base and gravity in place "
             "of the arguments above; none: they do"}};
    Requires<SharedWorld> world{this, "the world in which the robot stands", !world_robot->empty()};
    Provides<RobotConfiguration> configuration{this, [this] { return load(); }};
    Provides<ControlledJoints> controlled{this, [this]() -> std::shared_ptr<const ControlledJoints> {
                                              const auto* made = static_cast<const RobotConfiguration*>(
                                                  resolution().find_provided(RobotConfiguration::resource));
                                              return std::make_shared<const ControlledJoints>(
                                                  ControlledJoints{made->model.joint_names()});
                                          }};

  private:
    std::shared_ptr<const RobotConfiguration> load() const {
        if (world.is_bound()) {
            const auto& scene = *world->scene;
            const auto& options =
                scene.options().robots[static_cast<std::size_t>(scene.robot(*world_robot))].options;
            if (scene.is_mjcf(scene.robot(*world_robot)))
                throw std::runtime_error("robot '" + *world_robot +
                                         "' is an MJCF, of which the model blocks compute nothing; give its "
                                         "URDF as 'robot' in place of world_robot");
            return std::make_shared<const RobotConfiguration>(RobotConfiguration{
                dynamics::Model::load(options.urdf, options.joints, scene.options().gravity,
                                      options.base_link, options.floating_base),
                options.urdf, world->search_directories});
        }
        if (gravity->size() != 3)
            throw std::runtime_error("argument 'gravity' has " + std::to_string(gravity->size()) +
                                     " elements; give three, e.g. [0 0 -9.81]");
        for (const double g : *gravity)
            if (!std::isfinite(g))
                throw std::runtime_error("argument 'gravity' has " + Value(g).describe() +
                                         "; give finite numbers, m/s2");
        const std::vector<std::filesystem::path> directories{path_of("."),
                                                             std::filesystem::path(BF_ROBOT_MODELS),
                                                             std::filesystem::path(BF_ROBOT_MODELS) / "iCub"};
        const auto urdf = dynamics::find_urdf(*robot, directories);
        const Eigen::Vector3d g((*gravity)[0], (*gravity)[1], (*gravity)[2]);
        return std::make_shared<const RobotConfiguration>(RobotConfiguration{
            dynamics::Model::load(urdf, *joints, g, *base_link, floating_base), urdf, directories});
    }
};

class GetMeasurement final : public DeviceBlock {
  public:
    using DeviceBlock::DeviceBlock;
    Argument<std::string> measured_type{
        this,
        "measured_type",
        {.initial = "Joints Position", .doc = "what is measured", .choices = choices(measurements)}};
    Argument<bool> with_age{this, "with_age", {.initial = false, .doc = "port age"}};
    Output<Vector> y{
        this, "y", {.shape = {n}, .unit = unit_of(what()), .doc = "measurement, one element per joint"}};
    Output<double> age{
        this, "age", {.unit = unit<"s">, .doc = "how long ago it was measured", .present = with_age}};

    void infer(Inference&) const override {
        if (robot.is_bound()) robot->check_measurement(what());
    }
    Status output(Now at, Out out) const noexcept override {
        if (!at[robot].read(what(), out[y])) return Status::failure(at[robot].error());
        if (with_age) out[age] = at[robot].age();
        return ok;
    }

  private:
    Measurement what() const {
        const auto* found = find(measurements, *measured_type);
        return found ? *found : Measurement::joint_position;
    }
};

class GetSensor final : public DeviceBlock {
  public:
    using DeviceBlock::DeviceBlock;
    Argument<std::string> kind{
        this, "kind", {.initial = "wrench", .doc = "wrench (6) or imu (12)", .choices = choices(sensors)}};
    Argument<std::string> sensor{this, "sensor", {.doc = "name of the sensor"}};
    Output<Vector> y{this,
                     "y",
                     {.shape = {*kind == "imu" ? 12 : 6},
                      .unit = mixed_units,
                      .doc = "wrench: force [N], moment [Nm] in sensor axes; imu: roll pitch yaw [rad], "
                             "acceleration [m/s2], angular velocity [rad/s], magnetic field"}};

    void infer(Inference&) const override {
        if (robot.is_bound()) robot->check_sensor(which(), *sensor);
    }
    Status output(Now at, Out out) const noexcept override {
        return at[robot].read(which(), *sensor, out[y]) ? ok : Status::failure(at[robot].error());
    }

  private:
    Sensor which() const { return *kind == "imu" ? Sensor::imu : Sensor::wrench; }
};

class GetLimits final : public Block {
  public:
    using Block::Block;
    Argument<std::string> limit_type{
        this,
        "limit_type",
        {.initial = "ModelPosition",
         .doc = "limits of the control boards or of the URDF",
         .choices = {"ControlBoardPosition", "ControlBoardVelocity", "ModelPosition", "ModelVelocity"}}};
    Requires<RobotConfiguration> robot{this, "the robot whose URDF has the limits", of_model()};
    Requires<RobotDevice> device{this, "the robot whose control boards have the limits", !of_model()};
    Dim n{this, "n", [this]() -> Dim::Names {
              if (robot.is_bound()) return robot->model.joint_names();
              if (device.is_bound()) return device->joint_names();
              return std::nullopt;
          }};
    Output<Vector> minimum{
        this,
        "minimum",
        {.shape = {n}, .unit = limits_unit(), .doc = "lower limits, -inf where there are none"}};
    Output<Vector> maximum{
        this,
        "maximum",
        {.shape = {n}, .unit = limits_unit(), .doc = "upper limits, inf where there are none"}};

    Status output(Now at, Out out) const noexcept override {
        if (!of_model()) {
            const auto which = of_velocity() ? Limits::velocity : Limits::position;
            return at[device].read(which, out[minimum], out[maximum]) ? ok
                                                                      : Status::failure(at[device].error());
        }
        if (of_velocity()) {
            out[maximum] = robot->model.velocity_max();
            out[minimum] = -robot->model.velocity_max();
        } else {
            out[minimum] = robot->model.position_min();
            out[maximum] = robot->model.position_max();
        }
        return ok;
    }

  private:
    bool of_model() const { return limit_type->starts_with("Model"); }
    bool of_velocity() const { return limit_type->ends_with("Velocity"); }
    Unit limits_unit() const { return of_velocity() ? unit<"rad/s"> : unit<"rad">; }
};

class SetReferences final : public DeviceBlock {
  public:
    using DeviceBlock::DeviceBlock;
    Argument<std::string> control_type{
        this,
        "control_type",
        {.initial = "Torque", .doc = "how the joints are commanded", .choices = choices(modes)}};
    Argument<double> reference_speed{this,
                                     "reference_speed",
                                     {.initial = 0.17453292519943295,
                                      .above = 0,
                                      .doc = "largest speed of the trajectories of Position, rad/s"}};
    Argument<double> reference_acceleration{
        this,
        "reference_acceleration",
        {.initial = 17453.292519943295, .above = 0, .doc = "largest acceleration of Velocity, rad/s2"}};
    Argument<double> age_limit{
        this,
        "age_limit",
        {.initial = std::numeric_limits<double>::infinity(),
         .above = 0,
         .doc = "largest age of the measurements, s; above it happens what when_old says"}};
    Argument<std::string> when_old{this,
                                   "when_old",
                                   {.initial = "stop",
                                    .doc = "stop: the run ends; hold: the last references of before are sent "
                                           "on; ramp_down: they go to zero within ramp_time",
                                    .choices = {"stop", "hold", "ramp_down"}}};
    Argument<double> ramp_time{this, "ramp_time", {.initial = 0.5, .above = 0, .doc = "of ramp_down, s"}};
    Input<Vector> u{
        this,
        "u",
        {.shape = {n}, .unit = any_unit, .doc = "references: rad, rad/s, Nm or raw, by control_type"}};
    Input<double> age{this,
                      "age",
                      {.unit = unit<"s">,
                       .doc = "of what the references are computed from; unconnected: of the joints' "
                              "measurements",
                       .present = has_limit(),
                       .optional = true}};
    DiscreteState<bool> is_switched{this, "is_switched", {.doc = "the control mode was set"}};
    DiscreteState<Vector> last{this,
                               "last",
                               {.shape = {n},
                                .unit = any_unit,
                                .doc = "references of the last step with measurements that were not too old",
                                .present = mode() == ControlMode::position || has_limit()}};
    DiscreteState<double> since{
        this, "since", {.unit = unit<"s">, .doc = "how long they have been too old", .present = has_limit()}};
    Scratch<Vector> held{this, [this] { return Vector(Vector::Zero(value(n))); }};

    void infer(Inference& inference) const override {
        if (!robot.is_bound()) return;
        robot->check_mode(mode());
        inference.claim({robot->identity(), claimed_references});
        const bool is_position = mode() == ControlMode::position || mode() == ControlMode::position_direct ||
                                 mode() == ControlMode::impedance;
        if (has_limit() && *when_old == "ramp_down" && is_position)
            throw std::runtime_error("when_old is ramp_down, which would move the joints of control_type " +
                                     *control_type + " to zero; give hold or stop");
    }
    Status output(Now at, Out) const noexcept override {
        auto& connection = at[robot];
        if (!at[is_switched]) {
            const double limit = mode() == ControlMode::velocity ? reference_acceleration : reference_speed;
            if (!connection.set_mode(mode()) || !connection.set_trajectory_limit(mode(), limit))
                return Status::failure(connection.error());
        } else if (const int joint = connection.joint_in_other_mode(mode()); joint >= 0) {
            return Status::failure(
                "{element} has left its control mode; look for a fault of the robot, or let the subsystem "
                "reset its states when it is enabled, where another SetReferences drove the robot in between",
                u, joint);
        }
        if (has_limit()) {
            if (const double found = age_of(at); found > age_limit) {
                if (*when_old == "stop" && age_limit < 0.01)
                    return Status::failure("the measurements are {} us old, and age_limit is {} us; look at "
                                           "the robot's connection",
                                           count(found, 1e-6), count(age_limit, 1e-6));
                if (*when_old == "stop")
                    return Status::failure("the measurements are {} ms old, and age_limit is {} ms; look at "
                                           "the robot's connection",
                                           count(found, 1e-3), count(age_limit, 1e-3));
                if (mode() == ControlMode::position) return ok; // it has them
                const double left =
                    *when_old == "hold" ? 1 : std::max(0.0, 1 - (at[since] + at.period()) / ramp_time);
                at[held] = left * at[last];
                return connection.write(mode(), at[held]) ? ok : Status::failure(connection.error());
            }
        }
        for (int i = 0; i < at[u].size(); ++i)
            if (!std::isfinite(at[u](i)))
                return Status::failure("{element} is not finite; look at what computes it", u, i);
        // A reference begins a trajectory, so that the same one is not sent again.
        if (mode() == ControlMode::position && at[is_switched] && at[u] == at[last]) return ok;
        return connection.write(mode(), at[u]) ? ok : Status::failure(connection.error());
    }
    Status update(Now at, Next next) const noexcept override {
        next[is_switched] = true;
        const bool is_old = has_limit() && age_of(at) > age_limit;
        if (last.is_present() && !is_old) next[last] = at[u];
        if (has_limit()) next[since] = is_old ? at[since] + at.period() : 0;
        return ok;
    }

  private:
    bool has_limit() const { return std::isfinite(*age_limit); }
    double age_of(Now at) const { return at.is_connected(age) ? at[age] : at[robot].age(); }
    /// In that unit; what is not zero is not told as zero.
    static int count(double time, double unit) {
        return static_cast<int>(std::clamp(std::round(time / unit), 1.0, 1e9));
    }
    ControlMode mode() const {
        const auto* found = find(modes, *control_type);
        return found ? *found : ControlMode::torque;
    }
};

} // namespace

void add_robot(Library& library) {
    library.group("robot")
        .add<Configuration>(
            "Configuration",
            "The robot whose quantities the model blocks of this subsystem compute: URDF, joints, gravity. "
            "It has no ports: blocks in its subsystem and below find the nearest one, and all of them share "
            "one computation per state. `robot` is a file, a package:// or model:// address, or the name of "
            "an installed robot; `joints` is the order of all n-vectors; a joint that is not in it follows a "
            "listed one that the URDF lets it mimic, or is locked at zero. A listed joint is independent "
            "even if the URDF lets it mimic another. With `floating_base: false` M is n x n, h and tau have "
            "n elements, J and A n columns: what belongs to the six velocities of the base is left out. "
            "Errors: an unknown robot, a joint that is unknown, fixed or listed twice, two configurations in "
            "one subsystem.")
        .add<GetMeasurement>(
            "GetMeasurement",
            "What the robot's joints or motors measure now, n elements in joint order: rad, rad/s, rad/s2, "
            "Nm, or raw. The robot is the nearest around the block: a MujocoWorld or a connection to a real "
            "one. Errors: a measured_type that the robot does not have; a measurement that fails in a step.")
        .add<GetSensor>(
            "GetSensor",
            "Reading of a force/torque sensor or an inertial sensor of the robot. wrench: 6, force [N] and "
            "moment [Nm] at the sensor in sensor axes; of a simulated robot what the child's side exerts on "
            "the parent's, so that a tool at rest with z up reads -m g in z. imu: 12, roll pitch yaw [rad], "
            "acceleration minus gravity [m/s2] and angular velocity [rad/s] in sensor axes, magnetic field. "
            "Errors: a sensor that the robot does not have; the text lists those it has.")
        .add<GetLimits>("GetLimits", "Limits of the joints, n elements each, infinite where there are none. "
                                     "ModelPosition and ModelVelocity: from the URDF of the nearest "
                                     "Configuration; ControlBoardPosition and ControlBoardVelocity: from the "
                                     "nearest robot. They are read at the start of a run and constant in it.")
        .add<SetReferences>(
            "SetReferences",
            "Commands the robot's joints, n references in joint order: rad, rad/s, Nm or raw, by "
            "control_type. The control mode is set with the first reference, and anew after a reset; "
            "stopping the run puts it back. Position moves at most at reference_speed and sends references "
            "where they change; Velocity accelerates at most with reference_acceleration. A simulated robot "
            "clamps torques to the limits of effort; positions beyond theirs are sent as they are, and the "
            "stops of the joints hold there. Where measurements are older than age_limit, the references of "
            "before are held or ramped down, or the run ends; when they are fresh again, it goes on with u. "
            "Errors: a control_type that the robot does not have; two that command one robot in the same "
            "step, unless each stands in a conditional subsystem of its own, which resets its states when it "
            "is enabled; a reference that is not finite or a joint that has left its mode ends the run.");
}

} // namespace bf::toolbox

#include "world/world.hpp"

#include "BlockFactory/Core/Log.h"
#include "bf/core/differenced.hpp"
#include "bf/physics/world.hpp"
#include "rigid_body/robot_block.hpp"
#include "robot/device_block.hpp"
#include "world/simulated_robot.hpp"
#include "world/terrain.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace bf::toolbox {

namespace {

class MujocoWorld final : public RobotBlock, public Differenced {
  public:
    using RobotBlock::RobotBlock;
    Argument<std::vector<std::string>> feet{
        this, "feet", {.doc = "links that touch the ground, such as soles"}};
    Argument<std::string> contacts{
        this,
        "contacts",
        {.initial = "points",
         .doc =
             "what the feet touch with: contact_points, or the <collision> shapes that the URDF gives them",
         .choices = {"points", "urdf"}}};
    Argument<std::string> touching{
        this,
        "touching",
        {.initial = "feet",
         .doc = "what the ground carries: the feet alone, or all: the <collision> shapes of the other links, "
                "too, so that a robot that falls comes to lie on it; takes longer to load and to step",
         .choices = {"feet", "all"}}};
    Argument<Matrix> contact_points{
        this,
        "contact_points",
        {.initial = default_contact_points(),
         .doc =
             "shapes in the frames of the feet, m; one row each: x y z of a sphere on every foot; with the "
             "number of its foot before it, a sphere on that one alone; with half-sizes a b c behind that, a "
             "box"}};
    Argument<double> contact_radius{
        this, "contact_radius", {.initial = 0.005, .above = 0, .doc = "of the contact spheres, m"}};
    Argument<std::vector<std::string>> ft_sensors{
        this, "ft_sensors", {.doc = "fixed joints with force/torque sensors"}};
    Argument<std::string> imu_frame{
        this, "imu_frame", {.doc = "link of the inertial sensor; none: the base"}};
    Argument<std::vector<std::string>> push_links{
        this, "push_links", {.doc = "links that external wrenches may push"}};
    Argument<std::vector<double>> initial_joints{
        this,
        "initial_joints",
        {.doc = "joint positions at the start, rad; none: zero, or the limit next to it"}};
    Argument<bool> floating_base{this,
                                 "floating_base",
                                 {.initial = true,
                                  .doc = "false: the base is fixed to the world, as that of a Configuration "
                                         "with a fixed base always is"}};
    Argument<bool> has_floor{this, "floor", {.initial = true, .doc = "ground plane z = 0"}};
    Argument<std::string> terrain{
        this,
        "terrain",
        {.doc = "XML file of a world, as World reads it, on whose objects the feet stand as on the floor; "
                "all without mass, no robots; floor, step and gravity are not taken from it"}};
    Argument<double> friction{
        this, "friction", {.initial = 1, .minimum = 0, .doc = "Coulomb friction of the ground"}};
    Argument<std::vector<double>> solref{
        this,
        "solref",
        {.initial = {0.005, 1},
         .doc = "MuJoCo's time constant, s, and damping ratio with which ground and feet come apart"}};
    Argument<std::vector<double>> solimp{
        this,
        "solimp",
        {.initial = {0.9, 0.95, 0.001, 0.5, 2},
         .doc =
             "MuJoCo's impedance of ground and feet: at the surface, below it, width, m, midpoint, power"}};
    Argument<double> impratio{this,
                              "impratio",
                              {.initial = 100,
                               .above = 0,
                               .doc = "ratio of frictional to normal contact impedance; MuJoCo's option"}};
    Argument<std::vector<double>> armature{
        this, "armature", {.minimum = 0, .doc = "rotor inertia seen at the joints, kg m2; none: 0"}};
    Argument<std::vector<double>> damping{
        this,
        "joint_damping",
        {.minimum = 0, .doc = "viscous friction of the joints, Nm s/rad; none: the URDF's"}};
    Argument<std::vector<double>> joint_friction{
        this,
        "joint_friction",
        {.minimum = 0, .doc = "Coulomb friction of the joints, Nm; 0 switches it off; none: the URDF's"}};
    Argument<std::vector<double>> gear_ratio{
        this,
        "gear_ratio",
        {.initial = {1},
         .doc = "turns of the motors for one of the joints; below 0 they turn the other way"}};
    Argument<std::vector<double>> torque_constant{
        this,
        "torque_constant",
        {.initial = {1}, .doc = "joint torque per motor current, for control_type: Current"}};
    Argument<std::vector<double>> k_tau{
        this, "k_tau", {.initial = {1}, .doc = "motors: PWM = k_tau tau + k_bemf s_dot, in PWM per Nm"}};
    Argument<std::vector<double>> k_bemf{
        this, "k_bemf", {.initial = {0}, .doc = "the same, in PWM per rad/s"}};
    Argument<Matrix> position_gains{
        this,
        "position_gains",
        {.doc = "rows P I D of the loops behind control_type: Position, Position Direct and Velocity, in "
                "Nm/rad, Nm/(rad s), Nm s/rad; none: critical damping of 30 rad/s for the inertia that each "
                "joint sees at the start"}};
    Argument<Matrix> torque_gains{this,
                                  "torque_gains",
                                  {.doc = "rows P I D of the loop behind control_type: Torque, in PWM per "
                                          "Nm, Nm s and Nm/s; stable while P + 2 D / period < k_tau; none: "
                                          "zeros"}};
    Argument<Matrix> impedance_gains{
        this,
        "impedance_gains",
        {.doc = "rows K D, stiffness and damping behind control_type: Impedance, in Nm/rad and Nm s/rad; "
                "none: critical damping of 10 rad/s for the same inertia"}};
    Argument<std::vector<double>> noise{
        this,
        "noise",
        {.initial = {0, 0, 0},
         .minimum = 0,
         .doc = "standard deviation of measured positions [rad], velocities [rad/s], torques [Nm]"}};
    Argument<int> seed{this,
                       "seed",
                       {.minimum = 0,
                        .doc = "of the noise; without one the block's path in the model decides, so that the "
                               "noise of two worlds differs",
                        .from_path = true}};

    Argument<double> command_delay{
        this,
        "command_delay",
        {.initial = 0,
         .minimum = 0,
         .doc = "until torques and references arrive, s, a multiple of the period"}};
    Argument<double> measurement_delay{
        this,
        "measurement_delay",
        {.initial = 0,
         .minimum = 0,
         .doc = "until measurements of joints, motors and sensors are read, s, a multiple of the period; the "
                "loops of the low level have theirs at once"}};
    Argument<double> dropout{
        this,
        "dropout",
        {.initial = 0,
         .minimum = 0,
         .doc =
             "probability, below 1, that the measurements of a step are lost and the last ones read again; "
             "which ones the seed decides"}};
    Argument<std::vector<double>> backlash{
        this,
        "backlash",
        {.minimum = 0,
         .doc =
             "play of the gears between motors and joints, rad at the joint from flank to flank; the motor "
             "turns in it alone, with the joint's armature; none: 0"}};
    Argument<std::vector<double>> encoder_resolution{
        this,
        "encoder_resolution",
        {.minimum = 0, .doc = "of the encoders at the joints, rad per tick; none: exact"}};
    Argument<std::vector<double>> motor_encoder_resolution{
        this,
        "motor_encoder_resolution",
        {.minimum = 0, .doc = "of the encoders at the motors, rad of the motor per tick; none: exact"}};
    Argument<bool> velocities_from_encoders{
        this,
        "velocities_from_encoders",
        {.initial = false, .doc = "true: velocities are differences of what the encoders count in a period"}};

    Provides<RobotDevice> device{this, [this] { return make_device(); }};

    Input<Vector> tau{this,
                      "tau",
                      {.shape = {n},
                       .unit = unit<"Nm">,
                       .doc = "joint torques; unconnected: the references of SetReferences",
                       .feedthrough = false,
                       .optional = true}};
    InputList<Vector6> push{this,
                            prefixed("push_", *push_links),
                            {.unit = mixed_units,
                             .doc = "force [N] and moment [Nm] on the link's centre of mass, world axes",
                             .feedthrough = false,
                             .optional = true}};

    Parameter<Vector> disturbance{
        this,
        "disturbance",
        {.shape = {7},
         .initial = {0},
         .unit = mixed_units,
         .doc =
             "a force that takes hold of the robot: number of a body, as the editor counts them (0: none); "
             "x y z of a point in its frame, m; force there in world axes, N"}};

    Output<Vector> s{this, "s", {.shape = {n}, .unit = unit<"rad">, .doc = "measured joint positions"}};
    Output<Vector> s_dot{
        this, "s_dot", {.shape = {n}, .unit = unit<"rad/s">, .doc = "measured joint velocities"}};
    Output<Vector> tau_measured{
        this,
        "tau_measured",
        {.shape = {n}, .unit = unit<"Nm">, .doc = "measured joint torques of the last interval"}};
    Output<Transform> w_H_b{this, "w_H_b", {.unit = mixed_units, .doc = base_pose_doc}};
    Output<Vector6> v_b{this, "v_b", {.unit = mixed_units, .doc = base_velocity_doc}};
    Output<Vector3> com{this, "com", {.unit = unit<"m">, .doc = "centre of mass of the robot in the world"}};
    OutputList<Transform> foot_pose{
        this, prefixed("pose_", *feet), {.unit = mixed_units, .doc = "pose of the sole in the world"}};
    OutputList<Vector6> foot_wrench{
        this,
        prefixed("wrench_", *feet),
        {.unit = mixed_units,
         .doc = "force [N] and moment [Nm] of the ground at the sole's origin, world axes, last interval"}};

    void infer(Inference& inference) const override {
        if (const auto* made =
                static_cast<const RobotDevice*>(resolution().find_provided(RobotDevice::resource)))
            inference.claim({made->identity(), claimed_references, tau.index()});
    }
    void start(Now at) const override {
        auto& simulated = robot_of(at);
        simulated.set_time_step(at.period());
        simulated.start();
    }
    void stop(Now at) const noexcept override { robot_of(at).stop(); }

    Status output(Now at, Out out) const noexcept override {
        const auto& simulation = robot_of(at).simulation;
        out[s] = simulation.s(0);
        out[s_dot] = simulation.s_dot(0);
        out[tau_measured] = simulation.tau(0);
        out[w_H_b] = simulation.w_H_b(0);
        out[v_b] = simulation.v_b(0);
        out[com] = simulation.com(0);
        for (int i = 0; i < foot_pose.size(); ++i) {
            out[foot_pose[i]] = simulation.foot_pose(0, i);
            out[foot_wrench[i]] = simulation.foot_wrench(0, i);
        }
        return ok;
    }

    void difference(Now at, bool begins) const override { robot_of(at).simulation.solve_exactly(begins); }

    Status update(Now at, Next) const noexcept override {
        auto& simulation = robot_of(at).simulation;
        const bool is_commanded = at.is_connected(tau);
        const double* commanded = is_commanded ? at[tau].data() : simulation.control(0).reference().data();
        for (int i = 0; i < at[tau].size(); ++i)
            if (!std::isfinite(commanded[i]))
                return Status::failure("{element} is not finite; look at what computes it", tau, i);
        for (int i = 0; i < push.size(); ++i)
            if (!at[push[i]].allFinite())
                return Status::failure("push wrench {} is not finite; look at what computes it", i + 1);
        if (is_commanded) simulation.command(0, {commanded, static_cast<std::size_t>(at[tau].size())});
        for (int i = 0; i < push.size(); ++i) simulation.set_wrench(0, i, at[push[i]]);
        const auto& pulled = at[disturbance];
        // What is no number of a body is one that no world has.
        const double body = pulled[0] >= 0 && pulled[0] < 1e6 ? std::round(pulled[0]) : -1;
        if (simulation.step(1, {static_cast<int>(body), pulled.segment<3>(1), pulled.segment<3>(4)}))
            return ok;
        if (body < 0 || !pulled.allFinite())
            return Status::failure(
                "{element} is no disturbance; give the number of a body, a point and a force", disturbance,
                0);
        return failed_step(simulation.failure());
    }

  private:
    SimulatedRobot& robot_of(Now at) const { return static_cast<SimulatedRobot&>(at[device]); }

    static Matrix default_contact_points() {
        const auto shapes = physics::four_spheres();
        Matrix points(static_cast<Eigen::Index>(shapes.size()), 3);
        for (std::size_t i = 0; i < shapes.size(); ++i)
            points.row(static_cast<Eigen::Index>(i)) = shapes[i].position.transpose();
        return points;
    }

    template <std::size_t size>
    static std::array<double, size> list(const std::vector<double>& values, const char* name,
                                         const char* all) {
        if (values.size() != size)
            throw std::runtime_error(std::string("argument '") + name + "' has " +
                                     std::to_string(values.size()) + " elements; give " + all);
        std::array<double, size> array{};
        std::copy(values.begin(), values.end(), array.begin());
        return array;
    }

    std::shared_ptr<const RobotDevice> make_device() const {
        return std::make_shared<WorldDevice>(compile(), physics::Delays{command_delay, measurement_delay},
                                             *ft_sensors);
    }

    std::shared_ptr<const physics::World> compile() const {
        const bool has_urdf_shapes = *contacts == "urdf";
        const Eigen::Index columns = contact_points->cols();
        if (columns != 3 && columns != 4 && columns != 7)
            throw std::runtime_error("argument 'contact_points' has " + std::to_string(columns) +
                                     " columns; give rows x y z, foot x y z, or foot x y z a b c");
        for (Eigen::Index i = 0; columns > 3 && i < contact_points->rows(); ++i) {
            const double foot = (*contact_points)(i, 0);
            if (foot != std::floor(foot) || foot < 1 || foot > static_cast<double>(feet->size()))
                throw std::runtime_error("row " + std::to_string(i + 1) +
                                         " of argument 'contact_points' begins with no number of a foot; "
                                         "they are counted from 1 to " +
                                         std::to_string(feet->size()));
        }
        physics::WorldOptions options;
        options.urdf = robot->urdf;
        options.package_paths = robot->search_directories;
        options.joints = model().joint_names();
        options.base_link = model().base_link();
        for (const auto& follower : model().followers())
            options.followers.push_back(
                {follower.joint, follower.leader, follower.multiplier, follower.offset});
        options.floating_base = floating_base && model().has_floating_base();
        options.floor.enabled = has_floor;
        options.floor.friction = friction;
        const auto [time_constant, damping_ratio] =
            list<2>(solref, "solref", "two: time constant, damping ratio");
        options.floor.solref = {time_constant, damping_ratio};
        options.floor.solimp =
            list<5>(solimp, "solimp", "five: impedance at the surface and below it, width, midpoint, power");
        options.impratio = impratio;
        options.gravity = model().gravity();
        for (std::size_t k = 0; k < feet->size(); ++k) {
            physics::Foot foot{(*feet)[k], {}, has_urdf_shapes};
            for (Eigen::Index i = 0; !has_urdf_shapes && i < contact_points->rows(); ++i) {
                const Eigen::RowVectorXd row = contact_points->row(i);
                if (columns > 3 && row[0] != static_cast<double>(k + 1)) continue;
                const Vector3 centre = row.segment<3>(columns > 3 ? 1 : 0).transpose();
                foot.shapes.push_back(columns == 7
                                          ? physics::ContactShape::box(centre, row.tail<3>().transpose())
                                          : physics::ContactShape::sphere(centre, contact_radius));
            }
            options.feet.push_back(std::move(foot));
        }
        options.lands = *touching == "all";
        options.ft_sensors = *ft_sensors;
        options.imu_frame = *imu_frame;
        options.push_links = *push_links;
        options.armature = *armature;
        options.damping = *damping;
        options.friction = *joint_friction;
        const auto [position, velocity, torque] =
            list<3>(noise, "noise", "three: position, velocity, torque");
        options.noise = {position, velocity, torque, static_cast<std::uint64_t>(*seed)};
        physics::Imperfections& imperfections = options.imperfections;
        imperfections.dropout = dropout;
        imperfections.backlash = *backlash;
        imperfections.encoder_resolution = *encoder_resolution;
        imperfections.motor_encoder_resolution = *motor_encoder_resolution;
        imperfections.velocities_from_encoders = velocities_from_encoders;
        options.motors = {*gear_ratio,     *torque_constant, *k_tau,          *k_bemf,
                          *position_gains, *torque_gains,    *impedance_gains};
        options.initial_joints = *initial_joints;
        if (!terrain->empty()) options.terrain = read_terrain(path_of(*terrain));
        auto world = std::make_shared<const physics::World>(std::move(options));
        for (const auto& warning : world->warnings()) bfWarning << warning;
        return world;
    }
};

} // namespace

void add_world(Library& library) {
    library.group("world").add<MujocoWorld>(
        "MujocoWorld",
        "The configured robot in a MuJoCo physics world, in lockstep: outputs are of now, those of joints as "
        "GetMeasurement reads them, with noise and imperfections, the others true; the update advances the "
        "world by the block's period. Inputs are held over the interval: joint torques `tau` [n], clamped to "
        "the URDF's effort limits, and one wrench per push link. It is also the robot that GetMeasurement, "
        "GetSensor, GetLimits and SetReferences around it use; with `tau` unconnected it follows what "
        "SetReferences sent last, by PID loops and motors whose gains SetLowLevelPID and SetMotorParameters "
        "change in a run. The only contacts are those of the feet, or with touching: all of the whole robot, "
        "with the floor z = 0 and the terrain, none between links; the start pose stands on the feet. Before "
        "the first step, what is of the last interval (torques, accelerations, the accelerometer, wrenches "
        "of feet and force/torque sensors) is that of motors without torque: a value to tare with is one of "
        "a later step. An effort of 0 in the URDF, as exporters write it, is no limit. A link whose inertia "
        "no body can have receives the nearest possible one, and a moving one without mass a little, with a "
        "warning that names it. Source: E. Todorov, T. Erez, Y. Tassa, MuJoCo: a physics engine for "
        "model-based control, 2012. Errors: unknown frames, sensors or links; a torque or wrench that is not "
        "finite and a motion that diverges end the run.");
}

} // namespace bf::toolbox

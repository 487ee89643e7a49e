// Several robots and objects in one world.
#pragma once

#include "bf/physics/scene_options.hpp"
#include "bf/physics/world.hpp"

#include <Eigen/Dense>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace bf::physics {

/// A frame that is fixed to a body, by its number in Scene::bodies; -1: to the world.
struct Frame {
    int body = -1;
    Eigen::Matrix4d pose = Eigen::Matrix4d::Identity(); ///< in the body
};

/// What touches a body in the last interval.
struct Contact {
    Vector6d wrench = Vector6d::Zero(); ///< on the body (N, Nm), world axes, at the origin of a frame of it
    int points = 0;                     ///< in how many
};

/// A rectangle of tactile cells, in whose frame z points out of the body, at what presses.
struct Patch {
    Frame frame;              ///< its origin is the middle
    Eigen::Vector2d size;     ///< along x and y (m)
    double thickness = 0.005; ///< m, how far in front and behind contacts are felt
};

/// Compiled physics model of robots and objects. Immutable: any number of SceneSimulations, in any threads,
/// share it. Robots and objects are numbered from 0 in the order of the options.
class Scene {
  public:
    /// Throws std::runtime_error that begins with where in the file it is, names what is wrong and the
    /// remedy: two of one name, files, links or joints that are not there, numbers that are none.
    explicit Scene(SceneOptions options);
    /// One robot without a name, whose feet alone touch the floor; its bodies are called as its links. Throws
    /// std::invalid_argument (WorldOptions::validate) and std::runtime_error.
    explicit Scene(const WorldOptions& options);
    ~Scene();
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;

    const SceneOptions& options() const; ///< complete: joints, base links and IMU frames filled in
    int robot_count() const;
    int object_count() const;
    /// The number of the robot of that name. Throws std::runtime_error that lists those there are.
    int robot(const std::string& name) const;
    int object(const std::string& name) const;

    bool is_mjcf(int robot) const;    ///< otherwise a URDF
    int joint_count(int robot) const; ///< n
    const std::vector<std::string>& joint_names(int robot) const;
    bool is_prismatic(int robot, int joint) const;         ///< it moves along its axis, in m
    const Eigen::VectorXd& lower_limits(int robot) const;  ///< n, joint positions
    const Eigen::VectorXd& upper_limits(int robot) const;  ///< n, joint positions
    const Eigen::VectorXd& effort_limits(int robot) const; ///< n, |tau| is clamped to it
    /// Actuators of an MJCF that drive no controlled joint, such as those of tendons: by name, the number of
    /// one, which set_control wants. Throws std::runtime_error that lists those there are.
    const std::vector<std::string>& actuators(int robot) const;
    int actuator(int robot, const std::string& name) const;
    double mass(int robot) const; ///< kg, of what moves and of a fixed base

    int position_count() const; ///< of the whole scene, see SceneSimulation::q
    /// What these are: "robot/joint", and of a body that floats "body.x" .y .z and .qw .qx .qy .qz.
    std::vector<std::string> position_names() const;
    /// What moves by itself, each with all that is fixed to it: "robot/link", "object".
    const std::vector<std::string>& bodies() const;
    /// Number of one of them, from 0. Throws std::runtime_error that lists them.
    int body(const std::string& name) const;
    /// A frame at a pose in one of them, or in a link that is fixed to one; no name: in the world. Throws
    /// std::runtime_error that lists them, or says that the pose is none.
    Frame frame(const std::string& name, const Eigen::MatrixXd& pose = Eigen::Matrix4d::Identity()) const;
    /// What the scene does otherwise than the files say.
    const std::vector<std::string>& warnings() const;
    /// Loops of robots whose gains, as given, are unstable at the period of the loop, by robot and joint; and
    /// that the step of a World is longer than 5 ms.
    const std::vector<std::string>& loop_warnings() const;

  private:
    friend class SceneSimulation;
    friend class Puppet;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Why a step failed, for those who cannot pass a text on. Robots and their parts are numbered from 0.
struct Failure {
    enum class Cause { none, reference, wrench, control, contacts, motion };
    Cause cause = Cause::none;
    int robot = 0;
    int part = 0; ///< joint, push link, or number of the actuator in MuJoCo's model
};

/// One running copy of a Scene. A step is that of a Simulation, and so is what "now" and "last interval"
/// mean. Every returned map is a view that stays valid and changes with the next step.
class SceneSimulation {
  public:
    using VectorView = Eigen::Map<const Eigen::VectorXd>;
    using Vector3View = Eigen::Map<const Eigen::Vector3d>;
    using Vector6View = Eigen::Map<const Vector6d>;
    using Matrix4View = Eigen::Map<const Eigen::Matrix4d>;

    /// Allocates everything and resets. Throws std::bad_alloc or std::runtime_error.
    explicit SceneSimulation(std::shared_ptr<const Scene> scene);
    ~SceneSimulation();
    SceneSimulation(SceneSimulation&&) noexcept;
    SceneSimulation& operator=(SceneSimulation&&) noexcept;

    const Scene& scene() const noexcept;

    /// Back to t = 0, the start, zero velocities, zero torques and wrenches; loops as they began.
    void reset() noexcept;

    /// The loops of a robot, which this simulation advances. They hold their references; what is not finite
    /// fails the next step.
    JointControl& control(int robot) noexcept;
    /// JointControl::set_mode with the present positions.
    void set_mode(int robot, ControlMode mode) noexcept;
    /// References (n) in the mode torque.
    void set_torque(int robot, std::span<const double> tau) noexcept;
    /// Torques (n) past the loops, in place of references; none: the loops again.
    void command(int robot, std::span<const double> tau) noexcept;
    /// Force (N) and moment (Nm) on push link `i` of a robot, at its centre of mass, world axes; held.
    void set_wrench(int robot, int i, const Vector6d& wrench) noexcept;

    /// The control signal of an actuator, by its number, as the MJCF means it; held.
    void set_control(int actuator, double value) noexcept;

    /// Advances by `count` time steps, in which the disturbance acts. False when an input is not finite or
    /// the motion diverged; error() says why. After a failure every further step fails with the same text
    /// until reset() or restore().
    [[nodiscard]] bool step(int count = 1, const Disturbance& disturbance = {}) noexcept;
    /// Why the last step failed; empty when it did not.
    const char* error() const noexcept;
    Failure failure() const noexcept; ///< the same
    double time() const noexcept;     ///< s

    Readings readings(int robot) const noexcept;          ///< as Simulation::readings
    Readings readings_at_loops(int robot) const noexcept; ///< as Simulation::readings_at_loops
    VectorView s(int robot) const noexcept;               ///< of the readings
    VectorView s_dot(int robot) const noexcept;
    VectorView s_ddot(int robot) const noexcept;
    VectorView tau(int robot) const noexcept;
    Matrix4View w_H_b(int robot) const noexcept;       ///< pose of the base link, now
    Vector6View v_b(int robot) const noexcept;         ///< velocity of the base link, mixed, now
    Vector3View com(int robot) const noexcept;         ///< centre of mass, now
    Eigen::Vector3d imu_rpy(int robot) const noexcept; ///< as Simulation::imu_rpy
    Vector3View gyro(int robot) const noexcept;
    Vector3View accelerometer(int robot) const noexcept;
    Vector6View ft_wrench(int robot, int i) const noexcept;                   ///< as Simulation::ft_wrench
    Eigen::Map<const Eigen::Matrix3d> imu_rotation(int robot) const noexcept; ///< w_R_imu, now, exact
    Matrix4View foot_pose(int robot, int i) const noexcept;                   ///< as Simulation::foot_pose
    Vector6View foot_wrench(int robot, int i) const noexcept;                 ///< as Simulation::foot_wrench

    Matrix4View w_H_o(int object) const noexcept;           ///< pose of an object, now
    Eigen::Matrix4d w_H(const Frame& frame) const noexcept; ///< pose of a frame, now
    Vector6View v_o(int object) const noexcept;             ///< its velocity, mixed, now

    /// From now on contacts are remembered, which the functions below need; a saved state has them, too. Call
    /// it before the first step.
    void remember_contacts();
    /// All contacts of a body, or those with one other alone; -1: that with the world.
    Contact contact(const Frame& frame, std::optional<int> with = {}) const noexcept;
    /// Pressures (Pa) on n x m cells of a patch, n of them along x, from first to last. The normal force of
    /// each contact within goes to the four cells around it, by their distances, so that force and, off the
    /// borders, centre of pressure are kept.
    void pressures(const Patch& patch, Eigen::Ref<Eigen::MatrixXd> cells) const noexcept;

    /// How far (m) the nearest shape of another body is along each ray, now; `range` where there is none
    /// within. The rays begin at the origin of a frame, and `directions` are unit vectors there.
    void measure_rays(const Frame& frame, const Eigen::Ref<const Eigen::Matrix3Xd>& directions, double range,
                      Eigen::Ref<Eigen::VectorXd> distances) const noexcept;

    /// All positions of the scene, now, with which a figure of it is placed: for each body that floats its
    /// x y z (m), qw qx qy qz, for each joint rad or m, in MuJoCo's order.
    VectorView q() const noexcept;
    /// Kinetic and potential energy (J), now; that of springs and of gravity.
    Eigen::Vector2d energy() const noexcept;

    /// Contact forces are iterated to rounding: what differs by little between two steps is otherwise lost in
    /// the tolerance of MuJoCo's solver. A step takes longer. Throws std::bad_alloc.
    void solve_exactly(bool does);

    int state_size() const noexcept; ///< number of doubles of a saved state
    /// Writes the complete state, measurements and held inputs included.
    void save(double* state) const noexcept;
    /// Continues, bit for bit, from a state that save() wrote for the same Scene.
    void restore(const double* state) noexcept;
    /// Did a Scene of the same model, noise, imperfections and motors write a state of this size?
    bool is_of_this_scene(const double* state) const noexcept;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace bf::physics

#pragma once

#include "bf/physics/world_options.hpp"
#include "urdf.hpp"

#include <memory>
#include <mujoco/mujoco.h>
#include <string>
#include <vector>

namespace bf::physics {

struct MujocoDeleter {
    void operator()(mjSpec* spec) const { mj_deleteSpec(spec); }
    void operator()(mjModel* model) const { mj_deleteModel(model); }
    void operator()(mjData* data) const { mj_deleteData(data); }
};
using SpecPtr = std::unique_ptr<mjSpec, MujocoDeleter>;
using ModelPtr = std::unique_ptr<mjModel, MujocoDeleter>;
using DataPtr = std::unique_ptr<mjData, MujocoDeleter>;

/// From now on MuJoCo prints nothing and writes no log file in this process: warnings are counted in mjData,
/// which is where we read them, and errors, which would end the process, become std::runtime_error.
void silence_mujoco();

/// Is it a homogeneous transform?
bool is_rigid(const Eigen::MatrixXd& H);

/// Which visual parts the model keeps.
enum class Looks { none, meshes };

/// Which shapes of the URDF touch others: those that its feet have; these and, but with the ground alone, the
/// <collision> shapes of all links besides the feet; or all <collision> shapes.
enum class Touching { feet, ground, everything };

/// Fills in what the options leave to the URDF and checks every name against it. Throws std::runtime_error.
void complete(RobotOptions& options, const Urdf& urdf);

/// Step, solver, gravity: what belongs to no robot.
void set_physics(mjSpec* spec, const PhysicsOptions& options);
/// The plane z = 0, a geom "floor".
void add_floor(mjSpec* spec, const Floor& floor);
/// A body with the name and the shapes of `object`. Throws std::runtime_error for what is wrong with it.
void add_object(mjSpec* spec, const SceneObject& object);

/// MuJoCo's editable model of a robot alone; otherwise as make_spec.
SpecPtr make_robot(const RobotOptions& options, const PhysicsOptions& physics, const Urdf& urdf, Looks looks,
                   Touching touching, std::vector<std::string>& warnings);

void set_surface(mjsGeom* geom, const Surface& surface);

/// The name of what we add to a model, which nothing in a file has.
inline std::string mark(const std::string& name) { return "bf:" + name; }

/// Adds sites and sensors that carry the measurements of a robot.
void add_marks(mjSpec* spec, const RobotOptions& options);
/// The name of the joint between a gear's flanks, behind a joint with backlash.
inline std::string play_of(const std::string& joint) { return mark("play:" + joint); }

/// Entry i of a joint-wise list, or `otherwise` when the list is empty.
inline double entry(const std::vector<double>& list, size_t i, double otherwise) {
    return list.empty() ? otherwise : list[list.size() == 1 ? 0 : i];
}

/// An actuator that gives a joint the torque that is its control, without limits.
mjsActuator* add_motor(mjSpec* spec, const std::string& name, const std::string& joint);
/// The name of the actuator whose control is a damping of the joint.
inline std::string damper_of(const std::string& joint) { return mark("damper:" + joint); }

/// Adds motors to the joints of `options` and gives these what it says of them. Throws std::runtime_error
/// for backlash of a joint whose motor has no inertia.
void add_motors(mjSpec* spec, const RobotOptions& options);

/// MuJoCo's editable model of `options`, whose joint names and links must be complete (World fills them in).
/// Joints are actuated by motors of their names in the order of options.joints. Shapes of foot i are called
/// "foot:i:…". Sites "base", "imu", "ft:i", "push:i", sensors "accelerometer", "gyro", "force:i", "torque:i"
/// and the motors, all with a mark(), and sites "foot:i" carry the measurements. `warnings` receives what is
/// done otherwise than the URDF says. Throws std::runtime_error.
SpecPtr make_spec(const RobotOptions& options, const PhysicsOptions& physics, const Urdf& urdf, Looks looks,
                  std::vector<std::string>* warnings = nullptr);

/// The root of the URDF; its first link with inertia where the root is called "world", which is MuJoCo's name
/// for what stands still.
const std::string& floating_link(const Urdf& urdf);

/// Where the position of a follower and that of its leader stand in qpos.
struct FollowerAddress {
    int position, velocity, leader; ///< in qpos, qvel, qpos
    double multiplier, offset;

    void put(double* qpos) const { qpos[position] = multiplier * qpos[leader] + offset; }
};
std::vector<FollowerAddress> follower_addresses(const mjModel* model, const RobotOptions& options,
                                                const std::string& prefix = {});

/// kg, all links; a compiled model leaves out what is fixed to the world.
double total_mass(mjSpec* spec);

/// Throws std::runtime_error with MuJoCo's reason.
ModelPtr compile(mjSpec* spec, const std::filesystem::path& file);
DataPtr make_data(const mjModel* model);

/// Id of a named object; throws std::logic_error when the model lost it.
int id_of(const mjModel* model, mjtObj type, const std::string& name);

} // namespace bf::physics

#pragma once

#include "bf/physics/scene.hpp"
#include "robot_index.hpp"

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace bf::physics {

/// What of a robot only its file knows.
struct RobotStart {
    bool is_mjcf = false;
    double mass = 0.0;                                      ///< kg
    std::map<std::string, std::vector<double>> positions;   ///< of joints, from a key frame
    std::map<std::string, std::pair<double, double>> gains; ///< P and D of its position actuators, by joint
};

/// MuJoCo's editable model of a scene, whose robots it completes. Robot "a" with the link "b" is the body
/// "a/b" and so on. Throws std::runtime_error.
SpecPtr make_scene(SceneOptions& options, Looks looks, std::vector<RobotStart>& starts,
                   std::vector<std::string>& warnings);

/// Throws std::runtime_error for the first object that MuJoCo cannot compile alone.
void check_each_object(const SceneOptions& options);

/// What a message about something that stands in a file begins with.
inline std::string begin_of_message(const std::string& where) { return where.empty() ? "" : where + ": "; }

/// A body as it stands in the editable model.
struct Attached {
    std::string name, parent;
    Eigen::Matrix4d pose; ///< in the parent
};
/// All bodies; compiling a model takes those away that are fixed to others.
std::vector<Attached> bodies_of(mjSpec* spec);

struct Scene::Impl {
    SceneOptions options; ///< complete
    ModelPtr model;
    std::vector<RobotIndex> robots;
    std::vector<int> objects;                        ///< bodies
    std::vector<std::vector<std::string>> actuators; ///< per robot, those of the file
    std::vector<int> controls;                       ///< these, in ctrl
    std::vector<RobotStart> starts;
    std::vector<std::string> warnings, loop_warnings, bodies;
    std::map<std::string, Frame> links; ///< that are fixed to bodies
    Eigen::VectorXd start;              ///< nq, qpos at t = 0
    double fingerprint = 0.0;           ///< a whole number, of all that decides how a state goes on

    const RobotIndex& robot(int i) const { return robots[static_cast<size_t>(i)]; }
    /// Throws std::runtime_error, for an object that MuJoCo cannot make with its place.
    void compile_all(mjSpec* spec, const std::filesystem::path& file);
    void index();
    void index_links(const std::vector<Attached>& all);
    void place();
    /// Fills `start` of a robot on its feet; places a fixed base.
    void stand();
    void make_loops();
    void make_fingerprint();
};

} // namespace bf::physics

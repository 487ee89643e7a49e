#pragma once

#include "bf/physics/world.hpp"

#include <fstream>
#include <memory>
#include <numeric>
#include <string>

namespace bf::physics::test {

inline std::string icub_urdf() { return BF_SHARE "/iCub/robots/iCubGazeboV2_5/model.urdf"; }

inline std::vector<std::string> icub_joints() {
    return {"torso_pitch",    "torso_roll",    "torso_yaw",        "l_shoulder_pitch", "l_shoulder_roll",
            "l_shoulder_yaw", "l_elbow",       "r_shoulder_pitch", "r_shoulder_roll",  "r_shoulder_yaw",
            "r_elbow",        "l_hip_pitch",   "l_hip_roll",       "l_hip_yaw",        "l_knee",
            "l_ankle_pitch",  "l_ankle_roll",  "r_hip_pitch",      "r_hip_roll",       "r_hip_yaw",
            "r_knee",         "r_ankle_pitch", "r_ankle_roll"};
}

/// Knees slightly bent, soles flat, centre of mass over the feet (rad).
inline std::vector<double> icub_posture() {
    return {0.033, 0,      0,      -0.354, 0.5,    0,     0.801, -0.354, 0.5,  0,      0.801, 0.208,
            0.011, -0.002, -0.499, -0.292, -0.012, 0.208, 0.011, -0.002, -0.5, -0.292, -0.012};
}

inline WorldOptions icub_options() {
    WorldOptions options;
    options.urdf = icub_urdf();
    options.joints = icub_joints();
    options.initial_joints = icub_posture();
    options.feet = {{"l_sole"}, {"r_sole"}};
    options.ft_sensors = {"l_foot_ft_sensor", "r_foot_ft_sensor"};
    options.imu_frame = "imu_frame";
    options.push_links = {"chest"};
    return options;
}

inline Simulation simulate(WorldOptions options) {
    return Simulation(std::make_shared<const World>(std::move(options)));
}

/// Independent joint PD that holds the start posture: legs 400/8, torso 300/6, arms 50/2 (N m/rad, N m
/// s/rad).
class HoldPosture {
  public:
    explicit HoldPosture(const World& world) : tau(world.joint_count()), target_(world.joint_count()) {
        kp_.resize(world.joint_count());
        kd_.resize(world.joint_count());
        for (int i = 0; i < world.joint_count(); ++i) {
            const std::string& name = world.joint_names()[static_cast<size_t>(i)];
            const bool torso = name.starts_with("torso");
            const bool arm = name.find("shoulder") != name.npos || name.find("elbow") != name.npos;
            kp_[i] = torso ? 300 : arm ? 50 : 400;
            kd_[i] = torso ? 6 : arm ? 2 : 8;
            target_[i] = world.options().initial_joints.empty()
                             ? 0.0
                             : world.options().initial_joints[static_cast<size_t>(i)];
        }
    }
    std::span<const double> operator()(const Simulation& sim) {
        tau = kp_.cwiseProduct(target_ - sim.s()) - kd_.cwiseProduct(sim.s_dot());
        return {tau.data(), static_cast<size_t>(tau.size())};
    }
    Eigen::VectorXd tau;

  private:
    Eigen::VectorXd target_, kp_, kd_;
};

/// Writes a URDF with the given links and joints, returns its path.
inline std::string write_urdf(const std::string& name, const std::string& body) {
    const std::string file = BF_BINARY_DIRECTORY "/" + name + ".urdf";
    std::ofstream(file) << "<robot name=\"" << name << "\">" << body << "</robot>";
    return file;
}

/// Point-like mass `m` at distance `l` below a hinge about y, with rotational inertia `I` about its centre.
inline std::string pendulum_urdf() {
    return write_urdf("pendulum", R"(
      <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <!-- <link name="commented_out"/> -->
      <link name="bob"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
        <inertia ixx="0.02" iyy="0.03" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="tip"/>
      <joint name="swing" type="continuous"><origin xyz="0 0 1"/><axis xyz="0 1 0"/><parent link="stand"/><child link="bob"/></joint>
      <joint name="glue" type="fixed"><origin xyz="0 0 -1"/><parent link="bob"/><child link="tip"/></joint>)");
}

} // namespace bf::physics::test

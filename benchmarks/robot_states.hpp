// The iCub in random states, for us and for Pinocchio.
#pragma once

#include "bf/dynamics/data.hpp"
#include "bf/dynamics/model.hpp"

#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/model.hpp>
#include <pinocchio/parsers/urdf.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

namespace bf::benchmarks {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using VectorIn = Eigen::Ref<const Eigen::VectorXd>; // Pinocchio's library is compiled for these arguments

inline const std::string icub = BF_SHARE "/iCub/robots/iCubGazeboV2_5/model.urdf";

/// The first n of 30: torso, arms, legs; from the 24th on wrists, and one of the neck.
inline std::vector<std::string> icub_joints(int n) {
    static const std::vector<std::string> all = {
        "torso_pitch",    "torso_roll",     "torso_yaw",        "l_shoulder_pitch", "l_shoulder_roll",
        "l_shoulder_yaw", "l_elbow",        "r_shoulder_pitch", "r_shoulder_roll",  "r_shoulder_yaw",
        "r_elbow",        "l_hip_pitch",    "l_hip_roll",       "l_hip_yaw",        "l_knee",
        "l_ankle_pitch",  "l_ankle_roll",   "r_hip_pitch",      "r_hip_roll",       "r_hip_yaw",
        "r_knee",         "r_ankle_pitch",  "r_ankle_roll",     "l_wrist_prosup",   "l_wrist_pitch",
        "l_wrist_yaw",    "r_wrist_prosup", "r_wrist_pitch",    "r_wrist_yaw",      "neck_pitch"};
    return {all.begin(), all.begin() + n};
}

struct RobotState {
    Eigen::Matrix4d w_H_b = Eigen::Matrix4d::Identity();
    Eigen::VectorXd s, s_dot, forces;
    Vector6 nu_base;
};

/// 64 of them.
inline std::vector<RobotState> random_states(int n) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto draw = [&](int size) {
        return Eigen::VectorXd(
            Eigen::VectorXd::NullaryExpr(size, [&](Eigen::Index) { return uniform(random); }));
    };
    std::vector<RobotState> states(64);
    for (RobotState& state : states) {
        const Eigen::Vector4d quaternion = draw(4);
        state.w_H_b.topLeftCorner<3, 3>() = Eigen::Quaterniond(quaternion).normalized().toRotationMatrix();
        state.w_H_b.topRightCorner<3, 1>() = draw(3);
        state.s = draw(n);
        state.s_dot = draw(n);
        state.nu_base = draw(6);
        state.forces = 10.0 * draw(6 + n);
    }
    return states;
}

inline void set(const dynamics::Model& model, dynamics::Data& data, const RobotState& state) {
    dynamics::set_state(model, data, state.w_H_b, state.s, state.nu_base, state.s_dot);
}

/// The robot in Pinocchio, which keeps the velocity of the base in its own axes and the joints in its own
/// order.
struct BarePinocchio {
    explicit BarePinocchio(int n) : model(make(icub_joints(n))), data(model) {
        for (const RobotState& state : random_states(n)) {
            const Eigen::Matrix3d R = state.w_H_b.topLeftCorner<3, 3>();
            positions.emplace_back(7 + n) << state.w_H_b.topRightCorner<3, 1>(),
                Eigen::Quaterniond(R).coeffs(), state.s;
            velocities.emplace_back(6 + n) << state.nu_base, state.s_dot;
            forces.push_back(state.forces);
        }
    }
    static pinocchio::Model make(const std::vector<std::string>& joints) {
        pinocchio::Model full;
        pinocchio::urdf::buildModel(icub, pinocchio::JointModelFreeFlyer(), full);
        std::vector<pinocchio::JointIndex> locked;
        for (pinocchio::JointIndex i = 2; i < full.names.size(); ++i)
            if (std::find(joints.begin(), joints.end(), full.names[i]) == joints.end()) locked.push_back(i);
        return pinocchio::buildReducedModel(full, locked, pinocchio::neutral(full));
    }

    pinocchio::Model model;
    pinocchio::Data data;
    std::vector<Eigen::VectorXd> positions, velocities, forces;
};

} // namespace bf::benchmarks

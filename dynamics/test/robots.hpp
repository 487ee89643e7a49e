#pragma once

#include "bf/dynamics/algorithms.hpp"

#include <Eigen/Geometry>

#include <limits>
#include <random>
#include <string>
#include <vector>

namespace bf::dynamics::test {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;

constexpr double infinity = std::numeric_limits<double>::infinity();

inline const std::string icub = BF_SHARE "/iCub/robots/iCubGazeboV2_5/model.urdf";

inline const std::vector<std::string> icub_joints = {
    "torso_pitch",    "torso_roll",    "torso_yaw",        "l_shoulder_pitch", "l_shoulder_roll",
    "l_shoulder_yaw", "l_elbow",       "r_shoulder_pitch", "r_shoulder_roll",  "r_shoulder_yaw",
    "r_elbow",        "l_hip_pitch",   "l_hip_roll",       "l_hip_yaw",        "l_knee",
    "l_ankle_pitch",  "l_ankle_roll",  "r_hip_pitch",      "r_hip_roll",       "r_hip_yaw",
    "r_knee",         "r_ankle_pitch", "r_ankle_roll"};

struct State {
    Eigen::Matrix4d w_H_b = Eigen::Matrix4d::Identity();
    Eigen::VectorXd s;
    Vector6 nu_base;
    Eigen::VectorXd s_dot;

    Eigen::VectorXd nu() const { return (Eigen::VectorXd(6 + s.size()) << nu_base, s_dot).finished(); }
};

inline Eigen::VectorXd random_vector(Eigen::Index size, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    return Eigen::VectorXd::NullaryExpr(size, [&](Eigen::Index) { return uniform(random); });
}

inline State random_state(int joints, std::mt19937& random) {
    State state;
    const Eigen::Vector4d quaternion = random_vector(4, random);
    state.w_H_b.topLeftCorner<3, 3>() = Eigen::Quaterniond(quaternion).normalized().toRotationMatrix();
    state.w_H_b.topRightCorner<3, 1>() = 3.0 * random_vector(3, random);
    state.s = random_vector(joints, random);
    state.nu_base = 2.0 * random_vector(6, random);
    state.s_dot = 2.0 * random_vector(joints, random);
    return state;
}

inline void set(const Model& model, Data& data, const State& state) {
    set_state(model, data, state.w_H_b, state.s, state.nu_base, state.s_dot);
}

/// The state a time dt later at constant nu.
inline State moved(const State& state, double dt) {
    State later = state;
    const Eigen::Vector3d turn = dt * state.nu_base.tail<3>();
    later.w_H_b.topLeftCorner<3, 3>() =
        Eigen::AngleAxisd(turn.norm(), turn.normalized()) * state.w_H_b.topLeftCorner<3, 3>();
    later.w_H_b.topRightCorner<3, 1>() += dt * state.nu_base.head<3>();
    later.s += dt * state.s_dot;
    return later;
}

/// Every quantity of a state, as values.
struct Quantities {
    Eigen::Matrix4d w_H_f, relative;
    Matrix6X J, A, relative_J;
    Vector6 J_dot_nu, H, A_dot_nu;
    Eigen::Vector3d com, com_dot, com_J_dot_nu;
    Eigen::Matrix<double, 3, Eigen::Dynamic> com_J;
    Eigen::MatrixXd M, C, M_dot;
    Eigen::VectorXd h, g, c, tau, push, nu_dot;

    explicit Quantities(const Model& model)
        : J(6, model.velocities()), A(6, model.velocities()), relative_J(6, model.joints()),
          com_J(3, model.velocities()), M(model.velocities(), model.velocities()), C(M), M_dot(M),
          h(model.velocities()), g(h), c(h), tau(h), push(h), nu_dot(h) {}

    /// Asks for all of them. The two frames are `frame` and, for relative quantities, `reference`; `given`
    /// are the accelerations that tau makes and the generalised forces that make nu_dot.
    void compute(const Model& model, Data& data, Frame frame, Frame reference, const Eigen::VectorXd& given) {
        forward_kinematics(model, data, frame, w_H_f);
        jacobian(model, data, frame, J);
        bias_acceleration(model, data, frame, J_dot_nu);
        center_of_mass(model, data, com);
        center_of_mass_velocity(model, data, com_dot);
        com_jacobian(model, data, com_J);
        com_bias_acceleration(model, data, com_J_dot_nu);
        mass_matrix(model, data, M);
        bias_forces(model, data, h);
        gravity_forces(model, data, g);
        coriolis_forces(model, data, c);
        coriolis_matrix(model, data, C);
        mass_matrix_derivative(model, data, M_dot);
        inverse_dynamics(model, data, given.head<6>(), given.tail(model.joints()), tau);
        push.setZero();
        add_wrench(model, data, frame, Vector6(1.0, -2.0, 3.0, 0.5, 0.6, -0.7), push);
        forward_dynamics(model, data, given.tail(model.velocities()), nu_dot);
        centroidal_momentum(model, data, H);
        centroidal_momentum_matrix(model, data, A);
        centroidal_momentum_bias(model, data, A_dot_nu);
        relative_transform(model, data, reference, frame, relative);
        relative_jacobian(model, data, reference, frame, relative_J);
    }

    bool operator==(const Quantities&) const = default;
};

} // namespace bf::dynamics::test

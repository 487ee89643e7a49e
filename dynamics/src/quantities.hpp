// What is asked for of a state, as bf/dynamics/algorithms.hpp says it: a template over the numbers of the
// state.
#pragma once

#include "recursions.hpp"

#include <algorithm>
#include <type_traits>

namespace bf::dynamics {

inline const Placement& placement(const Model::Content& model, Frame frame) {
    return model.frames[static_cast<std::size_t>(frame.index)];
}

/// Pose of a frame where the bodies are at these poses.
template <class Number>
PoseOf<Number> operator*(const std::vector<PoseOf<Number>>& bodies, const Placement& frame) {
    const PoseOf<Number>& body = bodies[frame.body];
    return {body.rotation * frame.rotation, body.rotation * frame.translation + body.translation};
}

/// Calls f(joint, body that it moves, factor) for each joint that carries a body, with the factor by which
/// the body's joint follows.
template <class F> void for_each_joint(const Model::Content& model, std::size_t body, const F& f) {
    for (const Support& support : model.supports[body]) f(support.joint, support.body, 1.0);
    for (const Support& support : model.follower_supports[body]) {
        const FollowerIndex& follower =
            model.moving_followers[static_cast<std::size_t>(support.joint) - model.joint_names.size()];
        f(follower.leader, support.body, follower.factor);
    }
}

/// Adds sign times what the joints that carry a body contribute to the velocity of its point p, each per unit
/// of its velocity. Column(k) is the motion that the joint of body k gives to the point at the origin.
/// `first` is the column of the first joint.
template <class Number, class Column, class Out>
void add_joints(const Model::Content& model, std::size_t body, const Vector3Of<Number>& p, double sign,
                Eigen::Index first, const Column& column, Out&& J) {
    for_each_joint(model, body, [&](int joint, std::size_t k, double factor) {
        const Motion<Number>& S = column(k);
        J.col(first + joint).template head<3>() += sign * factor * (S.linear + S.angular.cross(p));
        J.col(first + joint).template tail<3>() += sign * factor * S.angular;
    });
}

template <class Number, class Out>
void forward_kinematics(const Model::Content& model, StateOf<Number>& d, Frame frame, Out&& w_H_f) {
    update_kinematics(model, d);
    const PoseOf<Number> pose = d.in_world * placement(model, frame);
    w_H_f.template topLeftCorner<3, 3>() = pose.rotation;
    w_H_f.template block<3, 1>(0, 3) = d.p + pose.translation;
    w_H_f.row(3) << 0.0, 0.0, 0.0, 1.0;
}

template <class Number, class Out>
void jacobian(const Model::Content& model, StateOf<Number>& d, Frame frame, Out&& J) {
    update_kinematics(model, d);
    const Placement& link = placement(model, frame);
    const Vector3Of<Number> p = (d.in_world * link).translation;
    const Eigen::Index first = model.base_velocities;
    J.setZero();
    if (first != 0) {
        J.template leftCols<6>().diagonal().setOnes();
        J.template block<3, 3>(0, 3) = -skew(p);
    }
    add_joints(
        model, link.body, p, 1.0, first, [&](std::size_t k) -> const Motion<Number>& { return d.columns[k]; },
        J);
}

template <class Number, class Out>
void frame_velocity(const Model::Content& model, StateOf<Number>& d, Frame frame, Out&& J_nu) {
    update_bias(model, d);
    const Placement& link = placement(model, frame);
    const Motion<Number>& v = d.velocity[link.body];
    J_nu.template head<3>() = d.p_dot + v.linear + v.angular.cross((d.in_world * link).translation);
    J_nu.template tail<3>() = v.angular;
}

template <class Number, class Out>
void bias_acceleration(const Model::Content& model, StateOf<Number>& d, Frame frame, Out&& J_dot_nu) {
    update_bias(model, d);
    const Placement& link = placement(model, frame);
    const Vector3Of<Number> p = (d.in_world * link).translation;
    const Motion<Number>&v = d.velocity[link.body], &a = d.acceleration[link.body];
    J_dot_nu.template head<3>() = a.linear + a.angular.cross(p) +
                                  v.angular.cross(v.linear + v.angular.cross(p)) +
                                  model.gravity.template cast<Number>();
    J_dot_nu.template tail<3>() = a.angular;
}

template <class Number, class Out>
void center_of_mass(const Model::Content& model, StateOf<Number>& d, Out&& com) {
    update_mass(model, d);
    com = d.p + d.com;
}

template <class Number, class Out>
void center_of_mass_velocity(const Model::Content& model, StateOf<Number>& d, Out&& com_dot) {
    update_momentum(model, d);
    com_dot = d.H.template head<3>() / model.total_mass;
}

template <class Number, class Out>
void com_jacobian(const Model::Content& model, StateOf<Number>& d, Out&& J) {
    update_mass(model, d);
    const double inverse_mass = 1.0 / model.total_mass;
    const auto own = d.M.rightCols(J.cols());
    for (Eigen::Index j = 0; j < J.cols(); ++j) J.col(j) = inverse_mass * own.col(j).template head<3>();
}

template <class Number, class Out>
void com_bias_acceleration(const Model::Content& model, StateOf<Number>& d, Out&& J_dot_nu) {
    update_bias(model, d);
    // The first rows of the equations of motion are those of the centre of mass: m J_dot_nu = h + m g.
    J_dot_nu = d.h.template head<3>() / model.total_mass + model.gravity.template cast<Number>();
}

template <class Number, class Out>
void mass_matrix(const Model::Content& model, StateOf<Number>& d, Out&& M) {
    update_mass(model, d);
    const auto own = d.M.bottomRightCorner(M.rows(), M.cols());
    for (Eigen::Index j = 0; j < M.cols(); ++j) std::copy_n(own.col(j).data(), M.rows(), M.col(j).data());
}

template <class Number, class Out>
void bias_forces(const Model::Content& model, StateOf<Number>& d, Out&& h) {
    update_bias(model, d);
    h = d.h.tail(h.size());
}

template <class Number, class Out>
void gravity_forces(const Model::Content& model, StateOf<Number>& d, Out&& g) {
    update_mass(model, d);
    // Gravity acts like an acceleration of the base the other way.
    g.noalias() = d.M.bottomRows(g.size()).template leftCols<3>() * -model.gravity.template cast<Number>();
}

template <class Number, class Out>
void coriolis_forces(const Model::Content& model, StateOf<Number>& d, Out&& c) {
    update_mass(model, d);
    bias_forces(model, d, c);
    c.noalias() += d.M.bottomRows(c.size()).template leftCols<3>() * model.gravity.template cast<Number>();
}

template <class Number, class Out>
void coriolis_matrix(const Model::Content& model, StateOf<Number>& d, Out&& C) {
    update_coriolis(model, d);
    C = d.C.bottomRightCorner(C.rows(), C.cols());
}

template <class Number, class Out>
void mass_matrix_derivative(const Model::Content& model, StateOf<Number>& d, Out&& M_dot) {
    update_coriolis(model, d);
    const auto C = d.C.bottomRightCorner(M_dot.rows(), M_dot.cols());
    M_dot.noalias() = C + C.transpose();
}

template <class Number, class Wrench, class Out>
void add_wrench(const Model::Content& model, StateOf<Number>& d, Frame frame, const Wrench& f, Out&& forces) {
    update_kinematics(model, d);
    const Placement& link = placement(model, frame);
    const Vector3Of<Number> force = f.template head<3>();
    // About the origin of the base, from which bodies are placed.
    const Vector3Of<Number> moment = f.template tail<3>() + (d.in_world * link).translation.cross(force);
    const Eigen::Index first = model.base_velocities;
    if (first != 0) {
        forces.template head<3>() += force;
        forces.template segment<3>(3) += moment;
    }
    for_each_joint(model, link.body, [&](int joint, std::size_t k, double factor) {
        forces[first + joint] += factor * (d.columns[k].linear.dot(force) + d.columns[k].angular.dot(moment));
    });
}

template <class Number, class Base, class Joints, class Out>
void inverse_dynamics(const Model::Content& model, StateOf<Number>& d, const Base& base_acceleration,
                      const Joints& s_ddot, Out&& tau) {
    bias_forces(model, d, tau);
    // Nothing accelerates: M, which takes longest, is not needed. Accelerations of 0 may still change.
    if constexpr (std::is_same_v<Number, double>)
        if (base_acceleration.isZero(0.0) && s_ddot.isZero(0.0)) return;
    update_mass(model, d);
    const auto M = d.M.bottomRows(tau.size());
    tau.noalias() += M.template leftCols<6>() * base_acceleration;
    tau.noalias() += M.rightCols(s_ddot.size()) * s_ddot;
}

template <class Number, class Out>
void centroidal_momentum(const Model::Content& model, StateOf<Number>& d, Out&& H) {
    update_momentum(model, d);
    H = d.H;
}

template <class Number, class Out>
void centroidal_momentum_matrix(const Model::Content& model, StateOf<Number>& d, Out&& A) {
    update_mass(model, d);
    const auto own = d.M.rightCols(A.cols());
    for (Eigen::Index j = 0; j < A.cols(); ++j) {
        const Vector3Of<Number> force = own.col(j).template head<3>();
        A.col(j).template head<3>() = force;
        A.col(j).template tail<3>() = own.col(j).template segment<3>(3) - d.com.cross(force);
    }
}

template <class Number, class Out>
void centroidal_momentum_bias(const Model::Content& model, StateOf<Number>& d, Out&& A_dot_nu) {
    update_mass(model, d);
    update_bias(model, d);
    // The forces h of this motion change the momentum; weight has no moment about the centre of mass.
    const Vector3Of<Number> force = d.h.template head<3>();
    A_dot_nu.template head<3>() = force + model.total_mass * model.gravity.template cast<Number>();
    A_dot_nu.template tail<3>() = d.h.template segment<3>(3) - d.com.cross(force);
}

template <class Number, class Out>
void relative_transform(const Model::Content& model, StateOf<Number>& d, Frame reference, Frame frame,
                        Out&& reference_H_frame) {
    update_joints(model, d);
    const PoseOf<Number> from = d.in_base * placement(model, reference);
    const PoseOf<Number> to = d.in_base * placement(model, frame);
    reference_H_frame.template topLeftCorner<3, 3>() = from.rotation.transpose() * to.rotation;
    reference_H_frame.template block<3, 1>(0, 3) =
        from.rotation.transpose() * (to.translation - from.translation);
    reference_H_frame.row(3) << 0.0, 0.0, 0.0, 1.0;
}

template <class Number, class Out>
void relative_jacobian(const Model::Content& model, StateOf<Number>& d, Frame reference, Frame frame,
                       Out&& J) {
    update_joints(model, d);
    const Placement &from = placement(model, reference), &to = placement(model, frame);
    const Vector3Of<Number> p = (d.in_base * to).translation;
    const auto column = [&](std::size_t k) { return motion(model.bodies[k], d.in_base[k]); };
    J.setZero();
    // A joint that carries both frames moves neither relative to the other: its two contributions cancel
    // exactly.
    add_joints(model, to.body, p, 1.0, 0, column, J);
    add_joints(model, from.body, p, -1.0, 0, column, J);
    const Matrix3Of<Number> R_transpose = (d.in_base * from).rotation.transpose();
    for (Eigen::Index j = 0; j < J.cols(); ++j) {
        const Eigen::Matrix<Number, 6, 1> moved = J.col(j);
        J.col(j).template head<3>() = R_transpose * moved.template head<3>();
        J.col(j).template tail<3>() = R_transpose * moved.template tail<3>();
    }
}

} // namespace bf::dynamics

#include "bf/dynamics/tasks.hpp"

#include "bf/dynamics/lie.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace bf::dynamics {
namespace {

using Eigen::Index;
using Kind = Target::Kind;

/// Bounds of equalities, and weights.
void finish(MatrixOut rows, const VectorIn& weight) {
    const Index a = rows.cols() - row_extra;
    rows.col(a + 1) = rows.col(a);
    rows.col(a + 2) = weight;
}

/// acceleration + K_d (velocity - now) + K_p error - bias
template <class Bound, class Now, class Bias>
void answer(Bound&& bound, const Wanted& wanted, const VectorIn& error, const Now& now, const Bias& bias) {
    bound = wanted.acceleration + wanted.kd.cwiseProduct(wanted.velocity - now) +
            wanted.kp.cwiseProduct(error) - bias;
}

/// Upper bound of the acceleration: `room` is what is left to the limit in the direction of the velocity v.
double most(double room, double v, double max_speed, double max_acceleration, double T) {
    const double stopping = -v / T; // ends the period at rest
    double bound = std::min(max_acceleration, (max_speed - v) / T);
    if (room < std::numeric_limits<double>::infinity()) {
        // Within the period: the position is largest at its end, or where the velocity crosses zero before.
        const double at_end = 2.0 * (room - T * v) / (T * T);
        double within = at_end;
        if (v > 0.0 && at_end <= stopping)
            within = room > 0.0 ? std::min(stopping, -v * v / (2.0 * room)) : -max_acceleration;
        // After it: v'² ≤ 2 max_acceleration room' for the velocity v' = v + T a and the room then, where v'
        // > 0.
        const double b = T * (2.0 * v + max_acceleration * T);
        const double c = v * v - 2.0 * max_acceleration * (room - T * v);
        const double discriminant = b * b - 4.0 * T * T * c;
        const double after = discriminant >= 0.0
                                 ? std::max(stopping, (std::sqrt(discriminant) - b) / (2.0 * T * T))
                                 : stopping;
        bound = std::min({bound, within, after});
    }
    return std::max(bound, -max_acceleration);
}

/// A of the rows of a contact: their upper bounds are 0, but for the row of the normal force.
void contact_matrix(const Eigen::Ref<const Eigen::Matrix3d>& w_R_c, const ContactLimits& limits,
                    MatrixOut A) {
    const Index faces = limits.faces;
    const auto x = w_R_c.col(0).transpose(), y = w_R_c.col(1).transpose(), z = w_R_c.col(2).transpose();
    A.setZero();
    const double slope = limits.friction * std::cos(std::numbers::pi / static_cast<double>(faces));
    for (Index k = 0; k < faces; ++k) {
        const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(faces);
        A.row(k).head<3>() = std::cos(angle) * x + std::sin(angle) * y - slope * z;
    }
    A.row(faces).head<3>() = z;
    if (A.cols() == 3) return;
    // ±m_z ≤ torsion f_z;  x_min f_z ≤ -m_y ≤ x_max f_z;  y_min f_z ≤ m_x ≤ y_max f_z
    const auto row = [&](Index k, double of_force, double of_moment, const auto& axis) {
        A.row(faces + k).head<3>() = of_force * z;
        A.row(faces + k).segment<3>(3) = of_moment * axis;
    };
    row(1, -limits.torsion, 1.0, z);
    row(2, -limits.torsion, -1.0, z);
    row(3, limits.x_min, 1.0, y);
    row(4, -limits.x_max, -1.0, y);
    row(5, limits.y_min, -1.0, x);
    row(6, -limits.y_max, 1.0, x);
}

} // namespace

void cartesian_task(const Model& model, Data& data, Frame frame, Kind kind,
                    const Eigen::Ref<const Eigen::Matrix4d>& target, const Wanted& wanted, MatrixOut rows,
                    VectorOut error, Matrix6XOut J) noexcept {
    assert(kind != Kind::center_of_mass);
    const Index count = kind == Kind::pose ? 6 : 3, first = kind == Kind::orientation ? 3 : 0,
                a = model.velocities();
    Eigen::Matrix4d H;
    Eigen::Matrix<double, 6, 1> bias, now;
    forward_kinematics(model, data, frame, H);
    jacobian(model, data, frame, J);
    bias_acceleration(model, data, frame, bias);
    frame_velocity(model, data, frame, now);
    if (kind != Kind::orientation) error.head<3>() = target.topRightCorner<3, 1>() - H.topRightCorner<3, 1>();
    if (kind != Kind::position) {
        error.tail<3>() = rotation_log(target.topLeftCorner<3, 3>() * H.topLeftCorner<3, 3>().transpose());
    }
    rows.leftCols(a) = J.middleRows(first, count);
    answer(rows.col(a), wanted, error, now.segment(first, count), bias.segment(first, count));
    finish(rows, wanted.weight);
}

void com_task(const Model& model, Data& data, const Eigen::Ref<const Eigen::Vector3d>& target,
              const Wanted& wanted, MatrixOut rows, VectorOut error) noexcept {
    const Index a = model.velocities();
    Eigen::Vector3d com, now, bias;
    center_of_mass(model, data, com);
    center_of_mass_velocity(model, data, now);
    com_bias_acceleration(model, data, bias);
    com_jacobian(model, data, rows.topRows<3>().leftCols(a));
    error = target - com;
    answer(rows.col(a), wanted, error, now, bias);
    finish(rows, wanted.weight);
}

void momentum_task(const Model& model, Data& data,
                   const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& target,
                   const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& rate, const VectorIn& k,
                   const VectorIn& weight, MatrixOut rows, VectorOut error) noexcept {
    const Index a = model.velocities();
    Eigen::Matrix<double, 6, 1> momentum, bias;
    centroidal_momentum(model, data, momentum);
    centroidal_momentum_bias(model, data, bias);
    centroidal_momentum_matrix(model, data, rows.topRows<6>().leftCols(a));
    error = target - momentum;
    rows.col(a) = rate + k.cwiseProduct(error) - bias;
    finish(rows, weight);
}

void posture_task(const Model& model, const VectorIn& s, const VectorIn& s_dot, const VectorIn& target,
                  const Wanted& wanted, MatrixOut rows, VectorOut error) noexcept {
    const Index a = model.velocities(), n = model.joints();
    rows.leftCols(a - n).setZero();
    rows.middleCols(a - n, n).setIdentity();
    error = target - s;
    answer(rows.col(a), wanted, error, s_dot, Eigen::VectorXd::Zero(n));
    finish(rows, wanted.weight);
}

void rigid_contact(const Model& model, Data& data, Frame frame, double damping, MatrixOut rows,
                   Matrix6XOut J) noexcept {
    const Index count = rows.rows(), a = model.velocities();
    Eigen::Matrix<double, 6, 1> bias, now;
    jacobian(model, data, frame, J);
    bias_acceleration(model, data, frame, bias);
    frame_velocity(model, data, frame, now);
    rows.leftCols(a) = J.topRows(count);
    rows.col(a) = -bias.head(count) - damping * now.head(count);
    rows.col(a + 1) = rows.col(a);
    rows.col(a + 2).setOnes();
}

void contact_limits(const Eigen::Ref<const Eigen::Matrix3d>& w_R_c, const ContactLimits& limits,
                    MatrixOut rows) noexcept {
    const Index a = rows.cols() - row_extra, faces = limits.faces;
    contact_matrix(w_R_c, limits, rows.leftCols(a));
    rows.col(a).setConstant(-std::numeric_limits<double>::infinity());
    rows.col(a + 1).setZero();
    rows.col(a + 2).setOnes();
    rows(faces, a) = limits.min_force;
    rows(faces, a + 1) = limits.max_force;
}

void contact_inequalities(const Eigen::Ref<const Eigen::Matrix3d>& w_R_c, const ContactLimits& limits,
                          MatrixOut C, VectorOut d) noexcept {
    const Index rows = C.rows() - 1, faces = limits.faces;
    contact_matrix(w_R_c, limits, C.topRows(rows));
    C.row(rows) = -C.row(faces);
    d.setZero();
    d[faces] = limits.max_force;
    d[rows] = -limits.min_force;
}

void motion_equations(const Model& model, Data& data, const std::vector<Contact>& contacts, MatrixOut matrix,
                      VectorOut h, Matrix6XOut J) noexcept {
    Index column = model.velocities();
    mass_matrix(model, data, matrix.leftCols(column));
    bias_forces(model, data, h);
    for (const Contact& contact : contacts) {
        jacobian(model, data, contact.frame, J);
        matrix.middleCols(column, contact.size) = -J.topRows(contact.size).transpose();
        column += contact.size;
    }
}

AccelerationBounds acceleration_bounds(double s, double s_dot, double s_min, double s_max, double max_speed,
                                       double max_acceleration, double period) noexcept {
    AccelerationBounds bounds{-most(s - s_min, -s_dot, max_speed, max_acceleration, period),
                              most(s_max - s, s_dot, max_speed, max_acceleration, period)};
    if (bounds.lower > bounds.upper) bounds.lower = bounds.upper = 0.5 * (bounds.lower + bounds.upper);
    return bounds;
}

} // namespace bf::dynamics

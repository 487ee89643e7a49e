#include "bf/walking/swing.hpp"

#include <algorithm>

namespace bf::walking {

Motion towards(const Motion& from, const Eigen::Vector3d& target, double time_left, double dt) noexcept {
    if (!(dt < time_left)) return {target, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    // In units of the time that is left: p = p0 + v0 x + a0/2 x² + c3 x³ + c4 x⁴ + c5 x⁵.
    const double T = time_left, x = dt / T;
    const Eigen::Vector3d v0 = T * from.velocity, a0 = T * T * from.acceleration, d = target - from.position;
    const Eigen::Vector3d c3 = 10 * d - 6 * v0 - 1.5 * a0, c4 = -15 * d + 8 * v0 + 1.5 * a0,
                          c5 = 6 * d - 3 * v0 - 0.5 * a0;
    Motion to;
    to.position = from.position + x * (v0 + x * (0.5 * a0 + x * (c3 + x * (c4 + x * c5))));
    to.velocity = (v0 + x * (a0 + x * (3 * c3 + x * (4 * c4 + x * 5 * c5)))) / T;
    to.acceleration = (a0 + x * (6 * c3 + x * (12 * c4 + x * 20 * c5))) / (T * T);
    return to;
}

void climb(Motion& along, double z_0, double z_1, double t, double T) noexcept {
    const double half = T / 2, y = std::clamp((t - (z_1 < z_0 ? half : 0.0)) / half, 0.0, 1.0), d = z_1 - z_0;
    along.position.z() = z_0 + d * y * y * y * (10 - 15 * y + 6 * y * y);
    along.velocity.z() = d * 30 * y * y * (1 - y) * (1 - y) / half;
    along.acceleration.z() = d * 60 * y * (1 - y) * (1 - 2 * y) / (half * half);
}

SwingState swing(const Motion& along, const Eigen::Matrix3d& R_0, const Eigen::Matrix3d& R_1, double apex,
                 double pitch, double t, double T) noexcept {
    const double x = std::clamp(t / T, 0.0, 1.0), y = 1 - x;
    SwingState state;
    state.pose.topRightCorner<3, 1>() = along.position;
    state.velocity.head<3>() = along.velocity;
    state.acceleration.head<3>() = along.acceleration;
    state.pose(2, 3) += 64 * apex * x * x * x * y * y * y;
    state.velocity[2] += 192 * apex * x * x * y * y * (y - x) / T;
    state.acceleration[2] += 384 * apex * x * y * (y * y - 3 * x * y + x * x) / (T * T);

    const Eigen::AngleAxisd turn(R_0.transpose() * R_1);
    const double s = x * x * x * (10 - 15 * x + 6 * x * x), s_dot = 30 * x * x * y * y / T,
                 s_ddot = 60 * x * y * (y - x) / (T * T);
    const Eigen::Matrix3d R = R_0 * Eigen::AngleAxisd(s * turn.angle(), turn.axis()).toRotationMatrix();
    const Eigen::Vector3d axis = R_0 * turn.axis() * turn.angle(), omega = s_dot * axis;

    constexpr double scale = 8.0 * 8 * 8 * 8 * 8 * 8 * 8 * 8 / (27.0 * 3125);
    const double c = scale * pitch, b = c * x * x * x * y * y * y * y * y,
                 b_dot = c * x * x * y * y * y * y * (3 * y - 5 * x) / T,
                 b_ddot = c * x * y * y * y * ((2 * y - 4 * x) * (3 * y - 5 * x) - 8 * x * y) / (T * T);
    state.pose.topLeftCorner<3, 3>() = R * Eigen::AngleAxisd(b, Eigen::Vector3d::UnitY()).toRotationMatrix();
    state.velocity.tail<3>() = omega + b_dot * R.col(1);
    state.acceleration.tail<3>() = s_ddot * axis + b_ddot * R.col(1) + b_dot * omega.cross(R.col(1));
    return state;
}

} // namespace bf::walking

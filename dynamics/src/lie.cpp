#include "bf/dynamics/lie.hpp"

#include <Eigen/Geometry>

#include <cmath>

namespace bf::dynamics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// f_k(x) = Σ_i (-x)ⁱ/(2i+k)! with two derivatives; of x = |φ|²: f_1 = sin|φ|/|φ|, f_2 = (1 - cos|φ|)/|φ|²,
/// ...
struct Coefficient {
    double value = 0.0, first = 0.0, second = 0.0;
};

Coefficient coefficient(int k, double x) noexcept {
    Coefficient f;
    double factorial = 1.0;
    for (int i = 2; i <= k; ++i) factorial *= i;
    // Turns are at most π, where these terms go down to 1e-17 of the first.
    double power = 1.0 / factorial;   // (-1)ⁱ xⁱ/(2i+k)!
    double lower = 0.0, lowest = 0.0; // the same with x^(i-1), x^(i-2)
    for (int i = 0; i < 22; ++i) {
        f.value += power;
        f.first += i * lower;
        f.second += i * (i - 1) * lowest;
        const double next = -1.0 / ((2 * i + k + 1.0) * (2 * i + k + 2.0));
        lowest = lower * next;
        lower = power * next;
        power = lower * x;
    }
    return f;
}

Matrix3d series(const Vector3d& phi, double zeroth, int k) noexcept {
    const Matrix3d S = skew(phi);
    const double x = phi.squaredNorm();
    return zeroth * Matrix3d::Identity() + coefficient(k, x).value * S + coefficient(k + 1, x).value * S * S;
}

} // namespace

Matrix3d skew(const Vector3d& v) noexcept {
    Matrix3d S;
    S << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
    return S;
}

Matrix3d rotation_exp(const Vector3d& phi) noexcept {
    const double angle = phi.norm();
    return angle > 0.0 ? Eigen::AngleAxisd(angle, phi / angle).toRotationMatrix() : Matrix3d::Identity();
}

Vector3d rotation_log(const Matrix3d& R) noexcept {
    const Eigen::AngleAxisd turn(R);
    return turn.angle() * turn.axis();
}

Eigen::Matrix<double, 6, 1> pose_error(const Eigen::Matrix4d& pose, const Eigen::Matrix4d& target) noexcept {
    Eigen::Matrix<double, 6, 1> error;
    error.head<3>() = target.topRightCorner<3, 1>() - pose.topRightCorner<3, 1>();
    error.tail<3>() = rotation_log(target.topLeftCorner<3, 3>() * pose.topLeftCorner<3, 3>().transpose());
    return error;
}

Matrix3d left_jacobian(const Vector3d& phi) noexcept { return series(phi, 1.0, 2); }

Matrix3d second_left_jacobian(const Vector3d& phi) noexcept { return series(phi, 0.5, 3); }

Jet left_jacobian_times(const Jet& phi, const Jet& u) noexcept {
    // J u = u + b φ×u + c φ×(φ×u), b and c functions of x = |φ|²
    const double x = phi.value.squaredNorm(), x_dot = 2.0 * phi.value.dot(phi.rate),
                 x_ddot = 2.0 * (phi.rate.squaredNorm() + phi.value.dot(phi.second));
    const Coefficient f2 = coefficient(2, x), f3 = coefficient(3, x);
    const double b = f2.value, b_dot = f2.first * x_dot,
                 b_ddot = f2.second * x_dot * x_dot + f2.first * x_ddot;
    const double c = f3.value, c_dot = f3.first * x_dot,
                 c_ddot = f3.second * x_dot * x_dot + f3.first * x_ddot;
    const auto cross = [](const Jet& left, const Jet& right) {
        return Jet{left.value.cross(right.value), left.rate.cross(right.value) + left.value.cross(right.rate),
                   left.second.cross(right.value) + 2.0 * left.rate.cross(right.rate) +
                       left.value.cross(right.second)};
    };
    const Jet once = cross(phi, u), twice = cross(phi, once);
    return {u.value + b * once.value + c * twice.value,
            u.rate + b_dot * once.value + b * once.rate + c_dot * twice.value + c * twice.rate,
            u.second + b_ddot * once.value + 2.0 * b_dot * once.rate + b * once.second +
                c_ddot * twice.value + 2.0 * c_dot * twice.rate + c * twice.second};
}

} // namespace bf::dynamics

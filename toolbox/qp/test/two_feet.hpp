#pragma once

#include <Eigen/Geometry>
#include <bf/qp/solver.hpp>
#include <cmath>
#include <numbers>
#include <vector>

/// The contact-wrench problems of a humanoid that balances on two feet: 12 variables, 38 constraints.
namespace bf::qp::two_feet {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

struct Balancing {
    Eigen::MatrixXd H;   // 12 × 12
    Eigen::VectorXd g;   // 12
    Eigen::MatrixXd A;   // 38 × 12
    Eigen::VectorXd ubA; // 38

    Problem problem() const { return {.H = H, .g = g, .A = A, .ubA = ubA}; }
};

inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
    return (Eigen::Matrix3d() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished();
}

/// The 19 rows C of one foot on [force; moment] in the sole frame: a 12-sided friction cone (μ = 1/3),
/// torsional friction (1/75), least normal force, centre of pressure inside the sole.
inline Eigen::Matrix<double, 19, 6> foot_rows() {
    constexpr double pi = std::numbers::pi, x_min = -0.045, x_max = 0.098, y_min = -0.028, y_max = 0.028;
    Eigen::Matrix<double, 19, 6> C = Eigen::Matrix<double, 19, 6>::Zero();
    for (int i = 0; i < 12; ++i) {
        const double angle = pi / 12 + i * pi / 6;
        C.row(i) << std::cos(angle), std::sin(angle), -std::cos(pi / 12) / 3.0, 0, 0, 0;
    }
    C.row(12) << 0, 0, -1.0 / 75, 0, 0, 1;
    C.row(13) << 0, 0, -1.0 / 75, 0, 0, -1;
    C.row(14) << 0, 0, -1, 0, 0, 0;
    C.row(15) << 0, 0, x_min, 0, 1, 0;
    C.row(16) << 0, 0, -x_max, 0, -1, 0;
    C.row(17) << 0, 0, y_min, -1, 0, 0;
    C.row(18) << 0, 0, -y_max, 1, 0, 0;
    return C;
}

/// Problem k of a robot of 33 kg that sways from foot to foot; neighbours differ little, as at 100 Hz:
/// min ½ |A_f f − r|² + ½ w |τ + Σ f|² + ½ ε |f|² over the wrenches f, with w = 1e-3, ε = 1e-6.
inline Balancing make(int k) {
    constexpr double mass = 33.06, w = 1e-3, epsilon = 1e-6;
    const double t = 0.01 * k;
    const Eigen::Vector3d com(0.03 + 0.03 * std::sin(0.7 * t), 0.06 * std::sin(t), 0.54);
    const Eigen::Vector3d acceleration(0.8 * std::sin(1.3 * t), 1.2 * std::sin(1.7 * t), 0.5 * std::sin(t));
    Vector6 r;
    r << mass * (acceleration + Eigen::Vector3d(0, 0, 9.81)), std::sin(t), 2 * std::cos(t),
        0.3 * std::sin(2 * t);

    Eigen::Matrix<double, 6, 12> map;
    Balancing b{Eigen::MatrixXd(12, 12), Eigen::VectorXd(12), Eigen::MatrixXd::Zero(38, 12),
                Eigen::VectorXd::Zero(38)};
    for (int foot = 0; foot < 2; ++foot) {
        const double side = foot == 0 ? 1.0 : -1.0;
        const Eigen::Vector3d sole(0.0, 0.075 * side, 0.0);
        map.middleCols<6>(6 * foot).setIdentity();
        map.block<3, 3>(3, 6 * foot) = cross_matrix(sole - com);
        const Eigen::Matrix3d R(Eigen::AngleAxisd(0.1 * side + 0.05 * std::sin(t), Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(0.02 * std::cos(t), Eigen::Vector3d::UnitY()));
        Matrix6 to_sole = Matrix6::Zero();
        to_sole.topLeftCorner<3, 3>() = to_sole.bottomRightCorner<3, 3>() = R.transpose();
        b.A.block<19, 6>(19 * foot, 6 * foot) = foot_rows() * to_sole;
        b.ubA[19 * foot + 14] = -10.0;
    }
    Eigen::Matrix<double, 23, 12> torque_map;
    Eigen::Matrix<double, 23, 1> torque;
    for (int i = 0; i < 23; ++i) {
        torque[i] = 8 * std::sin(1.1 * i + 0.5 * t);
        for (int j = 0; j < 12; ++j) {
            torque_map(i, j) = 0.3 * std::sin(0.7 * i + 2.3 * j * (i + 1) + 0.2 * t);
        }
    }
    b.H = map.transpose() * map + w * torque_map.transpose() * torque_map +
          epsilon * Eigen::Matrix<double, 12, 12>::Identity();
    b.g = -map.transpose() * r + w * torque_map.transpose() * torque;
    return b;
}

/// So many problems stay in the cache, as what blocks have just computed does.
inline constexpr int cached = 100;

inline std::vector<Balancing> sequence(int count) {
    std::vector<Balancing> problems;
    for (int k = 0; k < count; ++k) {
        problems.push_back(make(k));
    }
    return problems;
}

} // namespace bf::qp::two_feet

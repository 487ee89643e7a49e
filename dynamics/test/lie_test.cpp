#include "bf/dynamics/lie.hpp"

#include "robots.hpp"

#include <unsupported/Eigen/MatrixFunctions>

#include <gtest/gtest.h>
#include <numbers>

namespace bf::dynamics::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const std::vector<double> angles = {0.0, 1e-9, 1e-4, 0.3, 1.0, 2.5, 3.1, std::numbers::pi};

Vector3d about_some_axis(double angle, std::mt19937& random) {
    return angle * Vector3d(random_vector(3, random)).normalized();
}

} // namespace

TEST(Lie, ExponentialIsThatOfTheMatrixAndTheLogarithmItsInverse) {
    std::mt19937 random(1);
    for (const double angle : angles) {
        const Vector3d phi = about_some_axis(angle, random);
        const Matrix3d expected = skew(phi).exp();
        EXPECT_LT((rotation_exp(phi) - expected).norm(), 1e-13) << angle;
        if (angle < 3.14) {
            EXPECT_LT((rotation_log(rotation_exp(phi)) - phi).norm(), 1e-12) << angle;
        }
    }
    EXPECT_EQ(rotation_exp(Vector3d::Zero()), Matrix3d::Identity());
}

TEST(Lie, JacobiansAreTheBlocksOfALargerExponential) {
    // exp [S 1 0; 0 0 1; 0 0 0] has Σ Sᵏ/(k+1)! and Σ Sᵏ/(k+2)! in its first rows.
    std::mt19937 random(2);
    for (const double angle : angles) {
        const Vector3d phi = about_some_axis(angle, random);
        Eigen::Matrix<double, 9, 9> block = Eigen::Matrix<double, 9, 9>::Zero();
        block.topLeftCorner<3, 3>() = skew(phi);
        block.block<3, 3>(0, 3).setIdentity();
        block.block<3, 3>(3, 6).setIdentity();
        const Eigen::MatrixXd all = Eigen::MatrixXd(block).exp();
        EXPECT_LT((left_jacobian(phi) - all.block<3, 3>(0, 3)).norm(), 1e-13) << angle;
        EXPECT_LT((second_left_jacobian(phi) - all.block<3, 3>(0, 6)).norm(), 1e-13) << angle;
    }
}

TEST(Lie, LeftJacobianTurnsRatesIntoAngularVelocities) {
    std::mt19937 random(3);
    for (const double angle : angles) {
        const Vector3d phi = about_some_axis(angle, random), rate = random_vector(3, random);
        const double dt = 1e-5;
        const Matrix3d turned = rotation_exp(phi + dt * rate) * rotation_exp(phi - dt * rate).transpose();
        EXPECT_LT((rotation_log(turned) / (2.0 * dt) - left_jacobian(phi) * rate).norm(), 1e-8) << angle;
    }
}

TEST(Lie, JetsHaveTheRatesOfFiniteDifferences) {
    std::mt19937 random(4);
    for (const double angle : angles) {
        const Jet phi{about_some_axis(angle, random), random_vector(3, random), random_vector(3, random)};
        const Jet u{random_vector(3, random), random_vector(3, random), random_vector(3, random)};
        const auto at = [&](double t) -> Vector3d {
            const auto move = [t](const Jet& jet) -> Vector3d {
                return jet.value + t * jet.rate + 0.5 * t * t * jet.second;
            };
            return left_jacobian(move(phi)) * move(u);
        };
        const Jet jet = left_jacobian_times(phi, u);
        const double dt = 1e-4;
        EXPECT_LT((jet.value - at(0.0)).norm(), 1e-14);
        EXPECT_LT((jet.rate - (at(dt) - at(-dt)) / (2 * dt)).norm(), 1e-7) << angle;
        EXPECT_LT((jet.second - (at(dt) - 2.0 * at(0.0) + at(-dt)) / (dt * dt)).norm(), 1e-6) << angle;
    }
}

} // namespace bf::dynamics::test

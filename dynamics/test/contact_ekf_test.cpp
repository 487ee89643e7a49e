#include "bf/dynamics/contact_ekf.hpp"
#include "bf/dynamics/lie.hpp"

#include "robots.hpp"

#include <Eigen/Dense>
#include <unsupported/Eigen/MatrixFunctions>

#include <gtest/gtest.h>

namespace bf::dynamics::test {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int feet = 2, ekf_size = ContactEkf::before_contacts + 3 * feet;
constexpr int of_foot = ContactEkf::before_contacts;

/// R, v, p and points of contact as one matrix of SE_{2+k}(3).
MatrixXd group(const ContactEkf& of) {
    MatrixXd X = MatrixXd::Identity(5 + feet, 5 + feet);
    X.topLeftCorner<3, 3>() = of.R;
    X.block<3, 1>(0, 3) = of.v;
    X.block<3, 1>(0, 4) = of.p;
    X.topRightCorner(3, feet) = of.d;
    return X;
}

/// The matrix of errors in the order of the filter, without those of biases.
MatrixXd wedge(const VectorXd& xi) {
    MatrixXd W = MatrixXd::Zero(5 + feet, 5 + feet);
    W.topLeftCorner<3, 3>() = skew(xi.head<3>());
    W.block<3, 1>(0, 3) = xi.segment<3>(3);
    W.block<3, 1>(0, 4) = xi.segment<3>(6);
    for (int i = 0; i < feet; ++i) W.block<3, 1>(0, 5 + i) = xi.segment<3>(of_foot + 3 * i);
    return W;
}

VectorXd error_of(const ContactEkf& estimate, const ContactEkf& truth) {
    const MatrixXd W = MatrixXd(group(estimate) * group(truth).inverse()).log();
    VectorXd xi(ekf_size);
    xi << W(2, 1), W(0, 2), W(1, 0), W.block<3, 1>(0, 3), W.block<3, 1>(0, 4),
        estimate.gyroscope_bias - truth.gyroscope_bias,
        estimate.accelerometer_bias - truth.accelerometer_bias, W.block<3, 1>(0, 5), W.block<3, 1>(0, 6);
    return xi;
}

ContactEkf some_filter(std::mt19937& random) {
    ContactEkf filter(feet);
    filter.R = rotation_exp(random_vector(3, random));
    filter.v = random_vector(3, random);
    filter.p = random_vector(3, random);
    filter.gyroscope_bias = 0.1 * random_vector(3, random);
    filter.accelerometer_bias = 0.1 * random_vector(3, random);
    filter.d = Eigen::Matrix<double, 3, feet>::NullaryExpr(
        [&](Eigen::Index, Eigen::Index) { return random_vector(1, random)[0]; });
    filter.is_standing.setOnes();
    return filter;
}

/// The estimate whose error is xi.
ContactEkf disturbed(const ContactEkf& truth, const VectorXd& xi) {
    ContactEkf estimate = truth;
    const MatrixXd X = wedge(xi).exp() * group(truth);
    estimate.R = X.topLeftCorner<3, 3>();
    estimate.v = X.block<3, 1>(0, 3);
    estimate.p = X.block<3, 1>(0, 4);
    estimate.d = X.topRightCorner(3, feet);
    estimate.gyroscope_bias += xi.segment<3>(9);
    estimate.accelerometer_bias += xi.segment<3>(12);
    return estimate;
}

} // namespace

TEST(ContactEkf, PropagatesErrorsAsTheyAre) {
    std::mt19937 random(1);
    for (int k = 0; k < 10; ++k) {
        ContactEkf truth = some_filter(random);
        const VectorXd xi = 1e-5 * random_vector(ekf_size, random);
        ContactEkf estimate = disturbed(truth, xi);
        estimate.noise = {0, 0, 0, 0, 0};
        estimate.P = xi * xi.transpose();
        const Vector3d omega = random_vector(3, random), force = 5.0 * random_vector(3, random);
        const double dt = 1e-3;
        truth.predict(omega, force, dt);
        estimate.predict(omega, force, dt);
        const VectorXd after = error_of(estimate, truth);
        EXPECT_LT((after - xi).norm(), 0.1 * xi.norm());
        EXPECT_GT((after - xi).norm(), 1e-4 * xi.norm()) << "errors do change";
        EXPECT_LT((estimate.P - after * after.transpose()).norm(), 3e-5 * xi.squaredNorm());
    }
}

TEST(ContactEkf, FallsAndTurnsExactly) {
    // A constant turn and a constant force in its axes: the closed forms of a body that is thrown.
    ContactEkf filter(feet);
    filter.v << 1.0, 0.0, 2.0;
    for (int k = 0; k < 100; ++k) filter.predict({0.0, 0.0, 2.0}, {0.0, 0.0, 0.0}, 0.01);
    EXPECT_LT((filter.R - rotation_exp({0.0, 0.0, 2.0})).norm(), 1e-12);
    EXPECT_LT((filter.p - Vector3d(1.0, 0.0, 2.0 - 0.5 * 9.81)).norm(), 1e-12);
    // A force that turns with the body: v = ∫ F (cos 2t, sin 2t) dt
    filter = ContactEkf(feet);
    filter.gravity.setZero();
    for (int k = 0; k < 100; ++k) filter.predict({0.0, 0.0, 2.0}, {3.0, 0.0, 0.0}, 0.01);
    EXPECT_LT((filter.v - 1.5 * Vector3d(std::sin(2.0), 1.0 - std::cos(2.0), 0.0)).norm(), 1e-12);
    EXPECT_LT((filter.p - 0.75 * Vector3d(1.0 - std::cos(2.0), 2.0 - std::sin(2.0), 0.0)).norm(), 1e-12);
}

TEST(ContactEkf, CorrectsAsTheFilterOfWholeMatrices) {
    std::mt19937 random(2);
    for (int k = 0; k < 10; ++k) {
        ContactEkf filter = some_filter(random);
        const MatrixXd root = MatrixXd::NullaryExpr(ekf_size, ekf_size, [&](Eigen::Index, Eigen::Index) {
            return 0.1 * random_vector(1, random)[0];
        });
        filter.P = root * root.transpose();
        const Matrix3d small = 0.05 * Vector3d(1, 2, 3).asDiagonal().toDenseMatrix();
        const int foot = k % feet;
        const Vector3d seen =
            filter.R.transpose() * (filter.d.col(foot) - filter.p) + 0.1 * random_vector(3, random);

        MatrixXd H = MatrixXd::Zero(3, ekf_size);
        H.block<3, 3>(0, 6).setIdentity();
        H.block<3, 3>(0, of_foot + 3 * foot) = -Matrix3d::Identity();
        const MatrixXd S = H * filter.P * H.transpose() + filter.R * small * filter.R.transpose();
        const MatrixXd K = filter.P * H.transpose() * S.inverse();
        VectorXd b = VectorXd::Zero(5 + feet);
        b.head<3>() = seen;
        b[4] = 1.0;
        b[5 + foot] = -1.0;
        const VectorXd delta = -K * (group(filter) * b).head<3>();
        const MatrixXd expected = wedge(delta).exp() * group(filter),
                       P = (MatrixXd::Identity(ekf_size, ekf_size) - K * H) * filter.P;
        const Vector3d bias = filter.gyroscope_bias + delta.segment<3>(9);
        filter.correct(foot, true, seen, small);
        EXPECT_LT((group(filter) - expected).norm(), 1e-12);
        EXPECT_LT((filter.P - P).norm(), 1e-12);
        EXPECT_LT((filter.gyroscope_bias - bias).norm(), 1e-13);
    }
}

TEST(ContactEkf, BeginsAndEndsContacts) {
    std::mt19937 random(3);
    ContactEkf filter = some_filter(random);
    filter.P.setIdentity();
    filter.correct(1, false, Vector3d::Zero(), Matrix3d::Identity());
    EXPECT_EQ(filter.is_standing[1], 0.0);
    EXPECT_EQ(filter.P.bottomRows<3>().norm(), 0.0);
    filter.predict({0.1, 0.2, 0.3}, {0.0, 0.0, 9.81}, 0.01);
    EXPECT_EQ(filter.P.bottomRows<3>().norm() + filter.P.rightCols<3>().norm(), 0.0);
    const Vector3d seen(0.1, -0.2, -0.5);
    filter.correct(1, true, seen, 0.01 * Matrix3d::Identity());
    EXPECT_LT((filter.R.transpose() * (filter.d.col(1) - filter.p) - seen).norm(), 1e-14);
    EXPECT_LT((filter.P.bottomRightCorner<3, 3>() - filter.P.block<3, 3>(6, 6) - 0.01 * Matrix3d::Identity())
                  .norm(),
              1e-14);
    EXPECT_LT((filter.P - filter.P.transpose()).norm(), 1e-14);
}

TEST(ContactEkf, IsAsUncertainAsItIsWrong) {
    // Squared errors, weighed by the inverse covariance (NEES): their mean over runs of 15 errors lies
    // about 15.
    constexpr int runs = 40, steps = 300;
    constexpr double dt = 0.01;
    const ContactEkf::Noise noise{0.02, 0.2, 2e-3, 2e-2, 0.03};
    const double of_foot_seen = 0.01;
    double nees = 0.0, at_start = 0.0, tilt = 0.0;
    int outside = 0;
    for (int run = 0; run < runs; ++run) {
        std::mt19937 random(static_cast<unsigned>(100 + run));
        std::normal_distribution<double> normal;
        const auto draw = [&](double deviation) -> Vector3d {
            return deviation * Vector3d{normal(random), normal(random), normal(random)}; // in this order
        };
        ContactEkf truth(feet);
        truth.R = rotation_exp({0.1, -0.2, 0.5});
        truth.gyroscope_bias = Vector3d(0.02, -0.01, 0.03);
        truth.accelerometer_bias = Vector3d(0.1, 0.2, -0.1);
        VectorXd xi = VectorXd::Zero(ekf_size), deviation(5);
        deviation << 0.1, 0.2, 0.05, 0.03, 0.2;
        for (int i = 0; i < 5; ++i) xi.segment<3>(3 * i) = draw(deviation[i]);
        ContactEkf filter = disturbed(truth, xi);
        filter.d.setZero();
        filter.noise = noise;
        for (int i = 0; i < 5; ++i)
            filter.P.diagonal().segment<3>(3 * i).setConstant(deviation[i] * deviation[i]);
        for (int k = 0; k < steps; ++k) {
            const double t = k * dt;
            for (int foot = 0; foot < feet; ++foot) {
                const bool stands = std::sin(4.0 * t + 3.0 * foot) > -0.3;
                const Vector3d true_seen(0.1 * std::sin(t), 0.1 - 0.2 * foot, -0.5);
                if (stands && truth.is_standing[foot] == 0.0)
                    truth.d.col(foot) = truth.p + truth.R * true_seen;
                truth.is_standing[foot] = stands;
                const Vector3d seen =
                    truth.R.transpose() * (truth.d.col(foot) - truth.p) + draw(of_foot_seen);
                filter.correct(foot, stands, seen, of_foot_seen * of_foot_seen * Matrix3d::Identity());
            }
            if (k % 100 == 99) {
                const VectorXd error = error_of(filter, truth).head<15>();
                const double value = error.dot(filter.P.topLeftCorner<15, 15>().ldlt().solve(error));
                nees += value;
                outside += value > 32.8; // of 15 degrees of freedom in one case of 200
            }
            const Vector3d omega(0.5 * std::sin(2 * t), 0.4 * std::cos(3 * t), 0.3),
                force = truth.R.transpose() *
                        (Vector3d(std::sin(5 * t), std::cos(4 * t), 0.5 * std::sin(6 * t)) - truth.gravity);
            const double root = std::sqrt(dt);
            // Drawn one after the other, as the order of arguments is the compiler's.
            const Vector3d measured_omega = omega + truth.gyroscope_bias + draw(noise.gyroscope / root),
                           measured_force =
                               force + truth.accelerometer_bias + draw(noise.accelerometer / root);
            filter.predict(measured_omega, measured_force, dt);
            truth.predict(omega + truth.gyroscope_bias, force + truth.accelerometer_bias, dt);
            truth.gyroscope_bias += draw(noise.gyroscope_bias * root);
            truth.accelerometer_bias += draw(noise.accelerometer_bias * root);
            for (int foot = 0; foot < feet; ++foot)
                if (truth.is_standing[foot] != 0.0) truth.d.col(foot) += draw(noise.contact * root);
        }
        at_start += xi.head<3>().norm() / runs;
        tilt += (truth.R.transpose() * Vector3d::UnitZ() - filter.R.transpose() * Vector3d::UnitZ()).norm() /
                runs;
    }
    nees /= 3 * runs;
    // Deviation of the mean of 120 values, of which 40 are independent: sqrt(30/40) at most.
    EXPECT_NEAR(nees, 15.0, 3.0 * std::sqrt(30.0 / 40.0)) << at_start;
    EXPECT_LE(outside, 4);
    EXPECT_LT(tilt, at_start / 3) << "what is observable is known far better than at the start";
}

} // namespace bf::dynamics::test

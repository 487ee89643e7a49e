#include "bf/dynamics/contact_ekf.hpp"

#include "bf/dynamics/lie.hpp"

#include <Eigen/LU>

namespace bf::dynamics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Where errors begin.
constexpr int turn = 0, velocity = 3, place = 6, gyro = 9, accel = 12;

} // namespace

ContactEkf::ContactEkf(int contacts) {
    const int size = before_contacts + 3 * contacts;
    d.setZero(3, contacts);
    is_standing.setZero(contacts);
    P.setZero(size, size);
    A_ = Phi_ = product_ = P;
    noise_columns_.setZero(size, 15);
    cross_.setZero(size, 3);
    gain_ = cross_;
    xi_.setZero(size);
}

void ContactEkf::predict(const Vector3d& gyroscope, const Vector3d& accelerometer, double dt) noexcept {
    // ξ' = A ξ + Ad_X w. What is multiplied by R is in body axes.
    A_.setZero();
    A_.block<3, 3>(turn, gyro) = -R;
    A_.block<3, 3>(velocity, turn) = skew(gravity);
    A_.block<3, 3>(velocity, gyro) = -skew(v) * R;
    A_.block<3, 3>(velocity, accel) = -R;
    A_.block<3, 3>(place, velocity).setIdentity();
    A_.block<3, 3>(place, gyro) = -skew(p) * R;
    // Its fourth power vanishes, so that the exponential of A dt ends with the third.
    for (int i = 0; i < is_standing.size(); ++i)
        if (is_standing[i] != 0.0) A_.block<3, 3>(before_contacts + 3 * i, gyro) = -skew(d.col(i)) * R;
    A_ *= dt;
    Phi_ = A_;
    Phi_.diagonal().array() += 1.0;
    product_.noalias() = A_.lazyProduct(A_);
    Phi_ += 0.5 * product_;
    Phi_.noalias() += (1.0 / 6.0) * product_.lazyProduct(A_);

    // Noise of gyroscope, accelerometer, both biases: columns of Ad_X times deviations; of contacts, further
    // below.
    auto& N = noise_columns_;
    N.setZero();
    N.block<3, 3>(turn, 0) = noise.gyroscope * R;
    N.block<3, 3>(velocity, 0) = noise.gyroscope * skew(v) * R;
    N.block<3, 3>(place, 0) = noise.gyroscope * skew(p) * R;
    N.block<3, 3>(velocity, 3) = noise.accelerometer * R;
    N.block<3, 3>(gyro, 6) = noise.gyroscope_bias * Matrix3d::Identity();
    N.block<3, 3>(accel, 9) = noise.accelerometer_bias * Matrix3d::Identity();
    for (int i = 0; i < is_standing.size(); ++i) {
        if (is_standing[i] == 0.0) continue;
        const int row = before_contacts + 3 * i;
        N.block<3, 3>(row, 0) = noise.gyroscope * skew(d.col(i)) * R;
        P.block<3, 3>(row, row) += dt * noise.contact * noise.contact * Matrix3d::Identity();
    }
    P.noalias() += dt * N.lazyProduct(N.transpose());
    product_.noalias() = Phi_.lazyProduct(P);
    P.noalias() = product_.lazyProduct(Phi_.transpose());

    const Vector3d phi = (gyroscope - gyroscope_bias) * dt, force = accelerometer - accelerometer_bias;
    p += dt * v + dt * dt * (R * (second_left_jacobian(phi) * force) + 0.5 * gravity);
    v += dt * (R * (left_jacobian(phi) * force) + gravity);
    R = R * rotation_exp(phi);
}

void ContactEkf::correct(int i, bool stands, const Vector3d& position, const Matrix3d& covariance) noexcept {
    const int row = before_contacts + 3 * i;
    const Matrix3d in_world = R * covariance * R.transpose();
    if (!stands || is_standing[i] == 0.0) {
        P.middleRows<3>(row).setZero();
        P.middleCols<3>(row).setZero();
        is_standing[i] = stands;
        d.col(i).setZero();
        if (!stands) return;
        // The point lies where it is seen, so that its error is that of the position and of what is seen.
        d.col(i) = p + R * position;
        P.middleRows<3>(row) = P.middleRows<3>(place);
        P.middleCols<3>(row) = P.middleCols<3>(place);
        P.block<3, 3>(row, row) += in_world;
        return;
    }
    // R position + p - d = ξ_p - ξ_d + noise
    cross_ = P.middleCols<3>(place) - P.middleCols<3>(row);
    const Matrix3d S = cross_.middleRows<3>(place) - cross_.middleRows<3>(row) + in_world;
    gain_.noalias() = cross_.lazyProduct(S.inverse());
    const Vector3d seen = R * position + p - d.col(i);
    xi_.noalias() = -gain_.lazyProduct(seen);
    P.noalias() -= gain_.lazyProduct(cross_.transpose());
    for (Eigen::Index c = 0; c < P.cols(); ++c)
        for (Eigen::Index r = 0; r < c; ++r) P(r, c) = P(c, r) = 0.5 * (P(r, c) + P(c, r));
    move(xi_);
}

void ContactEkf::move(const Eigen::VectorXd& xi) noexcept {
    const Vector3d phi = xi.segment<3>(turn);
    const Matrix3d rotation = rotation_exp(phi), J = left_jacobian(phi);
    R = rotation * R;
    v = rotation * v + J * xi.segment<3>(velocity);
    p = rotation * p + J * xi.segment<3>(place);
    for (int i = 0; i < is_standing.size(); ++i)
        if (is_standing[i] != 0.0)
            d.col(i) = rotation * d.col(i) + J * xi.segment<3>(before_contacts + 3 * i);
    gyroscope_bias += xi.segment<3>(gyro);
    accelerometer_bias += xi.segment<3>(accel);
}

} // namespace bf::dynamics

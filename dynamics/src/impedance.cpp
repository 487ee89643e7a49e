#include "bf/dynamics/impedance.hpp"

#include "bf/dynamics/lie.hpp"

#include <Eigen/Eigenvalues>

namespace bf::dynamics {

using Vector6 = Eigen::Matrix<double, 6, 1>;

void cartesian_impedance(const Model& model, Data& data, Frame frame,
                         const Eigen::Ref<const Eigen::Matrix4d>& target,
                         const Eigen::Ref<const Vector6>& velocity, const FrameImpedance& impedance,
                         Vector6Out wrench, Vector6Out error) noexcept {
    Eigen::Matrix4d H;
    Vector6 now;
    forward_kinematics(model, data, frame, H);
    frame_velocity(model, data, frame, now);
    error = pose_error(H, target);
    const Vector6 slip = velocity - now;
    const Eigen::Matrix3d R = impedance.in_target_axes ? Eigen::Matrix3d(target.topLeftCorner<3, 3>())
                                                       : Eigen::Matrix3d::Identity();
    for (const int part : {0, 3}) {
        const auto of = [&](const Vector6& gain, const Vector6& e) -> Eigen::Vector3d {
            return R * gain.segment<3>(part).cwiseProduct(R.transpose() * e.segment<3>(part));
        };
        wrench.segment<3>(part) = of(impedance.stiffness, error) + of(impedance.damping, slip);
    }
}

NullSpace::NullSpace(int velocities)
    : M_(velocities, velocities), M_inverse_Jt_(velocities, 6), J_(6, velocities), factor_(velocities) {}

void NullSpace::project(const Model& model, Data& data, Frame frame, VectorOut forces) noexcept {
    mass_matrix(model, data, M_);
    jacobian(model, data, frame, J_);
    factor_.compute(M_);
    M_inverse_Jt_ = J_.transpose();
    factor_.solveInPlace(M_inverse_Jt_);
    const Eigen::Matrix<double, 6, 6> mobility = J_ * M_inverse_Jt_;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(mobility);
    const Vector6 acceleration = M_inverse_Jt_.transpose() * forces;
    Vector6 along = eigen.eigenvectors().transpose() * acceleration;
    const double least = 1e-6 * eigen.eigenvalues().maxCoeff();
    for (int i = 0; i < 6; ++i)
        along[i] = eigen.eigenvalues()[i] > least ? along[i] / eigen.eigenvalues()[i] : 0.0;
    const Vector6 wrench = eigen.eigenvectors() * along;
    forces.noalias() -= J_.transpose() * wrench;
}

} // namespace bf::dynamics

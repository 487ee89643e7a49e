#pragma once

#include "bf/dynamics/algorithms.hpp"

#include <Eigen/Cholesky>

/// What makes frames behave like springs and dampers. Source: N. Hogan, Impedance control: an approach to
/// manipulation, 1985. No function allocates memory or throws.
namespace bf::dynamics {

/// The wrench K e + D (v_target - J nu) on a frame.
struct FrameImpedance {
    Eigen::Matrix<double, 6, 1> stiffness; ///< K, N/m and Nm/rad
    Eigen::Matrix<double, 6, 1> damping;   ///< D, N s/m and Nm s/rad
    bool in_target_axes = false; ///< K and D are diagonal in the axes of the target, not of the world
};

/// Writes the wrench (6) at the frame's origin, world axes, and the error e (6), see pose_error. `velocity`
/// (6) is that of the target, mixed. Depends on position and velocity.
void cartesian_impedance(const Model& model, Data& data, Frame frame,
                         const Eigen::Ref<const Eigen::Matrix4d>& target,
                         const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& velocity,
                         const FrameImpedance& impedance, Vector6Out wrench, Vector6Out error) noexcept;

/// Takes from generalised forces what accelerates a frame: forces - Jᵀ (J M⁻¹ Jᵀ)⁺ J M⁻¹ forces, where
/// directions in which the frame hardly moves (below 1e-6 of the largest of J M⁻¹ Jᵀ) are left alone. Source:
/// O. Khatib, A unified approach for motion and force control of robot manipulators: the operational space
/// formulation, 1987.
///
/// All memory is allocated by the constructor. Not for concurrent use.
class NullSpace {
  public:
    explicit NullSpace(int velocities);
    /// Depends on the position.
    void project(const Model& model, Data& data, Frame frame, VectorOut forces) noexcept;

  private:
    Eigen::MatrixXd M_, M_inverse_Jt_;
    Eigen::Matrix<double, 6, Eigen::Dynamic> J_;
    Eigen::LLT<Eigen::MatrixXd> factor_;
};

} // namespace bf::dynamics

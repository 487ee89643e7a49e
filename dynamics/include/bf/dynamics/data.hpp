#pragma once

#include "bf/dynamics/model.hpp"

#include <Eigen/Core>

#include <memory>

namespace bf::dynamics {

/// Workspace of one Model: the current robot state and what was computed from it.
///
/// All memory is allocated here, none by the algorithms. An algorithm computes what it needs on the first
/// request after a change of state and keeps it, so any number of callers that set the same state pay once.
/// Initially the base is at the world's origin and all positions and velocities are zero. Not for concurrent
/// use.
class Data {
  public:
    explicit Data(const Model& model);
    ~Data();
    Data(Data&&) noexcept;
    Data& operator=(Data&&) noexcept;

    struct Content;
    Content& content() { return *content_; } ///< for the algorithms of this folder
    const Content& content() const { return *content_; }

  private:
    std::unique_ptr<Content> content_;
};

/// Sets the whole state. States are compared bit for bit: only what depends on a changed value is computed
/// again.
///
/// w_H_b (4×4) is the pose of the base in the world; its rotation must be orthonormal (not checked).
/// s (n) are the joint positions, rad or m. nu_base (6) = [pdot; omega] is the velocity of the base's origin
/// and the angular velocity of the base, both in world axes (mixed representation); s_dot (n) the joint
/// velocities.
void set_state(const Model& model, Data& data, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b,
               const Eigen::Ref<const Eigen::VectorXd>& s,
               const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& nu_base,
               const Eigen::Ref<const Eigen::VectorXd>& s_dot) noexcept;

/// Sets base pose and joint positions and keeps the velocities; for callers that only ask for functions of
/// the position. Results at velocity level stay valid when the position is the present one.
void set_position(const Model& model, Data& data, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b,
                  const Eigen::Ref<const Eigen::VectorXd>& s) noexcept;

/// Sets the joint positions and keeps all else; for callers that only ask for relative quantities.
void set_joint_position(const Model& model, Data& data, const Eigen::Ref<const Eigen::VectorXd>& s) noexcept;

} // namespace bf::dynamics

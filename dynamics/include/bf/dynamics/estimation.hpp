#pragma once

#include "bf/dynamics/algorithms.hpp"

#include <Eigen/Cholesky>

#include <filesystem>
#include <string>
#include <vector>

/// What acts on a robot, and where its base is, from what it measures; in the conventions of algorithms.hpp.
/// No function allocates memory or throws.
namespace bf::dynamics {

/// Generalised momentum p = M nu (6+n) and the part β = Ṁ nu - h = Cᵀ nu - g (6+n) of its rate that needs no
/// torque: ṗ = β + [0; tau] + Σ Jᵀ f. M (6+n)×(6+n) and nu (6+n) are memory. Depends on position and
/// velocity.
void momentum_balance(const Model& model, Data& data,
                      const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& nu_base,
                      const Eigen::Ref<const Eigen::VectorXd>& s_dot, VectorOut p, VectorOut beta,
                      MatrixOut M, VectorOut nu) noexcept;

/// The wrenches (6k) on k frames, f = argmin |r - Σ Jᵀ f|² + λ |f|², that best explain generalised forces r,
/// with λ = `damping`² times the largest diagonal entry of J Jᵀ. A wrench that the joints do not feel is
/// zero.
///
/// All memory is allocated by the constructor. Not for concurrent use.
class WrenchesOfForces {
  public:
    WrenchesOfForces(const Model& model, std::vector<Frame> frames);
    /// Depends on the position.
    void find(const Model& model, Data& data, const Eigen::Ref<const Eigen::VectorXd>& r, double damping,
              VectorOut wrenches) noexcept;

  private:
    std::vector<Frame> frames_;
    Eigen::Matrix<double, 6, Eigen::Dynamic> of_frame_;
    Eigen::MatrixXd J_, JJt_;
    Eigen::LDLT<Eigen::MatrixXd> factor_;
};

/// The wrenches of contacts and the joint torques, from force/torque sensors that cut the robot into parts,
/// and from how it moves. For each part the equations of its base, M nu_dot + h = Σ Jᵀ f without torques,
/// have six rows: one contact in a part has the wrench that they leave, several share it by least norm |f|,
/// and what a part without contacts leaves is not explained. Torques follow part by part. Source: F. Nori, S.
/// Traversaro, J. Eljaik, F. Romano, A. Del Prete, D. Pucci, iCub whole-body control through force regulation
/// on rigid non-coplanar contacts, 2015.
///
/// All memory is allocated by the constructor. Not for concurrent use.
class ContactWrenches {
  public:
    /// `sensors`: fixed joints, or their child links. Throws as Model::load_parts, and for an unknown frame.
    ContactWrenches(const Model& model, const std::filesystem::path& urdf,
                    const std::vector<std::string>& sensors, const std::vector<std::string>& contacts);

    /// Writes the wrenches (6 × contacts) at the frames' origins and the joint torques (n), from nu_dot (6+n)
    /// and what the sensors measure (6 × sensors): what the child link exerts on its parent, at the origin
    /// and in the axes of the child. Depends on position and velocity, of which it takes s and s_dot again.
    void find(const Model& model, Data& data, const Eigen::Ref<const Eigen::VectorXd>& s,
              const Eigen::Ref<const Eigen::VectorXd>& s_dot, const Eigen::Ref<const Eigen::VectorXd>& nu_dot,
              const Eigen::Ref<const Eigen::Matrix<double, 6, Eigen::Dynamic>>& measured,
              Matrix6XOut wrenches, VectorOut tau) noexcept;

  private:
    struct Part {
        Model model;
        Data data;
        Frame root, in_whole;       ///< of the part and of the whole robot
        int parent;                 ///< number of the part that carries it, or -1
        Frame parent_link;          ///< in that part
        std::vector<int> joints;    ///< numbers in the whole robot
        std::vector<int> contacts;  ///< numbers
        std::vector<Frame> contact; ///< in the part
        Eigen::VectorXd s, s_dot, s_ddot, forces;
        Eigen::Matrix4d w_H_root;
    };
    std::vector<Part> parts_; ///< first that of the base, then one for each sensor
    Eigen::Matrix<double, 6, Eigen::Dynamic> J_;
};

/// Pose of the base for which a frame stands where `w_H_f` says. Depends on the joint positions only.
void base_from_frame(const Model& model, Data& data, Frame frame,
                     const Eigen::Ref<const Eigen::Matrix4d>& w_H_f, Matrix4Out w_H_b) noexcept;

/// The velocity of the base (6, mixed) for which frames move least: argmin Σ w |J nu|², of frames with
/// weights above 0; zero if there is none. Of one frame it is the velocity at which that stands still. J
/// (6×(6+n)) is memory; the base must float. Depends on the position.
void base_velocity_from_contacts(const Model& model, Data& data, const std::vector<Frame>& frames,
                                 const Eigen::Ref<const Eigen::VectorXd>& weights,
                                 const Eigen::Ref<const Eigen::VectorXd>& s_dot, Vector6Out nu_base,
                                 Matrix6XOut J) noexcept;

/// The same where the angular velocity of the base is known, and of the frames the origins alone count:
/// argmin Σ w |J_linear nu|². Source: M. Bloesch et al., State estimation for legged robots: consistent
/// fusion of leg kinematics and IMU, 2012, for the kinematics.
void base_velocity_from_points(const Model& model, Data& data, const std::vector<Frame>& frames,
                               const Eigen::Ref<const Eigen::VectorXd>& weights,
                               const Eigen::Ref<const Eigen::Vector3d>& omega,
                               const Eigen::Ref<const Eigen::VectorXd>& s_dot, Vector6Out nu_base,
                               Matrix6XOut J) noexcept;

} // namespace bf::dynamics

#pragma once

#include "bf/dynamics/data.hpp"
#include "bf/dynamics/model.hpp"

#include <pinocchio/multibody.hpp>

#include <map>
#include <string>
#include <vector>

namespace bf::dynamics {

/// A link relative to the joint that moves it.
struct Placement {
    std::size_t joint; ///< Pinocchio's joint number: 1 is the base
    Eigen::Matrix3d rotation;
    Eigen::Vector3d translation;
};

/// One listed joint, in Pinocchio's numbers.
struct JointIndex {
    int number; ///< of the joint
    int q;      ///< first entry in the configuration
    int v;      ///< entry in the velocity
    bool angle; ///< stored as (cosine, sine): a joint of URDF type `continuous`
};

/// A joint on the way from the base to a link.
struct Support {
    int column; ///< in Pinocchio's Jacobian
    int joint;  ///< in joint_names, or n + number of the follower
};

/// A joint whose position is factor * s[leader] + offset.
struct FollowerIndex {
    JointIndex index;
    int leader; ///< in joint_names
    double factor;
    double offset;
};

struct Model::Content {
    pinocchio::Model tree; ///< the listed joints only
    std::vector<std::string> joint_names;
    std::vector<JointIndex> joints;
    std::vector<Follower> followers;
    std::vector<FollowerIndex> moving_followers; ///< those with a leader
    // By Pinocchio's joint number, base left out: the joint itself, and it with those that carry it.
    std::vector<Support> own;
    std::vector<std::vector<Support>> supports, follower_supports;
    int base_velocities = 6; ///< 0 for a fixed base
    double total_mass = 0.0;
    Eigen::Vector3d gravity;
    std::string base_link;
    std::vector<std::string> frame_names;
    std::vector<Placement> frames;
    std::map<std::string, int> frame_index;
    Eigen::VectorXd position_min, position_max, velocity_max, effort_max;
};

/// Inertia about the base's origin in world axes.
struct RigidInertia {
    double mass = 0.0;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero(); ///< mass times position of the centre of mass
    Eigen::Matrix3d rotational = Eigen::Matrix3d::Zero();

    void operator+=(const RigidInertia& other) {
        mass += other.mass;
        moment += other.moment;
        rotational += other.rotational;
    }
};

struct Data::Content {
    explicit Content(const Model::Content& model);

    // The state.
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity(); ///< world from base
    Eigen::Vector3d p = Eigen::Vector3d::Zero();     ///< origin of the base in the world
    Eigen::VectorXd s;
    Eigen::Vector3d p_dot = Eigen::Vector3d::Zero();
    Eigen::Vector3d omega = Eigen::Vector3d::Zero();
    Eigen::VectorXd s_dot;

    // Which of the results below belong to the state.
    bool has_kinematics = false;
    bool has_inertia = false;
    bool has_bias = false;
    bool has_momentum = false;

    // The results, all relative to the base's origin, in world axes.
    pinocchio::Data tree;                ///< kinematics: oMi, J; bias: v, a_gf in joint axes
    Eigen::VectorXd q, v;                ///< the state as Pinocchio wants it
    std::vector<RigidInertia> composite; ///< inertia: of the subtree of each joint
    Eigen::Vector3d com;                 ///< inertia
    Eigen::MatrixXd M;                   ///< inertia
    Eigen::MatrixXd M_wide, M_folded;    ///< inertia: M with followers independent, and half way to M
    Eigen::VectorXd h;                   ///< bias
    Eigen::Matrix<double, 6, 1> H;       ///< momentum
};

} // namespace bf::dynamics

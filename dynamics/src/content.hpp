#pragma once

#include "bf/dynamics/data.hpp"
#include "bf/dynamics/model.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <map>
#include <string>
#include <vector>

namespace bf::dynamics {

/// Rotation and origin of something, relative to something else.
struct Pose {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
};

/// A link relative to the body that carries it.
struct Placement : Pose {
    std::size_t body;
};

/// Rigid inertia: about the origin and in the axes that its owner names.
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

/// All links that move as one. Body 0 is the base; every other is moved by a joint and stands behind its
/// parent.
struct Body {
    std::size_t parent = 0;
    int joint = -1;    ///< in joint_names, or n + number of the follower
    bool turns = true; ///< about the axis; else it slides along it
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    Eigen::Vector3d origin = Eigen::Vector3d::Zero(); ///< in the parent, at position 0
    /// Orientation in the parent: fixed + cos(q) cosine + sin(q) sine.
    Eigen::Matrix3d fixed = Eigen::Matrix3d::Identity(), cosine = Eigen::Matrix3d::Zero(), sine = cosine;
    double mass = 0.0;
    Eigen::Vector3d com = Eigen::Vector3d::Zero();
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero(); ///< about com, own axes
};

/// A joint on the way from the base to a link.
struct Support {
    std::size_t body; ///< that it moves
    int joint;        ///< in joint_names, or n + number of the follower
};

/// A joint whose position is factor * s[leader] + offset.
struct FollowerIndex {
    int leader; ///< in joint_names
    double factor;
    double offset;
};

/// A joint in the order in which joints are eliminated from the mass matrix, tips first, with those behind it
/// in that order to which it is then coupled.
struct Elimination {
    int joint; ///< in joint_names
    std::vector<int> coupled;
};

struct Model::Content {
    std::string name;
    std::vector<Body> bodies;
    std::vector<std::string> joint_names;
    std::vector<Follower> followers;
    std::vector<FollowerIndex> moving_followers; ///< those with a leader
    // By body: the joints that carry it.
    std::vector<std::vector<Support>> supports, follower_supports;
    std::vector<Elimination> eliminations;
    int base_velocities = 6; ///< 0 for a fixed base
    double total_mass = 0.0;
    Eigen::Vector3d gravity;
    std::string base_link;
    std::vector<std::string> frame_names;
    std::vector<Placement> frames;
    std::map<std::string, int> frame_index;
    Eigen::VectorXd position_min, position_max, velocity_max, effort_max;
};

/// A velocity, or what a joint contributes to one: of the point at the base's origin, and angular, world
/// axes.
struct Motion {
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();
};

/// A force and its moment about the base's origin, or a momentum, world axes.
struct Force {
    Eigen::Vector3d linear = Eigen::Vector3d::Zero();
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();
};

/// What the velocity of bodies adds to the Coriolis matrix, in the axes and about the origin of their
/// inertia: B = [0, -momentum×; 0, rotational], with B v = v ×* Y v and B + Bᵀ = dY/dt.
struct InertiaRate {
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero(); ///< linear
    Eigen::Matrix3d rotational = Eigen::Matrix3d::Zero();

    void operator+=(const InertiaRate& other) {
        momentum += other.momentum;
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
    bool has_joints = false;
    bool has_kinematics = false;
    bool has_inertia = false;
    bool has_mass = false;
    bool has_factor = false;
    bool has_bias = false;
    bool has_coriolis = false;
    bool has_momentum = false;

    // The results. By body, where nothing else is said; about the base's origin and in world axes but for the
    // first.
    std::vector<Pose> in_base;           ///< joints: seen from the base
    std::vector<Pose> in_world;          ///< kinematics: origins relative to the base's
    std::vector<Motion> columns;         ///< kinematics: motion per unit of the joint's velocity
    std::vector<RigidInertia> inertia;   ///< inertia
    std::vector<RigidInertia> composite; ///< mass: of all that the joint carries
    Eigen::Vector3d com;                 ///< mass
    Eigen::MatrixXd M;                   ///< mass
    Eigen::MatrixXd wide, folded; ///< mass, coriolis: a matrix with followers independent, and half way
    Eigen::MatrixXd factor;       ///< factor: D and, below, L of M = Lᵀ D L in the order of elimination
    Eigen::LLT<Eigen::Matrix<double, 6, 6>> base_factor; ///< factor: of what is left for the base
    int singular = -1;            ///< factor: row of M with no inertia of its own, or none
    std::vector<Motion> velocity; ///< bias, for p_dot = 0
    std::vector<Motion>
        acceleration; ///< bias, for nu_dot = 0 and p_dot = 0, of a base that accelerates against gravity
    std::vector<Force> force;         ///< bias: what moves all that the joint carries
    Eigen::VectorXd h;                ///< bias
    std::vector<Motion> column_rates; ///< coriolis: time derivatives of the columns
    std::vector<InertiaRate> turning; ///< coriolis: of all that the joint carries
    Eigen::MatrixXd C;                ///< coriolis
    Eigen::Matrix<double, 6, 1> H;    ///< momentum
};

} // namespace bf::dynamics

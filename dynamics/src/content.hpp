#pragma once

#include "bf/dynamics/data.hpp"
#include "bf/dynamics/model.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <map>
#include <string>
#include <vector>

namespace bf::dynamics {

// What is computed of a state is a template over its numbers, so that it is also differentiated by running on
// numbers with derivatives. The model is constant.
template <class Number> using Vector3Of = Eigen::Matrix<Number, 3, 1>;
template <class Number> using Matrix3Of = Eigen::Matrix<Number, 3, 3>;
template <class Number> using VectorOf = Eigen::Matrix<Number, Eigen::Dynamic, 1>;
template <class Number> using MatrixOf = Eigen::Matrix<Number, Eigen::Dynamic, Eigen::Dynamic>;

/// Rotation and origin of something, relative to something else.
template <class Number> struct PoseOf {
    Matrix3Of<Number> rotation = Matrix3Of<Number>::Identity();
    Vector3Of<Number> translation = Vector3Of<Number>::Zero();
};
using Pose = PoseOf<double>;

/// A link relative to the body that carries it.
struct Placement : Pose {
    std::size_t body;
};

/// Rigid inertia: about the origin and in the axes that its owner names.
template <class Number> struct RigidInertia {
    double mass = 0.0;
    Vector3Of<Number> moment = Vector3Of<Number>::Zero(); ///< mass times position of the centre of mass
    Matrix3Of<Number> rotational = Matrix3Of<Number>::Zero();

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
template <class Number> struct Motion {
    Vector3Of<Number> linear = Vector3Of<Number>::Zero();
    Vector3Of<Number> angular = Vector3Of<Number>::Zero();
};

/// A force and its moment about the base's origin, or a momentum, world axes.
template <class Number> struct Force {
    Vector3Of<Number> linear = Vector3Of<Number>::Zero();
    Vector3Of<Number> angular = Vector3Of<Number>::Zero();
};

/// What the velocity of bodies adds to the Coriolis matrix, in the axes and about the origin of their
/// inertia: B = [0, -momentum×; 0, rotational], with B v = v ×* Y v and B + Bᵀ = dY/dt.
template <class Number> struct InertiaRate {
    Vector3Of<Number> momentum = Vector3Of<Number>::Zero(); ///< linear
    Matrix3Of<Number> rotational = Matrix3Of<Number>::Zero();

    void operator+=(const InertiaRate& other) {
        momentum += other.momentum;
        rotational += other.rotational;
    }
};

/// A state and what was computed of it.
template <class Number> struct StateOf {
    explicit StateOf(const Model::Content& model);

    // The state.
    Matrix3Of<Number> R = Matrix3Of<Number>::Identity(); ///< world from base
    Vector3Of<Number> p = Vector3Of<Number>::Zero();     ///< origin of the base in the world
    VectorOf<Number> s;
    Vector3Of<Number> p_dot = Vector3Of<Number>::Zero();
    Vector3Of<Number> omega = Vector3Of<Number>::Zero();
    VectorOf<Number> s_dot;

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
    std::vector<PoseOf<Number>> in_base;         ///< joints: seen from the base
    std::vector<PoseOf<Number>> in_world;        ///< kinematics: origins relative to the base's
    std::vector<Motion<Number>> columns;         ///< kinematics: motion per unit of the joint's velocity
    std::vector<RigidInertia<Number>> inertia;   ///< inertia
    std::vector<RigidInertia<Number>> composite; ///< mass: of all that the joint carries
    Vector3Of<Number> com;                       ///< mass
    MatrixOf<Number> M;                          ///< mass
    MatrixOf<Number> wide, folded; ///< mass, coriolis: a matrix with followers independent, and half way
    std::vector<Motion<Number>> velocity; ///< bias, for p_dot = 0
    std::vector<Motion<Number>>
        acceleration; ///< bias, for nu_dot = 0 and p_dot = 0, of a base that accelerates against gravity
    std::vector<Force<Number>> force;         ///< bias: what moves all that the joint carries
    VectorOf<Number> h;                       ///< bias
    std::vector<Motion<Number>> column_rates; ///< coriolis: time derivatives of the columns
    std::vector<InertiaRate<Number>> turning; ///< coriolis: of all that the joint carries
    MatrixOf<Number> C;                       ///< coriolis
    Eigen::Matrix<Number, 6, 1> H;            ///< momentum
};

struct Data::Content : StateOf<double> {
    explicit Content(const Model::Content& model) : StateOf(model), factor(M) {}

    Eigen::MatrixXd factor; ///< factor: D and, below, L of M = Lᵀ D L in the order of elimination
    Eigen::LLT<Eigen::Matrix<double, 6, 6>> base_factor; ///< factor: of what is left for the base
    int singular = -1; ///< factor: row of M with no inertia of its own, or none
};

/// x := M⁻¹ x. The mass matrix of this state is not singular.
void divide_by_mass(const Model& model, Data& data, Eigen::Ref<Eigen::VectorXd> x) noexcept;

} // namespace bf::dynamics

// The recursions over the tree of bodies, each of which fills what one part of a state's results holds.
#pragma once

#include "content.hpp"

#include <cassert>
#include <cmath>
#include <cstring>

// The generalised velocity is nu = [pdot; omega; s_dot]. All spatial vectors are in world axes about the
// base's origin, so that nothing is transformed from body to body. Two symmetries of rigid-body motion in
// uniform gravity allow it:
// - Shifting the world does not change the dynamics. The base therefore stands at the world's origin: the
//   columns of joints are what the mixed representation asks of them, and the base's own columns need no
//   computation. Results are as exact after a walk of a kilometre as at the start, and a change of the base's
//   position invalidates nothing.
// - Nor does an added uniform velocity. The bias terms are evaluated at pdot = 0, where the derivative of nu
//   is the spatial acceleration.

namespace bf::dynamics {

/// Matrix of x ↦ a × x.
template <class Number> Matrix3Of<Number> skew(const Vector3Of<Number>& a) {
    Matrix3Of<Number> A;
    A << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
    return A;
}

template <class Number>
StateOf<Number>::StateOf(const Model::Content& model)
    : s(VectorOf<Number>::Zero(static_cast<Eigen::Index>(model.joint_names.size()))), s_dot(s),
      in_base(model.bodies.size()), in_world(in_base), columns(in_base.size()), inertia(in_base.size()),
      composite(inertia), M(MatrixOf<Number>::Zero(6 + s.size(), 6 + s.size())), velocity(in_base.size()),
      acceleration(velocity), force(in_base.size()), h(6 + s.size()), column_rates(velocity),
      turning(in_base.size()), C(M) {
    if (!model.moving_followers.empty()) {
        const Eigen::Index size = M.cols() + static_cast<Eigen::Index>(model.moving_followers.size());
        wide.setZero(size, size);
        folded.resize(size, M.cols());
    }
}

/// Stores a value and says whether it differs, bit for bit, from the one before.
template <class Stored, class Given> bool replace(Stored& stored, const Given& given) {
    assert(stored.size() == given.size());
    const std::size_t bytes = sizeof(typename Stored::Scalar) * static_cast<std::size_t>(stored.rows());
    bool changed = false;
    for (Eigen::Index c = 0; c < stored.cols(); ++c) {
        changed = changed || std::memcmp(stored.col(c).data(), given.col(c).data(), bytes) != 0;
    }
    if (changed) stored = given;
    return changed;
}

template <class Number> void forget_velocity(StateOf<Number>& data) {
    data.has_bias = data.has_coriolis = data.has_momentum = false;
}

template <class Number> void forget_position(StateOf<Number>& data) {
    data.has_kinematics = data.has_inertia = data.has_mass = data.has_factor = false;
    forget_velocity(data);
}

template <class Number, class Transform> void set_base(StateOf<Number>& data, const Transform& w_H_b) {
    data.p = w_H_b.template block<3, 1>(0, 3);
    if (!replace(data.R, w_H_b.template topLeftCorner<3, 3>())) return;
    forget_position(data);
}

template <class Number, class Positions> void set_joints(StateOf<Number>& data, const Positions& s) {
    if (!replace(data.s, s)) return;
    data.has_joints = false;
    forget_position(data);
}

template <class Number, class Base, class Joints>
void set_velocities(StateOf<Number>& data, const Base& nu_base, const Joints& s_dot) {
    if (replace(data.p_dot, nu_base.template head<3>())) data.has_momentum = false;
    if (replace(data.omega, nu_base.template tail<3>())) forget_velocity(data);
    if (replace(data.s_dot, s_dot)) forget_velocity(data);
}

/// Motion per unit of the velocity of the joint that moves a body, of the point at the origin of its pose.
template <class Number> Motion<Number> motion(const Body& body, const PoseOf<Number>& pose) {
    const Vector3Of<Number> axis = pose.rotation * body.axis;
    return body.turns ? Motion<Number>{pose.translation.cross(axis), axis}
                      : Motion<Number>{axis, Vector3Of<Number>::Zero()};
}

/// Position or velocity of the joint that moves a body, of those of the listed joints.
template <class Number>
Number of_joint(const Model::Content& model, const Body& body, const VectorOf<Number>& listed,
                double offsets) {
    if (body.joint < listed.size()) return listed[body.joint];
    const FollowerIndex& follower =
        model.moving_followers[static_cast<std::size_t>(body.joint - listed.size())];
    return follower.factor * listed[follower.leader] + offsets * follower.offset;
}

template <class Number> void update_joints(const Model::Content& model, StateOf<Number>& data) {
    if (data.has_joints) return;
    using std::cos, std::sin;
    for (std::size_t k = 1; k < model.bodies.size(); ++k) {
        const Body& body = model.bodies[k];
        const PoseOf<Number>& parent = data.in_base[body.parent];
        const Number q = of_joint(model, body, data.s, 1.0);
        PoseOf<Number>& pose = data.in_base[k];
        pose.translation = parent.translation + parent.rotation * body.origin;
        if (body.turns) {
            const Matrix3Of<Number> turned = body.fixed + cos(q) * body.cosine + sin(q) * body.sine;
            pose.rotation.noalias() = parent.rotation * turned;
        } else {
            pose.rotation.noalias() = parent.rotation * body.fixed;
            pose.translation += q * (pose.rotation * body.axis);
        }
    }
    data.has_joints = true;
}

template <class Number> void update_kinematics(const Model::Content& model, StateOf<Number>& data) {
    if (data.has_kinematics) return;
    update_joints(model, data);
    data.in_world[0].rotation = data.R;
    for (std::size_t k = 1; k < model.bodies.size(); ++k) {
        PoseOf<Number>& pose = data.in_world[k];
        pose.rotation.noalias() = data.R * data.in_base[k].rotation;
        pose.translation.noalias() = data.R * data.in_base[k].translation;
        data.columns[k] = motion(model.bodies[k], pose);
    }
    data.has_kinematics = true;
}

/// Inertia of one body: c = R com + p, I = R I_com Rᵀ + m (cᵀc 1 - c cᵀ).
template <class Number> RigidInertia<Number> in_world(const PoseOf<Number>& pose, const Body& body) {
    const Matrix3Of<Number>& R = pose.rotation;
    const Vector3Of<Number> c = R * body.com + pose.translation;
    RigidInertia<Number> inertia;
    inertia.mass = body.mass;
    inertia.moment = body.mass * c;
    const Matrix3Of<Number> half = R * body.inertia;
    inertia.rotational.noalias() = half * R.transpose();
    inertia.rotational -= inertia.moment * c.transpose();
    inertia.rotational.diagonal().array() += inertia.moment.dot(c);
    return inertia;
}

template <class Number> void update_inertia(const Model::Content& model, StateOf<Number>& data) {
    if (data.has_inertia) return;
    update_kinematics(model, data);
    for (std::size_t k = 0; k < model.bodies.size(); ++k)
        data.inertia[k] = in_world(data.in_world[k], model.bodies[k]);
    data.has_inertia = true;
}

/// Momentum of a body that moves so.
template <class Number> Force<Number> operator*(const RigidInertia<Number>& Y, const Motion<Number>& v) {
    return {Y.mass * v.linear + v.angular.cross(Y.moment),
            Y.rotational * v.angular + Y.moment.cross(v.linear)};
}

/// result = Gᵀ wide G for [nu; velocities of the followers] = G nu.
template <class Number>
void fold(const Model::Content& model, StateOf<Number>& data, MatrixOf<Number>& result) {
    const Eigen::Index size = result.cols();
    data.folded = data.wide.leftCols(size);
    for (std::size_t k = 0; k < model.moving_followers.size(); ++k) {
        const FollowerIndex& follower = model.moving_followers[k];
        data.folded.col(6 + follower.leader) +=
            follower.factor * data.wide.col(size + static_cast<Eigen::Index>(k));
    }
    result = data.folded.topRows(size);
    for (std::size_t k = 0; k < model.moving_followers.size(); ++k) {
        const FollowerIndex& follower = model.moving_followers[k];
        result.row(6 + follower.leader) +=
            follower.factor * data.folded.row(size + static_cast<Eigen::Index>(k));
    }
}

/// M by the composite-rigid-body algorithm (Featherstone 2008, table 6.2), its columns about the base's
/// origin: with the momentum F = Y S of the subtree of joint j, M(base, j) = F and M(i, j) = Sᵢᵀ F for every
/// joint i that carries j. All other entries are zero since construction.
template <class Number> void update_mass(const Model::Content& model, StateOf<Number>& data) {
    if (data.has_mass) return;
    update_inertia(model, data);
    MatrixOf<Number>& M = model.moving_followers.empty() ? data.M : data.wide;
    const std::size_t count = model.bodies.size();
    data.composite = data.inertia;
    for (std::size_t k = count - 1; k > 0; --k) {
        const Force<Number> F = data.composite[k] * data.columns[k];
        const Eigen::Index j = 6 + model.bodies[k].joint;
        M.template block<3, 1>(0, j) = F.linear;
        M.template block<3, 1>(3, j) = F.angular;
        M.template block<1, 3>(j, 0) = F.linear;
        M.template block<1, 3>(j, 3) = F.angular;
        for (const auto* supports : {&model.supports[k], &model.follower_supports[k]}) {
            for (const Support& support : *supports) {
                const Eigen::Index i = 6 + support.joint;
                const Motion<Number>& S = data.columns[support.body];
                M(i, j) = M(j, i) = S.linear.dot(F.linear) + S.angular.dot(F.angular);
            }
        }
        data.composite[model.bodies[k].parent] += data.composite[k];
    }
    const RigidInertia<Number>& Y = data.composite[0];
    data.com = Y.moment / Y.mass;
    M.template topLeftCorner<3, 3>() = Y.mass * Matrix3Of<Number>::Identity();
    M.template block<3, 3>(3, 0) = skew(Y.moment);
    M.template block<3, 3>(0, 3) = -skew(Y.moment);
    M.template block<3, 3>(3, 3) = Y.rotational;
    if (!model.moving_followers.empty()) fold(model, data, data.M);
    data.has_mass = true;
}

/// The recursive Newton-Euler algorithm (Featherstone 2008, table 5.1) for nu_dot = 0: a = a_parent + v × S
/// qdot is the acceleration of a body, f = Y a + v × Y v the force that it needs, and h_j = Sᵀ of the sum of
/// all that j carries.
template <class Number> void update_bias(const Model::Content& model, StateOf<Number>& data) {
    if (data.has_bias) return;
    update_inertia(model, data);
    data.velocity[0].angular = data.omega;
    data.acceleration[0].linear = -model.gravity.template cast<Number>();
    const std::size_t count = model.bodies.size();
    for (std::size_t k = 0; k < count; ++k) {
        Motion<Number>&v = data.velocity[k], &a = data.acceleration[k];
        if (k > 0) {
            const Motion<Number>&v_parent = data.velocity[model.bodies[k].parent],
                  &a_parent = data.acceleration[model.bodies[k].parent], &S = data.columns[k];
            const Number q_dot = of_joint(model, model.bodies[k], data.s_dot, 0.0);
            const Motion<Number> own{q_dot * S.linear, q_dot * S.angular};
            v = {v_parent.linear + own.linear, v_parent.angular + own.angular};
            a = {a_parent.linear + v_parent.angular.cross(own.linear) + v_parent.linear.cross(own.angular),
                 a_parent.angular + v_parent.angular.cross(own.angular)};
        }
        const Force<Number> needed = data.inertia[k] * a, momentum = data.inertia[k] * v;
        data.force[k] = {needed.linear + v.angular.cross(momentum.linear),
                         needed.angular + v.angular.cross(momentum.angular) +
                             v.linear.cross(momentum.linear)};
    }
    data.h.setZero();
    for (std::size_t k = count - 1; k > 0; --k) {
        const Body& body = model.bodies[k];
        const Motion<Number>& S = data.columns[k];
        const Force<Number>& f = data.force[k];
        const Number tau = S.linear.dot(f.linear) + S.angular.dot(f.angular);
        if (body.joint < data.s.size()) {
            data.h[6 + body.joint] += tau;
        } else {
            const FollowerIndex& follower =
                model.moving_followers[static_cast<std::size_t>(body.joint - data.s.size())];
            data.h[6 + follower.leader] += follower.factor * tau;
        }
        Force<Number>& below = data.force[body.parent];
        below.linear += f.linear;
        below.angular += f.angular;
    }
    data.h.template head<3>() = data.force[0].linear;
    data.h.template segment<3>(3) = data.force[0].angular;
    data.has_bias = true;
}

/// C by its composite-rigid-body algorithm (Echeandia, Wensing 2021): C(i, j) = Sᵢᵀ (Y Sⱼ' + B Sⱼ) with the
/// inertia Y and its rate B of all that the further of the two joints carries, and the time derivative
/// S' = v × S of a column. Those of the base stand still, as pdot = 0. With v×, v×* and the exchanged product
/// of that paper worked out for a rigid body, B is [0, -momentum×; 0, ω× (I - ½ tr I) - moment× v×].
template <class Number> void update_coriolis(const Model::Content& model, StateOf<Number>& data) {
    if (data.has_coriolis) return;
    update_mass(model, data);
    update_bias(model, data);
    MatrixOf<Number>& C = model.moving_followers.empty() ? data.C : data.wide;
    const std::size_t count = model.bodies.size();
    for (std::size_t k = 0; k < count; ++k) {
        const Motion<Number>&v = data.velocity[k], &S = data.columns[k];
        data.column_rates[k] = {v.angular.cross(S.linear) + v.linear.cross(S.angular),
                                v.angular.cross(S.angular)};
        const RigidInertia<Number>& Y = data.inertia[k];
        Matrix3Of<Number> half = Y.rotational;
        half.diagonal().array() -= 0.5 * Y.rotational.trace();
        data.turning[k].momentum = (Y * v).linear;
        data.turning[k].rotational.noalias() = skew(v.angular) * half - skew(Y.moment) * skew(v.linear);
    }
    for (std::size_t k = count - 1; k > 0; --k) {
        const Motion<Number>&S = data.columns[k], &S_dot = data.column_rates[k];
        const InertiaRate<Number>& B = data.turning[k];
        const Force<Number> Y_S = data.composite[k] * S, Y_S_dot = data.composite[k] * S_dot;
        const Force<Number> F{Y_S_dot.linear + S.angular.cross(B.momentum),
                              Y_S_dot.angular + B.rotational * S.angular};
        const Vector3Of<Number> from_angular =
            B.momentum.cross(S.linear) + B.rotational.transpose() * S.angular; // Bᵀ S
        const Eigen::Index j = 6 + model.bodies[k].joint;
        C.template block<3, 1>(0, j) = F.linear;
        C.template block<3, 1>(3, j) = F.angular;
        C.template block<1, 3>(j, 3) = from_angular;
        for (const auto* supports : {&model.supports[k], &model.follower_supports[k]}) {
            for (const Support& support : *supports) {
                const Eigen::Index i = 6 + support.joint;
                const Motion<Number>&S_i = data.columns[support.body],
                      &S_i_dot = data.column_rates[support.body];
                C(i, j) = S_i.linear.dot(F.linear) + S_i.angular.dot(F.angular);
                C(j, i) = S_i_dot.linear.dot(Y_S.linear) + S_i_dot.angular.dot(Y_S.angular) +
                          S_i.angular.dot(from_angular);
            }
        }
        data.turning[model.bodies[k].parent] += B;
    }
    C.template block<3, 3>(0, 3) = -skew(data.turning[0].momentum);
    C.template block<3, 3>(3, 3) = data.turning[0].rotational;
    if (!model.moving_followers.empty()) {
        C.template leftCols<3>().setZero(); // where M was
        fold(model, data, data.C);
    }
    data.has_coriolis = true;
}

template <class Number> void update_momentum(const Model::Content& model, StateOf<Number>& data) {
    if (data.has_momentum) return;
    update_mass(model, data);
    data.H.noalias() = data.M.template topLeftCorner<6, 3>() * data.p_dot;
    data.H.noalias() += data.M.template block<6, 3>(0, 3) * data.omega;
    for (Eigen::Index i = 0; i < data.s_dot.size(); ++i) {
        data.H += data.M.col(6 + i).template head<6>() * data.s_dot[i];
    }
    data.H.template tail<3>() -=
        data.com.cross(data.H.template head<3>()); // from the base's origin to the centre of mass
    data.has_momentum = true;
}

} // namespace bf::dynamics

#include "bf/dynamics/variation.hpp"

#include "bf/base/dual.hpp"
#include "quantities.hpp"

#include <algorithm>
#include <utility>

namespace Eigen {

template <int lanes> struct NumTraits<bf::Dual<lanes>> : NumTraits<double> {
    using Real = bf::Dual<lanes>;
    using NonInteger = bf::Dual<lanes>;
    using Nested = bf::Dual<lanes>;
    enum { RequireInitialization = 0, ReadCost = 1 + lanes, AddCost = 1 + lanes, MulCost = 1 + 3 * lanes };
};
template <int lanes, class Operation> struct ScalarBinaryOpTraits<bf::Dual<lanes>, double, Operation> {
    using ReturnType = bf::Dual<lanes>;
};
template <int lanes, class Operation> struct ScalarBinaryOpTraits<double, bf::Dual<lanes>, Operation> {
    using ReturnType = bf::Dual<lanes>;
};

} // namespace Eigen

namespace bf::dynamics {

namespace {

using Number = Dual<4>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Values with their changes along the directions from `first` on.
template <class Values>
auto varied(const Values& values, const Eigen::Ref<const Eigen::MatrixXd>& changes, Eigen::Index first) {
    Eigen::Matrix<Number, Values::RowsAtCompileTime, Values::ColsAtCompileTime> numbers =
        values.template cast<Number>();
    const auto count = std::min<Eigen::Index>(Number::directions, changes.cols() - first);
    for (Eigen::Index e = 0; e < changes.rows(); ++e)
        for (Eigen::Index c = 0; c < count; ++c)
            numbers.data()[e].slope[static_cast<std::size_t>(c)] = changes(e, first + c);
    return numbers;
}

/// A quantity and its changes, as they were given last.
class Given {
  public:
    /// Is it so already, perhaps along more directions? Else it is from now on.
    bool replace(const Eigen::Ref<const Eigen::MatrixXd>& value, const Eigen::MatrixXd& changes,
                 Eigen::Index directions) {
        if (directions <= directions_ && value_ == value && changes_.rows() == changes.rows() &&
            (changes.rows() == 0 || changes_.leftCols(directions) == changes))
            return false;
        value_ = value;
        changes_ = changes;
        directions_ = directions;
        return true;
    }
    /// Does it stay along the directions from the first one on?
    bool is_still(Eigen::Index first) const {
        return changes_.rows() == 0 ||
               changes_.middleCols(first, std::min<Eigen::Index>(Number::directions, changes_.cols() - first))
                   .isZero(0.0);
    }

  private:
    Eigen::MatrixXd value_, changes_;
    Eigen::Index directions_ = -1;
};

PoseOf<Number> cast(const Pose& its) { return {its.rotation.cast<Number>(), its.translation.cast<Number>()}; }
Motion<Number> cast(const Motion<double>& its) {
    return {its.linear.cast<Number>(), its.angular.cast<Number>()};
}
RigidInertia<Number> cast(const RigidInertia<double>& its) {
    return {its.mass, its.moment.cast<Number>(), its.rotational.cast<Number>()};
}

template <class To, class From> void take(std::vector<To>& to, const std::vector<From>& from) {
    std::transform(from.begin(), from.end(), to.begin(), [](const From& its) { return cast(its); });
}

/// What follows from positions that do not change.
void take_positions(const Model& model, StateOf<double>& values, StateOf<Number>& state) {
    update_mass(model.content(), values);
    take(state.in_base, values.in_base);
    take(state.in_world, values.in_world);
    take(state.columns, values.columns);
    take(state.inertia, values.inertia);
    take(state.composite, values.composite);
    state.com = values.com.cast<Number>();
    state.M = values.M.cast<Number>();
    state.has_joints = state.has_kinematics = state.has_inertia = state.has_mass = true;
}

} // namespace

/// One state per four directions, with numbers that have four derivatives.
struct Variation::Content {
    explicit Content(const Model& model) : values(model) {}

    Data values;
    std::vector<StateOf<Number>> states;
    Eigen::Index directions = 0;
    Given pose, positions, base_velocity, velocities;

    /// f(state, first of its directions) of each.
    template <class F> void for_each(F&& f) {
        for (Eigen::Index first = 0; first < directions; first += Number::directions)
            f(states[static_cast<std::size_t>(first / Number::directions)], first);
    }
    void set_directions(const Model& model, Eigen::Index count) {
        directions = count;
        while (static_cast<Eigen::Index>(states.size()) * Number::directions < count)
            states.emplace_back(model.content());
    }
    void set_pose(const Eigen::Ref<const Eigen::Matrix4d>& w_H_b, const StateChanges& changes) {
        if (pose.replace(w_H_b, changes.w_H_b, directions))
            for_each([&](auto& state, Eigen::Index first) {
                set_base(state, varied(w_H_b, changes.w_H_b, first));
            });
    }
    void set_positions(const Eigen::Ref<const Eigen::VectorXd>& s, const StateChanges& changes) {
        if (positions.replace(s, changes.s, directions))
            for_each(
                [&](auto& state, Eigen::Index first) { set_joints(state, varied(s, changes.s, first)); });
    }
    void set_velocities(const Eigen::Ref<const Vector6>& nu_base,
                        const Eigen::Ref<const Eigen::VectorXd>& s_dot, const StateChanges& changes) {
        const bool is_other_base = base_velocity.replace(nu_base, changes.nu_base, directions),
                   is_other = velocities.replace(s_dot, changes.s_dot, directions);
        if (is_other_base || is_other)
            for_each([&](auto& state, Eigen::Index first) {
                dynamics::set_velocities(state, varied(nu_base, changes.nu_base, first),
                                         varied(s_dot, changes.s_dot, first));
            });
    }
    /// Along velocities alone nothing is repeated that hangs on positions.
    void take_still(const Model& model) {
        for_each([&](StateOf<Number>& state, Eigen::Index first) {
            if (!state.has_mass && pose.is_still(first) && positions.is_still(first))
                take_positions(model, values.content(), state);
        });
    }
    /// Changes of quantity(state, y), where y has a place for each element.
    template <class Plain, class Quantity> void changes_of(Plain y, MatrixOut changes, Quantity&& quantity) {
        for_each([&](StateOf<Number>& state, Eigen::Index first) {
            quantity(state, y, first);
            const auto count = std::min<Eigen::Index>(Number::directions, directions - first);
            for (Eigen::Index c = 0; c < count; ++c)
                for (Eigen::Index e = 0; e < y.size(); ++e)
                    changes(e, first + c) = y.data()[e].slope[static_cast<std::size_t>(c)];
        });
    }
};

Variation::Variation(const Model& model) : content_(std::make_unique<Content>(model)) {}
Variation::~Variation() = default;
Variation::Variation(Variation&&) noexcept = default;
Variation& Variation::operator=(Variation&&) noexcept = default;

void set_state(const Model& model, Variation& variation, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b,
               const Eigen::Ref<const Eigen::VectorXd>& s, const Eigen::Ref<const Vector6>& nu_base,
               const Eigen::Ref<const Eigen::VectorXd>& s_dot, const StateChanges& changes,
               Eigen::Index directions) {
    auto& v = variation.content();
    set_state(model, v.values, w_H_b, s, nu_base, s_dot);
    v.set_directions(model, directions);
    v.set_pose(w_H_b, changes);
    v.set_positions(s, changes);
    v.set_velocities(nu_base, s_dot, changes);
    v.take_still(model);
}

void set_position(const Model& model, Variation& variation, const Eigen::Ref<const Eigen::Matrix4d>& w_H_b,
                  const Eigen::Ref<const Eigen::VectorXd>& s, const StateChanges& changes,
                  Eigen::Index directions) {
    auto& v = variation.content();
    set_position(model, v.values, w_H_b, s);
    v.set_directions(model, directions);
    v.set_pose(w_H_b, changes);
    v.set_positions(s, changes);
}

void set_joint_position(const Model& model, Variation& variation, const Eigen::Ref<const Eigen::VectorXd>& s,
                        const StateChanges& changes, Eigen::Index directions) {
    auto& v = variation.content();
    set_joint_position(model, v.values, s);
    v.set_directions(model, directions);
    v.set_positions(s, changes);
}

namespace {

/// Changes of quantity(model, state, arguments..., y), where y has that shape.
template <class Y, class... Arguments>
void vary(const Model& model, Variation& variation, MatrixOut changes, Y&& shape,
          void (*quantity)(const Model::Content&, StateOf<Number>&, Arguments..., Y&),
          Arguments... arguments) {
    variation.content().changes_of(std::move(shape), changes,
                                   [&](StateOf<Number>& state, Y& y, Eigen::Index) {
                                       quantity(model.content(), state, arguments..., y);
                                   });
}

using Matrices = MatrixOf<Number>;
using Vectors = VectorOf<Number>;

} // namespace

void forward_kinematics(const Model& model, Variation& variation, Frame frame, MatrixOut changes) {
    vary(model, variation, changes, Matrices(4, 4), forward_kinematics<Number, Matrices&>, frame);
}
void jacobian(const Model& model, Variation& variation, Frame frame, MatrixOut changes) {
    vary(model, variation, changes, Matrices(6, model.velocities()), jacobian<Number, Matrices&>, frame);
}
void bias_acceleration(const Model& model, Variation& variation, Frame frame, MatrixOut changes) {
    vary(model, variation, changes, Vectors(6), bias_acceleration<Number, Vectors&>, frame);
}
void center_of_mass(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Vectors(3), center_of_mass<Number, Vectors&>);
}
void center_of_mass_velocity(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Vectors(3), center_of_mass_velocity<Number, Vectors&>);
}
void com_jacobian(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Matrices(3, model.velocities()), com_jacobian<Number, Matrices&>);
}
void com_bias_acceleration(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Vectors(3), com_bias_acceleration<Number, Vectors&>);
}
void mass_matrix(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Matrices(model.velocities(), model.velocities()),
         mass_matrix<Number, Matrices&>);
}
void bias_forces(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Vectors(model.velocities()), bias_forces<Number, Vectors&>);
}
void gravity_forces(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Vectors(model.velocities()), gravity_forces<Number, Vectors&>);
}
void coriolis_forces(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Vectors(model.velocities()), coriolis_forces<Number, Vectors&>);
}
void coriolis_matrix(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Matrices(model.velocities(), model.velocities()),
         coriolis_matrix<Number, Matrices&>);
}
void mass_matrix_derivative(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Matrices(model.velocities(), model.velocities()),
         mass_matrix_derivative<Number, Matrices&>);
}
void centroidal_momentum(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Vectors(6), centroidal_momentum<Number, Vectors&>);
}
void centroidal_momentum_matrix(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Matrices(6, model.velocities()),
         centroidal_momentum_matrix<Number, Matrices&>);
}
void centroidal_momentum_bias(const Model& model, Variation& variation, MatrixOut changes) {
    vary(model, variation, changes, Vectors(6), centroidal_momentum_bias<Number, Vectors&>);
}
void relative_transform(const Model& model, Variation& variation, Frame reference, Frame frame,
                        MatrixOut changes) {
    vary(model, variation, changes, Matrices(4, 4), relative_transform<Number, Matrices&>, reference, frame);
}
void relative_jacobian(const Model& model, Variation& variation, Frame reference, Frame frame,
                       MatrixOut changes) {
    vary(model, variation, changes, Matrices(6, model.joints()), relative_jacobian<Number, Matrices&>,
         reference, frame);
}

void inverse_dynamics(const Model& model, Variation& variation,
                      const Eigen::Ref<const Vector6>& base_acceleration,
                      const Eigen::Ref<const Eigen::VectorXd>& s_ddot,
                      const Changed& base_acceleration_changes, const Changed& s_ddot_changes,
                      MatrixOut changes) {
    auto& v = variation.content();
    v.changes_of(VectorOf<Number>(model.velocities()), changes,
                 [&](auto& state, auto& y, Eigen::Index first) {
                     inverse_dynamics(model.content(), state,
                                      varied(base_acceleration, base_acceleration_changes, first),
                                      varied(s_ddot, s_ddot_changes, first), y);
                 });
}

void add_wrench(const Model& model, Variation& variation, Frame frame, const Eigen::Ref<const Vector6>& f,
                const Changed& f_changes, MatrixOut forces_changes) {
    auto& v = variation.content();
    Eigen::MatrixXd added(model.velocities(), v.directions);
    v.changes_of(VectorOf<Number>(model.velocities()), added, [&](auto& state, auto& y, Eigen::Index first) {
        y.setZero();
        add_wrench(model.content(), state, frame, varied(f, f_changes, first), y);
    });
    forces_changes += added;
}

void forward_dynamics(const Model& model, Variation& variation,
                      const Eigen::Ref<const Eigen::VectorXd>& nu_dot, const Changed& forces_changes,
                      MatrixOut changes) {
    const Eigen::Index joints = model.joints();
    Vector6 base = Vector6::Zero();
    base.head(nu_dot.size() - joints) = nu_dot.head(nu_dot.size() - joints);
    const Eigen::MatrixXd none;
    inverse_dynamics(model, variation, base, nu_dot.tail(joints), none, none, changes);
    changes = forces_changes - changes;
    for (Eigen::Index c = 0; c < changes.cols(); ++c)
        divide_by_mass(model, variation.content().values, changes.col(c));
}

} // namespace bf::dynamics

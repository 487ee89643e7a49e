// What all blocks over a robot's description share.
#pragma once

#include "bf/core/block.hpp"
#include "bf/core/changes.hpp"
#include "bf/dynamics/algorithms.hpp"
#include "bf/toolbox/robot.hpp"
#include "checks.hpp"

namespace bf::toolbox {

/// Base of the model blocks: the configuration around the block and its number of joints n.
class RobotBlock : public Block {
  public:
    using Block::Block;
    Requires<RobotConfiguration> robot{this, "the robot whose quantities are computed"};
    Dim n{this, "n", [this]() -> Dim::Names {
              if (!robot.is_bound()) return std::nullopt;
              return robot->model.joint_names();
          }};
    /// Size of nu: 6 + n, or n for a fixed base.
    Dim v{this, "v", [this]() -> Dim::Names {
              if (!robot.is_bound()) return std::nullopt;
              std::vector<std::string> names;
              if (robot->model.has_floating_base())
                  names = {"base_x", "base_y", "base_z", "base_rx", "base_ry", "base_rz"};
              names.insert(names.end(), robot->model.joint_names().begin(), robot->model.joint_names().end());
              return names;
          }};

  protected:
    const dynamics::Model& model() const { return robot->model; }
    bool base_is_fixed() const { return robot.is_bound() && !model().has_floating_base(); }
    dynamics::Data& data(Now at) const { return at[robot].data; }
    dynamics::Variation& variation(Now at) const {
        auto& made = at[robot].variation;
        if (!made) made.emplace(model());
        return *made;
    }
};

/// A frame given by name, looked up once the robot is known. "com" stands for the centre of mass where a
/// block allows it.
class FrameArgument {
  public:
    FrameArgument(Block* owner, const char* name, const char* doc)
        : name_{owner, name, {.initial = "root_link", .doc = doc}} {}
    void resolve(const Requires<RobotConfiguration>& robot, bool allows_com = false) const {
        is_com = allows_com && *name_ == "com";
        if (robot.is_bound() && !is_com) frame = robot->model.frame(*name_);
    }
    mutable dynamics::Frame frame;
    mutable bool is_com = false;

  private:
    Argument<std::string> name_;
};

/// Names of ports that stand for the named things.
inline std::vector<std::string> prefixed(const std::string& prefix, const std::vector<std::string>& names) {
    std::vector<std::string> result;
    for (const auto& name : names) result.push_back(prefix + name);
    return result;
}

inline constexpr const char* base_pose_doc =
    "base pose: rotation [1], position [m]; a fixed base without one is at the origin";
inline constexpr const char* base_velocity_doc = "base velocity, mixed: origin [m/s], angular [rad/s], world "
                                                 "axes; zero for a fixed base, which needs none";

/// Blocks whose result depends on joint positions alone.
class JointBlock : public RobotBlock {
  public:
    using RobotBlock::RobotBlock;
    Input<Vector> s{this, "s", {.shape = {n}, .unit = unit<"rad">, .doc = "joint positions"}};

    Status output(Now at, Out out) const noexcept final { return evaluate(at, out); }

  protected:
    virtual Status evaluate(Now at, Out out) const noexcept = 0;
    dynamics::Data& at_state(Now at) const {
        dynamics::set_joint_position(model(), data(at), at[s]);
        return data(at);
    }
    dynamics::Variation& at_state(Now at, const Changes& changes) const {
        auto& v = variation(at);
        dynamics::set_joint_position(model(), v, at[s], {{}, changes[s], {}, {}}, changes.directions());
        return v;
    }
};

/// Blocks whose result depends on base pose and joint positions. A state that is none ends the step, by the
/// name of its port, before evaluate() gives the outputs.
class PositionBlock : public RobotBlock {
  public:
    using RobotBlock::RobotBlock;
    Input<Transform> w_H_b{this,
                           "w_H_b",
                           {.initial = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                            .unit = mixed_units,
                            .doc = base_pose_doc}};
    Input<Vector> s{this, "s", {.shape = {n}, .unit = unit<"rad">, .doc = "joint positions"}};

    bool needs(int input) const override {
        return RobotBlock::needs(input) && !(input == w_H_b.index() && base_is_fixed());
    }
    Status output(Now at, Out out) const noexcept final {
        const Status good = check_state(at);
        return good ? evaluate(at, out) : good;
    }

  protected:
    virtual Status evaluate(Now at, Out out) const noexcept = 0;
    virtual Status check_state(Now at) const noexcept {
        const Status good = all_finite(at, w_H_b, s);
        return good ? is_rotation(at, w_H_b) : good;
    }
    dynamics::Data& at_state(Now at) const {
        dynamics::set_position(model(), data(at), at[w_H_b], at[s]);
        return data(at);
    }
    dynamics::Variation& at_state(Now at, const Changes& changes) const {
        auto& v = variation(at);
        dynamics::set_position(model(), v, at[w_H_b], at[s], {changes[w_H_b], changes[s], {}, {}},
                               changes.directions());
        return v;
    }
};

/// Blocks whose result depends on velocities too.
class VelocityBlock : public PositionBlock {
  public:
    using PositionBlock::PositionBlock;
    Input<Vector6> v_b{this, "v_b", {.unit = mixed_units, .doc = base_velocity_doc}};
    Input<Vector> s_dot{this, "s_dot", {.shape = {n}, .unit = unit<"rad/s">, .doc = "joint velocities"}};

    bool needs(int input) const override {
        return PositionBlock::needs(input) && !(input == v_b.index() && base_is_fixed());
    }

  protected:
    Status check_state(Now at) const noexcept override {
        Status good = PositionBlock::check_state(at);
        if (good && model().has_floating_base()) good = all_finite(at, v_b);
        return good ? all_finite(at, s_dot) : good;
    }
    Vector6 base_velocity(Now at) const {
        return model().has_floating_base() ? Vector6(at[v_b]) : Vector6(Vector6::Zero());
    }
    dynamics::Data& at_state(Now at) const {
        dynamics::set_state(model(), data(at), at[w_H_b], at[s], base_velocity(at), at[s_dot]);
        return data(at);
    }
    dynamics::Variation& at_state(Now at, const Changes& changes) const {
        auto& v = variation(at);
        const Matrix still;
        dynamics::set_state(
            model(), v, at[w_H_b], at[s], base_velocity(at), at[s_dot],
            {changes[w_H_b], changes[s], model().has_floating_base() ? changes[v_b] : still, changes[s_dot]},
            changes.directions());
        return v;
    }
};

/// A block of one quantity of the robot, which depends on the inputs of Base: B says by `compute(state, to)`
/// what it is, of a state with its values, and of a variation with their changes.
template <class Base, class B> class QuantityOf : public Base, public Differentiable {
  public:
    using Base::Base;
    bool directional_derivative(Now at, Changes& changes) const final {
        static_cast<const B&>(*this).compute(this->at_state(at, changes), changes);
        return true;
    }

  protected:
    Status evaluate(Now at, Out out) const noexcept final {
        static_cast<const B&>(*this).compute(this->at_state(at), out);
        return ok;
    }
};

} // namespace bf::toolbox

// Blocks that declare their derivative.
#pragma once

#include "bf/core/access.hpp"

#include <Eigen/Core>

#include <vector>

namespace bf {

/// Small changes of what a block reads and writes, along several directions at once: of each quantity a
/// matrix with a row per element, in the order of its memory, and a column per direction. Made by the engine.
class Changes {
  public:
    Changes(int slots, int directions)
        : changes_(static_cast<std::size_t>(slots)), rates_(changes_.size()), next_(changes_.size()),
          directions_(directions) {}

    int directions() const { return directions_; }
    /// Does it change along any of the directions? Only inputs with feedthrough and states do.
    template <class T, Role role> bool moves(const Key<T, role>& key) const {
        return key.is_present() && at(key.index()).size() > 0;
    }
    /// Of what is read, where it moves: elements × directions. Of what is written, to be filled: zeros at
    /// first.
    template <class T, Role role> Eigen::MatrixXd& operator[](const Key<T, role>& key) {
        return at(key.index());
    }
    template <class T, Role role> const Eigen::MatrixXd& operator[](const Key<T, role>& key) const {
        return at(key.index());
    }
    /// The same, and zeros where it does not move.
    template <class T, Role role> Eigen::MatrixXd of(const Key<T, role>& key, Eigen::Index elements) const {
        return moves(key) ? (*this)[key] : Eigen::MatrixXd::Zero(elements, directions_);
    }
    /// Of the derivative of a continuous state by the time, to be filled: zeros at first.
    template <class T> Eigen::MatrixXd& rate(const Key<T, Role::continuous_state>& key) {
        return rate_at(key.index());
    }
    /// Of the next value of a discrete state, to be filled: zeros at first.
    template <class T> Eigen::MatrixXd& next(const Key<T, Role::discrete_state>& key) {
        return next_at(key.index());
    }
    /// The derivative is that of one side, as there is a jump or corner right here.
    void meets_corner() { has_corner_ = true; }
    bool has_corner() const { return has_corner_; }

    Eigen::MatrixXd& at(int slot) { return changes_[static_cast<std::size_t>(slot)]; } ///< for engines
    const Eigen::MatrixXd& at(int slot) const { return changes_[static_cast<std::size_t>(slot)]; }
    Eigen::MatrixXd& rate_at(int slot) { return rates_[static_cast<std::size_t>(slot)]; } ///< for engines
    Eigen::MatrixXd& next_at(int slot) { return next_[static_cast<std::size_t>(slot)]; }  ///< for engines

  private:
    std::vector<Eigen::MatrixXd> changes_, rates_, next_; // by slot; empty: it does not move
    int directions_;
    bool has_corner_ = false;
};

/// A block with exact derivatives of its methods says so by this base beside Block:
/// class MyBlock : public Block, public Differentiable. Rules have theirs by themselves; methods that declare
/// none are differenced. Nothing in a simulation calls it: it is no part of a step and may allocate.
class Differentiable {
  public:
    /// Fills the changes of what `output` writes from those of what it reads, at the values of this instant,
    /// for which it ran. False: it has none here.
    virtual bool directional_derivative(Now /*at*/, Changes& /*changes*/) const { return false; }
    /// The same of the rates of continuous states that `derivative` writes.
    virtual bool directional_derivative_of_rates(Now /*at*/, Changes& /*changes*/) const { return false; }
    /// The same of the next values of discrete states that `update` writes; it reads outputs, too.
    virtual bool directional_derivative_of_update(Now /*at*/, Changes& /*changes*/) const { return false; }

  protected:
    ~Differentiable() = default;
};

} // namespace bf

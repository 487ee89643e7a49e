// Numbers that a run can change, by name: "controller.pid.P", "Gain.Kp", "lqr.K[1][2]", "K[2]".
#pragma once

#include "bf/engine/simulation.hpp"

#include <string>
#include <utility>
#include <vector>

namespace bf::analysis {

/// A parameter of doubles, or a variable.
struct Adjustable {
    ParameterValue given; ///< as it is when they are looked for
    bool is_variable = false;
    int rows = 1, cols = 1;
    Limits limits = {};
    std::string fixed = {}; ///< why a run cannot change it; empty: it can
};

class Adjustables {
  public:
    explicit Adjustables(const Simulation& run); ///< which has started, and outlives it

    /// Variables, then parameters.
    const std::vector<Adjustable>& all() const { return all_; }
    /// Null: there is none of that name.
    const Adjustable* find(const std::string& path) const;
    /// All elements of what is named, or the one that is, "K[2]" also of a row. Null: there is none of that
    /// name. Throws RunError: it has no such element, or a run cannot change it.
    std::pair<const Adjustable*, std::vector<std::size_t>> named(const std::string& name) const;
    /// "K[2]" of a variable's vector; nothing but the path where there is one element.
    std::string name(const Adjustable& number, std::size_t element) const;
    /// ": did you mean ...?" among them all, or names of their fields.
    std::string nearest(const std::string& name) const;
    /// What `run.follow` says, with all its refusals as RunError.
    std::vector<ParameterValue> follow(const std::vector<ParameterValue>& asked) const;

  private:
    const Simulation& run_;
    std::vector<Adjustable> all_;
};

} // namespace bf::analysis

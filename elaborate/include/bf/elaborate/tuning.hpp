// Variables of a model that a run may change, and what follows from them.
#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/matlab/workspace.hpp"

#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace bf {

/// A change that cannot be made in a run; the text names what and why.
struct TuningError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Per definition why it is fixed from elaboration on; empty: a run may change it. Fixed are variables that
/// decide what blocks are made with, sizes or rates, and those that are neither double nor boolean. `reasons`
/// may begin with more.
std::vector<std::string> fixed_definitions(const Diagram& diagram, std::vector<std::string> reasons = {});

/// The variables that an expression names, with these values of all definitions.
matlab::Workspace variables_of(const Definition& definition, const std::vector<matlab::Value>& values);

/// New values by name, each column by column.
using NamedValues = std::vector<std::pair<std::string, std::vector<double>>>;

/// Follows what parameters become when variables change, as an elaboration with these overrides would give
/// it: expressions are evaluated again, except where a value was given by name.
class Tuning {
  public:
    explicit Tuning(const Diagram& diagram); ///< which must outlive it

    struct Variable {
        std::string path;
        std::string fixed; ///< why it cannot be changed; empty: it can
        std::vector<double> values;
        int rows, cols;
        bool is_logical;
        Limits limits;
        std::string unit, about;
    };
    std::vector<Variable> variables() const; ///< of numbers, with their present values

    /// The parameters that these variables and parameters lead to, each once. Throws TuningError for a
    /// variable that is fixed, a wrong number of elements, NaN, a value outside of its limits, or a result
    /// that has another size.
    NamedValues follow(const NamedValues& changes) const;
    /// From now on these hold: to be said when they were applied.
    void accept(const NamedValues& changes);

    /// What was accepted, for a Tuning of a diagram that has the same definitions.
    std::vector<double> save() const;
    /// Goes on there. Throws TuningError, also where the definitions are others.
    void restore(std::span<const double> saved);

  private:
    struct State {
        std::vector<matlab::Value> values; ///< of all definitions
        std::vector<char> is_given;
    };
    int number_of(const std::string& name) const;
    void check_limits(std::size_t definition, const std::vector<double>& values) const;
    NamedValues change(State& state, const NamedValues& changes) const;

    const Diagram& diagram_;
    std::vector<std::string> fixed_;
    State state_;
};

} // namespace bf

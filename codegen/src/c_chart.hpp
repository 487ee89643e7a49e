// State charts in plain C.
#pragma once

#include "c_rule.hpp"

#include "bf/kernels/chart.hpp"

#include <vector>

namespace bf::codegen {

/// The charts of one model: the texts of kernels/chart_*.h, which C++ compiles, too, and beside them what is
/// each chart's own, its table and its formulas as equations.
class CCharts {
  public:
    /// As `c_rule`, of the kernels of charts; nothing for others. Small charts without hierarchy are
    /// equations.
    std::optional<CRule> rule(std::string_view kernel, const std::vector<Argument>& arguments, int list_from,
                              int list_size, const std::string& prefix);
    /// What these rules need, to stand before them; empty: nothing.
    std::string definitions(const std::string& prefix) const;

  private:
    struct Chart {
        std::vector<double> table;
        std::string text; ///< its table and formulas
        std::set<CFunction> functions;
        std::string name;
    };

    std::optional<CRule> active_states(const std::vector<Argument>& arguments) const;
    /// Null: one of the formulas is more than arithmetic.
    const Chart* chart(const Argument& table, const Argument& time, int inputs, const std::string& prefix);

    std::vector<Chart> charts_;
    Type real_ = Type::float64;
    bool shows_ = false, keeps_ = false; ///< are there rules of outputs, and of states?
};

} // namespace bf::codegen

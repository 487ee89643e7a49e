#pragma once

#include "bf/model/chart.hpp"

#include <array>
#include <string_view>

namespace bf::model {

/// What becomes of the rows of a matrix, or the items of a list.
struct RowChange {
    std::optional<std::size_t> removed = {};
    bool is_added = false; ///< one more at the end
};

/// Edits the settings of a state machine; what else they say stays as it is written. Each edit keeps the
/// chart right: no state is named twice, and rows lead from states to states.
class ChartEditor {
  public:
    ChartEditor(Block& block, Chart chart) : block_(block), chart_(std::move(chart)) {}

    const Chart& chart() const { return chart_; }
    /// Where the document has the states, or the transitions, or else the block.
    Location where_states() const;
    Location where_transitions() const;
    std::optional<std::size_t> find_state(std::string_view name) const;
    std::optional<std::size_t> find_transition(std::string_view name) const;

    void add_state(const std::string& name);
    void rename_state(std::size_t state, const std::string& name);
    void remove_state(std::size_t state); ///< with the transitions from and to it
    void set_initial(std::size_t state);
    void add_transition(std::size_t from, std::size_t to);
    void remove_transition(std::size_t transition);
    void set_entry(std::size_t transition, std::size_t column, const std::string& text);

  private:
    void write(const char* setting, std::string text, RowChange change = {});

    Block& block_;
    Chart chart_;
};

} // namespace bf::model

#pragma once

#include "bf/model/chart.hpp"

#include <array>
#include <string_view>

namespace bf::model {

/// Edits the settings of a state machine; what else they say stays as it is written. Each edit keeps the
/// chart right: no state is named twice, and rows lead from states to states.
class ChartEditor {
  public:
    /// False where the settings have to be evaluated before they can be edited.
    static bool may_edit(const Block& block) { return chart_of(block).has_value(); }
    explicit ChartEditor(Block& block);

    const Chart& chart() const { return chart_; }
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
    void write_states(const std::vector<std::string>& states);
    void write_transitions(std::string text);

    Block& block_;
    Chart chart_;
};

} // namespace bf::model

// The chart of a state machine: what its block's settings say, as states and transitions.
#pragma once

#include "bf/model/model.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bf::model {

/// A row [from to condition minimum_time] of `transitions`. Of the rows that leave a state the first one that
/// may be taken is.
struct Transition {
    std::size_t from = 0, to = 0; ///< places in the list of states
    std::string condition;        ///< number of the input's element, from 1; 0: none
    std::string minimum_time;     ///< expression, s
};

struct Chart {
    std::vector<std::string> states;
    std::vector<Transition> transitions;
    std::size_t initial = 0; ///< place of the first state

    /// "shift.1": the state that it leads to and the number of its row, from 1.
    std::string name_of(std::size_t transition) const;
};

/// The setting that holds a chart with states in states; the block then has no `states` and `transitions`.
inline constexpr const char* chart_setting = "chart";

/// Whether the block is a `StateMachine`.
bool has_chart(const Block& block);

/// None where a setting is an expression that has to be evaluated first, or is wrong: `defect` then says
/// which, where and why, without the block's path.
std::optional<Chart> chart_of(const Block& block, Diagnostic* defect = nullptr);

/// The state machine that a path leads into, and the name in it: "controller.machine.lift" is "lift" of the
/// block "controller.machine". An empty path of the block: none.
std::pair<std::string, std::string> split_chart(const Model& model, const std::string& path);

} // namespace bf::model

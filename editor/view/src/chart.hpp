// The chart of a state machine on its way to a drawing: what stands at its states and transitions.
#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/model/chart.hpp"
#include "bf/view/drawing.hpp"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace bf::editor {

/// The node of a block of the system that the state machine stands in; null where nothing is known of it.
using FindNode = std::function<const DiagramNode*(const std::string& block)>;

/// Of the block's settings, or of their values where these are expressions; empty where neither is known.
model::Chart chart_of(const model::Block& block, const DiagramNode* node);

/// What a state is, as its drawing shows it.
enum class StateKind { plain, with_states, with_regions, final, shallow_history, deep_history, junction };

/// One level of a chart with states in states: the states within one of them, and what leads from one to
/// another, from or to their insides, too.
struct Level {
    model::Chart chart; ///< the conditions of its transitions are their labels
    std::vector<StateKind> kinds;
    std::vector<std::optional<int>> numbers; ///< of the states in the whole chart; none: it is never active
    /// Of the transitions, "up.1" for the first one that leaves the state `up`; further goals of it have a
    /// second number.
    std::vector<std::string> names;
};
/// `inside` is the path of the state, empty for the chart itself. None where the block has no such chart, or
/// a wrong one.
std::optional<Level> level_of(const model::Block& block, const std::string& folder,
                              const std::string& inside);

/// What drives each element of the input `conditions`, as far as a Mux gathers them: "is_touching", "u(2)".
std::vector<std::string> condition_names(const model::Block& block, const model::System& system,
                                         const Diagram& diagram, const FindNode& find_node);

/// "[is_touching] after 0.1 s": the condition by its name, or else by its number; empty where the transition
/// is always taken.
std::string label_of(const model::Transition& transition, const std::vector<std::string>& conditions);

/// A line with an arrow head at its end.
std::vector<Shape> arrow_along(const std::vector<Point>& points);

} // namespace bf::editor

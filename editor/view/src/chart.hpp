// The chart of a state machine on its way to a drawing: what stands at its states and transitions.
#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/model/chart.hpp"

#include <functional>
#include <string>

namespace bf::editor {

/// The node of a block of the system that the state machine stands in; null where nothing is known of it.
using FindNode = std::function<const DiagramNode*(const std::string& block)>;

/// Of the block's settings, or of their values where these are expressions; empty where neither is known.
model::Chart chart_of(const model::Block& block, const DiagramNode* node);

/// "[is_touching] after 0.1 s": the condition is called as what drives the element of the input that it
/// reads, as far as a Mux gathers it, or else by its number; empty where the transition is always taken.
std::string label_of(const model::Transition& transition, const model::Block& block,
                     const model::System& system, const Diagram& diagram, const FindNode& find_node);

} // namespace bf::editor

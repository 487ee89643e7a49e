// A block or an own port of a subsystem on its way to an element: what it looks like and where its ports are.
#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/view/place.hpp"
#include "chart.hpp"

#include <string>
#include <vector>

namespace bf::editor {

inline constexpr double letter = 11, small_letter = 9;

/// Shapes and ports are from the upper left corner.
struct Item {
    Element element;
    Box box;
    Point at;
    bool is_placed = false, shows_name = true, is_circle = false, names_ports = false;
};

struct PortNames {
    std::vector<std::string> inputs, outputs, controls;
};

// `drawn` is what the document says of its size and the sides of its ports; else it is as large as what it
// shows needs.

/// `node` is null where elaboration knows nothing of it.
Item block_item(const model::Block& block, const DiagramNode* node, const PortNames& ports,
                const model::Placement& drawn);
/// A state of a chart with pins for the transitions to it and from it, in their order, and ports by which new
/// ones are named: they begin and end anywhere at it.
Item state_item(const std::string& name, StateKind kind, bool is_initial, std::size_t inputs,
                std::size_t outputs, const model::Placement& drawn);
Item port_item(const model::Port& port, bool is_output, const model::Placement& drawn);

/// The element at the item's place, with its name.
Element finished(const Item& item);
Element noted(const model::Note& note, const Point& at);

/// "pd" of "controller.pd".
std::string last_name(const std::string& path);

} // namespace bf::editor

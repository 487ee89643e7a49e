// The drawing of a subsystem, from the document and all that elaboration knows of it.
#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/model/compare.hpp"
#include "bf/model/operation.hpp"
#include "bf/view/drawing.hpp"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace bf::editor {

struct DrawOptions {
    bool sizes = false, types = false, rates = false, units = false; ///< beside wires
    /// Blocks, ports and wires of the subsystem that are drawn elsewhere than the document says, by path, and
    /// notes by name.
    struct Place {
        Point at;
        std::optional<Point> size = {};
    };
    std::map<std::string, Place> moved = {};
    std::map<std::string, std::vector<Point>> bent = {};
    std::map<std::string, Point> moved_notes = {};
    bool marks_open = true; ///< are ports marked as mistakes where all that is wrong is that a wire lacks?
    std::filesystem::path folder =
        {}; ///< in which images of notes and icons may lie; empty: that of the model
};

/// Draws one subsystem, or the chart of a state machine; `system` is its path, empty for the model itself.
/// Where the document has no positions, blocks are arranged. `diagram` and `diagnostics` are those of this
/// model, as far as known (see bf::examine); the diagram may be one of an earlier state, of which blocks of
/// the same path and type tell their ports. Throws model::Errors when there is no such subsystem.
Drawing draw(const model::Model& model, const std::string& system, const Diagram& diagram,
             const std::vector<model::Diagnostic>& diagnostics, const DrawOptions& options = {});

/// Whether there is a subsystem or a state machine of that path, or the model itself.
bool may_draw(const model::Model& model, const std::string& system);

/// What drives each element of the input `conditions` of a state machine, as charts call it: "is_touching",
/// "u(2)"; empty where nothing does, or as far as nobody knows. Throws as `draw`.
std::vector<std::string> conditions_of(const model::Model& model, const std::string& machine,
                                       const Diagram& diagram);

/// Draws a line around a block, port or note, or along a wire.
void outline(Element& element, Style style);

/// Both models' subsystem, the earlier one at the left, with what one says of the other (model::compare)
/// outlined: blocks, ports and wires, and subsystems in which something differs.
Drawing beside(Drawing before, Drawing after, const std::vector<model::Distinction>& distinctions,
               const std::string& before_title, const std::string& after_title);

/// What a picture of the drawing shows: its bounds, and a margin around them.
Rectangle sheet_of(const Drawing& drawing);

/// As a document of its own with all its images, readable on white and on black where `is_dark`.
std::string to_svg(const Drawing& drawing, bool is_dark = false);

/// Gives each block and port of the subsystem, or state of the chart, a place, whatever the document says;
/// wires find their way, as corners by hand are of where things stood.
model::operations::Batch arranged(const model::Model& model, const std::string& system,
                                  const Diagram& diagram);

/// Where `draw` puts those that have no place in the document.
std::vector<std::pair<std::string, Point>> unplaced(const model::Model& model, const std::string& system,
                                                    const Diagram& diagram);

} // namespace bf::editor

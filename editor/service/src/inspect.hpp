#pragma once

#include "bf/core/registry.hpp"
#include "bf/elaborate/diagram.hpp"
#include "bf/service/protocol.hpp"

namespace bf::service {

/// Of values that have many elements the text is long; a page shows its beginning.
std::string shortened(std::string text);

/// What a block declares and the document gives it, or the properties of a subsystem, port or model, with the
/// values that they have in the diagram. Throws model::Errors where nothing stands at `path`.
Inspection inspected(Registry& registry, const model::Model& model, const Diagram& diagram,
                     const std::string& path);

/// Of each block those that may change in a run, and of each subsystem its variables; nothing of what has
/// none.
Parameters parameters_of(Registry& registry, const model::Model& model, const Diagram& diagram);

/// The variables that the system at `path` declares, with what the diagnostics say of them.
Variables variables_of(const model::System& system, const std::string& path, const Diagram& diagram,
                       const std::vector<model::Diagnostic>& diagnostics = {});
/// The variables that expressions of the subsystem see, its own first. Throws std::runtime_error where there
/// is none of that path.
Variables variables_seen_in(const std::string& path, const model::Model& model, const Diagram& diagram,
                            const std::vector<model::Diagnostic>& diagnostics);

} // namespace bf::service

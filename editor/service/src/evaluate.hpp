#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/service/protocol.hpp"

namespace bf::service {

/// What an expression comes to where the blocks of `system` stand, or why it does not; with the values that
/// variables have in the diagram.
Evaluated evaluated(const model::Model& model, const Diagram& diagram, const std::string& system,
                    const std::string& text);

} // namespace bf::service

#pragma once

#include "bf/model/operation.hpp"
#include "bf/service/protocol.hpp"
#include "bf/view/draw.hpp"

#include <set>
#include <string>

namespace bf::service {

/// The subsystems and state machines in which an operation gives something a place, or would make what has
/// none stand elsewhere while a person works on it.
std::set<std::string> systems_placed_in(const model::Model& model, const model::Operation& operation);

/// Throws model::Errors where an operation places a port that a block is drawn without: which ports blocks of
/// a library have, their declarations tell.
void require_ports(const model::Model& model, const Diagram& diagram, const model::Operation& operation);

/// How a page wants a subsystem to be drawn. Throws model::Errors for places where nothing can be drawn.
editor::DrawOptions options_of(const Draw& asked);

} // namespace bf::service

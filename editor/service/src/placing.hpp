#pragma once

#include "bf/model/operation.hpp"

#include <set>
#include <string>

namespace bf::service {

/// The subsystems and state machines in which an operation gives something a place.
std::set<std::string> systems_placed_in(const model::Model& model, const model::Operation& operation);

} // namespace bf::service

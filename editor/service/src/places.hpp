#pragma once

#include "bf/service/protocol.hpp"

#include <string>
#include <vector>

namespace bf::service {

/// Where blocks, own ports and wires stand in the text that `model` was read from. `system` is the path of
/// the block that stands for the model in another one; of the opened model it is empty.
std::vector<TextPlace> places_in(const model::Model& model, const std::string& system);

} // namespace bf::service

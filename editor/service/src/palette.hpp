#pragma once

#include "bf/service/protocol.hpp"

#include <vector>

namespace bf::service {

/// The blocks of all plugins that are found, with their ports as far as these need no arguments.
std::vector<LibraryBlock> palette();

} // namespace bf::service

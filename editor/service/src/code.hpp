#pragma once

#include "bf/library/load.hpp"
#include "bf/service/protocol.hpp"

namespace bf::service {

/// Throws std::runtime_error where no code can be generated, with the generator's reasons, or where it is
/// more than a page shows.
GeneratedCode generated(const LoadedModel& model, Language language);

} // namespace bf::service

#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// Streams of vectors between programs, and what keeps a run in step with a clock or a simulator.
void add_streams(Library& library);

} // namespace bf::toolbox

// A diagram whose devices are replaced by what was recorded of them.
#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/recording/reader.hpp"

#include <vector>

namespace bf {

/// Makes a diagram reproducible: blocks that are or use a device (Context::devices) do not run, and Replay
/// writes their recorded outputs instead. Returns them. Throws RunError naming an output that another block
/// reads and that was not recorded.
std::vector<int> play_back_devices(Diagram& diagram, const recording::Recording& recording);

} // namespace bf

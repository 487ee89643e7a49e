// A Simulink library of masked blocks.
#pragma once

#include "bf/library/declared.hpp"

#include <string>
#include <vector>

namespace bf::tools {

/// A text model file (.mdl) with one subsystem per group and in it one masked block of the S-function
/// `BlockFactory` per class: prompts, defaults and docs are those of the declarations, ports carry their
/// names.
std::string simulink_library(const std::string& name, const std::vector<const BlockClass*>& classes);

} // namespace bf::tools

// Models that are right: every wire joins sizes, types and units that the blocks accept.
#pragma once

#include "chance.hpp"

#include <string>

namespace bf::fuzz {

/// A model of standard blocks as YAML: subsystems of all kinds, several rates, loops through delays. Blocks
/// are asked, as elaboration asks them, what they make of the signals wired to them.
std::string right_model(Chance& chance, const std::string& name = "chance", bool has_fixed_steps = false);

} // namespace bf::fuzz

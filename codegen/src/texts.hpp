// The sources that generated projects carry along, and what the generator must know of them.
#pragma once

#include "bf/codegen/generate.hpp"

#include <set>
#include <string_view>

namespace bf::codegen {

/// The kernel behind the name that a rule prints: which header defines it, and whether it can fail.
struct Kernel {
    std::string header;
    bool can_fail = false;
};

/// Looks up "bf::kernels::Gain{}" in the kernels' sources; null when it is not among them.
const Kernel* find_kernel(std::string_view printed_name);

/// Adds a header and all that it includes, as "include/bf/...".
void add_header(const std::string& header, Files& files);

} // namespace bf::codegen

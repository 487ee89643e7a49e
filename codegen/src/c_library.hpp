// Kernels that are more than arithmetic, in C.
#pragma once

#include "c_rule.hpp"

namespace bf::codegen {

/// Conversions, bits, random numbers and tables: calls of functions that `c_definition` writes, which do what
/// the kernel does. Nothing for other kernels, and for operands of types that these functions do not take.
std::optional<CRule> library_rule(std::string_view kernel, const std::vector<Argument>& arguments,
                                  int list_size, const std::string& prefix);

} // namespace bf::codegen

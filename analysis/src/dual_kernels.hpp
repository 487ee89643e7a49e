// Kernels on numbers with a derivative: one source file sees them, which takes a minute to compile.
#pragma once

#include "dual.hpp"

#include <string_view>

namespace bf::analysis {

/// The kernel that prints so; null: no exact derivative of it is known.
const NamedKernel<Dual>* dual_kernel(std::string_view name);

} // namespace bf::analysis

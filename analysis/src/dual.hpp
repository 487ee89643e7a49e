// Kernels on numbers with derivatives.
#pragma once

#include "bf/core/dual_kernels.hpp"
#include "bf/core/named_kernels.hpp"

namespace bf::analysis {

/// Four directions at once: as many as registers hold beside what a kernel itself needs.
using Dual = bf::Dual<4>;

} // namespace bf::analysis

// Kernels on numbers with a derivative: one source file sees them, which takes a minute to compile.
#pragma once

#include "dual.hpp"

#include <cstdint>
#include <string_view>

namespace bf::analysis {

/// Which results of a kernel depend on which elements of its operands.
enum class Structure : std::uint8_t {
    any,
    move,       ///< each result is an element of an operand, or constant
    elementwise ///< each result depends on the elements beside it, and on operands of one element
};

struct DualKernel {
    const NamedKernel<Dual>* kernel = nullptr; ///< none: no exact derivative of it is known
    Structure structure = Structure::any;
};

/// The kernel that prints so.
DualKernel dual_kernel(std::string_view name);

} // namespace bf::analysis

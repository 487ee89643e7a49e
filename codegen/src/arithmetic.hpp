// The arithmetic of a kernel as text. A kernel is run on symbols instead of numbers, once for each way that
// its conditions can turn out; what it leaves in its outputs then is the equation that a person reads. It is
// written once, in the kernel, and its operations keep their order, so that the text computes the same bits.
#pragma once

#include "bf/core/declaration.hpp"

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace bf::codegen {

/// An operand of a rule, and how its elements are written.
struct Argument {
    Type type = Type::float64;
    Size size = {};
    std::string text = {};           ///< of a scalar, or of the array that [i] is written behind
    bool is_array = false;           ///< is [i] written behind it?
    bool is_written = false;         ///< by the kernel
    std::vector<double> values = {}; ///< of a constant
};

struct Equations {
    std::vector<std::string> lines;  ///< a statement each
    std::set<std::string> functions; ///< of bf::generated::math that they call
};

/// Nothing for a kernel that is more than arithmetic on such operands.
/// `list_from` and `list_size` tell which arguments are a list, as in bf::Call.
std::optional<Equations> arithmetic(std::string_view kernel, const std::vector<Argument>& arguments,
                                    int list_from, int list_size);

} // namespace bf::codegen

// Kernels that run on symbols, and what comes of it.
#pragma once

#include "arithmetic.hpp"
#include "symbol.hpp"

#include <optional>
#include <string_view>
#include <vector>

namespace bf::codegen {

/// What a kernel does.
struct Traced {
    /// By argument and element; those that the kernel did not write stand for themselves.
    std::vector<std::vector<TermPtr>> terms;
    TermPtr fails; ///< true where the kernel refuses its operands; a number where that is known
};

/// Runs the kernel once for each way that its conditions can turn out. Nothing when it is more than
/// arithmetic on such operands, or more than `most_terms` in one text.
std::optional<Traced> trace(std::string_view kernel, const std::vector<Argument>& arguments, int list_from,
                            int list_size, std::size_t most_terms);

/// Does a kernel do the same to element i of all its operands?
enum class Elements {
    differ,
    of_all,
    of_all_but_constants ///< which are the same for every element
};
Elements elements_of(std::string_view kernel);
/// What a kernel says of operands that it refuses.
std::string_view failure_of(std::string_view kernel);

} // namespace bf::codegen

// A rule in plain C.
#pragma once

#include "arithmetic.hpp"
#include "c_language.hpp"

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace bf::codegen {

struct CRule {
    std::vector<std::string> lines;
    std::set<CFunction> functions; ///< that they call
    std::string_view failure = {}; ///< what the kernel says of operands that it refuses
};

/// Stands in a line where the step fails because the kernel refuses its operands.
inline constexpr std::string_view c_fail = "@fail@";

/// As `arithmetic`, of any length: what stands in several places is computed once, and what is done to each
/// element alike is a loop. `prefix` is that of functions of ours.
std::optional<CRule> c_rule(std::string_view kernel, const std::vector<Argument>& arguments, int list_from,
                            int list_size, const std::string& prefix);

} // namespace bf::codegen

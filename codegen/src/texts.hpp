// The sources that generated projects carry along, and what the generator must know of them.
#pragma once

#include "bf/codegen/generate.hpp"

#include <set>
#include <string_view>

namespace bf::codegen {

/// The header that defines the kernel "bf::kernels::Gain{}"; null when it is not among the kernels' sources.
const std::string* header_of_kernel(std::string_view printed_name);

/// What a header says; empty: there is none of that name.
std::string_view text_of_header(std::string_view header);

/// Adds a header and all that it includes, as "include/bf/...".
void add_header(const std::string& header, Files& files);
/// Those that a text includes.
void add_headers_of(std::string_view text, Files& files);

} // namespace bf::codegen

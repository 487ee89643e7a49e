#pragma once

#include "bf/library/declared.hpp"

#include <string>
#include <vector>

namespace bf::tools {

/// A page of all blocks of a library, in Markdown.
std::string reference_page(const std::string& library, const std::vector<Declared>& blocks);

} // namespace bf::tools

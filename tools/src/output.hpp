// How verbs write numbers and JSON, and files that they write.
#pragma once

#include "bf/base/files.hpp"

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace bf::tools {

/// Indented, with a line break at the end; bytes that are no UTF-8 are replaced.
std::string to_text(const nlohmann::ordered_json& json);

/// 0.0123, 1234.5: six significant digits.
std::string number(double x);

} // namespace bf::tools

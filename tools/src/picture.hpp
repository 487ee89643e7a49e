// Pictures as files.
#pragma once

#include <string>

namespace bf::tools {

/// Writes SVG to the file, as PDF or PNG (by librsvg) where its name ends so, and prints the name. Throws
/// CommandError.
void write_picture(const std::string& svg, const std::string& file);

} // namespace bf::tools

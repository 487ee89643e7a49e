// Pictures as files.
#pragma once

#include "bf/view/drawing.hpp"

#include <string>

namespace bf::tools {

/// Writes the drawing to the file as SVG, PDF or PNG (by librsvg), as its name ends, and prints the name.
/// Throws CommandError.
void write_picture(const editor::Drawing& drawing, bool is_dark, const std::string& file);
/// The same without a word.
void save_picture(const editor::Drawing& drawing, bool is_dark, const std::string& file);

} // namespace bf::tools

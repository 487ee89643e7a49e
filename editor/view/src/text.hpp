#pragma once

#include <string>
#include <string_view>

namespace bf::editor {

/// Of a sans-serif text in pixels, by the widths of Helvetica (Adobe, Core 14 font metrics), which Arial and
/// Liberation Sans share; other characters count as wide as an n.
double text_width(std::string_view text, double size);

/// The text, or its beginning and "…" where it is wider than `most` pixels.
std::string fitted(const std::string& text, double size, double most);

/// "10 ms" of "every 10 ms".
std::string without_every(const std::string& rate);

} // namespace bf::editor

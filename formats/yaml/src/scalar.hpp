#pragma once

#include <string>
#include <string_view>

/// How texts are written in YAML.
namespace bf::formats {

/// Whether `text` may stand without quotes; within brackets (`flow`) less may.
bool is_plain(std::string_view text, bool flow);

/// Whether `text` may stand as the lines after `|` or `|-`.
bool is_literal(std::string_view text);

std::string double_quoted(std::string_view text);
std::string single_quoted(std::string_view text);

/// A key or a name: plain if that is possible everywhere, else in double quotes.
std::string key_text(std::string_view text);

/// Columns that UTF-8 text takes.
std::size_t width(std::string_view text);

} // namespace bf::formats

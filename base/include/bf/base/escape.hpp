// Text of people - names, titles, units - inside text that a program reads: one function per language.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace bf::escape {

/// A string literal of C and C++ with its quotes. No trigraph, line break or directional character enters
/// the source, and bytes that are no UTF-8 are escaped.
std::string cpp(std::string_view text);

/// Text or a quoted attribute of XML, HTML and SVG: no mark-up, control character or byte that is no UTF-8
/// enters it.
std::string xml(std::string_view text);

/// One line for a comment of C, C++, Python, CMake or a shell: neither ends it, nor joins it with the next
/// line, nor begins another, and shows what it says (directional characters are left out).
std::string comment(std::string_view text);

/// A string literal of Python, which is one of JSON too, with its quotes.
std::string python(std::string_view text);

/// A word of a POSIX shell.
std::string shell(std::string_view text);

/// A quoted argument of CMake.
std::string cmake(std::string_view text);

/// The path of a URI (RFC 3986): slashes stay, all but unreserved characters become codes of their bytes.
std::string uri(std::string_view path);

/// A string of gnuplot: between single quotes nothing is substituted.
std::string gnuplot(std::string_view text);

/// A field of CSV (RFC 4180): in quotes where it holds a separator, a quote or a line break.
std::string csv(std::string_view text);

/// A string literal of MATLAB, on one line.
std::string matlab(std::string_view text);

/// Text that Markdown shows as it is, on one line, also inside a table. Backticks stay: docs use them.
std::string markdown(std::string_view text);

/// Code in Markdown, also inside a table; empty for an empty text.
std::string markdown_code(std::string_view text);

/// A part of the name of a file: without slashes and control characters, of at most
/// 120 bytes.
std::string file_name(std::string_view text);

/// For a terminal: control characters other than line breaks and tabs, with which text could write over
/// other text, are shown as <1b>.
std::string terminal(std::string_view text);

/// For a message: a text of more than `most` bytes without its middle, with the length that it has.
std::string shortened(std::string_view text, std::size_t most = 4000);

} // namespace bf::escape

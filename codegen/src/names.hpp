// C++ spellings of names, texts and numbers.
#pragma once

#include "bf/core/declaration.hpp"

#include <set>
#include <string>
#include <string_view>

namespace bf::codegen {

/// Letters, digits and single underscores; no keyword, no reserved name, no common macro.
std::string identifier(std::string_view name);
/// identifier(name), or identifier_2, ... when that is taken; takes it.
std::string unique_identifier(std::string_view name, std::set<std::string>& taken);
/// "icub_balancing" -> "IcubBalancing"
std::string upper_camel(std::string_view name);

std::string number(int i);
/// Every line of a text behind so many spaces.
std::string indented(const std::string& text, int spaces);
/// One line of text for a comment.
std::string comment(std::string_view text);
/// A string literal with quotes.
std::string literal(std::string_view text);
/// The shortest literal of `type` that reads back as the value which bf::write_values stores.
std::string literal(double value, Type type);
/// double, float, std::int8_t, ...
const char* cpp_name(Type type);
/// float64, float32, int8, ...: the enumerators of bf::Type and bf::generated::Type.
const char* enumerator(Type type);

} // namespace bf::codegen

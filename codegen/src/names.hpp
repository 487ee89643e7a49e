// C++ spellings of names, texts and numbers.
#pragma once

#include "bf/base/escape.hpp"
#include "bf/core/declaration.hpp"

#include <map>
#include <set>
#include <string>
#include <string_view>

namespace bf::codegen {

/// Letters, digits and single underscores; no keyword, no macro, no structure of the generated class.
std::string identifier(std::string_view name);
/// identifier(name), or identifier_2, ... when that is taken; takes it.
std::string unique_identifier(std::string_view name, std::set<std::string>& taken);
/// "Balancing iCub" -> "balancing_icub": a name of files, C functions and a Python module.
std::string file_identifier(std::string_view name);
/// "icub_balancing" -> "IcubBalancing"
std::string upper_camel(std::string_view name);

std::string number(int i);
/// Replaces marks, e.g. "@name@", by their values, which may hold marks that mean nothing.
using Marks = std::map<std::string, std::string>;
std::string filled(const std::string& text, const Marks& marks);
/// Every line of a text behind so many spaces.
std::string indented(const std::string& text, int spaces);
using escape::comment;
/// A string literal with quotes.
inline std::string literal(std::string_view text) { return escape::cpp(text); }
/// The shortest literal of `type` that reads back as the value which bf::write_values stores.
std::string literal(double value, Type type);
/// double, float, std::int8_t, ...
const char* cpp_name(Type type);
/// float64, float32, int8, ...: the enumerators of bf::Type and bf::generated::Type.
const char* enumerator(Type type);

} // namespace bf::codegen

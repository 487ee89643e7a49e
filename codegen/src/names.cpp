#include "names.hpp"

#include "bf/core/context.hpp"

#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <type_traits>

namespace bf::codegen {

namespace {

/// Keywords and alternative tokens of C++17 to C++26, and macros of the headers that generated code includes.
const std::set<std::string, std::less<>>& reserved() {
    static const std::set<std::string, std::less<>> words{"alignas",      "alignof",
                                                          "and",          "and_eq",
                                                          "asm",          "auto",
                                                          "bitand",       "bitor",
                                                          "bool",         "break",
                                                          "case",         "catch",
                                                          "char",         "char8_t",
                                                          "char16_t",     "char32_t",
                                                          "class",        "compl",
                                                          "concept",      "const",
                                                          "consteval",    "constexpr",
                                                          "constinit",    "const_cast",
                                                          "continue",     "contract_assert",
                                                          "co_await",     "co_return",
                                                          "co_yield",     "decltype",
                                                          "default",      "delete",
                                                          "do",           "double",
                                                          "dynamic_cast", "else",
                                                          "enum",         "explicit",
                                                          "export",       "extern",
                                                          "false",        "float",
                                                          "for",          "friend",
                                                          "goto",         "if",
                                                          "inline",       "int",
                                                          "long",         "mutable",
                                                          "namespace",    "new",
                                                          "noexcept",     "not",
                                                          "not_eq",       "nullptr",
                                                          "operator",     "or",
                                                          "or_eq",        "private",
                                                          "protected",    "public",
                                                          "register",     "reinterpret_cast",
                                                          "requires",     "restrict",
                                                          "return",       "short",
                                                          "signed",       "sizeof",
                                                          "static",       "static_assert",
                                                          "static_cast",  "struct",
                                                          "switch",       "template",
                                                          "this",         "thread_local",
                                                          "throw",        "true",
                                                          "try",          "typedef",
                                                          "typeid",       "typename",
                                                          "union",        "unsigned",
                                                          "using",        "virtual",
                                                          "void",         "volatile",
                                                          "wchar_t",      "while",
                                                          "xor",          "xor_eq",
                                                          "assert",       "bf",
                                                          "errno",        "linux",
                                                          "main",         "offsetof",
                                                          "stderr",       "stdin",
                                                          "stdout",       "std",
                                                          "unix",         "EOF",
                                                          "INFINITY",     "NAN",
                                                          "NULL",         "BUFSIZ",
                                                          "HUGE_VAL",     "HUGE_VALF"};
    return words;
}

bool is_plain(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 && static_cast<unsigned char>(c) < 128;
}

} // namespace

std::string identifier(std::string_view name) {
    std::string result;
    for (const char c : name)
        if (is_plain(c))
            result += c;
        else if (!result.empty() && result.back() != '_')
            result += '_';
    while (!result.empty() && result.back() == '_') result.pop_back();
    if (result.empty() || std::isdigit(static_cast<unsigned char>(result[0]))) result = "n" + result;
    const bool is_macro_like = result.size() > 2 && result[1] == '_' && result[0] == 'M'; // M_PI
    if (reserved().contains(result) || is_macro_like) result += '_';
    return result;
}

std::string unique_identifier(std::string_view name, std::set<std::string>& taken) {
    const std::string plain = identifier(name);
    std::string result = plain;
    for (int i = 2; !taken.insert(result).second; ++i)
        result = plain + (plain.back() == '_' ? "" : "_") + std::to_string(i);
    return result;
}

std::string upper_camel(std::string_view name) {
    std::string result;
    bool starts_word = true;
    for (const char c : name) {
        if (is_plain(c))
            result += starts_word ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
        starts_word = !is_plain(c);
    }
    static const std::set<std::string, std::less<>> own{"Inputs", "Outputs",          "Parameters", "Signals",
                                                        "States", "ContinuousStates", "Workspace"};
    if (result.empty() || std::isdigit(static_cast<unsigned char>(result[0]))) result = "Model" + result;
    if (own.contains(result) || reserved().contains(result)) result += "Model";
    return result;
}

std::string number(int i) { return std::to_string(i); }

std::string indented(const std::string& text, int spaces) {
    std::string result;
    for (std::size_t at = 0; at < text.size();) {
        const auto end = std::min(text.find('\n', at), text.size() - 1);
        result += std::string(static_cast<std::size_t>(spaces), ' ') + text.substr(at, end - at + 1);
        at = end + 1;
    }
    return result;
}

std::string comment(std::string_view text) {
    std::string line;
    for (const char c : text) { // a backslash would join lines, and two question marks begin a trigraph
        if (c == '?' && line.ends_with('?')) line += ' ';
        line += static_cast<unsigned char>(c) < 32 || c == 127 ? ' ' : c == '\\' ? '/' : c;
    }
    return line;
}

std::string literal(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        const auto code = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\' || (c == '?' && result.ends_with('?'))) {
            result += '\\';
            result += c;
        } else if (code < 32 || code == 127) {
            char octal[8];
            std::snprintf(octal, sizeof octal, "\\%03o", code);
            result += octal;
        } else {
            result += c;
        }
    }
    return result + "\"";
}

std::string literal(double value, Type type) {
    return with_type(type, [&](auto t) -> std::string {
        using T = typename decltype(t)::type;
        T stored{};
        write_values(&stored, type, 1, {value});
        if constexpr (std::is_same_v<T, bool>) {
            return stored ? "true" : "false";
        } else if constexpr (std::is_integral_v<T>) {
            return std::to_string(stored) + (std::is_same_v<T, std::uint32_t> ? "u" : "");
        } else {
            const std::string limits = std::string("std::numeric_limits<") + cpp_name(type) + ">::";
            if (std::isnan(stored)) return limits + "quiet_NaN()";
            if (std::isinf(stored)) return (stored < 0 ? "-" : "") + limits + "infinity()";
            char text[48];
            const auto end = std::to_chars(text, text + sizeof text, stored).ptr;
            std::string result(text, end);
            if (result.find_first_of(".e") == std::string::npos) result += ".0";
            return result + (std::is_same_v<T, float> ? "f" : "");
        }
    });
}

const char* cpp_name(Type type) {
    constexpr const char* names[] = {"double",       "float",         "std::int8_t",
                                     "std::uint8_t", "std::int16_t",  "std::uint16_t",
                                     "std::int32_t", "std::uint32_t", "bool"};
    return names[static_cast<std::size_t>(type)];
}

const char* enumerator(Type type) {
    constexpr const char* names[] = {"float64", "float32", "int8",   "uint8",  "int16",
                                     "uint16",  "int32",   "uint32", "boolean"};
    return names[static_cast<std::size_t>(type)];
}

} // namespace bf::codegen

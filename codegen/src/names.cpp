#include "names.hpp"

#include "bf/base/numbers.hpp"
#include "bf/core/context.hpp"
#include "reserved.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <type_traits>

namespace bf::codegen {

namespace {

/// The structures of a generated class, which has no members of their names, and what its sources use beside
/// it.
bool is_own(std::string_view name) {
    static const std::set<std::string_view> own{
        "Inputs",    "Outputs",    "Parameters", "Variables",  "Signals",  "States",    "ContinuousStates",
        "Workspace", "Guards",     "Given",      "Control",    "Real",     "Type",      "Where",
        "Quantity",  "Quantities", "FixedName",  "FixedNames", "NewValue", "OnNumbers", "ElaboratedModel"};
    return own.contains(name);
}

/// What a class of the generated Python module would hide, and types of C's library.
bool is_class_elsewhere(std::string_view name) {
    static const std::set<std::string_view> known{
        "None", "True", "False", "RuntimeError", "ValueError", "KeyError", "MemoryError", "FILE", "DIR"};
    return known.contains(name);
}

/// Of classes and files: systems take names of 255 bytes.
constexpr std::size_t longest_name = 100;

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
    if (is_reserved(result) || is_own(result)) result += '_';
    return result;
}

std::string unique_identifier(std::string_view name, std::set<std::string>& taken) {
    const std::string plain = identifier(name);
    std::string result = plain;
    for (int i = 2; !taken.insert(result).second; ++i)
        result = plain + (plain.back() == '_' ? "" : "_") + std::to_string(i);
    return result;
}

std::string file_identifier(std::string_view name) {
    std::string result = identifier(name);
    for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    result.resize(std::min(result.size(), longest_name));
    while (result.ends_with('_')) result.pop_back();
    const bool is_taken = result == "main" || is_reserved(result) || is_reserved_for_files(result);
    return is_taken ? result + "_model" : result;
}

std::string upper_camel(std::string_view name) {
    std::string result;
    bool starts_word = true;
    for (const char c : name) {
        if (is_plain(c))
            result += starts_word ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
        starts_word = !is_plain(c);
    }
    if (result.empty() || std::isdigit(static_cast<unsigned char>(result[0]))) result = "Model" + result;
    result.resize(std::min(result.size(), longest_name));
    if (is_own(result) || is_class_elsewhere(result) || is_reserved(result)) result += "Model";
    return result;
}

std::string number(int i) { return std::to_string(i); }

std::string filled(const std::string& text, const Marks& marks) {
    std::string result;
    for (std::size_t at = 0; at < text.size();) {
        const auto end = text[at] == '@' ? text.find('@', at + 1) : std::string::npos;
        const auto mark = end == std::string::npos ? marks.end() : marks.find(text.substr(at, end + 1 - at));
        if (mark == marks.end()) {
            result += text[at++];
        } else {
            result += mark->second;
            at = end + 1;
        }
    }
    return result;
}

std::string indented(const std::string& text, int spaces) {
    std::string result;
    for (std::size_t at = 0; at < text.size();) {
        const auto end = std::min(text.find('\n', at), text.size() - 1);
        result += std::string(static_cast<std::size_t>(spaces), ' ') + text.substr(at, end - at + 1);
        at = end + 1;
    }
    return result;
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
            std::string result = number_text(stored);
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

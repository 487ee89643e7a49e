// What reads XML that anybody may have written: attributes, each wrong one a message with its line.
#pragma once

#include "bf/base/escape.hpp"
#include "bf/base/numbers.hpp"
#include "bf/fmi/description.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <tinyxml2.h>
#include <utility>
#include <vector>

namespace bf::fmi {

using XmlNode = tinyxml2::XMLElement;

/// The types of variables as FMI 3.0 and SSP 2.0 call them, in the order of Type.
inline constexpr const char* type_names[] = {"Float64", "Float32", "Int8",   "UInt8", "Int16",
                                             "UInt16",  "Int32",   "UInt32", "Int64", "UInt64",
                                             "Boolean", "String",  "Binary", "Clock", "Enumeration"};
/// The type of that name, also of FMI 2.0 and SSP 1.0; nothing for another one.
std::optional<Type> type_of_name(std::string_view name);

inline constexpr std::pair<const char*, Causality> causality_names[] = {
    {"parameter", Causality::parameter},
    {"calculatedParameter", Causality::calculated_parameter},
    {"structuralParameter", Causality::structural_parameter},
    {"input", Causality::input},
    {"output", Causality::output},
    {"local", Causality::local},
    {"independent", Causality::independent}};

/// In the order of Variability.
inline constexpr const char* variability_names[] = {"constant", "fixed", "tunable", "discrete", "continuous"};

inline constexpr std::pair<const char*, Ticks::Kind> interval_names[] = {
    {"constant", Ticks::Kind::constant},   {"fixed", Ticks::Kind::fixed},
    {"tunable", Ticks::Kind::tunable},     {"changing", Ticks::Kind::changing},
    {"countdown", Ticks::Kind::countdown}, {"triggered", Ticks::Kind::triggered}};

/// The base units of all three standards.
constexpr const char* base_units[] = {"kg", "m", "s", "A", "K", "mol", "cd", "rad"};

/// As XML Schema writes numbers.
std::string xml_number(double x);
/// ' name="value"', the value escaped.
std::string attribute(const char* name, const std::string& value);
/// Nothing for an empty value.
std::string optional_attribute(const char* name, const std::string& value);
/// When a clock ticks, as FMI 3.0 and SSP 2.0 write it.
std::string clock_attributes(const Ticks& ticks);

/// One document of an archive. Messages name the archive, the document and the line.
class XmlReader {
  protected:
    XmlReader(const std::string& archive, std::string document)
        : archive_(archive), document_(std::move(document)) {}

    /// The root of what the document says, which must be well-formed.
    const XmlNode* parse(tinyxml2::XMLDocument& to, const std::string& xml) const;
    [[noreturn]] void refuse(const XmlNode* at, const std::string& what) const;
    std::string located(const XmlNode* at) const; ///< archive, document and line

    static std::string text(const XmlNode* e, const char* name) {
        const char* const value = e->Attribute(name);
        return value ? value : "";
    }
    std::string needed(const XmlNode* e, const char* name) const;
    bool truth(const XmlNode* e, const char* name, bool otherwise = false) const;
    static std::string shown(const std::string& value) { return escape::shortened(value, 100); }
    double number(const XmlNode* e, const char* name, const std::string& value) const;
    std::optional<double> number(const XmlNode* e, const char* name) const {
        const std::string value = text(e, name);
        return value.empty() ? std::nullopt : std::optional(number(e, name, value));
    }
    template <class Enum, std::size_t n>
    Enum one_of(const XmlNode* e, const char* name, const std::pair<const char*, Enum> (&all)[n],
                Enum otherwise) const {
        const std::string value = text(e, name);
        if (value.empty()) return otherwise;
        std::string list;
        for (const auto& [known, meaning] : all) {
            if (value == known) return meaning;
            list += (list.empty() ? "" : ", ") + std::string(known);
        }
        refuse(e, std::string("'") + name + "' is '" + shown(value) + "', but must be one of: " + list +
                      rule_of_choices_);
    }
    /// Of a <BaseUnit>.
    UnitDefinition unit(const XmlNode* base) const;
    /// The words of a list.
    static std::vector<std::string> words(const std::string& list);
    /// Of a clock of that name; what it does not say itself, its declared type may say.
    Ticks ticks(const XmlNode* e, const XmlNode* declared, const std::string& name) const;

    std::string rule_of_attributes_, rule_of_choices_; ///< " (section of the standard)", in messages

  private:
    const std::string& archive_;
    std::string document_;
};

} // namespace bf::fmi

#include "xml.hpp"

#include <cmath>

namespace bf::fmi {

std::optional<Type> type_of_name(std::string_view name) {
    if (name == "Real") return Type::float64;
    if (name == "Integer") return Type::int32;
    const auto* const found = std::find(std::begin(type_names), std::end(type_names), name);
    if (found == std::end(type_names)) return std::nullopt;
    return static_cast<Type>(found - std::begin(type_names));
}

std::string xml_number(double x) {
    if (std::isnan(x)) return "NaN";
    if (std::isinf(x)) return x > 0 ? "INF" : "-INF";
    return number_text(x);
}

std::string attribute(const char* name, const std::string& value) {
    return std::string(" ") + name + "=\"" + escape::xml(value) + "\"";
}
std::string optional_attribute(const char* name, const std::string& value) {
    return value.empty() ? "" : attribute(name, value);
}
std::string clock_attributes(const Ticks& ticks) {
    std::string text = attribute("intervalVariability", interval_names[static_cast<int>(ticks.kind)].first);
    if (ticks.interval) text += attribute("intervalDecimal", xml_number(*ticks.interval));
    if (ticks.shift != 0) text += attribute("shiftDecimal", xml_number(ticks.shift));
    if (ticks.resolution == 0) return text;
    return text + attribute("supportsFraction", "true") +
           attribute("resolution", std::to_string(ticks.resolution)) +
           attribute("intervalCounter", std::to_string(ticks.interval_count)) +
           attribute("shiftCounter", std::to_string(ticks.shift_count));
}

const XmlNode* XmlReader::parse(tinyxml2::XMLDocument& to, const std::string& xml) const {
    if (xml.size() > description_limit)
        throw FmuError(archive_ + ": its " + document_ + " has more than 64 MiB");
    if (to.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS)
        throw FmuError(archive_ + ": " + document_ + ":" + std::to_string(to.ErrorLineNum()) +
                       ": it is no well-formed XML: " + tinyxml2::XMLDocument::ErrorIDToName(to.ErrorID()));
    return to.RootElement();
}

void XmlReader::refuse(const XmlNode* at, const std::string& what) const {
    throw FmuError(located(at) + ": " + what);
}

std::string XmlReader::located(const XmlNode* at) const {
    return archive_ + ": " + document_ + (at ? ":" + std::to_string(at->GetLineNum()) : "");
}

std::string XmlReader::needed(const XmlNode* e, const char* name) const {
    const char* const value = e->Attribute(name);
    if (!value || !*value)
        refuse(e,
               std::string("<") + e->Name() + "> lacks its attribute '" + name + "'" + rule_of_attributes_);
    return value;
}

bool XmlReader::truth(const XmlNode* e, const char* name, bool otherwise) const {
    const std::string value = text(e, name);
    if (value.empty()) return otherwise;
    if (value != "true" && value != "false" && value != "1" && value != "0")
        refuse(e, std::string("'") + name + "' is '" + shown(value) + "', but must be true or false");
    return value == "true" || value == "1";
}

Ticks XmlReader::ticks(const XmlNode* e, const XmlNode* declared, const std::string& name) const {
    const std::string rule = " (FMI 3.0, section 2.2.9)";
    const auto of = [&](const char* attribute) {
        return declared && !e->Attribute(attribute) ? declared : e;
    };
    const auto count = [&](const char* attribute) {
        const double value = number(of(attribute), attribute).value_or(0);
        if (!(value >= 0 && value < 9e15) || value != std::floor(value))
            refuse(e, "'" + shown(name) + "': '" + attribute + "' must be a whole number from 0, but is " +
                          number_text(value));
        return static_cast<std::uint64_t>(value);
    };
    Ticks its;
    its.kind = one_of(of("intervalVariability"), "intervalVariability", interval_names, its.kind);
    its.interval = number(of("intervalDecimal"), "intervalDecimal");
    its.shift = number(of("shiftDecimal"), "shiftDecimal").value_or(0);
    its.resolution = count("resolution");
    its.interval_count = count("intervalCounter");
    its.shift_count = count("shiftCounter");
    if (its.interval && !(*its.interval > 0 && std::isfinite(*its.interval)))
        refuse(e, "the interval of '" + shown(name) + "' is " + number_text(*its.interval) +
                      " s, but must be a number above 0" + rule);
    if (!(its.shift >= 0 && std::isfinite(its.shift)))
        refuse(e, "the shift of '" + shown(name) + "' is " + number_text(its.shift) +
                      " s, but must be a number that is not below 0" + rule);
    return its;
}

double XmlReader::number(const XmlNode* e, const char* name, const std::string& value) const {
    if (value == "INF" || value == "+INF") return std::numeric_limits<double>::infinity();
    if (value == "-INF") return -std::numeric_limits<double>::infinity();
    if (value == "NaN") return std::numeric_limits<double>::quiet_NaN();
    const char* begin = value.c_str();
    if (*begin == '+') ++begin;
    const auto found = number_of(std::string_view(begin));
    if (!found) refuse(e, std::string("'") + name + "' is '" + shown(value) + "', which is no number");
    return *found;
}

UnitDefinition XmlReader::unit(const XmlNode* base) const {
    UnitDefinition definition;
    for (std::size_t i = 0; i < std::size(base_units); ++i) {
        const double exponent = number(base, base_units[i]).value_or(0);
        if (exponent != std::round(exponent) || std::abs(exponent) > 100)
            refuse(base, std::string("'") + base_units[i] + "' is no small whole number");
        definition.exponents[i] = static_cast<int>(exponent);
    }
    definition.factor = number(base, "factor").value_or(1);
    definition.offset = number(base, "offset").value_or(0);
    if (!(std::abs(definition.factor) > 0) || !std::isfinite(definition.factor) ||
        !std::isfinite(definition.offset))
        refuse(base, "the factor of a unit is not 0, and both it and the offset are finite");
    return definition;
}

std::vector<std::string> XmlReader::words(const std::string& list) {
    std::vector<std::string> all;
    for (std::size_t at = 0; at < list.size();) {
        const auto begin = list.find_first_not_of(" \t\r\n", at);
        if (begin == std::string::npos) break;
        const auto end = std::min(list.find_first_of(" \t\r\n", begin), list.size());
        all.push_back(list.substr(begin, end - begin));
        at = end;
    }
    return all;
}

} // namespace bf::fmi

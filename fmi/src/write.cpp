// Descriptions as XML.
#include "xml.hpp"

#include <cctype>
#include <cmath>
#include <set>

namespace bf::fmi {

namespace {

constexpr const char* initials[] = {"", "exact", "approx", "calculated"};

bool is_real(Type type) { return type == Type::float64 || type == Type::float32; }

/// The type of FMI 2.0, whose integers have 32 bits.
const char* type_2(Type type) {
    switch (type) {
    case Type::boolean: return "Boolean";
    case Type::string: return "String";
    case Type::enumeration: return "Enumeration";
    case Type::int8:
    case Type::uint8:
    case Type::int16:
    case Type::uint16:
    case Type::int32: return "Integer";
    default: return "Real";
    }
}

std::string truth(const char* name, bool value) { return value ? attribute(name, "true") : ""; }

std::string start_of(const Variable& v) {
    std::string text;
    for (const double x : v.start)
        text += (text.empty() ? "" : " ") +
                (v.type == Type::boolean ? std::string(x != 0 ? "true" : "false") : xml_number(x));
    return text;
}

/// Attributes that stand at the variable in FMI 3.0, at its type in 2.0.
std::string of_type(const Variable& v, const std::string& standard_type, int derivative) {
    std::string text = optional_attribute("declaredType", v.declared_type);
    const bool has_unit = standard_type == "Real" || is_real(v.type);
    if (has_unit) text += optional_attribute("unit", v.unit);
    if (v.type != Type::boolean && v.minimum) text += attribute("min", xml_number(*v.minimum));
    if (v.type != Type::boolean && v.maximum) text += attribute("max", xml_number(*v.maximum));
    if (derivative >= 0) text += attribute("derivative", std::to_string(derivative));
    if (!v.start.empty()) text += attribute("start", start_of(v));
    return text;
}

std::string variable(const Description& d, const Variable& v) {
    std::string clocks;
    for (const int clock : v.clocks)
        clocks += (clocks.empty() ? "" : " ") +
                  std::to_string(d.variables[static_cast<std::size_t>(clock)].reference);
    const std::string common = attribute("name", v.name) +
                               attribute("valueReference", std::to_string(v.reference)) +
                               optional_attribute("description", v.doc) +
                               attribute("causality", causality_names[static_cast<int>(v.causality)].first) +
                               attribute("variability", variability_names[static_cast<int>(v.variability)]) +
                               optional_attribute("initial", initials[static_cast<int>(v.initial)]);
    if (d.version == 2)
        return "    <ScalarVariable" + common + "><" + type_2(v.type) +
               of_type(v, type_2(v.type), v.derivative_of < 0 ? -1 : v.derivative_of + 1) +
               "/></ScalarVariable>\n";
    const std::string type = type_names[static_cast<int>(v.type)];
    const int derivative =
        v.derivative_of < 0
            ? -1
            : static_cast<int>(d.variables[static_cast<std::size_t>(v.derivative_of)].reference);
    // What goes on inside a step may be read there (FMI 3.0, section 4.2.2).
    const bool is_between = d.co_simulation && d.co_simulation->returns_early &&
                            v.variability == Variability::continuous &&
                            (v.causality == Causality::output || v.causality == Causality::local);
    const std::string head = "    <" + type + common + optional_attribute("clocks", clocks) +
                             (is_between ? attribute("intermediateUpdate", "true") : "") +
                             (v.ticks ? clock_attributes(*v.ticks) : of_type(v, type, derivative));
    if (v.dimensions.empty()) return head + "/>\n";
    std::string dimensions;
    for (std::size_t i = 0; i < v.dimensions.size(); ++i) {
        const int by = i < v.dimension_by.size() ? v.dimension_by[i] : -1;
        dimensions +=
            "<Dimension" +
            (by < 0 ? attribute("start", std::to_string(v.dimensions[i]))
                    : attribute("valueReference",
                                std::to_string(d.variables[static_cast<std::size_t>(by)].reference))) +
            "/>";
    }
    return head + ">" + dimensions + "</" + type + ">\n";
}

std::string unknown(const Description& d, const char* element, const Unknown& u) {
    const auto number = [&](int variable) {
        return std::to_string(d.version == 2 ? static_cast<std::uint32_t>(variable) + 1
                                             : d.variables[static_cast<std::size_t>(variable)].reference);
    };
    std::string text = std::string("    ") + (d.version == 2 ? "  <Unknown" : std::string("<") + element) +
                       attribute(d.version == 2 ? "index" : "valueReference", number(u.variable));
    if (u.dependencies) {
        std::string list;
        for (const int by : *u.dependencies) list += (list.empty() ? "" : " ") + number(by);
        text += attribute("dependencies", list);
    }
    return text + "/>\n";
}

std::string interface(const Description& d, const Interface& its, bool is_co_simulation) {
    const bool is_2 = d.version == 2;
    std::string text = std::string("  <") + (is_co_simulation ? "CoSimulation" : "ModelExchange") +
                       attribute("modelIdentifier", its.identifier) +
                       truth(is_2 ? "canGetAndSetFMUstate" : "canGetAndSetFMUState", its.has_state) +
                       truth(is_2 ? "canSerializeFMUstate" : "canSerializeFMUState", its.can_serialize) +
                       truth(is_2 ? "providesDirectionalDerivative" : "providesDirectionalDerivatives",
                             its.has_derivatives) +
                       truth("providesAdjointDerivatives", !is_2 && its.has_adjoint) +
                       truth("canBeInstantiatedOnlyOncePerProcess", its.only_once);
    if (is_co_simulation) {
        text += truth("canHandleVariableCommunicationStepSize", its.takes_any_step);
        if (!is_2) {
            text += truth("hasEventMode", its.has_event_mode) +
                    truth("providesIntermediateUpdate", its.returns_early) +
                    truth("canReturnEarlyAfterIntermediateUpdate", its.returns_early);
            if (its.internal_step) text += attribute("fixedInternalStepSize", xml_number(*its.internal_step));
        }
    } else {
        text += is_2 ? truth("completedIntegratorStepNotNeeded", !its.needs_completed_step)
                     : attribute("needsCompletedIntegratorStep", its.needs_completed_step ? "true" : "false");
    }
    if (!is_2 || its.sources.empty()) return text + "/>\n";
    text += ">\n    <SourceFiles>\n";
    for (const auto& source : its.sources) text += "      <File" + attribute("name", source) + "/>\n";
    return text + std::string("    </SourceFiles>\n  </") +
           (is_co_simulation ? "CoSimulation" : "ModelExchange") + ">\n";
}

std::string of_base(const UnitDefinition& unit) {
    std::string text;
    for (std::size_t i = 0; i < unit.exponents.size(); ++i)
        if (unit.exponents[i] != 0) text += attribute(base_units[i], std::to_string(unit.exponents[i]));
    if (unit.factor != 1) text += attribute("factor", xml_number(unit.factor));
    if (unit.offset != 0) text += attribute("offset", xml_number(unit.offset));
    return text;
}

bool is_derivative(const std::string& name) { return name.starts_with("der(") && name.back() == ')'; }

} // namespace

std::string structured_name(const std::string& path) {
    if (is_derivative(path)) return "der(" + structured_name(path.substr(4, path.size() - 5)) + ")";
    std::string name;
    const auto add = [&](const std::string& part) {
        bool is_plain = !part.empty() && !std::isdigit(static_cast<unsigned char>(part.front()));
        for (const char c : part)
            is_plain = is_plain && (std::isalnum(static_cast<unsigned char>(c)) || c == '_');
        if (is_plain) {
            name += part;
            return;
        }
        name += '\'';
        // The grammar knows no letters outside of ASCII, so that these stand as their bytes, and no control
        // characters.
        bool is_letter = false;
        for (const char c : part) {
            const auto byte = static_cast<unsigned char>(c);
            const bool is_known = byte >= 0x20 && byte < 0x7f, goes_on = is_letter && byte >> 6u == 2;
            if (is_letter && !goes_on) name += '}';
            if (!is_known && !goes_on) name += '{';
            is_letter = !is_known;
            if (is_known) {
                if (c == '\'' || c == '\\') name += '\\';
                name += c;
            } else {
                name += "0123456789ABCDEF"[byte >> 4u];
                name += "0123456789ABCDEF"[byte & 15u];
            }
        }
        if (is_letter) name += '}';
        name += '\'';
    };
    std::size_t at = 0;
    for (auto dot = path.find('.'); dot != std::string::npos; dot = path.find('.', at)) {
        add(path.substr(at, dot - at));
        name += '.';
        at = dot + 1;
    }
    add(path.substr(at));
    return name;
}

Description scalars_of(const Description& description) {
    Description d = description;
    d.variables.clear();
    std::vector<int> first; // element of each variable
    std::uint32_t reference = description.variables.empty() ? 0 : description.variables.front().reference;
    for (const auto& v : description.variables) {
        first.push_back(static_cast<int>(d.variables.size()));
        for (int i = 0; i < v.count(); ++i) {
            Variable one = v;
            one.reference = reference++;
            one.dimensions.clear();
            if (!v.start.empty()) one.start = {v.start[static_cast<std::size_t>(i)]};
            std::string place;
            for (int k = i, axis = static_cast<int>(v.dimensions.size()) - 1; axis >= 0; --axis) {
                const int size = v.dimensions[static_cast<std::size_t>(axis)];
                place = std::to_string(k % size + 1) + (place.empty() ? "" : "," + place);
                k /= size;
            }
            if (!place.empty())
                one.name.insert(one.name.size() - (is_derivative(v.name) ? 1 : 0), "[" + place + "]");
            if (v.derivative_of >= 0)
                one.derivative_of = first[static_cast<std::size_t>(v.derivative_of)] + i;
            d.variables.push_back(std::move(one));
        }
    }
    const auto spread = [&](std::vector<Unknown>& unknowns) {
        std::vector<Unknown> all;
        for (const auto& u : unknowns)
            for (int i = 0; i < description.variables[static_cast<std::size_t>(u.variable)].count(); ++i) {
                Unknown one{first[static_cast<std::size_t>(u.variable)] + i};
                if (u.dependencies) {
                    one.dependencies.emplace();
                    for (const int by : *u.dependencies)
                        for (int k = 0; k < description.variables[static_cast<std::size_t>(by)].count(); ++k)
                            one.dependencies->push_back(first[static_cast<std::size_t>(by)] + k);
                }
                all.push_back(std::move(one));
            }
        unknowns = std::move(all);
    };
    spread(d.outputs);
    spread(d.derivatives);
    spread(d.initial_unknowns);
    return d;
}

std::string to_xml(const Description& d) {
    const bool is_2 = d.version == 2;
    std::string text =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription" +
        attribute("fmiVersion", is_2 ? "2.0" : "3.0") + attribute("modelName", d.name) +
        attribute(is_2 ? "guid" : "instantiationToken", d.token) + optional_attribute("description", d.doc) +
        optional_attribute("generationTool", d.tool) + attribute("variableNamingConvention", "structured");
    if (is_2 && d.model_exchange)
        text += attribute("numberOfEventIndicators", std::to_string(d.event_indicators));
    text += ">\n";
    if (d.model_exchange) text += interface(d, *d.model_exchange, false);
    if (d.co_simulation) text += interface(d, *d.co_simulation, true);

    std::set<std::string> units;
    for (const auto& v : d.variables)
        if (!v.unit.empty() && (is_real(v.type) || (is_2 && type_2(v.type) == std::string("Real"))))
            units.insert(v.unit);
    if (!units.empty()) {
        text += "  <UnitDefinitions>\n";
        for (const auto& unit : units) {
            text += "    <Unit" + attribute("name", unit);
            const auto defined = d.units.find(unit);
            text +=
                defined == d.units.end() ? "/>\n" : "><BaseUnit" + of_base(defined->second) + "/></Unit>\n";
        }
        text += "  </UnitDefinitions>\n";
    }
    if (!d.enumerations.empty()) {
        text += "  <TypeDefinitions>\n";
        for (const auto& type : d.enumerations) {
            const std::string name = attribute("name", type.name);
            text +=
                is_2 ? "    <SimpleType" + name + "><Enumeration>\n" : "    <EnumerationType" + name + ">\n";
            for (const auto& [value, item] : type.items)
                text +=
                    "      <Item" + attribute("name", item) + attribute("value", number_text(value)) + "/>\n";
            text += is_2 ? "    </Enumeration></SimpleType>\n" : "    </EnumerationType>\n";
        }
        text += "  </TypeDefinitions>\n";
    }
    text += "  <LogCategories>\n    <Category name=\"logStatusWarning\"/>\n    <Category "
            "name=\"logStatusError\"/>\n"
            "  </LogCategories>\n  <DefaultExperiment" +
            attribute("startTime", xml_number(d.start));
    if (d.stop) text += attribute("stopTime", xml_number(*d.stop));
    if (d.step) text += attribute("stepSize", xml_number(*d.step));
    text += "/>\n  <ModelVariables>\n";
    for (const auto& v : d.variables) text += variable(d, v);
    text += "  </ModelVariables>\n  <ModelStructure>\n";
    const auto list = [&](const char* group, const char* element, const std::vector<Unknown>& unknowns) {
        if (unknowns.empty()) return;
        if (is_2) text += std::string("    <") + group + ">\n";
        for (const auto& u : unknowns) text += unknown(d, element, u);
        if (is_2) text += std::string("    </") + group + ">\n";
    };
    list("Outputs", "Output", d.outputs);
    list("Derivatives", "ContinuousStateDerivative", d.derivatives);
    list("InitialUnknowns", "InitialUnknown", d.initial_unknowns);
    for (const int number : is_2 ? std::vector<int>() : d.indicators)
        text += unknown(d, "EventIndicator", {number});
    return text + "  </ModelStructure>\n</fmiModelDescription>\n";
}

} // namespace bf::fmi

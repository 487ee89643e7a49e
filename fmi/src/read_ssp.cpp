// Systems from XML, which anybody may have written.
#include "bf/base/files.hpp"
#include "bf/fmi/ssp.hpp"
#include "xml.hpp"

#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <set>
#include <string_view>

namespace bf::fmi {

namespace {

namespace fs = std::filesystem;

/// Values of one parameter, elements of all systems together, systems inside each other: so many fit into
/// memory whatever a package says.
constexpr std::size_t most_values = 10'000'000, most_elements = 250'000, deepest = 100;

/// The name without the prefix of its namespace.
std::string_view local(const XmlNode* e) {
    const std::string_view name = e->Name();
    const auto colon = name.find(':');
    return colon == std::string_view::npos ? name : name.substr(colon + 1);
}
const XmlNode* next(const XmlNode* e, std::string_view name) {
    while (e && local(e) != name) e = e->NextSiblingElement();
    return e;
}
const XmlNode* child(const XmlNode* e, std::string_view name) {
    return e ? next(e->FirstChildElement(), name) : nullptr;
}
/// Each child of that name.
template <class F> void for_each(const XmlNode* e, std::string_view name, F&& f) {
    for (const auto* c = child(e, name); c; c = next(c->NextSiblingElement(), name)) f(c);
}

using UnitDefinitions = std::map<std::string, UnitDefinition>;
/// The numbers of the items of an enumeration.
using EnumerationItems = std::map<std::string, std::map<std::string, double>>;

/// What one document defines: of the structure, a parameter set or a mapping.
class SspReader : XmlReader {
  public:
    SspReader(const fs::path& folder, const std::string& package, const std::string& document)
        : XmlReader(package, document), folder_(folder), package_(package) {
        rule_of_attributes_ = rule_of_choices_ = " (SSP 2.0)";
    }
    SystemStructure structure();

  private:
    const XmlNode* root(const char* name);
    fs::path file(const XmlNode* e, const std::string& uri) const;
    void read_definitions(const XmlNode* e);
    void read_element(const XmlNode* e, SystemElement& to, int depth);
    void read_system(const XmlNode* e, SystemElement& to, int depth);
    void read_component(const XmlNode* e, SystemElement& to);
    void read_connectors(const XmlNode* e, SystemElement& to) const;
    void read_wires(const XmlNode* e, SystemElement& to) const;
    /// The connectors of one element.
    struct Ends {
        const SystemElement* of;
        std::map<std::string_view, const Connector*> connectors;
    };
    /// Those of all elements of a system, and its own by an empty name.
    using EndsOfSystem = std::map<std::string_view, Ends>;
    Wire wire(const XmlNode* e, const EndsOfSystem& ends) const;
    std::vector<double> numbers(const XmlNode* e, const char* name) const;
    std::vector<int> dimensions(const XmlNode* e) const;
    Linear linear(const XmlNode* e) const;
    Linear between_units(const XmlNode* e, const std::string& from, const std::string& to) const;

    std::vector<ParameterValue> binding(const XmlNode* e) const;
    std::vector<ParameterValue> parameter_set(const XmlNode* e);
    ParameterValue parameter(const XmlNode* e) const;
    /// Applies the mapping to what a set has.
    std::vector<ParameterValue> mapped(const XmlNode* e, const std::vector<ParameterValue>& set) const;
    std::map<std::string, std::string> own(const XmlNode* e, const char* name) const;
    const XmlNode* annotation(const XmlNode* e) const;

    const fs::path& folder_;
    const std::string& package_;
    tinyxml2::XMLDocument document_;
    UnitDefinitions units_;
    EnumerationItems enumerations_;
    const EnumerationItems* around_ = &enumerations_; ///< of the document that names this one
    std::vector<std::string>* warnings_ = nullptr;
    std::size_t elements_ = 0;
};

const XmlNode* SspReader::root(const char* name) {
    const auto* const e = document_.RootElement();
    if (!e || local(e) != name) refuse(e, std::string("its root is no <") + name + "> (SSP 2.0)");
    const std::string version = text(e, "version");
    if (version != "1.0" && version != "2.0")
        refuse(e, "it is of SSP version '" + shown(version) + "', but 1.0 and 2.0 are known");
    return e;
}

/// The file that a reference means, which lies below the folder.
fs::path SspReader::file(const XmlNode* e, const std::string& uri) const {
    std::string name;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const auto digit = [&](std::size_t at) {
            return at < uri.size()
                       ? std::string_view("0123456789abcdef")
                             .find(static_cast<char>(std::tolower(static_cast<unsigned char>(uri[at]))))
                       : std::string_view::npos;
        };
        const auto high = digit(i + 1), low = digit(i + 2);
        const bool is_code = uri[i] == '%' && high != std::string_view::npos && low != std::string_view::npos;
        name += is_code ? static_cast<char>(high * 16 + low) : uri[i];
        if (is_code) i += 2;
    }
    const fs::path path = fs::path(name).lexically_normal();
    const bool leaves = path.empty() || path.is_absolute() || *path.begin() == ".." ||
                        name.find_first_of(std::string_view(":\\\0", 3)) != std::string::npos;
    std::error_code error;
    if (leaves || uri.find_first_of("#?") != std::string::npos)
        refuse(e,
               "'" + shown(uri) + "' is no file of the package; only these are taken (SSP 2.0, section 5.6)");
    if (!fs::is_regular_file(folder_ / path, error))
        refuse(e, "there is no file '" + shown(uri) + "' in the package");
    return path;
}

void SspReader::read_definitions(const XmlNode* e) {
    for_each(child(e, "Units"), "Unit", [&](const XmlNode* unit) {
        const auto* const base = child(unit, "BaseUnit");
        if (!base) refuse(unit, "a unit has no <BaseUnit>");
        units_[needed(unit, "name")] = this->unit(base);
    });
    for_each(child(e, "Enumerations"), "Enumeration", [&](const XmlNode* enumeration) {
        auto& items = enumerations_[needed(enumeration, "name")];
        for_each(enumeration, "Item", [&](const XmlNode* item) {
            items[needed(item, "name")] = number(item, "value", needed(item, "value"));
        });
    });
}

std::vector<double> SspReader::numbers(const XmlNode* e, const char* name) const {
    std::vector<double> all;
    for (const auto& word : words(text(e, name)))
        all.push_back(word == "true" ? 1 : word == "false" ? 0 : number(e, name, word));
    if (all.size() > most_values) refuse(e, "it has more values than fit into memory");
    return all;
}

std::vector<int> SspReader::dimensions(const XmlNode* e) const {
    std::vector<int> all;
    for_each(e, "Dimension", [&](const XmlNode* size) {
        const double rows = number(size, "size").value_or(0);
        if (!(rows >= 0 && rows <= static_cast<double>(most_values)) || rows != std::floor(rows))
            refuse(size, "a size of '" + shown(text(size, "size")) + "' cannot be");
        all.push_back(static_cast<int>(rows));
    });
    return all;
}

Linear SspReader::linear(const XmlNode* e) const {
    for (const char* other :
         {"BooleanMappingTransformation", "IntegerMappingTransformation", "EnumerationMappingTransformation"})
        if (const auto* const mapping = child(e, other))
            refuse(mapping, std::string("<") + other + "> is not known here; map the values in an FMU");
    const auto* const its = child(e, "LinearTransformation");
    if (!its) return {};
    return {number(its, "factor").value_or(1), number(its, "offset").value_or(0)};
}

Linear SspReader::between_units(const XmlNode* e, const std::string& from, const std::string& to) const {
    if (from.empty() || to.empty() || from == to) return {};
    const auto a = units_.find(from), b = units_.find(to);
    if (a == units_.end() || b == units_.end() || a->second.exponents != b->second.exponents)
        refuse(e, "from '" + shown(from) + "' to '" + shown(to) +
                      "' there is no conversion; define both as units of one quantity, or say "
                      "suppressUnitConversion (SSP 2.0, section 4.5)");
    return {a->second.factor / b->second.factor, (a->second.offset - b->second.offset) / b->second.factor};
}

// ---- parameters

ParameterValue SspReader::parameter(const XmlNode* e) const {
    ParameterValue p{needed(e, "name")};
    const XmlNode* value = e->FirstChildElement();
    const auto type = value ? type_of_name(local(value)) : std::nullopt;
    if (!type) refuse(e, "the parameter '" + shown(p.name) + "' has no type that is known");
    p.type = *type;
    p.unit = text(value, "unit");
    p.place = located(e);
    p.dimensions = dimensions(e);
    if (p.type == Type::enumeration) {
        const std::string name_of_type = text(value, "name");
        const auto& known = enumerations_.contains(name_of_type) ? enumerations_ : *around_;
        const auto items = known.find(name_of_type);
        std::vector<std::string> names;
        if (const char* one = value->Attribute("value")) names.emplace_back(one);
        for_each(value, "Value", [&](const XmlNode* item) { names.push_back(text(item, "value")); });
        for (const auto& name : names) {
            const auto plain = number_of(name);
            const bool is_known = items != known.end() && items->second.contains(name);
            if (!is_known && !plain)
                refuse(value,
                       "'" + shown(name) + "' is no item of the enumeration '" + shown(name_of_type) + "'");
            p.values.push_back(is_known ? items->second.at(name) : *plain);
        }
    } else if (has_values(p.type)) {
        p.values = numbers(value, "value");
    } else {
        p.text = text(value, "value");
    }
    if (has_values(p.type) && p.values.empty())
        refuse(value, "the parameter '" + shown(p.name) + "' has no value");
    return p;
}

std::vector<ParameterValue> SspReader::parameter_set(const XmlNode* e) {
    read_definitions(e);
    std::vector<ParameterValue> set;
    std::set<std::string> names;
    for_each(child(e, "Parameters"), "Parameter", [&](const XmlNode* p) {
        set.push_back(parameter(p));
        if (!names.insert(set.back().name).second)
            refuse(p, "two parameters of the set are called '" + shown(set.back().name) +
                          "' (SSP 2.0, section 6.3)");
    });
    return set;
}

std::vector<ParameterValue> SspReader::mapped(const XmlNode* e,
                                              const std::vector<ParameterValue>& set) const {
    std::vector<ParameterValue> all;
    std::set<std::string> targets;
    for_each(e, "MappingEntry", [&](const XmlNode* entry) {
        const std::string source = needed(entry, "source"), target = needed(entry, "target");
        if (!targets.insert(target).second)
            refuse(entry, "two parameters are mapped to '" + shown(target) + "' (SSP 2.0, section 7.1)");
        const Linear change = linear(entry);
        if (std::ranges::none_of(set, [&](const auto& p) { return p.name == source; }))
            warnings_->push_back(located(entry) + ": no parameter '" + shown(source) +
                                 "' is given, so that nothing is mapped to '" + shown(target) + "'");
        for (const auto& p : set) {
            if (p.name != source) continue;
            all.push_back(p);
            all.back().name = target;
            all.back().place = located(entry);
            if (change == Linear{}) continue;
            if (p.type != Type::float64 && p.type != Type::float32)
                refuse(entry, "a linear transformation is for real numbers (SSP 2.0, section 4.6)");
            for (double& x : all.back().values) x = change.factor * x + change.offset;
        }
    });
    return all;
}

std::vector<ParameterValue> SspReader::binding(const XmlNode* e) const {
    const auto in_package = [&](const XmlNode* at, const char* type) {
        if (const std::string its = text(at, "type"); !its.empty() && its != type)
            refuse(at, "a source of type '" + shown(its) + "' is not known here, but " + type);
        if (text(at, "sourceBase") == "component")
            refuse(at,
                   "sources inside of components are not taken; put the file beside them into the package");
        return at->Attribute("source") != nullptr;
    };
    const auto document = [&](const XmlNode* at) {
        const std::string uri = text(at, "source");
        return std::pair(uri, read_text_file(folder_ / file(at, uri), description_limit));
    };
    std::vector<ParameterValue> set;
    if (in_package(e, "application/x-ssp-parameter-set")) {
        const auto [uri, xml] = document(e);
        SspReader reader(folder_, package_, uri);
        reader.around_ = &enumerations_;
        reader.warnings_ = warnings_;
        static_cast<void>(reader.parse(reader.document_, xml));
        set = reader.parameter_set(reader.root("ParameterSet"));
    } else if (const auto* const inline_set = child(child(e, "ParameterValues"), "ParameterSet")) {
        SspReader reader(folder_, package_, "SystemStructure.ssd");
        reader.around_ = &enumerations_;
        reader.warnings_ = warnings_;
        set = reader.parameter_set(inline_set);
    }
    // The prefix comes before names are looked up, in a mapping as well.
    for (auto& p : set) p.name.insert(0, text(e, "prefix"));
    const auto* const mapping = child(e, "ParameterMapping");
    if (!mapping) return set;
    if (in_package(mapping, "application/x-ssp-parameter-mapping")) {
        const auto [uri, xml] = document(mapping);
        SspReader reader(folder_, package_, uri);
        reader.warnings_ = warnings_;
        static_cast<void>(reader.parse(reader.document_, xml));
        return reader.mapped(reader.root("ParameterMapping"), set);
    }
    const auto* const inline_mapping = child(mapping, "ParameterMapping");
    return inline_mapping ? mapped(inline_mapping, set) : set;
}

// ---- elements

void SspReader::read_connectors(const XmlNode* e, SystemElement& to) const {
    static constexpr std::pair<const char*, Causality> kinds[] = {
        {"input", Causality::input},
        {"output", Causality::output},
        {"parameter", Causality::parameter},
        {"calculatedParameter", Causality::calculated_parameter},
        {"structuralParameter", Causality::structural_parameter},
        {"constant", Causality::local},
        {"local", Causality::local}};
    std::set<std::string> names;
    for_each(child(e, "Connectors"), "Connector", [&](const XmlNode* c) {
        Connector its{needed(c, "name")};
        static_cast<void>(needed(c, "kind"));
        its.kind = one_of(c, "kind", kinds, Causality::input);
        for (const auto* part = c->FirstChildElement(); part; part = part->NextSiblingElement()) {
            // The type of a clock has no name, the clock that a connector belongs to has one.
            if (local(part) == "Clock" && part->Attribute("name")) {
                its.clocks.push_back(needed(part, "name"));
                continue;
            }
            if (its.type) continue;
            its.type = type_of_name(local(part));
            if (its.type) its.unit = text(part, "unit");
            if (its.type == Type::clock && part->Attribute("intervalVariability"))
                its.ticks = ticks(part, nullptr, its.name);
        }
        its.dimensions = dimensions(c);
        if (!names.insert(its.name).second)
            refuse(c, "two connectors of '" + shown(to.name) + "' are called '" + shown(its.name) +
                          "' (SSP 2.0, section 5.2.1)");
        to.connectors.push_back(std::move(its));
    });
    std::set<std::string_view> clocks;
    for (const auto& c : to.connectors)
        if (c.type == Type::clock) clocks.insert(c.name);
    for (const auto& c : to.connectors)
        for (const auto& clock : c.clocks)
            if (!clocks.contains(clock))
                refuse(child(e, "Connectors"), "'" + shown(c.name) + "' has the clock '" + shown(clock) +
                                                   "', which is no clock of '" + shown(to.name) +
                                                   "' (SSP 2.0, section 5.2.1)");
}

/// One that gives a value to what is around it, or inside of a system.
bool gives(const Connector& c, bool is_own) {
    const bool comes_in = c.kind == Causality::input || c.kind == Causality::parameter ||
                          c.kind == Causality::structural_parameter;
    return comes_in == is_own;
}

Wire SspReader::wire(const XmlNode* e, const EndsOfSystem& ends) const {
    struct End {
        std::string element, name;
        const Connector* connector;
    };
    const auto end = [&](const char* element, const char* connector, const char* indices) {
        End its{text(e, element), needed(e, connector), nullptr};
        if (e->Attribute(indices))
            refuse(e, "connections of elements of an array are not known here; connect whole arrays");
        const auto element_found = ends.find(its.element);
        if (element_found == ends.end())
            refuse(e, "there is no element '" + shown(its.element) + "' to connect");
        const auto& [of, connectors] = element_found->second;
        const auto found = connectors.find(its.name);
        if (found == connectors.end())
            refuse(e, "'" + shown(of->name) + "' has no connector '" + shown(its.name) +
                          "' to connect (SSP 2.0, section 5.3.2)");
        its.connector = found->second;
        return its;
    };
    End from = end("startElement", "startConnector", "startIndices"),
        to = end("endElement", "endConnector", "endIndices");
    // What is called its start need not be where the value comes from.
    bool is_turned =
        gives(*to.connector, to.element.empty()) && !gives(*from.connector, from.element.empty());
    if (is_turned) std::swap(from, to);
    if (!gives(*from.connector, from.element.empty()) || gives(*to.connector, to.element.empty()))
        refuse(e, "'" + shown(from.name) + "' and '" + shown(to.name) +
                      "' are no source and destination of a value (SSP 2.0, section 5.3.2)");
    Wire its{from.element, from.name, to.element, to.name};
    const Linear own = linear(e);
    if (is_turned && !(own == Linear{}))
        refuse(e, "a transformation wants its source as the start of the connection");
    Linear units;
    if (!truth(e, "suppressUnitConversion"))
        units = between_units(e, from.connector->unit, to.connector->unit);
    its.conversion = {own.factor * units.factor, own.factor * units.offset + own.offset};
    if (const auto* const geometry = child(e, "ConnectionGeometry")) {
        its.xs = numbers(geometry, "pointsX"), its.ys = numbers(geometry, "pointsY");
        if (its.xs.size() != its.ys.size())
            refuse(geometry, "'pointsX' and 'pointsY' have different lengths");
        if (is_turned) std::reverse(its.xs.begin(), its.xs.end()), std::reverse(its.ys.begin(), its.ys.end());
    }
    return its;
}

void SspReader::read_wires(const XmlNode* e, SystemElement& to) const {
    EndsOfSystem ends;
    const auto add = [&](std::string_view name, const SystemElement& element) {
        auto& its = ends[name];
        its.of = &element;
        for (const auto& c : element.connectors) its.connectors[c.name] = &c;
    };
    add("", to);
    for (const auto& element : to.elements) add(element.name, element);
    std::set<std::pair<std::string, std::string>> driven;
    for_each(child(e, "Connections"), "Connection", [&](const XmlNode* c) {
        to.wires.push_back(wire(c, ends));
        const auto& its = to.wires.back();
        if (!driven.insert({its.to_element, its.to}).second)
            refuse(c, "two connections lead to '" +
                          shown(its.to_element.empty() ? its.to : its.to_element + "." + its.to) +
                          "' (SSP 2.0, section 5.3.2)");
    });
}

void SspReader::read_component(const XmlNode* e, SystemElement& to) {
    static constexpr std::pair<const char*, std::optional<Kind>> kinds[] = {
        {"any", std::nullopt},
        {"CoSimulation", Kind::co_simulation},
        {"ModelExchange", Kind::model_exchange}};
    if (const std::string type = text(e, "type"); !type.empty() && type != "application/x-fmu-sharedlibrary")
        refuse(e, "the component '" + shown(to.name) + "' is of type '" + shown(type) +
                      "', but FMUs alone are known here (application/x-fmu-sharedlibrary)");
    if (!e->Attribute("source"))
        refuse(e,
               "the component '" + shown(to.name) + "' has no source; name its FMU (SSP 2.0, section 5.4)");
    to.source = file(e, text(e, "source")).generic_string();
    to.kind = one_of(e, "implementation", kinds, std::optional<Kind>());
}

void SspReader::read_system(const XmlNode* e, SystemElement& to, int depth) {
    to.is_system = true;
    std::set<std::string> names;
    const auto* const list = child(e, "Elements");
    for (const auto* c = list ? list->FirstChildElement() : nullptr; c; c = c->NextSiblingElement()) {
        const bool is_system = local(c) == "System";
        if (!is_system && local(c) != "Component")
            refuse(c, "<" + std::string(local(c)) + "> is not known here; connect its ends to each other");
        to.elements.emplace_back();
        read_element(c, to.elements.back(), depth);
        const auto& its = to.elements.back();
        if (!names.insert(its.name).second)
            refuse(c, "two elements are called '" + shown(its.name) + "' (SSP 2.0, section 5.3.1)");
    }
    read_wires(e, to);
}

void SspReader::read_element(const XmlNode* e, SystemElement& to, int depth) {
    if (depth > static_cast<int>(deepest)) refuse(e, "systems stand too deep in each other");
    if (++elements_ > most_elements) refuse(e, "it has more elements than are known here (250000)");
    to.name = needed(e, "name");
    to.doc = text(e, "description");
    if (const auto* const place = child(e, "ElementGeometry")) {
        const auto at = [&](const char* name) { return number(place, name, needed(place, name)); };
        to.place = Place{at("x1"), at("y1"), at("x2"), at("y2"), number(place, "rotation").value_or(0)};
    }
    read_connectors(e, to);
    for_each(child(e, "ParameterBindings"), "ParameterBinding", [&](const XmlNode* b) {
        for (auto& p : binding(b)) to.parameters.push_back(std::move(p));
    });
    to.own = own(e, "element");
    if (local(e) == "System")
        read_system(e, to, depth + 1);
    else
        read_component(e, to);
}

const XmlNode* SspReader::annotation(const XmlNode* e) const {
    const XmlNode* its = nullptr;
    for_each(child(e, "Annotations"), "Annotation", [&](const XmlNode* a) {
        if (text(a, "type") == own_annotation) its = a;
    });
    return its;
}

std::map<std::string, std::string> SspReader::own(const XmlNode* e, const char* name) const {
    std::map<std::string, std::string> all;
    if (const auto* const its = child(annotation(e), name))
        for (const auto* a = its->FirstAttribute(); a; a = a->Next()) all[a->Name()] = a->Value();
    return all;
}

SystemStructure SspReader::structure() {
    static_cast<void>(parse(document_, read_text_file(folder_ / "SystemStructure.ssd", description_limit)));
    const auto* const e = root("SystemStructureDescription");
    SystemStructure its{needed(e, "name")};
    warnings_ = &its.warnings;
    read_definitions(e);
    const auto* const system = child(e, "System");
    if (!system) refuse(e, "it has no <System> (SSP 2.0, section 5.1)");
    read_element(system, its.system, 0);
    for (const auto& [name, unit] : units_) its.units[name] = unit.exponents;
    if (const auto* const experiment = child(e, "DefaultExperiment")) {
        its.start = number(experiment, "startTime").value_or(0);
        its.stop = number(experiment, "stopTime");
        its.own = own(experiment, "experiment");
        for_each(child(annotation(experiment), "experiment"), "record",
                 [&](const XmlNode* r) { its.record.push_back(needed(r, "signal")); });
    }
    return its;
}

} // namespace

const Connector* SystemElement::find(const std::string& connector) const {
    const auto found = std::find_if(connectors.begin(), connectors.end(),
                                    [&](const Connector& c) { return c.name == connector; });
    return found == connectors.end() ? nullptr : &*found;
}

SystemStructure read_system(const fs::path& folder, const std::string& package) {
    std::error_code error;
    if (!fs::is_regular_file(folder / "SystemStructure.ssd", error))
        throw FmuError(
            package +
            ": it has no SystemStructure.ssd, which every system structure package has (SSP 2.0, chapter 3)");
    return SspReader(folder, package, "SystemStructure.ssd").structure();
}

} // namespace bf::fmi

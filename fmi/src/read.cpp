// Descriptions from XML, which anybody may have written.
#include "xml.hpp"

#include <cctype>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

namespace bf::fmi {

namespace {

using Element = XmlNode;

/// Elements of one array, and of all variables; so many fit into memory whatever a description says.
constexpr std::int64_t largest_array = 10'000'000, all_elements = 100'000'000;

class Reader : XmlReader {
  public:
    Reader(const std::string& fmu, const Structure& structure)
        : XmlReader(fmu, "modelDescription.xml"), structure_(structure) {}
    Description read(const std::string& xml);

  private:
    std::string section(const char* of_2, const char* of_3) const {
        return d_.version == 2 ? std::string(" (FMI 2.0.4, section ") + of_2 + ")"
                               : std::string(" (FMI 3.0, section ") + of_3 + ")";
    }
    std::uint32_t reference(const Element* e, const char* name, const std::string& value) const {
        const auto found = number_of<std::uint32_t>(value);
        if (!found)
            refuse(e, std::string("'") + name + "' is '" + shown(value) + "', but must be a number from 0");
        return *found;
    }

    Interface interface(const Element* e) const;
    void read_types(const Element* root);
    void set_structure();
    void read_variables(const Element* root);
    void read_variable(const Element* e, const Element* its_type);
    void read_start(Variable& v, const Element* its_type);
    void read_ticks(Variable& v, const Element* its_type, const Element* declared) const;
    void read_structure(const Element* root);
    int variable_of(const Element* e, const char* name, const std::string& value) const;

    const Structure& structure_;
    std::set<std::string> changed_; ///< of its parameters
    Description d_;
    std::map<std::string, const Element*> types_; ///< by their name
    std::map<std::uint32_t, int> by_reference_;   ///< of FMI 3.0
    std::int64_t elements_ = 0;
};

Interface Reader::interface(const Element* e) const {
    Interface its;
    its.identifier = needed(e, "modelIdentifier");
    const bool is_name =
        its.identifier.size() < 200 && !std::isdigit(static_cast<unsigned char>(its.identifier[0])) &&
        std::all_of(its.identifier.begin(), its.identifier.end(),
                    [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; });
    // It is the name of a file that is opened.
    if (!is_name)
        refuse(e,
               "the modelIdentifier '" + shown(its.identifier) + "' is no C name" + section("2.2.1", "2.4"));
    its.has_state = truth(e, "canGetAndSetFMUState") || truth(e, "canGetAndSetFMUstate");
    its.can_serialize = truth(e, "canSerializeFMUState") || truth(e, "canSerializeFMUstate");
    its.has_derivatives =
        truth(e, "providesDirectionalDerivatives") || truth(e, "providesDirectionalDerivative");
    its.has_adjoint = truth(e, "providesAdjointDerivatives");
    its.takes_any_step = truth(e, "canHandleVariableCommunicationStepSize");
    its.has_event_mode = truth(e, "hasEventMode");
    its.returns_early = truth(e, "canReturnEarlyAfterIntermediateUpdate");
    its.internal_step = number(e, "fixedInternalStepSize");
    its.needs_completed_step = d_.version == 2 ? !truth(e, "completedIntegratorStepNotNeeded")
                                               : truth(e, "needsCompletedIntegratorStep", true);
    its.only_once = truth(e, "canBeInstantiatedOnlyOncePerProcess");
    its.needs_tool = truth(e, "needsExecutionTool");
    if (const auto* sources = e->FirstChildElement("SourceFiles"))
        for (const auto* file = sources->FirstChildElement("File"); file;
             file = file->NextSiblingElement("File"))
            its.sources.push_back(needed(file, "name"));
    return its;
}

void Reader::read_types(const Element* root) {
    if (const auto* list = root->FirstChildElement("UnitDefinitions"))
        for (const auto* its = list->FirstChildElement("Unit"); its; its = its->NextSiblingElement("Unit"))
            if (const auto* base = its->FirstChildElement("BaseUnit"))
                d_.units[needed(its, "name")] = unit(base);
    if (const auto* list = root->FirstChildElement("TypeDefinitions"))
        for (const auto* type = list->FirstChildElement(); type; type = type->NextSiblingElement()) {
            const auto* const its = d_.version == 2 ? type->FirstChildElement() : type;
            if (!its) continue;
            const std::string name = needed(type, "name");
            types_[name] = its;
            EnumerationType enumeration{name, {}};
            for (const auto* item = its->FirstChildElement("Item"); item;
                 item = item->NextSiblingElement("Item"))
                enumeration.items.emplace_back(number(item, "value", needed(item, "value")),
                                               needed(item, "name"));
            if (!enumeration.items.empty()) d_.enumerations.push_back(std::move(enumeration));
        }
}

void Reader::read_start(Variable& v, const Element* its) {
    const char* const start = its->Attribute("start");
    if (v.type == Type::string) {
        if (start) v.text = start;
        if (const auto* child = its->FirstChildElement("Start")) v.text = text(child, "value");
        return;
    }
    if (!start || v.type == Type::binary || v.type == Type::clock) return;
    for (const auto& word : words(start))
        v.start.push_back(v.type == Type::boolean ? (word == "true" || word == "1")
                                                  : number(its, "start", word));
}

/// Attributes may stand at the declared type.
void Reader::read_ticks(Variable& v, const Element* its, const Element* declared) const {
    static_cast<void>(
        needed(declared && !its->Attribute("intervalVariability") ? declared : its, "intervalVariability"));
    v.ticks = ticks(its, declared, v.name);
    if (v.ticks->kind == Ticks::Kind::constant && !v.ticks->interval)
        refuse(its, "'" + shown(v.name) + "' ticks at a constant interval, but has no intervalDecimal" +
                        section("", "2.4.4"));
}

void Reader::read_variable(const Element* e, const Element* its) {
    static constexpr std::pair<const char*, Variability> variabilities[] = {
        {"constant", Variability::constant},
        {"fixed", Variability::fixed},
        {"tunable", Variability::tunable},
        {"discrete", Variability::discrete},
        {"continuous", Variability::continuous}};
    static constexpr std::pair<const char*, Initial> initials[] = {
        {"exact", Initial::exact}, {"approx", Initial::approx}, {"calculated", Initial::calculated}};
    Variable v;
    const std::string type = its->Name();
    const auto known = type_of_name(type);
    if (!known) refuse(its, "there is no type of variables <" + shown(type) + ">");
    v.type = *known;
    const bool is_real = v.type == Type::float64 || v.type == Type::float32;
    v.name = needed(e, "name");
    v.doc = text(e, "description");
    v.reference = reference(e, "valueReference", needed(e, "valueReference"));
    v.causality = one_of(e, "causality", causality_names, Causality::local);
    v.variability =
        one_of(e, "variability", variabilities,
               v.causality == Causality::parameter || v.causality == Causality::calculated_parameter ||
                       v.causality == Causality::structural_parameter
                   ? Variability::fixed
               : is_real ? Variability::continuous
                         : Variability::discrete);
    v.initial = one_of(e, "initial", initials, Initial::none);
    const Element* declared = nullptr;
    if (const std::string name = text(its, "declaredType"); !name.empty()) {
        const auto found = types_.find(name);
        if (found == types_.end())
            refuse(its, "'" + v.name + "' has the type '" + shown(name) + "', which is not defined" +
                            section("2.2.3", "2.4.4"));
        declared = found->second;
        if (v.type == Type::enumeration) v.declared_type = name;
    }
    v.unit = text(its, "unit");
    v.minimum = number(its, "min");
    v.maximum = number(its, "max");
    if (declared) {
        if (v.unit.empty()) v.unit = text(declared, "unit");
        if (!v.minimum) v.minimum = number(declared, "min");
        if (!v.maximum) v.maximum = number(declared, "max");
    }
    read_start(v, its);
    if (v.type == Type::clock) read_ticks(v, its, declared);
    d_.variables.push_back(std::move(v));
}

void Reader::read_variables(const Element* root) {
    const auto* const list = root->FirstChildElement("ModelVariables");
    if (!list) refuse(root, "it has no <ModelVariables>" + section("2.2.7", "2.4.7"));
    std::vector<const Element*> places;
    std::set<std::string> names;
    for (const auto* e = list->FirstChildElement(); e; e = e->NextSiblingElement()) {
        const Element* its = e;
        if (d_.version == 2) {
            its = e->FirstChildElement();
            while (its && std::strcmp(its->Name(), "Annotations") == 0) its = its->NextSiblingElement();
            if (!its) refuse(e, "a variable has no type" + section("2.2.7", "2.4.7"));
        }
        read_variable(e, its);
        places.push_back(its);
        const auto& v = d_.variables.back();
        if (!names.insert(v.name).second)
            refuse(e, "two variables are called '" + shown(v.name) + "'" + section("2.2.7", "2.4.7"));
        if (d_.version == 3 &&
            !by_reference_.emplace(v.reference, static_cast<int>(d_.variables.size()) - 1).second)
            refuse(e, "two variables have the reference " + std::to_string(v.reference) +
                          section("2.2.7", "2.4.7"));
    }
    set_structure();
    // Sizes, which other variables may give, then what needs them.
    for (std::size_t i = 0; i < places.size(); ++i) {
        Variable& v = d_.variables[i];
        std::int64_t count = 1;
        bool is_changed = false; // its size
        for (const auto* size = places[i]->FirstChildElement("Dimension"); size;
             size = size->NextSiblingElement("Dimension")) {
            double rows = 0;
            if (const std::string by = text(size, "valueReference"); !by.empty()) {
                const auto& other =
                    d_.variables[static_cast<std::size_t>(variable_of(size, "valueReference", by))];
                if (other.start.size() != 1)
                    refuse(size, "the size of '" + v.name + "' is '" + other.name +
                                     "', which has no start value" + section("", "2.4.7.5.1"));
                rows = other.start.front();
                is_changed = is_changed || changed_.contains(other.name);
            } else {
                rows = number(size, "start", needed(size, "start"));
            }
            if (!(rows >= 0 && rows <= static_cast<double>(largest_array)) || rows != std::floor(rows))
                refuse(size, "'" + v.name + "' has a size of " + number_text(rows) + ", which cannot be");
            v.dimensions.push_back(static_cast<int>(rows));
            count *= v.dimensions.back();
            if (count > largest_array)
                refuse(size, "'" + v.name + "' has more elements than fit into memory");
        }
        elements_ += count;
        if (elements_ > all_elements)
            refuse(places[i], "its variables have more elements than fit into memory");
        // What the FMU has then is not known here: parameters must be given, as NaN is no value of theirs.
        if (is_changed && v.start.size() > 1)
            v.start = {v.causality == Causality::parameter &&
                               (v.type == Type::float64 || v.type == Type::float32)
                           ? std::numeric_limits<double>::quiet_NaN()
                           : 0.0};
        if (v.start.size() == 1 && count != 1)
            v.start.assign(static_cast<std::size_t>(count), v.start.front());
        if (!v.start.empty() && v.start.size() != static_cast<std::size_t>(count))
            refuse(places[i], "'" + v.name + "' has " + std::to_string(count) + " elements, but " +
                                  std::to_string(v.start.size()) + " start values" +
                                  section("2.2.7", "2.4.7"));
        const std::string derivative = text(places[i], "derivative");
        if (!derivative.empty()) v.derivative_of = variable_of(places[i], "derivative", derivative);
        for (const auto& word : words(text(places[i], "clocks"))) {
            v.clocks.push_back(variable_of(places[i], "clocks", word));
            const auto& clock = d_.variables[static_cast<std::size_t>(v.clocks.back())];
            if (clock.type != Type::clock)
                refuse(places[i], "'" + shown(v.name) + "' has the clock '" + shown(clock.name) +
                                      "', which is none" + section("", "2.4.7"));
        }
    }
}

/// Structural parameters have the values that the importer gives them in the Configuration Mode (FMI 3.0,
/// section 2.4.7.5.1).
void Reader::set_structure() {
    for (const auto& [name, value] : structure_) {
        const auto is_structural = [](const Variable& v) {
            return v.causality == Causality::structural_parameter && v.type == Type::uint64;
        };
        const auto found =
            std::find_if(d_.variables.begin(), d_.variables.end(), [&, &wanted = name](const Variable& v) {
                return v.name == wanted && is_structural(v);
            });
        if (found == d_.variables.end()) {
            std::string known;
            for (const auto& v : d_.variables)
                if (is_structural(v)) known += (known.empty() ? "" : ", ") + v.name;
            refuse(nullptr, "'" + shown(name) + "' is no structural parameter; " +
                                (known.empty() ? std::string("it has none") : "there are: " + shown(known)));
        }
        const double minimum = std::max(0.0, found->minimum.value_or(0)),
                     maximum = found->maximum.value_or(static_cast<double>(largest_array));
        if (!(value >= minimum && value <= maximum) || value != std::floor(value))
            refuse(nullptr, "the structural parameter '" + shown(name) + "' must be a whole number from " +
                                number_text(minimum) + " to " + number_text(maximum) + ", but is " +
                                number_text(value));
        if (found->start != std::vector{value}) changed_.insert(name);
        found->start = {value};
    }
}

/// The variable that a structure of FMI 2.0 gives by its place, of 3.0 by its reference.
int Reader::variable_of(const Element* e, const char* name, const std::string& value) const {
    const std::uint32_t number = reference(e, name, value);
    if (d_.version == 2) {
        if (number < 1 || number > d_.variables.size())
            refuse(e, std::string("'") + name + "' is " + value + ", but there are " +
                          std::to_string(d_.variables.size()) + " variables" + section("2.2.8", "2.4.8"));
        return static_cast<int>(number) - 1;
    }
    const auto found = by_reference_.find(number);
    if (found == by_reference_.end())
        refuse(e, std::string("'") + name + "' is " + value + ", which is no variable's reference" +
                      section("2.2.8", "2.4.8"));
    return found->second;
}

void Reader::read_structure(const Element* root) {
    const auto* const list = root->FirstChildElement("ModelStructure");
    if (!list) refuse(root, "it has no <ModelStructure>" + section("2.2.8", "2.4.8"));
    const auto read = [&](const Element* first, const char* name, std::vector<Unknown>& to) {
        for (const auto* e = first; e; e = e->NextSiblingElement(name)) {
            const char* const number = d_.version == 2 ? "index" : "valueReference";
            Unknown u{variable_of(e, number, needed(e, number))};
            if (const char* by = e->Attribute("dependencies")) {
                u.dependencies.emplace();
                for (const auto& word : words(by))
                    u.dependencies->push_back(variable_of(e, "dependencies", word));
            }
            to.push_back(std::move(u));
        }
    };
    if (d_.version == 3) {
        read(list->FirstChildElement("Output"), "Output", d_.outputs);
        read(list->FirstChildElement("ContinuousStateDerivative"), "ContinuousStateDerivative",
             d_.derivatives);
        read(list->FirstChildElement("InitialUnknown"), "InitialUnknown", d_.initial_unknowns);
        for (const auto* e = list->FirstChildElement("EventIndicator"); e;
             e = e->NextSiblingElement("EventIndicator")) {
            d_.indicators.push_back(variable_of(e, "valueReference", needed(e, "valueReference")));
            d_.event_indicators += d_.variables[static_cast<std::size_t>(d_.indicators.back())].count();
        }
    } else {
        const auto group = [&](const char* name, std::vector<Unknown>& to) {
            if (const auto* all = list->FirstChildElement(name))
                read(all->FirstChildElement("Unknown"), "Unknown", to);
        };
        group("Outputs", d_.outputs);
        group("Derivatives", d_.derivatives);
        group("InitialUnknowns", d_.initial_unknowns);
    }
}

Description Reader::read(const std::string& xml) {
    tinyxml2::XMLDocument document;
    const auto* const root = parse(document, xml);
    if (!root || std::strcmp(root->Name(), "fmiModelDescription") != 0)
        refuse(root, "its root is no <fmiModelDescription> (FMI 3.0, section 2.4)");
    const std::string version = text(root, "fmiVersion");
    if (version != "2.0" && !version.starts_with("3."))
        refuse(root, "it is of FMI version '" + shown(version) +
                         "', but 2.0 and 3.0 are known; export it for one of these");
    d_.version = version == "2.0" ? 2 : 3;
    rule_of_attributes_ = section("2.2", "2.4"), rule_of_choices_ = section("2.2.7", "2.4.7");
    d_.name = needed(root, "modelName");
    d_.token = needed(root, d_.version == 2 ? "guid" : "instantiationToken");
    d_.doc = text(root, "description");
    d_.tool = text(root, "generationTool");
    if (d_.version == 2)
        d_.event_indicators = static_cast<int>(number(root, "numberOfEventIndicators").value_or(0));
    if (const auto* e = root->FirstChildElement("CoSimulation")) d_.co_simulation = interface(e);
    if (const auto* e = root->FirstChildElement("ModelExchange")) d_.model_exchange = interface(e);
    if (!d_.co_simulation && !d_.model_exchange)
        refuse(root, "it is neither for co-simulation nor for model exchange; export it for one of both" +
                         section("2.2.1", "2.4"));
    if (const auto* e = root->FirstChildElement("DefaultExperiment")) {
        d_.start = number(e, "startTime").value_or(0);
        d_.stop = number(e, "stopTime");
        d_.step = number(e, "stepSize");
    }
    read_types(root);
    read_variables(root);
    read_structure(root);
    return std::move(d_);
}

} // namespace

Description read_description(const std::string& xml, const std::string& fmu, const Structure& structure) {
    return Reader(fmu, structure).read(xml);
}

} // namespace bf::fmi

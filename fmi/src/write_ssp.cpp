// Systems as XML.
#include "bf/fmi/ssp.hpp"
#include "xml.hpp"

namespace bf::fmi {

namespace {

constexpr const char* parameter_file = "resources/parameters.ssv";

const char* type_of_1(Type type) {
    switch (type) {
    case Type::float64: return "Real";
    case Type::int32: return "Integer";
    case Type::boolean: return "Boolean";
    default: return nullptr;
    }
}

/// Does SSP 1.0 have all that is in it?
bool is_of_1(const SystemElement& e) {
    for (const auto& c : e.connectors)
        if (!c.dimensions.empty() || (c.type && !type_of_1(*c.type)) ||
            c.kind == Causality::structural_parameter)
            return false;
    for (const auto& p : e.parameters)
        if (!type_of_1(p.type) || p.values.size() != 1) return false;
    return std::all_of(e.elements.begin(), e.elements.end(), is_of_1);
}

std::string list_of(const std::vector<double>& values) {
    std::string text;
    for (const double x : values) text += (text.empty() ? "" : " ") + xml_number(x);
    return text;
}

class Writer {
  public:
    explicit Writer(const SystemStructure& structure)
        : its_(structure), is_1_(!structure.has_fmi_3 && is_of_1(structure.system)) {}

    std::string structure() {
        const std::string name = "SystemStructureDescription";
        std::string text = head(name, "xmlns:ssd=\"http://ssp-standard.org/SSP1/" + name + "\"") +
                           attribute("name", its_.name) + attribute("generationTool", "BlockFactory") + ">\n";
        text += element(its_.system, "  ", true);
        text += units("ssd");
        text += "  <ssd:DefaultExperiment" + attribute("startTime", xml_number(its_.start));
        if (its_.stop) text += attribute("stopTime", xml_number(*its_.stop));
        std::string record;
        for (const auto& signal : its_.record) record += "<record" + attribute("signal", signal) + "/>";
        text += ">\n" + annotation("    ", "experiment", its_.own, record) + "  </ssd:DefaultExperiment>\n";
        return text + "</ssd:SystemStructureDescription>\n";
    }

    std::string values() const {
        const std::string name = "SystemStructureParameterValues";
        std::string text =
            head("ParameterSet", "xmlns:ssv=\"http://ssp-standard.org/SSP1/" + name + "\"", "ssv") +
            attribute("name", its_.name) + ">\n  <ssv:Parameters>\n";
        for (const auto& p : its_.system.parameters) {
            text += "    <ssv:Parameter" + attribute("name", p.name) + "><ssv:" + type(p.type) +
                    attribute("value", p.type == Type::boolean ? truths(p.values) : list_of(p.values)) +
                    optional_attribute("unit", p.unit) + "/>";
            for (const int size : p.dimensions)
                text += "<ssc:Dimension" + attribute("size", std::to_string(size)) + "/>";
            text += "</ssv:Parameter>\n";
        }
        return text + "  </ssv:Parameters>\n" + units("ssv") + "</ssv:ParameterSet>\n";
    }

  private:
    std::string head(const std::string& root, const std::string& space,
                     const std::string& prefix = "ssd") const {
        return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<" + prefix + ":" + root + " " + space +
               " xmlns:ssc=\"http://ssp-standard.org/SSP1/SystemStructureCommon\"" +
               attribute("version", is_1_ ? "1.0" : "2.0");
    }
    std::string type(Type type) const { return is_1_ ? type_of_1(type) : type_names[static_cast<int>(type)]; }
    static std::string truths(const std::vector<double>& values) {
        std::string text;
        for (const double x : values)
            text += (text.empty() ? "" : " ") + std::string(x != 0 ? "true" : "false");
        return text;
    }

    std::string units(const std::string& prefix) const {
        if (its_.units.empty()) return "";
        std::string text = "  <" + prefix + ":Units>\n";
        for (const auto& [name, exponents] : its_.units) {
            text += "    <ssc:Unit" + attribute("name", name) + "><ssc:BaseUnit";
            for (std::size_t i = 0; i < 8; ++i)
                if (exponents[i] != 0) text += attribute(base_units[i], std::to_string(exponents[i]));
            text += "/></ssc:Unit>\n";
        }
        return text + "  </" + prefix + ":Units>\n";
    }

    static std::string annotation(const std::string& indent, const std::string& name,
                                  const std::map<std::string, std::string>& own,
                                  const std::string& inside = "") {
        if (own.empty() && inside.empty()) return "";
        std::string text = indent + "<ssd:Annotations>\n" + indent + "  <ssc:Annotation" +
                           attribute("type", own_annotation) + "><" + name;
        for (const auto& [key, value] : own) text += attribute(key.c_str(), value);
        return text + (inside.empty() ? "/>" : ">" + inside + "</" + name + ">") + "</ssc:Annotation>\n" +
               indent + "</ssd:Annotations>\n";
    }

    std::string connectors(const SystemElement& e, const std::string& indent) const {
        if (e.connectors.empty()) return "";
        std::string text = indent + "<ssd:Connectors>\n";
        for (const auto& c : e.connectors) {
            text += indent + "  <ssd:Connector" + attribute("name", c.name) +
                    attribute("kind", causality_names[static_cast<int>(c.kind)].first) + ">";
            if (c.type)
                text += "<ssc:" + type(*c.type) + optional_attribute("unit", c.unit) +
                        (c.ticks ? clock_attributes(*c.ticks) : "") + "/>";
            for (const int size : c.dimensions)
                text += "<ssc:Dimension" + attribute("size", std::to_string(size)) + "/>";
            for (const auto& clock : c.clocks) text += "<ssd:Clock" + attribute("name", clock) + "/>";
            text += "</ssd:Connector>\n";
        }
        return text + indent + "</ssd:Connectors>\n";
    }

    std::string element(const SystemElement& e, const std::string& indent, bool is_root = false) const {
        const std::string name = e.is_system ? "ssd:System" : "ssd:Component", inner = indent + "  ";
        std::string text =
            indent + "<" + name + optional_attribute("description", e.doc) + attribute("name", e.name);
        if (!e.is_system) {
            text += attribute("type", "application/x-fmu-sharedlibrary") +
                    attribute("source", escape::uri(e.source));
            if (e.kind)
                text += attribute("implementation",
                                  *e.kind == Kind::co_simulation ? "CoSimulation" : "ModelExchange");
        }
        text += ">\n" + connectors(e, inner);
        if (e.place) {
            text += inner + "<ssd:ElementGeometry" + attribute("x1", xml_number(e.place->x1)) +
                    attribute("y1", xml_number(e.place->y1)) + attribute("x2", xml_number(e.place->x2)) +
                    attribute("y2", xml_number(e.place->y2));
            if (e.place->rotation != 0) text += attribute("rotation", xml_number(e.place->rotation));
            text += "/>\n";
        }
        if (is_root && !e.parameters.empty())
            text += inner + "<ssd:ParameterBindings><ssd:ParameterBinding" +
                    attribute("source", parameter_file) + "/></ssd:ParameterBindings>\n";
        if (!e.elements.empty()) {
            text += inner + "<ssd:Elements>\n";
            for (const auto& its : e.elements) text += element(its, inner + "  ");
            text += inner + "</ssd:Elements>\n";
        }
        if (!e.wires.empty()) {
            text += inner + "<ssd:Connections>\n";
            for (const auto& its : e.wires) text += wire(its, inner + "  ");
            text += inner + "</ssd:Connections>\n";
        }
        text += annotation(inner, "element", e.own);
        return text + indent + "</" + name + ">\n";
    }

    /// The wires of a model carry numbers as they are.
    static std::string wire(const Wire& its, const std::string& indent) {
        std::string text = indent + "<ssd:Connection" + optional_attribute("startElement", its.from_element) +
                           attribute("startConnector", its.from) +
                           optional_attribute("endElement", its.to_element) +
                           attribute("endConnector", its.to) + attribute("suppressUnitConversion", "true");
        if (its.xs.empty()) return text + "/>\n";
        return text + "><ssd:ConnectionGeometry" + attribute("pointsX", list_of(its.xs)) +
               attribute("pointsY", list_of(its.ys)) + "/></ssd:Connection>\n";
    }

    const SystemStructure& its_;
    bool is_1_;
};

} // namespace

std::string to_ssd(const SystemStructure& structure) { return Writer(structure).structure(); }
std::string to_ssv(const SystemStructure& structure) { return Writer(structure).values(); }

} // namespace bf::fmi

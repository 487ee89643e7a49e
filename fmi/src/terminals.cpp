#include "bf/base/files.hpp"
#include "bf/fmi/check.hpp"
#include "xml.hpp"

#include <set>

namespace bf::fmi {

namespace {

namespace fs = std::filesystem;

const fs::path place = "terminalsAndIcons";

class TerminalsReader : XmlReader {
  public:
    TerminalsReader(const fs::path& folder, const std::string& fmu, const Description& d)
        : XmlReader(fmu, (place / "terminalsAndIcons.xml").string()), folder_(folder) {
        rule_of_attributes_ = rule_;
        for (const auto& v : d.variables) variables_.insert(v.name);
    }

    std::vector<std::string> problems() {
        try {
            tinyxml2::XMLDocument document;
            const auto* const root =
                parse(document, read_text_file(folder_ / place / "terminalsAndIcons.xml", description_limit));
            if (std::string_view(root->Name()) != "fmiTerminalsAndIcons")
                refuse(root, "its root is no <fmiTerminalsAndIcons>" + rule_);
            if (const auto* const picture = root->FirstChildElement("GraphicalRepresentation"))
                if (const auto* const icon = picture->FirstChildElement("Icon")) find_icon(icon, "icon");
            if (const auto* const all = root->FirstChildElement("Terminals")) read(all, "", 0);
        } catch (const FmuError& error) {
            problems_.emplace_back(error.what());
        }
        return std::move(problems_);
    }

  private:
    void add(const XmlNode* at, const std::string& what) {
        try {
            refuse(at, what + rule_);
        } catch (const FmuError& error) {
            problems_.emplace_back(error.what());
        }
    }

    /// Those of one terminal, or the outermost ones.
    void read(const XmlNode* e, const std::string& path, int depth) {
        if (depth > deepest) refuse(e, "terminals stand too deep in each other");
        std::set<std::string> names;
        for (const auto* t = e->FirstChildElement("Terminal"); t; t = t->NextSiblingElement("Terminal")) {
            const std::string name = path + needed(t, "name");
            if (!names.insert(name).second) add(t, "two terminals are called '" + shown(name) + "'");
            read_members(t, name, needed(t, "matchingRule"));
            if (const auto* const picture = t->FirstChildElement("TerminalGraphicalRepresentation"))
                find_icon(picture, needed(picture, "iconBaseName"));
            read(t, name + ".", depth + 1);
        }
    }

    void read_members(const XmlNode* terminal, const std::string& name, const std::string& rule) {
        // Plugs and buses are matched by the names of their members, sequences by their order.
        const bool by_names = rule == "plug" || rule == "bus";
        std::set<std::string> members;
        const auto member = [&](const XmlNode* e, const char* attribute) {
            const std::string its = text(e, attribute);
            if (its.empty() && by_names)
                add(e, "a member of the terminal '" + shown(name) + "' has no '" + attribute +
                           "', by which terminals of the rule '" + rule + "' are matched");
            if (!its.empty() && !members.insert(its).second)
                add(e, "two members of the terminal '" + shown(name) + "' are called '" + shown(its) + "'");
        };
        const auto variable = [&](const XmlNode* e, const char* attribute) {
            if (const std::string its = needed(e, attribute); !variables_.contains(its))
                add(e, "the terminal '" + shown(name) + "' has the variable '" + shown(its) +
                           "', which the FMU has not");
        };
        for (const auto* e = terminal->FirstChildElement(); e; e = e->NextSiblingElement()) {
            if (std::string_view(e->Name()) == "TerminalMemberVariable") {
                variable(e, "variableName");
                member(e, "memberName");
                static_cast<void>(needed(e, "variableKind"));
            } else if (std::string_view(e->Name()) == "TerminalStreamMemberVariable") {
                variable(e, "inStreamVariableName");
                variable(e, "outStreamVariableName");
                member(e, "inStreamMemberName");
                member(e, "outStreamMemberName");
            }
        }
    }

    void find_icon(const XmlNode* e, const std::string& base) {
        const std::string name = base + ".png";
        std::error_code error;
        if (name.find_first_of(std::string_view("/\\\0", 3)) != std::string::npos ||
            !fs::is_regular_file(folder_ / place / name, error))
            add(e, "there is no picture '" + (place / shown(name)).string() + "' beside it");
    }

    static constexpr int deepest = 100;
    const std::string rule_ = " (FMI 3.0, section 2.4.9)";
    const fs::path& folder_;
    std::set<std::string> variables_;
    std::vector<std::string> problems_;
};

} // namespace

std::vector<std::string> problems_of_terminals(const fs::path& folder, const std::string& fmu,
                                               const Description& d) {
    std::error_code error;
    if (d.version == 2 || !fs::exists(folder / place / "terminalsAndIcons.xml", error)) return {};
    return TerminalsReader(folder, fmu, d).problems();
}

} // namespace bf::fmi

// Reference pages in Markdown.
#include "reference.hpp"

#include "bf/base/escape.hpp"

#include <algorithm>

namespace bf::tools {

namespace {

using Cells = std::vector<std::string>;

using escape::markdown;
constexpr auto code = escape::markdown_code;

/// Columns that are empty in all rows are left out.
std::string table(const Cells& heads, const std::vector<Cells>& rows) {
    const auto line = [&](const Cells& cells) {
        std::string text = "|";
        for (std::size_t i = 0; i < heads.size(); ++i) {
            const bool is_used =
                std::any_of(rows.begin(), rows.end(), [&](const Cells& row) { return !row[i].empty(); });
            if (is_used) text += " " + cells[i] + " |";
        }
        return text + "\n";
    };
    std::string text = line(heads) + line(Cells(heads.size(), "---"));
    for (const auto& row : rows) text += line(row);
    return text + "\n";
}

std::string argument_table(const Declared& block) {
    std::vector<Cells> rows;
    for (const auto& a : block.arguments) {
        std::string choices;
        for (const auto& choice : a.choices) choices += (choices.empty() ? "one of " : ", ") + code(choice);
        const std::string doc = markdown(with_limits(a.doc, a.limits));
        rows.push_back({code(a.name), a.type, code(a.initial),
                        doc + (doc.empty() || choices.empty() ? "" : "; ") + choices});
    }
    return rows.empty() ? "" : table({"argument", "type", "default", "meaning"}, rows);
}

std::string quantity_table(const Declared& block, Role role, const std::string& head) {
    std::vector<Cells> rows;
    for (const auto& q : block.quantities)
        if (q.role == role)
            rows.push_back({code(q.name), q.size, q.type, markdown(q.unit), code(q.initial),
                            markdown(with_limits(q.doc, q.limits, q.at_least)), code(q.condition)});
    const char* initial = is_state(role) ? "at the start" : role == Role::input ? "unconnected" : "default";
    return rows.empty() ? "" : table({head, "size", "type", "unit", initial, "meaning", "only with"}, rows);
}

std::string section(const Declared& block) {
    std::string text = "### " + block.name + "\n\n" + markdown(block.doc) + "\n\n" + argument_table(block);
    for (const auto& [role, heading] : shown_roles) {
        std::string head = heading;
        head.pop_back(); // the plural's s
        text += quantity_table(block, role, head);
    }
    for (const auto& need : block.needs)
        text += "Needs a block around it that provides a " + code(need.type) +
                (need.doc.empty() ? "" : ": " + markdown(need.doc)) + ".\n\n";
    for (const auto& provided : block.provides)
        text += "Provides a " + code(provided.type) + " to the blocks around it.\n\n";
    return text;
}

std::string anchor(const std::string& heading) {
    std::string text;
    for (const char c : heading) text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

} // namespace

std::string reference_page(const std::string& library, const std::vector<Declared>& blocks) {
    const std::string title = library.empty() ? "Standard blocks" : library;
    std::string text =
        "# " + title + "\n\n" + "What each block declares, written by `bf describe --markdown " +
        (library.empty() ? "standard" : library) +
        "` (scripts/update-reference). Arguments are fixed when a block is made; parameters may change "
        "between two steps; a model gives both as settings. Sizes: `scalar`, `n` a 1-D signal of n "
        "elements, `n x m` a matrix, `any` is decided by the wiring.\n\n";
    if (!library.empty()) text += "A model calls them `" + library + "/NAME`.\n\n";
    std::string index, body, group;
    for (const auto& block : blocks) {
        if (block.group != group || body.empty()) {
            group = block.group;
            index += (index.empty() ? "**" : "\n**") + markdown(group) + "**\n\n";
            body += "## Group " + markdown(group) + "\n\n";
        }
        index += "- [" + block.name + "](#" + anchor(block.name) +
                 "): " + markdown(first_sentence(block.doc)) + "\n";
        body += section(block);
    }
    text += index + "\n" + body;
    text.pop_back(); // one line break at the end
    return text;
}

} // namespace bf::tools

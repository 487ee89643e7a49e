#include "bf/formats/yaml.hpp"
#include "flow.hpp"
#include "keys.hpp"
#include "scalar.hpp"

#include <algorithm>

namespace bf::formats {
namespace {

using namespace model;

constexpr std::size_t max_width = 110;
const Comments no_comments;

/// What is to be written, before it is decided what stands on one line.
struct Item {
    struct Content {
        enum class Kind { scalar, literal, raw, list, map };

        Kind kind = Kind::scalar;
        std::string text = {}; ///< of a scalar, ready to print; of a literal, as it is; raw: follows the ':'
        bool may_flow = true;  ///< whether it may stand in braces
        std::vector<Item> items = {}; ///< of lists (keys empty) and maps
    };
    std::string key;
    Content content;
    const Comments* comments = &no_comments;
};
using Content = Item::Content;

class Printer {
  public:
    std::string text;

    void print(const Item& item, int indent) {
        print_lines(item.comments->before, indent);
        const Content& content = item.content;
        text.append(indent, ' ');
        text += item.key.empty() ? "-" : item.key + ":";
        const std::size_t column = indent + width(item.key) + 2;
        switch (content.kind) {
        case Content::Kind::raw: text += content.text; return end_line({});
        case Content::Kind::scalar: return print_scalar(content.text, column, item.comments->trailing);
        case Content::Kind::literal: return print_literal(content.text, indent + 2, item.comments->trailing);
        default: break;
        }
        const bool empty = content.items.empty();
        const std::string line = empty || may_flow(content) ? flow(content) : "";
        if (empty || (!line.empty() && column + width(line) <= max_width)) {
            text += " " + line;
            return end_line(item.comments->trailing);
        }
        end_line(item.comments->trailing);
        for (const Item& inner : content.items) print(inner, indent + 2);
    }

    void print_lines(const std::vector<std::string>& lines, int indent) {
        for (const std::string& line : lines)
            text += line.empty() ? "\n" : std::string(indent, ' ') + line + "\n";
    }

  private:
    void end_line(const std::string& trailing) {
        if (!trailing.empty()) text += (trailing[0] == '#' ? "  " : "") + trailing;
        text += '\n';
    }

    /// A scalar, whose further lines (of a matrix) stand under its first element. The comment follows the
    /// last line: a line that ends with ';' goes on behind the break, where YAML allows none.
    void print_scalar(std::string_view scalar, std::size_t column, const std::string& trailing) {
        text += ' ';
        for (char c : scalar) {
            text += c;
            if (c == '\n') text.append(column + 1, ' ');
        }
        end_line(trailing);
    }

    void print_literal(std::string_view lines, int indent, const std::string& trailing) {
        const bool ends = lines.ends_with('\n');
        text += ends ? " |" : " |-";
        end_line(trailing);
        if (ends) lines.remove_suffix(1);
        for (std::size_t begin = 0; begin <= lines.size();) {
            const std::size_t end = std::min(lines.find('\n', begin), lines.size());
            if (end > begin) text.append(indent, ' ');
            text += lines.substr(begin, end - begin);
            text += '\n';
            begin = end + 1;
        }
    }

    static bool may_flow(const Content& content) {
        return content.may_flow && content.kind != Content::Kind::literal &&
               std::ranges::all_of(content.items, [](const Item& inner) {
                   return inner.comments->empty() && may_flow(inner.content);
               });
    }

    static std::string flow(const Content& content) {
        if (content.kind == Content::Kind::scalar) return content.text;
        const bool map = content.kind == Content::Kind::map;
        std::string line = map ? "{" : "[";
        for (const Item& inner : content.items)
            line += (line.size() > 1 ? ", " : "") + (map ? inner.key + ": " : "") + flow(inner.content);
        return line + (map ? "}" : "]");
    }
};

Content scalar(std::string_view text, bool flow_too = true) {
    if (flow_too && is_plain(text, true)) return {.text = std::string(text)};
    if (is_plain(text, false)) return {.text = std::string(text), .may_flow = false};
    return {.text = double_quoted(text)};
}

Content name_scalar(std::string_view name) { return {.text = key_text(name)}; }

Content text_content(std::string text) {
    while (text.ends_with('\n')) text.pop_back();
    const bool lines = text.find('\n') != text.npos && is_literal(text);
    return lines ? Content{.kind = Content::Kind::literal, .text = text + "\n"} : scalar(text);
}

/// Whether `text` is a whole MATLAB char array, which YAML's single quotes read the same way.
bool is_char_array(std::string_view text) {
    if (text.size() < 2 || text.front() != '\'' || text.back() != '\'') return false;
    for (std::size_t i = 1; i + 1 < text.size(); ++i)
        if (text[i] == '\'' && (i + 2 >= text.size() || text[++i] != '\'')) return false;
    return std::ranges::all_of(text, [](unsigned char c) { return c >= 0x20 && c != 0x7f; });
}

Content expression(const Expression& value) {
    if (!value.spelling.empty())
        return {.text = value.spelling, .may_flow = value.spelling.find('\n') == std::string::npos};
    const std::string matlab = value.matlab();
    if (value.quotes == Quotes::literal && is_literal(value.text))
        return {.kind = Content::Kind::literal, .text = value.text};
    if (value.quotes == Quotes::single || value.quotes == Quotes::none)
        if (is_char_array(matlab)) return {.text = matlab};
    if (value.quotes == Quotes::none) return is_flow_text(matlab) ? Content{.text = matlab} : scalar(matlab);
    return {.text = double_quoted(matlab)};
}

Content choice(const keys::Keys& choices, auto value) {
    return {.text = choices[static_cast<std::size_t>(value)]};
}

/// The items in the document's order; one the document does not have follows its canonical predecessor.
std::vector<Item> ordered(std::vector<Item> canonical, const std::vector<Key>& recorded) {
    std::vector<Item> items;
    std::vector<std::string> names;
    for (const Item& item : canonical) names.push_back(item.key);
    for (const Key& key : recorded) {
        const auto found = std::ranges::find(canonical, key_text(key.name), &Item::key);
        if (found == canonical.end() || std::ranges::find(items, found->key, &Item::key) != items.end())
            continue;
        items.push_back(*found);
        items.back().comments = &key.comments;
    }
    auto place = items.begin();
    for (Item& item : canonical) {
        const auto found = std::ranges::find(items, item.key, &Item::key);
        place = std::next(found != items.end() ? found : items.insert(place, std::move(item)));
    }
    return items;
}

/// Collects the keys of a mapping: those with a value, and those the document has anyway.
class MapBuilder {
  public:
    explicit MapBuilder(const std::vector<Key>& recorded) : recorded_(recorded) {}

    bool wanted(std::string_view key, bool has_value) const {
        return has_value ||
               std::ranges::any_of(recorded_, [&](const Key& known) { return known.name == key; });
    }
    void add(std::string_view key, Content content) { items_.push_back({key_text(key), std::move(content)}); }
    void add(std::string_view key, const std::optional<Expression>& value) {
        if (value) add(key, expression(*value));
    }
    void add_text(std::string_view key, const std::string& text) {
        if (wanted(key, !text.empty())) add(key, text_content(text));
    }
    Content build(bool may_flow) {
        return {
            .kind = Content::Kind::map, .may_flow = may_flow, .items = ordered(std::move(items_), recorded_)};
    }

  private:
    const std::vector<Key>& recorded_;
    std::vector<Item> items_;
};

template <typename Item_> Content list(const std::vector<Item_>& items, std::string Item_::*member) {
    Content content{.kind = Content::Kind::list};
    for (const Item_& item : items) content.items.push_back({"", name_scalar(item.*member), &item.comments});
    return content;
}

Content variables(const std::vector<Variable>& all, bool may_flow);

Content variable(const Variable& variable) {
    if (!variable.fields.empty()) return variables(variable.fields, true);
    if (!variable.minimum && !variable.above && !variable.maximum && variable.unit.empty() &&
        variable.doc.empty())
        return expression(variable.value);
    const std::vector<Key> none;
    MapBuilder map(none);
    map.add("value", expression(variable.value));
    map.add("minimum", variable.minimum);
    map.add("above", variable.above);
    map.add("maximum", variable.maximum);
    map.add_text("unit", variable.unit);
    map.add_text("doc", variable.doc);
    return map.build(true);
}

Content variables(const std::vector<Variable>& all, bool may_flow) {
    Content content{.kind = Content::Kind::map, .may_flow = may_flow};
    for (const Variable& each : all)
        content.items.push_back({key_text(each.name), variable(each), &each.comments});
    return content;
}

Content enumerations(const std::vector<Variable>& all) {
    Content content{.kind = Content::Kind::map, .may_flow = false};
    for (const Variable& enumeration : all) {
        const auto& fields = enumeration.fields;
        const bool is_list =
            std::ranges::all_of(fields, [](const Variable& f) { return f.value.text.empty(); });
        content.items.push_back({key_text(enumeration.name),
                                 is_list ? list(fields, &Variable::name) : variables(fields, true),
                                 &enumeration.comments});
    }
    return content;
}

Content port(const Port& port) {
    const std::vector<Key> none;
    MapBuilder map(none);
    map.add("shape", port.shape);
    map.add_text("type", port.type);
    map.add_text("unit", port.unit);
    map.add_text("doc", port.doc);
    if (port.when_disabled != WhenDisabled::held)
        map.add("when_disabled", choice(keys::held_or_reset, port.when_disabled));
    map.add("initial", port.initial);
    if (port.each) map.add("each", Content{.text = "true"});
    return map.build(true);
}

Content ports(const std::vector<Port>& all) {
    Content map{.kind = Content::Kind::map, .may_flow = false};
    bool bare = true;
    for (const Port& p : all) {
        map.items.push_back({key_text(p.name), port(p), &p.comments});
        bare = bare && map.items.back().content.items.empty();
    }
    return bare ? list(all, &Port::name) : map;
}

Content connections(const std::vector<Connection>& all) {
    Content map{.kind = Content::Kind::map, .may_flow = false};
    for (const Connection& connection : all) {
        Content to{.kind = Content::Kind::list};
        for (const Endpoint& end : connection.to)
            to.items.push_back({"", name_scalar(end.text()), &end.comments});
        if (to.items.size() == 1 && to.items[0].comments->empty()) to = Content(to.items[0].content);
        map.items.push_back({key_text(connection.from.text()), std::move(to), &connection.comments});
    }
    return map;
}

Content block(const Block& block);

void add_system(MapBuilder& map, const System& system, bool needs_blocks) {
    if (map.wanted("execution", system.execution != Execution::plain))
        map.add("execution", choice(keys::executions, system.execution));
    if (map.wanted("states", system.states != States::held))
        map.add("states", choice(keys::held_or_reset, system.states));
    if (map.wanted("trigger", system.trigger != Edge::rising))
        map.add("trigger", choice(keys::triggers, system.trigger));
    if (system.reset) map.add("reset", choice(keys::resets, *system.reset));
    map.add("iterations", system.iterations);
    if (map.wanted("inputs", !system.inputs.empty())) map.add("inputs", ports(system.inputs));
    if (map.wanted("outputs", !system.outputs.empty())) map.add("outputs", ports(system.outputs));
    if (map.wanted("enumerations", !system.enumerations.empty()))
        map.add("enumerations", enumerations(system.enumerations));
    if (map.wanted("variables", !system.variables.empty()))
        map.add("variables", variables(system.variables, false));
    if (map.wanted("blocks", needs_blocks || !system.blocks.empty())) {
        Content blocks{.kind = Content::Kind::map, .may_flow = false};
        for (const Block& inner : system.blocks)
            blocks.items.push_back({key_text(inner.name), block(inner), &inner.comments});
        map.add("blocks", std::move(blocks));
    }
    if (map.wanted("connections", !system.connections.empty()))
        map.add("connections", connections(system.connections));
}

Content block(const Block& block) {
    MapBuilder map(block.keys);
    if (block.is_library_block()) map.add("block", name_scalar(block.type));
    if (block.reference) {
        map.add("file", scalar(block.reference->file));
        if (map.wanted("with", !block.reference->with.empty()))
            map.add("with", variables(block.reference->with, true));
    }
    map.add_text("doc", block.doc);
    map.add("when", block.when);
    map.add("period", block.period);
    map.add("offset", block.offset);
    for (const Setting& setting : block.settings) map.add(setting.name, expression(setting.value));
    if (block.system) add_system(map, *block.system, true);
    return map.build(!block.system);
}

} // namespace

std::string write_yaml(const Model& model) {
    MapBuilder map(model.keys);
    map.add("model", name_scalar(model.name));
    map.add_text("doc", model.doc);
    if (map.wanted("plugins", !model.plugins.empty())) map.add("plugins", list(model.plugins, &Plugin::name));
    map.add("step", model.step);
    map.add("stop", model.stop);
    map.add("solver", model.solver);
    map.add("relative_tolerance", model.relative_tolerance);
    map.add("absolute_tolerance", model.absolute_tolerance);
    map.add("max_step", model.max_step);
    if (map.wanted("rate_transitions", model.rate_transitions != RateTransitions::allowed))
        map.add("rate_transitions", choice(keys::rate_transitions, model.rate_transitions));
    if (map.wanted("algebraic_loops", model.algebraic_loops != AlgebraicLoops::error))
        map.add("algebraic_loops", choice(keys::algebraic_loops, model.algebraic_loops));
    if (map.wanted("non_finite", model.non_finite != NonFinite::allowed))
        map.add("non_finite", choice(keys::non_finite, model.non_finite));
    add_system(map, model.root, false);
    if (model.record_all)
        map.add("record", Content{.text = "all"});
    else if (map.wanted("record", !model.record.empty()))
        map.add("record", list(model.record, &Signal::path));
    if (map.wanted("plots", !model.plots.empty())) {
        Content plots{.kind = Content::Kind::map, .may_flow = false};
        for (const Panel& panel : model.plots)
            plots.items.push_back(
                {key_text(panel.title), list(panel.signals, &Signal::path), &panel.comments});
        map.add("plots", std::move(plots));
    }
    if (!model.layout.empty()) map.add("layout", {.kind = Content::Kind::raw, .text = model.layout});
    Printer printer;
    for (const Item& item : map.build(false).items) printer.print(item, 0);
    printer.print_lines(model.end, 0);
    return std::move(printer.text);
}

} // namespace bf::formats

#include "bf/formats/yaml.hpp"
#include "content.hpp"
#include "flow.hpp"
#include "keys.hpp"
#include "mapping.hpp"
#include "printer.hpp"
#include "scalar.hpp"

#include "bf/base/numbers.hpp"
#include "bf/model/chart.hpp"

#include <algorithm>

namespace bf::formats {
namespace {

using namespace model;

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

Content spelled(const Expression& value) {
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

Content expression(const Expression& value) {
    Content content = spelled(value);
    content.value = &value;
    return content;
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
        items.back().where = &key.where;
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
    for (const Item_& item : items)
        content.items.push_back({"", name_scalar(item.*member), &item.comments, &item.where});
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
        content.items.push_back({key_text(each.name), variable(each), &each.comments, &each.where});
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
                                 &enumeration.comments, &enumeration.where});
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
        map.items.push_back({key_text(p.name), port(p), &p.comments, &p.where});
        bare = bare && map.items.back().content.items.empty();
    }
    return bare ? list(all, &Port::name) : map;
}

Content connections(const std::vector<Connection>& all) {
    Content map{.kind = Content::Kind::map, .may_flow = false};
    for (const Connection& connection : all) {
        Content to{.kind = Content::Kind::list};
        for (const Endpoint& end : connection.to)
            to.items.push_back({"", name_scalar(end.text()), &end.comments, &end.where});
        if (to.items.size() == 1 && to.items[0].comments->empty()) to = Content(to.items[0].content);
        map.items.push_back(
            {key_text(connection.from.text()), std::move(to), &connection.comments, &connection.where});
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
    map.add_text("icon", system.icon);
    if (map.wanted("inputs", !system.inputs.empty())) map.add("inputs", ports(system.inputs));
    if (map.wanted("outputs", !system.outputs.empty())) map.add("outputs", ports(system.outputs));
    if (map.wanted("enumerations", !system.enumerations.empty()))
        map.add("enumerations", enumerations(system.enumerations));
    if (map.wanted("variables", !system.variables.empty()))
        map.add("variables", variables(system.variables, false));
    if (map.wanted("blocks", needs_blocks || !system.blocks.empty())) {
        Content blocks{.kind = Content::Kind::map, .may_flow = false};
        for (const Block& inner : system.blocks)
            blocks.items.push_back({key_text(inner.name), block(inner), &inner.comments, &inner.where});
        map.add("blocks", std::move(blocks));
    }
    if (map.wanted("connections", !system.connections.empty()))
        map.add("connections", connections(system.connections));
    if (map.wanted("signals", !system.signals.empty())) {
        Content signals{.kind = Content::Kind::map, .may_flow = false};
        for (const NamedSignal& signal : system.signals)
            signals.items.push_back(
                {key_text(signal.name), name_scalar(signal.of.text()), &signal.comments, &signal.where});
        map.add("signals", std::move(signals));
    }
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
    for (const Setting& setting : block.settings)
        map.add(setting.name, has_chart(block) && setting.name == chart_setting && is_mapping(setting.value)
                                  ? mapping_content(setting.value)
                                  : expression(setting.value));
    if (block.system) add_system(map, *block.system, true);
    return map.build(!block.system);
}

std::string coordinate(double x) { return number_text(x + 0.0); } // -0 is 0 here

void add_extent(MapBuilder& map, const Point& at, const std::optional<Point>& size) {
    map.add("x", Content{.text = coordinate(at.x)});
    map.add("y", Content{.text = coordinate(at.y)});
    if (!size) return;
    map.add("width", Content{.text = coordinate(size->x)});
    map.add("height", Content{.text = coordinate(size->y)});
}

Content layout(const Layout& layout) {
    const std::vector<Key> none;
    const auto part = [] { return Content{.kind = Content::Kind::map, .may_flow = false}; };
    Content blocks = part(), wires = part(), notes = part(), displays = part();
    for (const Placement& drawn : layout.blocks) {
        MapBuilder map(none);
        add_extent(map, drawn.at, drawn.size);
        if (drawn.flipped) map.add("flipped", Content{.text = "true"});
        if (drawn.rotated != Rotation::none)
            map.add("rotated",
                    Content{.text = choices::rotations.at(static_cast<std::size_t>(drawn.rotated))});
        if (!drawn.sides.empty()) {
            MapBuilder sides(none);
            for (const auto& [port, side] : drawn.sides)
                sides.add(port, Content{.text = choices::sides.at(static_cast<std::size_t>(side))});
            map.add("sides", sides.build(true));
        }
        blocks.items.push_back({key_text(drawn.path), map.build(true), &drawn.comments, &drawn.where});
    }
    for (const Bends& bends : layout.wires) {
        Content drawn{.kind = Content::Kind::list};
        for (const Point& point : bends.points)
            drawn.items.push_back(
                {"", {.text = "[" + coordinate(point.x) + ", " + coordinate(point.y) + "]"}});
        if (bends.as_labels) drawn = {.text = std::string(keys::labels)};
        wires.items.push_back({key_text(bends.path), std::move(drawn), &bends.comments, &bends.where});
    }
    for (const Note& note : layout.notes) {
        MapBuilder map(none);
        map.add_text("text", note.text);
        map.add_text("image", note.image);
        map.add_text("in", note.system);
        add_extent(map, note.at, note.size);
        notes.items.push_back({key_text(note.name), map.build(true), &note.comments, &note.where});
    }
    for (const Display& display : layout.displays) {
        MapBuilder map(none);
        map.add("shows", Content{.text = choices::shows.at(static_cast<std::size_t>(display.shows))});
        map.add("signals", list(display.signals, &Signal::path));
        displays.items.push_back(
            {key_text(display.name), map.build(true), &display.comments, &display.where});
    }
    MapBuilder map(layout.keys);
    if (map.wanted("blocks", !layout.blocks.empty())) map.add("blocks", std::move(blocks));
    if (map.wanted("wires", !layout.wires.empty())) map.add("wires", std::move(wires));
    if (map.wanted("notes", !layout.notes.empty())) map.add("notes", std::move(notes));
    if (map.wanted("displays", !layout.displays.empty())) map.add("displays", std::move(displays));
    return map.build(false);
}

} // namespace

Content content_of(const Model& model) {
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
                {key_text(panel.title), list(panel.signals, &Signal::path), &panel.comments, &panel.where});
        map.add("plots", std::move(plots));
    }
    if (map.wanted("layout", !model.layout.empty())) map.add("layout", layout(model.layout));
    return map.build(false);
}

std::string canonical_yaml(const Model& model) {
    Printer printer;
    const Content content = content_of(model);
    for (const Item& item : content.items) printer.print(item, 0);
    printer.print_lines(model.end, 0);
    return std::move(printer.text);
}

std::string write_yaml(const Model& model) {
    if (model.source)
        if (std::optional<std::string> text = edited_yaml(model)) return std::move(*text);
    return canonical_yaml(model);
}

} // namespace bf::formats

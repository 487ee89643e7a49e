#include "reader.hpp"

#include "flow.hpp"
#include "mapping.hpp"

#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/model/chart.hpp"
#include "bf/model/suggest.hpp"

#include <algorithm>
#include <unordered_map>

namespace bf::formats {

using namespace model;

/// Calls `on_entry` with each key and value; reports what is no mapping, keys that are no text, and second
/// ones.
void Reader::read_entries(const Node& map, const std::string& path, const std::string& what,
                          const OnEntry& on_entry) {
    if (!map.is_map())
        return report(map, path, "expected " + what + ", a mapping",
                      map.is_sequence() ? "write `key: value` lines without '-'"
                                        : "write `key: value` lines");
    std::unordered_map<std::string_view, const Node*> seen;
    for (std::size_t i = 0; i < map.items.size(); i += 2) {
        const Node &key = map.items[i], &value = map.items[i + 1];
        if (!key.is_scalar() || key.text.empty()) {
            report(key, path, "a key that is no text", "put the key in double quotes");
            continue;
        }
        const auto [first, is_new] = seen.try_emplace(key.text, &key);
        if (!is_new) {
            report(key, path, "a second '" + key.text + "'",
                   "remove or rename one; the first is at " + at(*first->second).text());
            continue;
        }
        if (map.flow && value.is_null() && i > 0) {
            const Node& last = map.items[i - 1];
            if (last.is_scalar() && !last.quoted() &&
                std::ranges::count(last.text, '(') > std::ranges::count(last.text, ')')) {
                report(last, path, "the ',' ends the value '" + last.text + "'",
                       "put the expression in double quotes: \"" + last.text + ", " + key.text + "\"");
                continue;
            }
        }
        on_entry(key, value);
    }
}

void Reader::report_unknown(const Node& key, const std::string& path, const std::string& of,
                            const keys::Keys& known) {
    report(key, path, "unknown key '" + key.text + "' of " + of, name_remedy(key.text, known));
}

std::string Reader::read_text(const Node& key, const Node& value, const std::string& path) {
    if (!value.is_scalar()) {
        report(value, path, "'" + key.text + "' is a text", "write it on one line or after '|'");
        return {};
    }
    std::string text = value.text;
    while (text.ends_with('\n')) text.pop_back();
    return text;
}

std::size_t Reader::read_choice(const Node& key, const Node& value, const std::string& path,
                                const keys::Keys& choices) {
    const std::string text = value.is_scalar() ? value.text : "";
    const auto found = std::ranges::find(choices, text);
    if (found != choices.end()) return found - choices.begin();
    std::string all;
    for (const std::string& choice : choices) all += (all.empty() ? "" : ", ") + choice;
    report(value, path, "'" + key.text + "' is '" + text + "'", "it is one of: " + all);
    return 0;
}

/// Whether a map is MATLAB's cell array: {}, {'a', 'b'}.
bool Reader::is_cell(const Node& map) const {
    bool cell = map.flow && source_.text[map.position] == '{';
    for (std::size_t i = 1; i < map.items.size(); i += 2) cell = cell && map.items[i].is_null();
    return cell;
}

Expression Reader::read_flow(const Node& value, const std::string& path) {
    const std::string_view text = source_.text;
    const std::size_t end = std::min(flow_end(text, value.position), text.size());
    const std::string_view slice = text.substr(value.position, end - value.position);
    const std::vector<std::string> lines = flow_lines(slice);
    values.push_back({value.line, source_.line_of(end - 1)});
    if (ambiguous_break(lines) < lines.size())
        report(value, path,
               "a line of the matrix ends without ',' or ';', after '" + lines[ambiguous_break(lines)] + "'",
               "end it with ';' for a new row or with ',' for the same row");
    const std::string written = join_flow_lines(lines);
    Expression expression{.text = written, .where = at(value)};
    std::string spelling;
    for (const std::string& line : lines) spelling += (spelling.empty() ? "" : "\n") + line;
    const std::string matrix = matrix_of_rows(written);
    if (!matrix.empty()) expression.text = matrix;
    const std::vector<std::string_view> rows = flow_items(written);
    if (!matrix.empty() && std::ranges::any_of(rows, [](auto row) { return !matrix_of_rows(row).empty(); }))
        report(value, path, "sequences nested more than twice", "a matrix is a sequence of rows");
    if (spelling != expression.text) expression.spelling = spelling;
    const std::vector<std::string_view> ended = flow_items(slice, ';');
    if (matrix.empty() && ended.size() > 1)
        expression.rows = at(ended);
    else if (value.is_sequence())
        expression.rows = at(value.items);
    return expression;
}

constexpr std::size_t most_rows = 1000; // of longer lists, which programs write, no places are kept

std::vector<Location> Reader::at(const std::vector<Node>& items) const {
    std::vector<Location> places;
    if (items.size() > most_rows) return places;
    for (const Node& item : items) places.push_back(at(item));
    return places;
}

std::vector<Location> Reader::at(const std::vector<std::string_view>& parts) const {
    std::vector<Location> places;
    if (parts.size() > most_rows) return places;
    for (const std::string_view part : parts)
        places.push_back(source_.at(static_cast<std::size_t>(part.data() - source_.text.data())));
    return places;
}

/// Rows of a matrix in double quotes or on lines after '|'.
std::vector<Location> Reader::rows_of_text(const Node& value) const {
    const std::string_view written =
        std::string_view(source_.text).substr(value.position, value.end - value.position);
    const std::size_t open = written.find('[');
    if (!value.text.starts_with('[') || open == written.npos || written.find('\\') != written.npos) return {};
    std::vector<std::string_view> rows = flow_items(written.substr(open), ';');
    if (rows.size() > 1 || value.quotes != Quotes::literal) return at(rows);
    rows.clear(); // which end with their lines
    for (std::size_t begin = open + 1; begin < written.size();) {
        const std::size_t end = std::min(written.find('\n', begin), written.size());
        const std::size_t first = written.find_first_not_of(" \t];", begin);
        if (first < end) rows.push_back(written.substr(first, end - first));
        begin = end + 1;
    }
    return at(rows);
}

/// A block sequence: a row, or the rows of a matrix.
Expression Reader::read_rows(const Node& key, const Node& value, const std::string& path) {
    std::string text;
    for (const Node& item : value.items) {
        const std::string element = read_expression(key, item, path).matlab();
        const bool row = item.is_sequence() && element.size() > 1;
        if (!text.empty()) text += row ? "; " : ", ";
        text += row ? element.substr(1, element.size() - 2) : element;
    }
    values.push_back({key.line, value.items.empty() ? key.line : value.items.back().line});
    return {.text = "[" + text + "]", .where = at(value), .rows = at(value.items)};
}

/// The chart of a state machine is a mapping of names to states.
bool Reader::is_mapping_setting(const Node& block, const Node& key) {
    for (std::size_t i = 0; i + 1 < block.items.size(); i += 2)
        if (block.items[i].text == "block")
            return has_chart({.name = {}, .type = block.items[i + 1].text}) && key.text == chart_setting;
    return false;
}

Expression Reader::read_mapping(const Node& key, const Node& value, const std::string& path) {
    const std::function<void(const Node&)> check = [&](const Node& node) {
        if (node.is_map())
            read_entries(node, path, "'" + key.text + "'",
                         [&](const Node&, const Node& inner) { check(inner); });
        for (const Node& item : node.items)
            if (node.is_sequence()) check(item);
    };
    check(value);
    values.push_back({key.line, source_.line_of(value.end > 0 ? value.end - 1 : 0)});
    return {.text = json_of(value), .where = at(value), .quotes = Quotes::literal};
}

Expression Reader::read_expression(const Node& key, const Node& value, const std::string& path) {
    if (value.is_scalar()) {
        if (!value.text.empty() || value.quoted())
            return {.text = value.text,
                    .where = at(value),
                    .quotes = value.quotes,
                    .rows = value.quoted() ? rows_of_text(value) : std::vector<Location>()};
    } else if (value.is_sequence()) {
        return value.flow ? read_flow(value, path) : read_rows(key, value, path);
    } else if (value.is_map()) {
        if (is_cell(value)) return read_flow(value, path);
        report(value, path, "'" + key.text + "' is an expression, not a mapping",
               "put a struct in `variables` and name it here");
        return {.text = "[]", .where = at(value)};
    }
    report(key, path, "'" + key.text + "' has no value", "give it one, or remove the key");
    return {.text = "[]", .where = at(key)};
}

/// A value with limits, unit and doc.
void Reader::read_declared(Variable& variable, const Node& map, const std::string& path) {
    values.push_back({variable.where.line, map.items.back().line});
    const std::string what = "the variable '" + variable.name + "', which has a `value`";
    read_entries(map, path, what, [&](const Node& key, const Node& value) {
        const std::string& name = key.text;
        if (!keys::contains(keys::variable, name))
            report_unknown(key, path, what, keys::variable);
        else if (name == "value")
            variable.value = read_expression(key, value, path);
        else if (name == "unit")
            variable.unit = read_text(key, value, path);
        else if (name == "doc")
            variable.doc = read_text(key, value, path);
        else
            (name == "minimum" ? variable.minimum
             : name == "above" ? variable.above
                               : variable.maximum) = read_expression(key, value, path);
    });
}

/// A mapping is a struct; where variables are declared, one with `value` is a value with limits, unit and
/// doc.
std::vector<Variable> Reader::read_variables(const Node& map, const std::string& path, bool are_declared) {
    std::vector<Variable> variables;
    read_entries(map, path, "variables", [&](const Node& key, const Node& value) {
        Variable variable{.name = key.text, .where = at(key)};
        if (are_declared && value.is_map() && value.has("value") && !is_cell(value))
            read_declared(variable, value, path);
        else if (value.is_map() && !is_cell(value))
            variable.fields = read_variables(value, path, are_declared);
        else
            variable.value = read_expression(key, value, path);
        variables.push_back(std::move(variable));
    });
    return variables;
}

/// Each a list of names, or a mapping of names to numbers.
std::vector<Variable> Reader::read_enumerations(const Node& map, const std::string& path) {
    std::vector<Variable> enumerations;
    read_entries(map, path, "enumerations", [&](const Node& key, const Node& value) {
        Variable& enumeration = enumerations.emplace_back(Variable{.name = key.text, .where = at(key)});
        if (value.is_map())
            enumeration.fields = read_variables(value, path);
        else
            enumeration.fields = read_list<Variable>(key, value, &Variable::name);
    });
    return enumerations;
}

void Reader::read_port(Port& port, const Node& map, const std::string& path, const keys::Keys& known) {
    values.push_back({port.where.line, map.items.empty() ? map.line : map.items.back().line});
    read_entries(map, path, "the port '" + port.name + "'", [&](const Node& key, const Node& value) {
        const std::string& name = key.text;
        if (!keys::contains(known, name))
            report_unknown(key, path, "the port '" + port.name + "'", known);
        else if (name == "shape")
            port.shape = read_expression(key, value, path);
        else if (name == "type")
            port.type = read_text(key, value, path);
        else if (name == "unit")
            port.unit = read_text(key, value, path);
        else if (name == "doc")
            port.doc = read_text(key, value, path);
        else if (name == "initial")
            port.initial = read_expression(key, value, path);
        else if (name == "each")
            port.each = read_choice(key, value, path, keys::no_or_yes) == 1;
        else
            port.when_disabled =
                static_cast<WhenDisabled>(read_choice(key, value, path, keys::held_or_reset));
    });
}

std::vector<Port> Reader::read_ports(const Node& key, const Node& value, const std::string& path,
                                     const keys::Keys& known) {
    if (!value.is_map()) return read_list<Port>(key, value, &Port::name);
    std::vector<Port> ports;
    read_entries(value, path, "ports", [&](const Node& name, const Node& attributes) {
        Port& port = ports.emplace_back(Port{.name = name.text, .where = at(name)});
        if (!attributes.is_null()) read_port(port, attributes, path, known);
    });
    return ports;
}

/// A list of texts, or a single one.
template <typename Item>
std::vector<Item> Reader::read_list(const Node& key, const Node& value, std::string Item::*member) {
    std::vector<Item> items;
    auto add = [&](const Node& node) {
        if (!node.is_scalar() || node.text.empty())
            return report(node, "", "an entry of '" + key.text + "' is no name",
                          "write a list of names: [first, second]");
        Item& item = items.emplace_back();
        item.*member = node.text;
        item.where = at(node);
    };
    if (!value.is_sequence()) add(value);
    for (const Node& node : value.items)
        if (value.is_sequence()) add(node);
    return items;
}

std::optional<Endpoint> Reader::read_endpoint(const Node& node, const std::string& path,
                                              const std::unordered_set<std::string>& blocks) {
    const std::string remedy =
        "write `block.port`, or the name of a block, input or output of this subsystem";
    if (!node.is_scalar()) {
        report(node, path, "an end of a connection is no text", remedy);
        return std::nullopt;
    }
    const std::size_t dot = node.text.find('.');
    if (dot == std::string::npos && blocks.contains(node.text))
        return Endpoint{.block = node.text, .where = at(node)};
    if (dot == std::string::npos && !node.text.empty())
        return Endpoint{.block = {}, .port = node.text, .where = at(node)};
    if (dot == std::string::npos || dot == 0 || dot + 1 == node.text.size() || dot != node.text.rfind('.')) {
        report(node, path, "'" + node.text + "' is no end of a connection", remedy);
        return std::nullopt;
    }
    return Endpoint{.block = node.text.substr(0, dot), .port = node.text.substr(dot + 1), .where = at(node)};
}

void Reader::read_ends(System& system, const Ends& ends, const std::string& path) {
    std::unordered_set<std::string> blocks;
    for (const Block& block : system.blocks) blocks.insert(block.name);
    const auto read_signal = [&](const Node& key, const Node& value) {
        if (const std::optional<Endpoint> of = read_endpoint(value, path, blocks))
            system.signals.push_back({.name = key.text, .of = *of, .where = at(key)});
    };
    if (ends.signals) read_entries(*ends.signals, path, "signals", read_signal);
    if (!ends.connections) return;
    read_entries(*ends.connections, path, "connections", [&](const Node& key, const Node& value) {
        if (value.is_null())
            return report(key, path, "'" + key.text + "' is connected to nothing",
                          "name a destination, or remove the connection");
        const std::optional<Endpoint> from = read_endpoint(key, path, blocks);
        Connection connection{.from = from.value_or(Endpoint{}), .to = {}, .where = at(key)};
        bool complete = from.has_value();
        auto add = [&](const Node& node) {
            if (std::optional<Endpoint> end = read_endpoint(node, path, blocks))
                connection.to.push_back(*end);
            else
                complete = false;
        };
        if (!value.is_sequence()) add(value);
        for (const Node& end : value.items)
            if (value.is_sequence()) add(end);
        if (!complete) return; // reported
        if (connection.to.size() == 1) values.push_back({key.line, connection.to[0].where.line});
        system.connections.push_back(std::move(connection));
    });
}

/// Reads what every subsystem has, but for what needs all blocks; false for another key.
bool Reader::read_system_key(System& system, Ends& ends, const Node& key, const Node& value,
                             const std::string& path) {
    const std::string& name = key.text;
    if (name == "execution")
        system.execution = static_cast<Execution>(read_choice(key, value, path, keys::executions));
    else if (name == "states")
        system.states = static_cast<States>(read_choice(key, value, path, keys::held_or_reset));
    else if (name == "trigger")
        system.trigger = static_cast<Edge>(read_choice(key, value, path, keys::triggers));
    else if (name == "reset")
        system.reset = static_cast<Edge>(read_choice(key, value, path, keys::resets));
    else if (name == "iterations")
        system.iterations = read_expression(key, value, path);
    else if (name == "icon")
        system.icon = read_text(key, value, path);
    else if (name == "inputs")
        system.inputs = read_ports(key, value, path, keys::input);
    else if (name == "outputs")
        system.outputs = read_ports(key, value, path, keys::output);
    else if (name == "enumerations")
        system.enumerations = read_enumerations(value, path);
    else if (name == "variables")
        system.variables = read_variables(value, path, true);
    else if (name == "blocks")
        system.blocks = read_blocks(value, path);
    else if (name == "connections")
        ends.connections = &value;
    else if (name == "signals")
        ends.signals = &value;
    else
        return false;
    return true;
}

std::vector<Block> Reader::read_blocks(const Node& map, const std::string& path) {
    std::vector<Block> blocks;
    read_entries(map, path, "blocks", [&](const Node& key, const Node& value) {
        blocks.push_back(read_block(key, value, path.empty() ? key.text : path + "." + key.text));
    });
    return blocks;
}

Block Reader::read_block(const Node& name, const Node& map, const std::string& path) {
    Block block{.name = name.text, .where = at(name)};
    block.type_where = block.where;
    const bool is_library = map.has("block"), is_system = map.has("blocks");
    const bool is_file = map.has("file") && !is_library; // a library's block may have a setting `file`
    const keys::Keys& known = is_library ? keys::library_block : is_file ? keys::reference : keys::subsystem;
    if (!map.is_map() || is_library + is_file + is_system != 1) {
        const std::vector<std::string> kinds = {"block", "blocks", "file"};
        std::string remedy = "say which it is: of a library, a subsystem, or in a file of its own";
        for (std::size_t i = 0; map.is_map() && i < map.items.size(); i += 2)
            if (const std::string& key = map.items[i].text; std::ranges::find(kinds, key) == kinds.end())
                if (const std::string meant = did_you_mean(key, kinds, ""); !meant.empty()) remedy = meant;
        report(name, path, "a block has exactly one of `block: TYPE`, `blocks:` and `file:`", remedy);
        block.type = "?"; // keeps its place, so that connections to it are no second error
        return block;
    }
    if (is_file) block.reference = Reference{.file = {}, .where = block.where};
    if (is_system) block.system = std::make_unique<System>();
    Ends ends;
    read_entries(map, path, "a block", [&](const Node& key, const Node& value) {
        block.keys.push_back({.name = key.text, .where = at(key)});
        if (!is_library && !keys::contains(known, key.text))
            return report_unknown(key, path, is_file ? "a block in a file" : "a subsystem", known);
        if (key.text == "doc")
            block.doc = read_text(key, value, path);
        else if (key.text == "when")
            block.when = read_expression(key, value, path);
        else if (key.text == "period")
            block.period = read_expression(key, value, path);
        else if (key.text == "offset")
            block.offset = read_expression(key, value, path);
        else if (key.text == "block") {
            block.type = read_text(key, value, path);
            block.type_where = at(value);
        } else if (is_file && key.text == "file") {
            block.reference->file = read_text(key, value, path);
            block.reference->where = at(value);
        } else if (is_file && key.text == "with")
            block.reference->with = read_variables(value, path);
        else if (is_library && value.is_map() && is_mapping_setting(map, key))
            block.settings.push_back(
                {.name = key.text, .value = read_mapping(key, value, path), .where = at(key)});
        else if (!is_system || !read_system_key(*block.system, ends, key, value, path))
            block.settings.push_back(
                {.name = key.text, .value = read_expression(key, value, path), .where = at(key)});
    });
    if (is_system) read_ends(*block.system, ends, path);
    if (is_library && block.type.empty()) block.type = "?";
    if (is_file && !block.reference->file.empty() && load_)
        block.reference->model = load_(block.reference->file, block.reference->where, path);
    return block;
}

double Reader::read_number(const Node& key, const Node& value) {
    if (value.is_scalar())
        if (const auto number = number_of(value.text)) return *number;
    report(value, "", "'" + key.text + "' of the layout is '" + value.text + "'", "give a number");
    return 0;
}

/// The keys `x`, `y`, `width` and `height` of something drawn.
bool Reader::read_extent(Point& at, std::optional<Point>& size, const Node& key, const Node& value) {
    if (key.text == "x")
        at.x = read_number(key, value);
    else if (key.text == "y")
        at.y = read_number(key, value);
    else if (key.text == "width" || key.text == "height") {
        if (!size) size.emplace();
        (key.text == "width" ? size->x : size->y) = read_number(key, value);
    } else
        return false;
    return true;
}

std::vector<Point> Reader::read_points(const Node& key, const Node& value) {
    std::vector<Point> points;
    if (!value.is_sequence())
        report(value, "", "the bends of '" + key.text + "' are no list", "write [[x, y], ...], or labels");
    for (const Node& item : value.items)
        if (item.is_sequence() && item.items.size() == 2)
            points.push_back({read_number(key, item.items[0]), read_number(key, item.items[1])});
        else
            report(item, "", "a corner of '" + key.text + "' is no point", "write [x, y]");
    return points;
}

Layout Reader::read_layout(const Node& map) {
    Layout layout;
    read_entries(map, "", "a layout", [&](const Node& part, const Node& entries) {
        layout.keys.push_back({.name = part.text, .where = at(part)});
        if (!keys::contains(keys::layout, part.text))
            return report_unknown(part, "", "a layout", keys::layout);
        read_entries(entries, "", part.text + " of the layout", [&](const Node& name, const Node& value) {
            if (part.text == "wires") {
                Bends& wire = layout.wires.emplace_back(Bends{.path = name.text, .where = at(name)});
                wire.as_labels = value.is_scalar() && value.text == keys::labels;
                if (!wire.as_labels) wire.points = read_points(name, value);
                return;
            }
            if (part.text == "displays") {
                Display display{.name = name.text, .where = at(name)};
                read_entries(
                    value, "", "the display '" + name.text + "'", [&](const Node& key, const Node& what) {
                        if (key.text == "shows")
                            display.shows = static_cast<Shows>(read_choice(key, what, "", choices::shows));
                        else if (key.text == "signals")
                            display.signals = read_list<Signal>(key, what, &Signal::path);
                        else
                            report_unknown(key, "", "a display", keys::display);
                    });
                layout.displays.push_back(std::move(display));
                return;
            }
            const bool is_note = part.text == "notes";
            Placement drawn{.path = name.text, .where = at(name)};
            Note note{.name = name.text, .text = {}, .where = drawn.where};
            read_entries(
                value, "", "what is drawn as '" + name.text + "'", [&](const Node& key, const Node& what) {
                    if (read_extent(drawn.at, drawn.size, key, what)) return;
                    if (!is_note && key.text == "flipped")
                        drawn.flipped = read_choice(key, what, "", keys::no_or_yes) == 1;
                    else if (!is_note && key.text == "rotated")
                        drawn.rotated = static_cast<Rotation>(read_choice(key, what, "", choices::rotations));
                    else if (!is_note && key.text == "sides")
                        read_entries(what, "", "the sides of ports", [&](const Node& port, const Node& side) {
                            drawn.sides.push_back(
                                {port.text, static_cast<Side>(read_choice(port, side, "", choices::sides))});
                        });
                    else if (is_note && key.text == "text")
                        note.text = read_text(key, what, "");
                    else if (is_note && key.text == "image")
                        note.image = read_text(key, what, "");
                    else if (is_note && key.text == "in")
                        note.system = read_text(key, what, "");
                    else
                        report_unknown(key, "", "the layout", is_note ? keys::note : keys::placement);
                });
            note.at = drawn.at;
            note.size = drawn.size;
            if (is_note)
                layout.notes.push_back(std::move(note));
            else
                layout.blocks.push_back(std::move(drawn));
        });
    });
    return layout;
}

Model Reader::read_model(const Node& node) {
    Model model;
    model.where = node.is_null() ? source_.at(1, 1) : at(node);
    if (node.is_null()) {
        wrong.push_back(
            {model.where, "", "the file holds no model", "begin with `model: NAME` and `blocks:`"});
        return model;
    }
    Ends ends;
    read_entries(node, "", "a model", [&](const Node& key, const Node& value) {
        model.keys.push_back({.name = key.text, .where = at(key)});
        if (key.text == "model")
            model.name = read_text(key, value, "");
        else if (key.text == "doc")
            model.doc = read_text(key, value, "");
        else if (key.text == "plugins")
            model.plugins = read_list<Plugin>(key, value, &Plugin::name);
        else if (key.text == "step")
            model.step = read_expression(key, value, "");
        else if (key.text == "stop")
            model.stop = read_expression(key, value, "");
        else if (key.text == "solver")
            model.solver = read_expression(key, value, "");
        else if (key.text == "relative_tolerance")
            model.relative_tolerance = read_expression(key, value, "");
        else if (key.text == "absolute_tolerance")
            model.absolute_tolerance = read_expression(key, value, "");
        else if (key.text == "max_step")
            model.max_step = read_expression(key, value, "");
        else if (key.text == "algebraic_loops")
            model.algebraic_loops =
                static_cast<AlgebraicLoops>(read_choice(key, value, "", keys::algebraic_loops));
        else if (key.text == "rate_transitions")
            model.rate_transitions =
                static_cast<RateTransitions>(read_choice(key, value, "", keys::rate_transitions));
        else if (key.text == "non_finite")
            model.non_finite = static_cast<NonFinite>(read_choice(key, value, "", keys::non_finite));
        else if (key.text == "record" && value.is_scalar() && value.text == "all")
            model.record_all = true;
        else if (key.text == "record")
            model.record = read_list<Signal>(key, value, &Signal::path);
        else if (key.text == "layout")
            model.layout = read_layout(value);
        else if (key.text == "plots")
            read_entries(value, "", "plots", [&](const Node& title, const Node& signals) {
                model.plots.push_back({.title = title.text,
                                       .signals = read_list<Signal>(title, signals, &Signal::path),
                                       .where = at(title)});
            });
        else if (!read_system_key(model.root, ends, key, value, ""))
            report_unknown(key, "", "a model", keys::model);
    });
    read_ends(model.root, ends, "");
    const bool named = std::ranges::any_of(model.keys, [](const Key& key) { return key.name == "model"; });
    if (node.is_map() && !named)
        report(node, "", "the model has no name", "begin the file with `model: NAME`");
    return model;
}

} // namespace bf::formats

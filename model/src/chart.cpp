#include "chart.hpp"

#include "bf/base/numbers.hpp"
#include "bf/model/check.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/listed.hpp"
#include "bf/model/suggest.hpp"
#include "editor.hpp"
#include "identifiers.hpp"

#include <algorithm>

namespace bf::model {

namespace {

constexpr const char *states_setting = "states", *transitions_setting = "transitions",
                     *initial_setting = "initial";
constexpr std::size_t columns = 4;

constexpr const char* state_name_rule = "it begins with a letter and has letters, digits and '_' alone";

struct Span {
    std::size_t begin = 0, end = 0;
};
using Row = std::array<Span, columns>;

std::string_view trimmed(std::string_view text) {
    const std::string_view blanks = " \t\n\r";
    const std::size_t begin = text.find_first_not_of(blanks);
    return begin == text.npos ? std::string_view()
                              : text.substr(begin, text.find_last_not_of(blanks) + 1 - begin);
}

std::string text_of(const Block& block, const char* setting) {
    const Setting* const found = block.find_setting(setting);
    return found ? found->value.text : setting == states_setting ? "idle" : "";
}

/// Of a row or an item, where that is known.
Location where(const Block& block, const char* setting, std::optional<std::size_t> row = {}) {
    const Setting* const found = block.find_setting(setting);
    if (found && row && *row < found->value.rows.size() && found->value.rows[*row])
        return found->value.rows[*row];
    return found && found->value.where ? found->value.where : block.where;
}

std::string part(const std::string& text, const Span& span) {
    return text.substr(span.begin, span.end - span.begin);
}

/// What keeps a setting from being read as part of a chart, and what to do about it.
struct Defect {
    const char* setting;
    std::string message, remedy;
    std::optional<std::size_t> row = {}; ///< or item of a list, from 0
};

std::vector<std::string> states_of(const Block& block) {
    const std::string text = text_of(block, states_setting);
    const Setting* const setting = block.find_setting(states_setting);
    const bool is_one =
        setting && (setting->value.quotes == Quotes::single || setting->value.quotes == Quotes::literal);
    const std::string as_list = "write a list of names, [idle, move]";
    if (is_one) throw Defect{states_setting, "`states` is one text", as_list};
    std::vector<std::string> states;
    for (const ListedText& item : listed_texts(text)) {
        const bool is_quoted = part(text, {item.begin, item.end}) != item.text;
        if (!is_quoted && item.text.find_first_of("{}()[]") != item.text.npos)
            throw Defect{states_setting,
                         "the state '" + item.text + "' is an expression, which is evaluated first",
                         as_list + ", and a name with brackets in single quotes", states.size()};
        if (!is_name(item.text))
            throw Defect{states_setting, "'" + item.text + "' is no name for a state", name_rule,
                         states.size()};
        if (std::ranges::find(states, item.text) != states.end())
            throw Defect{states_setting, "a second state '" + item.text + "'", "rename one of them",
                         states.size()};
        states.push_back(item.text);
    }
    if (states.empty()) throw Defect{states_setting, "`states` has no names", as_list};
    return states;
}

/// Where the entries of a matrix of four columns stand.
std::vector<Row> rows_of(const std::string& text) {
    std::vector<Row> rows;
    std::vector<Span> row;
    const std::string_view whole = trimmed(text);
    if (whole.empty()) return rows;
    const auto refuse = [&](const std::string& message, const std::string& remedy) {
        throw Defect{transitions_setting, message, remedy, rows.size()};
    };
    const std::string form = "[from to condition minimum_time]";
    if (whole.front() != '[' || whole.back() != ']' || whole.find_first_of("%#") != whole.npos)
        refuse("`transitions` is '" + text + "', which is evaluated first",
               "write rows " + form + " with numbers of states");
    const auto first = static_cast<std::size_t>(whole.data() - text.data()) + 1,
               last = first + whole.size() - 2;
    int depth = 0;
    std::size_t begin = text.npos; // of an entry
    for (std::size_t at = first; at <= last; ++at) {
        const char c = at == last ? ';' : text[at];
        const bool is_new_row = depth == 0 && (c == ';' || c == '\n');
        if (is_new_row || (depth == 0 && (c == ',' || c == ' ' || c == '\t' || c == '\r'))) {
            if (begin != text.npos) row.push_back({begin, at});
            begin = text.npos;
        } else {
            depth += (c == '(' || c == '[' || c == '{') - (c == ')' || c == ']' || c == '}');
            if (begin == text.npos) begin = at;
        }
        if (depth < 0 || (at == last && depth > 0))
            refuse("row " + std::to_string(rows.size() + 1) + " of `transitions` has a bracket too much",
                   "remove it, or add the other one");
        if (!is_new_row || row.empty()) continue;
        if (row.size() != columns)
            refuse("row " + std::to_string(rows.size() + 1) + " of `transitions` has " +
                       std::to_string(row.size()) + (row.size() == 1 ? " entry" : " entries") + ", '" +
                       text.substr(row.front().begin, row.back().end - row.front().begin) + "'",
                   "a row is " + form + "; put an entry with blanks in parentheses");
        std::copy(row.begin(), row.end(), rows.emplace_back().begin());
        row.clear();
    }
    return rows;
}

/// A number of a list of `count`, from 1, as its place there.
std::optional<std::size_t> place_of(const std::string& text, std::size_t count) {
    const auto number = number_of(text);
    if (!number || !(*number >= 1) || *number > static_cast<double>(count)) return {};
    const auto place = static_cast<std::size_t>(*number);
    return static_cast<double>(place) == *number ? std::optional(place - 1) : std::nullopt;
}

std::size_t required_place(const std::string& text, std::size_t count, const char* setting,
                           const std::string& what, std::optional<std::size_t> row = {}) {
    if (const auto place = place_of(text, count)) return *place;
    throw Defect{setting, what + " '" + text + "', which is no number of a state",
                 "states are numbered 1 to " + std::to_string(count), row};
}

Chart read_chart(const Block& block) {
    Chart chart;
    if (block.find_setting(chart_setting))
        throw Defect{chart_setting, "its states have states inside", "edit the `chart` in the file"};
    chart.states = states_of(block);
    const std::size_t count = chart.states.size();
    const std::string text = text_of(block, transitions_setting), initial = text_of(block, initial_setting);
    for (const Row& row : rows_of(text)) {
        const std::size_t number = chart.transitions.size();
        const auto state = [&](int column, const char* leads) {
            return required_place(part(text, row[static_cast<std::size_t>(column)]), count,
                                  transitions_setting,
                                  "row " + std::to_string(number + 1) + " leads " + leads, number);
        };
        const std::size_t from = state(0, "from"), to = state(1, "to");
        chart.transitions.push_back({from, to, part(text, row[2]), part(text, row[3])});
    }
    if (!initial.empty()) chart.initial = required_place(initial, count, initial_setting, "`initial` is");
    return chart;
}

/// Whether a text stays one entry of a row.
bool is_entry(const std::string& text) {
    try {
        return rows_of("[0 0 0 " + text + "]").size() == 1;
    } catch (const Defect&) {
        return false;
    }
}

Span span_of(const Row& row) { return {row.front().begin, row.back().end}; }
Span span_of(const ListedText& item) { return {item.begin, item.end}; }

/// One more of the items, of which there are some, parted as the last two are.
template <typename Items>
std::string with_item(std::string text, const Items& items, const std::string& usual_gap,
                      const std::string& item) {
    const Span last = span_of(items.back());
    const std::string gap =
        items.size() > 1 ? part(text, {span_of(items[items.size() - 2]).end, last.begin}) : usual_gap;
    return text.insert(last.end, gap + item);
}

template <typename Items> std::string without_item(std::string text, const Items& items, std::size_t i) {
    const bool is_last = i + 1 == items.size();
    const std::size_t begin = is_last && i > 0 ? span_of(items[i - 1]).end : span_of(items[i]).begin,
                      end = is_last ? span_of(items[i]).end : span_of(items[i + 1]).begin;
    return text.erase(begin, end - begin);
}

} // namespace

std::string Chart::name_of(std::size_t transition) const {
    return joined(states[transitions[transition].to], std::to_string(transition + 1));
}

bool has_chart(const Block& block) { return block.type == "StateMachine"; }

std::optional<Chart> chart_of(const Block& block, Diagnostic* defect) {
    if (!has_chart(block)) return {};
    try {
        return read_chart(block);
    } catch (const Defect& found) {
        if (defect) *defect = {where(block, found.setting, found.row), "", found.message, found.remedy};
        return {};
    }
}

std::pair<std::string, std::string> split_chart(const Model& model, const std::string& path) {
    for (std::size_t dot = path.find('.'); dot != path.npos; dot = path.find('.', dot + 1)) {
        const Block* const block = find(model, std::string_view(path).substr(0, dot));
        if (block && has_chart(*block)) return {path.substr(0, dot), path.substr(dot + 1)};
    }
    return {};
}

Location ChartEditor::where_states() const { return where(block_, states_setting); }
Location ChartEditor::where_transitions() const { return where(block_, transitions_setting); }

std::optional<std::size_t> ChartEditor::find_state(std::string_view name) const {
    const auto found = std::ranges::find(chart_.states, name);
    if (found == chart_.states.end()) return {};
    return static_cast<std::size_t>(found - chart_.states.begin());
}

std::optional<std::size_t> ChartEditor::find_transition(std::string_view name) const {
    for (std::size_t i = 0; i < chart_.transitions.size(); ++i)
        if (chart_.name_of(i) == name) return i;
    return {};
}

void ChartEditor::write(const char* setting, std::string text, RowChange change) {
    const auto find = [&] { return std::ranges::find(block_.settings, setting, &Setting::name); };
    const auto known = find();
    std::vector<Location> rows =
        known == block_.settings.end() ? std::vector<Location>() : std::move(known->value.rows);
    if (change.removed && *change.removed < rows.size())
        rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(*change.removed));
    if (change.is_added && !rows.empty()) rows.emplace_back();
    set(block_, setting, std::move(text));
    find()->value.rows = std::move(rows);
    chart_ = *chart_of(block_);
}

void ChartEditor::add_state(const std::string& name) {
    const std::string text = text_of(block_, states_setting);
    const std::string list = with_item(text, listed_texts(text), ", ", listed(name));
    write(states_setting, list.starts_with('[') ? list : "[" + list + "]", {.is_added = true});
}

void ChartEditor::rename_state(std::size_t state, const std::string& name) {
    std::string text = text_of(block_, states_setting);
    const Span item = span_of(listed_texts(text)[state]);
    if (const auto mark = block_.state_marks.extract(chart_.states[state]))
        block_.state_marks.insert_or_assign(name, mark.mapped());
    write(states_setting, text.replace(item.begin, item.end - item.begin, listed(name)));
}

void ChartEditor::remove_state(std::size_t state) {
    for (std::size_t i = chart_.transitions.size(); i-- > 0;)
        if (chart_.transitions[i].from == state || chart_.transitions[i].to == state) remove_transition(i);
    const std::size_t initial = chart_.initial == state ? 0 : chart_.initial - (chart_.initial > state);
    for (std::size_t i = 0; i < chart_.transitions.size(); ++i) {
        const auto [from, to] = std::pair(chart_.transitions[i].from, chart_.transitions[i].to);
        if (from > state) set_entry(i, 0, std::to_string(from));
        if (to > state) set_entry(i, 1, std::to_string(to));
    }
    set_initial(initial);
    block_.state_marks.erase(chart_.states[state]);
    const std::string text = text_of(block_, states_setting);
    write(states_setting, without_item(text, listed_texts(text), state), {.removed = state});
}

void ChartEditor::set_initial(std::size_t state) {
    if (chart_.initial == state) return;
    std::erase_if(block_.settings, [&](const Setting& s) { return state == 0 && s.name == initial_setting; });
    if (state > 0) set(block_, initial_setting, std::to_string(state + 1));
    chart_.initial = state;
}

void ChartEditor::add_transition(std::size_t from, std::size_t to) {
    const std::string text = text_of(block_, transitions_setting);
    const auto rows = rows_of(text);
    const std::string gap = rows.empty() ? " " : part(text, {rows.back()[0].end, rows.back()[1].begin});
    std::string row = std::to_string(from + 1);
    for (const std::string& entry : {std::to_string(to + 1), std::string("0"), std::string("0")})
        row += gap + entry;
    write(transitions_setting, rows.empty() ? "[" + row + "]" : with_item(text, rows, "; ", row),
          {.is_added = true});
}

void ChartEditor::remove_transition(std::size_t transition) {
    const std::string text = text_of(block_, transitions_setting);
    write(transitions_setting, without_item(text, rows_of(text), transition), {.removed = transition});
}

void ChartEditor::set_entry(std::size_t transition, std::size_t column, const std::string& text) {
    std::string all = text_of(block_, transitions_setting);
    const Span entry = rows_of(all)[transition][column];
    write(transitions_setting, all.replace(entry.begin, entry.end - entry.begin, text));
}

// ---- operations ----

namespace {

/// The names of transitions once some of them are gone.
Renamed renumbered(const Chart& chart, const std::function<bool(std::size_t)>& is_gone) {
    Renamed renamed;
    std::size_t number = 0;
    for (std::size_t i = 0; i < chart.transitions.size(); ++i) {
        const bool is_kept = !is_gone(i);
        number += is_kept;
        renamed.emplace_back(chart.name_of(i),
                             is_kept ? joined(chart.states[chart.transitions[i].to], std::to_string(number))
                                     : "");
    }
    return renamed;
}

} // namespace

ChartEditor Editor::chart_at(const std::string& path) {
    Block& block = block_at(path);
    Diagnostic defect;
    auto chart = chart_of(block, &defect);
    if (!chart) refuse(defect.where, path, "the chart cannot be edited: " + defect.message, defect.remedy);
    return {block, std::move(*chart)};
}

bool Editor::is_chart(const std::string& path) const {
    const Block* const block = find(std::as_const(model_), path);
    return block ? has_chart(*block) : nested_at(path).has_value();
}

std::optional<std::pair<std::string, std::string>> Editor::nested_at(const std::string& path) const {
    const Block* const block = find(std::as_const(model_), path);
    auto found = block && has_chart(*block) ? std::pair(path, std::string()) : split_chart(model_, path);
    if (found.first.empty() || !NestedChart::is_in(*find(std::as_const(model_), found.first))) return {};
    return found;
}

void Editor::on_nested(const std::string& machine, const std::function<void(Block&)>& action) {
    Block& block = block_at(machine);
    try {
        action(block);
    } catch (const NestedChart::Refusal& refused) {
        refuse(where(block, chart_setting), machine, refused.message, refused.remedy);
    } catch (const nlohmann::json::exception& wrong) {
        refuse(where(block, chart_setting), machine,
               std::string("the chart would be no JSON: ") + wrong.what(), "give texts in UTF-8");
    }
}

void Editor::edit_nested(const std::string& machine, const std::function<void(NestedChart&)>& change) {
    on_nested(machine, [&](Block& block) {
        NestedChart chart(block);
        change(chart);
        named(block.settings, chart_setting)->value.text = chart.text();
    });
}

std::size_t Editor::state_of(const ChartEditor& editor, const std::string& path,
                             const std::string& name) const {
    if (const auto state = editor.find_state(name)) return *state;
    if (name.find('.') != name.npos) refuse_transition(editor, path, name);
    refuse(editor.where_states(), path, "there is no state '" + name + "'",
           name_remedy(name, editor.chart().states));
}

void Editor::refuse_transition(const ChartEditor& editor, const std::string& path,
                               const std::string& name) const {
    std::vector<std::string> known;
    for (std::size_t i = 0; i < editor.chart().transitions.size(); ++i)
        known.push_back(editor.chart().name_of(i));
    const bool is_known = std::ranges::find(known, name) != known.end();
    refuse(editor.where_transitions(), path,
           is_known ? "'" + name + "' is a transition, and no state"
                    : "there is no transition '" + name + "'",
           is_known ? "name a state" : name_remedy(name, known));
}

void Editor::require_free_state(const ChartEditor& editor, const std::string& path,
                                const std::string& name) const {
    if (!is_name(name))
        refuse(editor.where_states(), path, "'" + name + "' is no name for a state", name_rule);
    if (editor.find_state(name))
        refuse(editor.where_states(), path, "there is a state '" + name + "' already", "use another name");
}

void Editor::add_state(const operations::Add& add) {
    if (!add.block.type.empty() || add.block.system || add.block.reference)
        refuse(block_at(add.system).where, add.system, "a chart has states, and no blocks",
               "add a block with a name alone");
    if (const auto nested = nested_at(add.system)) {
        const auto& [machine, inside] = *nested;
        if (!is_identifier(add.block.name))
            refuse(block_at(machine).where, add.system, "'" + add.block.name + "' is no name for a state",
                   state_name_rule);
        edit_nested(machine,
                    [&, inside = inside](NestedChart& chart) { chart.add_state(inside, add.block.name); });
        if (add.at) (*this)(operations::Move{joined(add.system, add.block.name), *add.at});
        return;
    }
    ChartEditor editor = chart_at(add.system);
    require_free_state(editor, add.system, add.block.name);
    editor.add_state(add.block.name);
    if (add.at) (*this)(operations::Move{joined(add.system, add.block.name), *add.at});
}

void Editor::remove_state(const std::string& machine, const std::string& name) {
    Renamed renamed;
    if (nested_at(machine)) {
        edit_nested(machine, [&](NestedChart& chart) { renamed = chart.remove_state(name); });
        return follow_chart(machine, renamed);
    }
    ChartEditor editor = chart_at(machine);
    const std::size_t state = state_of(editor, machine, name);
    if (editor.chart().states.size() == 1)
        refuse(editor.where_states(), machine, "a chart has at least one state", "add another one first");
    renamed = renumbered(editor.chart(), [&](std::size_t i) {
        const Transition& transition = editor.chart().transitions[i];
        return transition.from == state || transition.to == state;
    });
    renamed.emplace_back(name, "");
    editor.remove_state(state);
    follow_chart(machine, renamed);
}

void Editor::follow_chart(const std::string& machine, const Renamed& renamed) {
    follow([&](const std::string& path) -> std::vector<std::string> {
        for (const auto& [old, now] : renamed)
            if (const auto rest = rest_under(path, joined(machine, old)))
                return now.empty() ? std::vector<std::string>() : std::vector{joined(machine, now) + *rest};
        return {path};
    });
}

void Editor::rename_state(const std::string& machine, const std::string& name, const std::string& to) {
    if (name == to) return;
    if (nested_at(machine)) {
        if (!is_identifier(to))
            refuse(block_at(machine).where, machine, "'" + to + "' is no name for a state", state_name_rule);
        edit_nested(machine, [&](NestedChart& chart) { chart.rename_state(name, to); });
        return move_paths(joined(machine, name), joined(machine, joined(split_last(name).first, to)));
    }
    ChartEditor editor = chart_at(machine);
    const std::size_t state = state_of(editor, machine, name);
    require_free_state(editor, machine, to);
    editor.rename_state(state, to);
    move_paths(joined(machine, name), joined(machine, to));
}

void Editor::connect_states(const operations::Connect& connect) {
    if (const auto nested = nested_at(connect.system))
        return edit_nested(nested->first, [&](NestedChart& chart) {
            chart.connect(joined(nested->second, connect.from), joined(nested->second, connect.to));
        });
    ChartEditor editor = chart_at(connect.system);
    editor.add_transition(state_of(editor, connect.system, connect.from),
                          state_of(editor, connect.system, connect.to));
}

void Editor::disconnect_states(const operations::Disconnect& disconnect) {
    Renamed renamed;
    if (const auto nested = nested_at(disconnect.system)) {
        edit_nested(nested->first, [&](NestedChart& chart) {
            renamed = chart.disconnect(joined(nested->second, disconnect.to));
        });
        return follow_chart(nested->first, renamed);
    }
    ChartEditor editor = chart_at(disconnect.system);
    const auto transition = editor.find_transition(disconnect.to);
    if (!transition) refuse_transition(editor, disconnect.system, disconnect.to);
    renamed = renumbered(editor.chart(), [&](std::size_t i) { return i == *transition; });
    editor.remove_transition(*transition);
    follow_chart(disconnect.system, renamed);
}

void Editor::set_in_chart(const std::string& machine, const std::string& name, const operations::Set& set) {
    if (nested_at(machine))
        return edit_nested(machine, [&](NestedChart& chart) { chart.set(name, set.name, set.value); });
    ChartEditor editor = chart_at(machine);
    if (const auto transition = editor.find_transition(name)) {
        const std::size_t column = set.name == "condition" ? 2 : 3;
        if (set.name != "condition" && set.name != "minimum_time")
            refuse(editor.where_transitions(), set.path, "there is no '" + set.name + "' to set here",
                   "set 'condition' or 'minimum_time'");
        const std::string text(trimmed(set.value.value_or("0")));
        if (!is_entry(text))
            refuse(editor.where_transitions(), set.path, "'" + text + "' is no single entry of a matrix",
                   "put it in parentheses");
        return editor.set_entry(*transition, column, text);
    }
    const std::size_t state = state_of(editor, machine, name);
    if (set.name != "initial" || set.value != "true")
        refuse(editor.where_states(), set.path, "of a state one can set 'initial' to true alone",
               "make another state the first one");
    editor.set_initial(state);
}

std::vector<Property> chart_properties(const Block& block, const std::string& name) {
    if (NestedChart::is_in(block)) try {
            return NestedChart(block).properties(name);
        } catch (const NestedChart::Refusal& refused) {
            throw Errors({{block.where, block.name, refused.message, refused.remedy}});
        }
    const auto chart = chart_of(block);
    if (!chart) return {};
    for (std::size_t i = 0; i < chart->transitions.size(); ++i)
        if (chart->name_of(i) == name)
            return {{.name = "condition", .value = chart->transitions[i].condition},
                    {.name = "minimum_time", .value = chart->transitions[i].minimum_time}};
    if (std::ranges::find(chart->states, name) == chart->states.end())
        throw Errors({{block.where, block.name, "there is no state or transition '" + name + "'",
                       name_remedy(name, chart->states)}});
    if (chart->states[chart->initial] == name)
        return {{.name = "initial", .value = "true", .choices = {"true"}}};
    return {{.name = "initial", .choices = {"true"}}};
}

} // namespace bf::model

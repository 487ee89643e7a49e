#include "chart.hpp"

#include "bf/base/numbers.hpp"
#include "bf/model/check.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/suggest.hpp"
#include "editor.hpp"

#include <algorithm>

namespace bf::model {

namespace {

constexpr const char *states_setting = "states", *transitions_setting = "transitions",
                     *initial_setting = "initial";
constexpr std::size_t columns = 4;

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
    return found ? found->value.text : "";
}

/// Items between commas, with or without brackets: how a list of texts is written. None of a cell array.
std::optional<std::vector<std::string>> states_of(const Block& block) {
    std::string_view rest =
        trimmed(block.find_setting(states_setting) ? block.find_setting(states_setting)->value.text
                                                   : std::string_view("idle"));
    if (rest.starts_with('[') && rest.ends_with(']')) rest = rest.substr(1, rest.size() - 2);
    std::vector<std::string> states;
    while (!rest.empty()) {
        const std::size_t comma = std::min(rest.find(','), rest.size());
        if (const auto item = trimmed(rest.substr(0, comma)); !item.empty()) states.emplace_back(item);
        rest.remove_prefix(std::min(comma + 1, rest.size()));
    }
    const auto is_name = [](const std::string& state) {
        return state.find_first_of("{}()[]'\"") == state.npos;
    };
    if (states.empty() || !std::ranges::all_of(states, is_name)) return {};
    return states;
}

/// Where the entries of a matrix of four columns stand; none where it is another expression.
std::optional<std::vector<Row>> rows_of(const std::string& text) {
    std::vector<Row> rows;
    std::vector<Span> row;
    const std::string_view whole = trimmed(text);
    if (whole.empty()) return rows;
    if (whole.front() != '[' || whole.back() != ']' || whole.find_first_of("%#") != whole.npos) return {};
    const auto first = static_cast<std::size_t>(whole.data() - text.data()) + 1,
               last = first + whole.size() - 2;
    int depth = 0;
    std::optional<std::size_t> begin;
    for (std::size_t at = first; at <= last; ++at) {
        const char c = at == last ? ';' : text[at];
        const bool is_new_row = depth == 0 && (c == ';' || c == '\n');
        if (is_new_row || (depth == 0 && (c == ',' || c == ' ' || c == '\t' || c == '\r'))) {
            if (begin) row.push_back({*begin, at});
            begin.reset();
        } else {
            depth += (c == '(' || c == '[' || c == '{') - (c == ')' || c == ']' || c == '}');
            if (depth < 0) return {};
            if (!begin) begin = at;
        }
        if (!is_new_row || row.empty()) continue;
        if (row.size() != columns) return {};
        std::copy(row.begin(), row.end(), rows.emplace_back().begin());
        row.clear();
    }
    if (depth != 0) return {};
    return rows;
}

std::string part(const std::string& text, const Span& span) {
    return text.substr(span.begin, span.end - span.begin);
}

/// A number of a list of `count`, from 1, as its place there.
std::optional<std::size_t> place_of(const std::string& text, std::size_t count) {
    const auto number = number_of(text);
    if (!number || !(*number >= 1) || *number > static_cast<double>(count)) return {};
    const auto place = static_cast<std::size_t>(*number);
    return static_cast<double>(place) == *number ? std::optional(place - 1) : std::nullopt;
}

} // namespace

std::string Chart::name_of(std::size_t transition) const {
    return joined(states[transitions[transition].to], std::to_string(transition + 1));
}

bool has_chart(const Block& block) { return block.type == "StateMachine"; }

std::optional<Chart> chart_of(const Block& block) {
    if (!has_chart(block)) return {};
    Chart chart;
    const auto states = states_of(block);
    const std::string text = text_of(block, transitions_setting), initial = text_of(block, initial_setting);
    const auto rows = rows_of(text);
    if (!states || !rows) return {};
    chart.states = *states;
    for (const Row& row : *rows) {
        const auto from = place_of(part(text, row[0]), states->size()),
                   to = place_of(part(text, row[1]), states->size());
        if (!from || !to) return {};
        chart.transitions.push_back({*from, *to, part(text, row[2]), part(text, row[3])});
    }
    if (!initial.empty()) {
        const auto first = place_of(initial, states->size());
        if (!first) return {};
        chart.initial = *first;
    }
    return chart;
}

std::pair<std::string, std::string> split_chart(const Model& model, const std::string& path) {
    for (std::size_t dot = path.find('.'); dot != path.npos; dot = path.find('.', dot + 1)) {
        const Block* const block = find(model, std::string_view(path).substr(0, dot));
        if (block && has_chart(*block)) return {path.substr(0, dot), path.substr(dot + 1)};
    }
    return {};
}

ChartEditor::ChartEditor(Block& block) : block_(block), chart_(*chart_of(block)) {}

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

void ChartEditor::write_states(const std::vector<std::string>& states) {
    std::string text;
    for (const std::string& state : states) text += (text.empty() ? "" : ", ") + state;
    set(block_, states_setting, "[" + text + "]");
    chart_ = *chart_of(block_);
}

void ChartEditor::write_transitions(std::string text) {
    set(block_, transitions_setting, std::move(text));
    chart_ = *chart_of(block_);
}

void ChartEditor::add_state(const std::string& name) {
    auto states = chart_.states;
    states.push_back(name);
    write_states(states);
}

void ChartEditor::rename_state(std::size_t state, const std::string& name) {
    auto states = chart_.states;
    states[state] = name;
    write_states(states);
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
    auto states = chart_.states;
    states.erase(states.begin() + static_cast<std::ptrdiff_t>(state));
    write_states(states);
}

void ChartEditor::set_initial(std::size_t state) {
    if (chart_.initial == state) return;
    std::erase_if(block_.settings, [&](const Setting& s) { return state == 0 && s.name == initial_setting; });
    if (state > 0) set(block_, initial_setting, std::to_string(state + 1));
    chart_.initial = state;
}

void ChartEditor::add_transition(std::size_t from, std::size_t to) {
    std::string text = text_of(block_, transitions_setting);
    const auto rows = *rows_of(text);
    const std::string row = std::to_string(from + 1) + " " + std::to_string(to + 1) + " 0 0";
    if (rows.empty()) return write_transitions("[" + row + "]");
    const std::size_t end = rows.back()[columns - 1].end; // rows are parted as the last two are
    const std::string gap =
        rows.size() > 1 ? part(text, {rows[rows.size() - 2][columns - 1].end, rows.back()[0].begin}) : "; ";
    write_transitions(text.insert(end, gap + row));
}

void ChartEditor::remove_transition(std::size_t transition) {
    std::string text = text_of(block_, transitions_setting);
    const auto rows = *rows_of(text);
    const bool is_last = transition + 1 == rows.size();
    const std::size_t begin = is_last && transition > 0 ? rows[transition - 1][columns - 1].end
                                                        : rows[transition][0].begin,
                      end = is_last ? rows[transition][columns - 1].end : rows[transition + 1][0].begin;
    write_transitions(text.erase(begin, end - begin));
}

void ChartEditor::set_entry(std::size_t transition, std::size_t column, const std::string& text) {
    std::string all = text_of(block_, transitions_setting);
    const Span entry = (*rows_of(all))[transition][column];
    write_transitions(all.replace(entry.begin, entry.end - entry.begin, text));
}

// ---- operations ----

ChartEditor Editor::chart_at(const std::string& path) {
    Block& block = block_at(path);
    if (!ChartEditor::may_edit(block))
        refuse(block.where, path, "its settings are evaluated before they are states and transitions",
               "write `states` as a list of names, and `transitions` as a matrix [from to condition "
               "minimum_time] "
               "with numbers of states");
    return ChartEditor(block);
}

bool Editor::is_chart(const std::string& path) const {
    const Block* const block = find(std::as_const(model_), path);
    return block && has_chart(*block);
}

std::size_t Editor::state_of(const ChartEditor& editor, const std::string& path,
                             const std::string& name) const {
    const auto state = editor.find_state(name);
    if (!state)
        refuse({}, path, "there is no state '" + name + "'", did_you_mean(name, editor.chart().states));
    return *state;
}

void Editor::require_free_state(const ChartEditor& editor, const std::string& path,
                                const std::string& name) const {
    if (!is_name(name) || name.find_first_of(",'\"{}()[]#:") != name.npos)
        refuse({}, path, "'" + name + "' is no name for a state", "use a word");
    if (editor.find_state(name))
        refuse({}, path, "there is a state '" + name + "' already", "use another name");
}

void Editor::add_state(const operations::Add& add) {
    if (!add.block.type.empty() || add.block.system || add.block.reference)
        refuse({}, add.system, "a chart has states, and no blocks", "add a block with a name alone");
    ChartEditor editor = chart_at(add.system);
    require_free_state(editor, add.system, add.block.name);
    editor.add_state(add.block.name);
    if (add.at) (*this)(operations::Move{joined(add.system, add.block.name), *add.at});
}

void Editor::remove_state(const std::string& machine, const std::string& name) {
    ChartEditor editor = chart_at(machine);
    const std::size_t state = state_of(editor, machine, name);
    if (editor.chart().states.size() == 1)
        refuse({}, machine, "a chart has at least one state", "add another one first");
    const Chart before = editor.chart();
    std::vector<bool> is_kept;
    for (const Transition& t : before.transitions) is_kept.push_back(t.from != state && t.to != state);
    editor.remove_state(state);
    renumber(machine, before, is_kept);
    follow([&](const std::string& path) -> std::vector<std::string> {
        if (rest_under(path, joined(machine, name))) return {};
        return {path};
    });
}

void Editor::renumber(const std::string& machine, const Chart& before, const std::vector<bool>& is_kept) {
    std::size_t number = 0;
    for (std::size_t i = 0; i < is_kept.size(); ++i) {
        number += is_kept[i];
        const std::string to = joined(machine, before.states[before.transitions[i].to]),
                          old = joined(to, std::to_string(i + 1)), now = joined(to, std::to_string(number));
        auto& wires = model_.layout.wires;
        if (!is_kept[i]) std::erase_if(wires, [&](const Bends& bends) { return bends.path == old; });
        const auto found = std::ranges::find(wires, old, &Bends::path);
        if (found != wires.end()) found->path = now;
    }
}

void Editor::rename_state(const std::string& machine, const std::string& name, const std::string& to) {
    if (name == to) return;
    ChartEditor editor = chart_at(machine);
    const std::size_t state = state_of(editor, machine, name);
    require_free_state(editor, machine, to);
    editor.rename_state(state, to);
    move_paths(joined(machine, name), joined(machine, to));
}

void Editor::connect_states(const operations::Connect& connect) {
    ChartEditor editor = chart_at(connect.system);
    editor.add_transition(state_of(editor, connect.system, connect.from),
                          state_of(editor, connect.system, connect.to));
}

void Editor::disconnect_states(const operations::Disconnect& disconnect) {
    ChartEditor editor = chart_at(disconnect.system);
    const auto transition = editor.find_transition(disconnect.to);
    if (!transition) refuse({}, disconnect.system, "there is no transition '" + disconnect.to + "'", "");
    const Chart before = editor.chart();
    std::vector<bool> is_kept(before.transitions.size(), true);
    is_kept[*transition] = false;
    editor.remove_transition(*transition);
    renumber(disconnect.system, before, is_kept);
}

void Editor::set_in_chart(const std::string& machine, const std::string& name, const operations::Set& set) {
    ChartEditor editor = chart_at(machine);
    if (const auto transition = editor.find_transition(name)) {
        const std::size_t column = set.name == "condition" ? 2 : 3;
        if (set.name != "condition" && set.name != "minimum_time")
            refuse({}, set.path, "there is no '" + set.name + "' to set here",
                   "set 'condition' or 'minimum_time'");
        const std::string text(trimmed(set.value.value_or("0")));
        const auto rows = rows_of("[0 0 0 " + text + "]"); // one entry it must stay
        if (!rows || rows->size() != 1)
            refuse({}, set.path, "'" + text + "' is no single entry of a matrix", "put it in parentheses");
        return editor.set_entry(*transition, column, text);
    }
    const std::size_t state = state_of(editor, machine, name);
    if (set.name != "initial" || set.value != "true")
        refuse({}, set.path, "of a state one can set 'initial' to true alone",
               "make another state the first one");
    editor.set_initial(state);
}

std::vector<Property> chart_properties(const Block& block, const std::string& name) {
    const auto chart = chart_of(block);
    if (!chart) return {};
    for (std::size_t i = 0; i < chart->transitions.size(); ++i)
        if (chart->name_of(i) == name)
            return {{.name = "condition", .value = chart->transitions[i].condition},
                    {.name = "minimum_time", .value = chart->transitions[i].minimum_time}};
    if (chart->states[chart->initial] == name)
        return {{.name = "initial", .value = "true", .choices = {"true"}}};
    return {{.name = "initial", .choices = {"true"}}};
}

} // namespace bf::model

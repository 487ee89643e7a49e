#include "nested_chart.hpp"

#include "bf/base/names.hpp"
#include "bf/model/chart.hpp"
#include "bf/model/edit.hpp"
#include "bf/model/listed.hpp"
#include "bf/model/suggest.hpp"
#include "identifiers.hpp"

#include <algorithm>
#include <array>
#include <cctype>

namespace bf::model {

namespace {

using Json = nlohmann::ordered_json;

bool is_number(const std::string& text) {
    return !text.empty() && std::isdigit(static_cast<unsigned char>(text[0])) != 0;
}
bool is_in_names(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// The states inside, which are all active at once where they are `regions`.
const char* inside_of(const Json& state) { return state.contains("regions") ? "regions" : "states"; }

const std::vector<std::string> actions{"entry", "during", "exit"};
const std::vector<std::string> transition_keys{"to", "on", "if", "after", "every", "do", "internal"};

bool is_list(const std::string& key) { return key == "to" || key == "on" || key == "initial"; }

std::string written(const Json& value) {
    if (!value.is_array()) return value.is_string() ? value.get<std::string>() : value.dump();
    std::string list;
    for (const auto& item : value) list += (list.empty() ? "" : ", ") + listed(written(item));
    return "[" + list + "]";
}

/// With blanks, as the reader of documents writes mappings.
std::string spaced(const Json& value) {
    std::string items;
    if (value.is_object())
        for (const auto& [key, item] : value.items())
            items += (items.empty() ? "" : ", ") + Json(key).dump() + ": " + spaced(item);
    else if (value.is_array())
        for (const auto& item : value) items += (items.empty() ? "" : ", ") + spaced(item);
    else
        return value.dump();
    return value.is_object() ? "{" + items + "}" : "[" + items + "]";
}

/// Of a list, of one text or the keys of a mapping.
std::vector<std::string> names_in(const Json& chart, const char* key) {
    std::vector<std::string> names;
    if (!chart.contains(key)) return names;
    const Json& given = chart[key];
    for (const auto& [name, value] : given.items())
        names.push_back(given.is_object() ? name : written(value));
    return names;
}

/// As many names from the end of a path as there are in another one.
std::string as_much_of(const std::string& path, const std::string& other) {
    auto dot = path.rfind('.');
    for (auto dots = std::ranges::count(other, '.'); dots > 0 && dot != path.npos; --dots)
        dot = dot > 0 ? path.rfind('.', dot - 1) : path.npos;
    return dot == path.npos ? path : path.substr(dot + 1);
}

/// The state of a path; empty: the chart itself. Null: there is none. `Any` is Json, or Json that is not
/// changed.
template <typename Any> Any* found_in(Any& chart, const std::string& path) {
    Any* at = &chart;
    for (std::string rest = path; !rest.empty();) {
        const std::string name = rest.substr(0, rest.find('.'));
        rest.erase(0, name.size() + 1);
        const char* const inside = inside_of(*at);
        if (!at->contains(inside) || !(*at)[inside].contains(name)) return nullptr;
        at = &(*at)[inside][name];
    }
    return at;
}

/// Calls `on_state` with each state and its path, from the outside in.
template <typename Any, typename OnState>
void each_state(Any& around, const OnState& on_state, const std::string& path = "") {
    if (!around.contains(inside_of(around))) return;
    for (auto&& [name, state] : around[inside_of(around)].items()) {
        on_state(joined(path, name), state);
        each_state(state, on_state, joined(path, name));
    }
}

/// Whether a name in a formula or an action may be a state's: not a function's, nor that of the event that
/// is raised, sent or cancelled, which have names of their own.
bool may_be_state(std::string_view text, std::string_view name) {
    const auto begin = static_cast<std::size_t>(name.data() - text.data());
    const std::string_view blanks = " \t";
    const std::size_t next = text.find_first_not_of(blanks, begin + name.size());
    if (next != text.npos && (text[next] == '(' || is_in_names(text[next]))) return false;
    std::string_view before = text.substr(0, begin);
    before = before.substr(0, before.find_last_not_of(blanks) + 1);
    return std::ranges::none_of(std::array<std::string_view, 3>{"raise", "send", "cancel"}, [&](auto word) {
        return before.ends_with(word) &&
               (before.size() == word.size() || !is_in_names(before[before.size() - word.size() - 1]));
    });
}

/// Takes transitions of the state `path` away; those after them have other numbers then.
template <typename IsGone>
void remove_transitions(Json& state, const std::string& path, const IsGone& is_gone, Renamed& renamed) {
    if (!state.contains("transitions")) return;
    Json kept = Json::array();
    std::size_t number = 0;
    for (Json& transition : state["transitions"]) {
        const std::string old = joined(path, std::to_string(++number));
        if (is_gone(transition)) {
            renamed.emplace_back(old, "");
            continue;
        }
        kept.push_back(std::move(transition));
        renamed.emplace_back(old, joined(path, std::to_string(kept.size())));
    }
    if (kept.empty())
        state.erase("transitions");
    else
        state["transitions"] = std::move(kept);
}

/// Refuses a chart or a state whose parts are not of the kind that all edits count on.
void require_form(const Json& around, const std::string& path = "") {
    const auto refuse = [](const std::string& what) {
        throw NestedChart::Refusal{what, "edit it in the file"};
    };
    const auto its = [&](const std::string& key) {
        return "the `" + key + "` of " + (path.empty() ? "its chart" : "'" + path + "'") + " are ";
    };
    if (around.contains("transitions") && !around["transitions"].is_array())
        refuse(its("transitions") + "no list");
    for (const char* key : {"states", "regions"}) {
        if (!around.contains(key)) continue;
        if (!around[key].is_object()) refuse(its(key) + "no mapping");
        for (const auto& [name, state] : around[key].items()) {
            const std::string inside = joined(path, name);
            if (!state.is_object() && !state.is_null()) refuse("the state '" + inside + "' is no mapping");
            require_form(state, inside);
        }
    }
}

void rename_key(Json& map, const std::string& from, const std::string& to) {
    Json renamed = Json::object();
    for (auto& [key, value] : map.items()) renamed[key == from ? to : key] = std::move(value);
    map = std::move(renamed);
}

} // namespace

bool NestedChart::is_in(const Block& block) {
    const Setting* const setting = has_chart(block) ? block.find_setting(chart_setting) : nullptr;
    return setting && setting->value.text.starts_with("{");
}

NestedChart::NestedChart(const Block& block)
    : json_(Json::parse(block.find_setting(chart_setting)->value.text, nullptr, false)) {
    if (!json_.is_object()) throw Refusal{"its `chart` is no mapping", "edit it in the file"};
    if (json_.contains("file"))
        throw Refusal{"its states stand in the file " + written(json_["file"]), "edit that file"};
    require_form(json_);
}

const NestedChart::Json* NestedChart::find(const std::string& path) const { return found_in(json_, path); }

void NestedChart::refuse_unknown(const std::string& path) const {
    std::vector<std::string> known;
    each_state(json_, [&](const std::string& other, const Json&) { known.push_back(other); });
    throw Refusal{"there is no state or transition '" + path + "'", name_remedy(path, known)};
}

void NestedChart::require_state(const std::string& path) const {
    if (path.empty() || !find(path)) refuse_unknown(path);
}

NestedChart::Json& NestedChart::state_at(const std::string& path) {
    require_state(path);
    Json& state = *found_in(json_, path);
    if (!state.is_object()) state = Json::object(); // `idle:` without anything
    return state;
}

const NestedChart::Json* NestedChart::transition_at(const std::string& path, std::string* state,
                                                    std::size_t* place) const {
    std::string at = path, number;
    while (is_number(split_last(at).second)) std::tie(at, number) = split_last(at);
    const Json* const source = number.empty() || at.empty() ? nullptr : find(at);
    if (!source || !source->is_object() || !source->contains("transitions")) return nullptr;
    const Json& all = (*source)["transitions"];
    const std::size_t found = std::stoul(number.substr(0, 6)) - 1;
    if (!all.is_array() || found >= all.size() || !all[found].is_object()) return nullptr;
    *state = at, *place = found;
    return &all[found];
}

std::string NestedChart::resolved(const std::string& name, const std::string& from) const {
    if (find(name)) return name;
    for (std::string around = from; !around.empty(); around = split_last(around).first)
        if (find(joined(around, name))) return joined(around, name);
    std::string only;
    int count = 0;
    each_state(json_, [&](const std::string& path, const Json&) {
        if (split_last(path).second != name) return;
        only = path;
        ++count;
    });
    return count == 1 ? only : "";
}

std::string NestedChart::name_of(const std::string& path, const std::string& from) const {
    for (auto dot = path.rfind('.'); dot != path.npos && dot > 0; dot = path.rfind('.', dot - 1))
        if (const std::string end = path.substr(dot + 1); resolved(end, from) == path) return end;
    return path;
}

void NestedChart::each_name(const std::function<void(const std::string&, std::string&)>& on_name) {
    const auto each_text = [](Json& value, const std::function<void(std::string&)>& on_text) {
        if (value.is_string()) on_text(value.get_ref<std::string&>());
        if (!value.is_array()) return;
        for (auto& item : value)
            if (item.is_string()) on_text(item.get_ref<std::string&>());
    };
    const auto goals = [&](const std::string& from, Json& map, const char* key) {
        if (map.contains(key)) each_text(map[key], [&](std::string& text) { on_name(from, text); });
    };
    // Formulas read states by names that nothing else has.
    std::vector<std::string> others{"time", "period", "time_in_state"};
    for (const char* key : {"inputs", "parameters", "variables"})
        std::ranges::copy(names_in(json_, key), std::back_inserter(others));
    const auto is_other = [&](const std::string& name) {
        return std::ranges::find(others, name) != others.end();
    };
    const auto formulas = [&](const std::string& from, Json& map, std::initializer_list<const char*> keys) {
        const auto in_text = [&](std::string& text) {
            const std::string before = text;
            const auto in_name = [&](std::string_view word) {
                std::string name(word);
                if (!is_other(name) && may_be_state(before, word)) on_name(from, name);
                return name;
            };
            text = replace_names(before, in_name, true);
        };
        for (const char* key : keys)
            if (map.contains(key)) each_text(map[key], in_text);
    };
    if (json_.contains("outputs"))
        each_text(json_["outputs"], [&, variables = names_in(json_, "variables")](std::string& text) {
            if (std::ranges::find(variables, text) == variables.end()) on_name("", text);
        });
    goals("", json_, "initial");
    formulas("", json_, {"begin"});
    each_state(json_, [&](const std::string& path, Json& state) {
        goals(path, state, "initial");
        goals(split_last(path).first, state, "to"); // of a history, which names what is beside it
        formulas(path, state, {"entry", "during", "exit", "begin"});
        if (!state.contains("transitions")) return;
        for (auto& transition : state["transitions"]) {
            if (transition.is_string()) on_name(path, transition.get_ref<std::string&>());
            goals(path, transition, "to");
            formulas(path, transition, {"if", "after", "every", "do"});
        }
    });
}

void NestedChart::add_state(const std::string& inside, const std::string& name) {
    Json& around = inside.empty() ? json_ : state_at(inside);
    Json& states = around[inside_of(around)];
    if (states.is_null()) states = Json::object();
    if (states.contains(name)) throw Refusal{"there is a state '" + name + "' already", "use another name"};
    states[name] = Json::object();
}

void NestedChart::rename_state(const std::string& path, const std::string& name) {
    const std::string around = split_last(path).first, old = split_last(path).second;
    require_state(path);
    const std::string renamed = joined(around, name);
    if (find(renamed)) throw Refusal{"there is a state '" + name + "' already", "use another name"};
    // What means the state, or one inside of it, before and under its new name.
    const auto now = [&](const std::string& meant) {
        const auto rest = rest_under(meant, path);
        return rest ? renamed + *rest : std::string();
    };
    std::vector<std::string> meant; // of all names in their order
    each_name(
        [&](const std::string& from, std::string& text) { meant.push_back(now(resolved(text, from))); });
    each_state(json_, [&](const std::string&, Json& state) {
        if (!state.contains("transitions")) return;
        for (auto& transition : state["transitions"]) {
            if (!transition.contains("on")) continue;
            const auto event = [&](Json& one) {
                if (one == "done.state." + old && resolved(old, path) == path) one = "done.state." + name;
            };
            if (transition["on"].is_array())
                for (auto& one : transition["on"]) event(one);
            else
                event(transition["on"]);
        }
    });
    Json& states = around.empty() ? json_ : state_at(around);
    rename_key(states[inside_of(states)], old, name);
    std::size_t i = 0;
    each_name([&](const std::string& from, std::string& text) {
        const std::string& its = meant[i++];
        if (its.empty()) return;
        text = as_much_of(its, text);
        if (resolved(text, from) != its) text = name_of(its, from);
    });
}

Renamed NestedChart::remove_state(const std::string& path) {
    require_state(path);
    std::vector<std::string> gone{path};
    const auto is_gone = [&](const std::string& meant) {
        return std::ranges::any_of(gone,
                                   [&](const auto& each) { return rest_under(meant, each).has_value(); });
    };
    const auto is_of_gone = [&](const Json& text, const std::string& from) {
        return text.is_string() && is_gone(resolved(text.get<std::string>(), from));
    };
    const auto leads_there = [&](const Json& goals, const std::string& from) {
        return goals.is_array()
                   ? std::ranges::any_of(goals, [&](const Json& goal) { return is_of_gone(goal, from); })
                   : is_of_gone(goals, from);
    };
    const auto is_way_there = [&](const Json& transition, const std::string& from) {
        return leads_there(transition.contains("to") ? transition["to"] : transition, from);
    };
    // A history or a junction that leads nowhere else goes, too, and with it what leads there.
    for (std::size_t before = 0; before < gone.size();) {
        before = gone.size();
        each_state(std::as_const(json_), [&](const std::string& at, const Json& state) {
            const bool is_junction = state.contains("junction") && written(state["junction"]) == "true";
            const bool is_lost = state.contains("history")
                                     ? state.contains("to") && leads_there(state["to"], split_last(at).first)
                                     : is_junction && state.contains("transitions") &&
                                           std::ranges::all_of(state["transitions"], [&](const Json& each) {
                                               return is_way_there(each, at);
                                           });
            if (is_lost && !is_gone(at)) gone.push_back(at);
        });
    }
    Renamed renamed;
    for (const auto& each : gone) renamed.emplace_back(each, "");
    // First of all what leads there, as long as names mean what they mean.
    const auto remove_initial = [&](Json& map, const std::string& from) {
        if (map.contains("initial") && leads_there(map["initial"], from)) map.erase("initial");
    };
    remove_initial(json_, "");
    const auto variables = names_in(json_, "variables");
    const auto is_state = [&](const Json& output) {
        return is_of_gone(output, "") &&
               std::ranges::find(variables, output.get<std::string>()) == variables.end();
    };
    if (json_.contains("outputs") && json_["outputs"].is_array())
        std::erase_if(json_["outputs"].get_ref<Json::array_t&>(), is_state);
    else if (json_.contains("outputs") && is_state(json_["outputs"]))
        json_.erase("outputs");
    each_state(json_, [&](const std::string& at, Json& state) {
        remove_initial(state, at);
        remove_transitions(
            state, at, [&](const Json& transition) { return is_way_there(transition, at); }, renamed);
    });
    for (const auto& each : gone) {
        const auto [around, name] = split_last(each);
        Json& outer = *found_in(json_, around);
        const char* const key = inside_of(outer);
        outer[key].erase(name);
        if (outer[key].empty()) outer.erase(key);
    }
    if (!json_.contains(inside_of(json_)))
        throw Refusal{"a chart has at least one state", "add another one first"};
    return renamed;
}

void NestedChart::connect(const std::string& from, const std::string& to) {
    Json& source = state_at(from);
    require_state(to);
    if (source.contains("history"))
        throw Refusal{"'" + from + "' is a history, which has no transitions", "set its `to`"};
    source["transitions"].push_back(Json{{"to", name_of(to, from)}});
}

Renamed NestedChart::disconnect(const std::string& transition) {
    std::string state;
    std::size_t place = 0;
    const Json* const removed = transition_at(transition, &state, &place);
    if (!removed) throw Refusal{"there is no transition '" + transition + "'", "look at the chart"};
    Renamed renamed;
    remove_transitions(
        state_at(state), state, [&](const Json& each) { return &each == removed; }, renamed);
    return renamed;
}

std::vector<Property> NestedChart::properties(const std::string& path) const {
    std::string state;
    std::size_t place = 0;
    const Json* at = transition_at(path, &state, &place);
    std::vector<std::string> keys = transition_keys;
    if (!at) {
        require_state(path);
        at = find(path);
        const bool has_history = at->is_object() && at->contains("history");
        keys = has_history ? std::vector<std::string>{"history", "to"} : actions;
        if (at->is_object() && at->contains("states")) keys.insert(keys.end(), {"initial", "begin"});
    }
    std::vector<Property> all;
    for (const auto& key : keys) {
        Property property{.name = key};
        if (at->is_object() && at->contains(key)) property.value = written((*at)[key]);
        if (key == "internal") property.choices = {"true"};
        if (key == "history") property.choices = {"shallow", "deep"};
        all.push_back(std::move(property));
    }
    return all;
}

void NestedChart::set(const std::string& path, const std::string& name,
                      const std::optional<std::string>& value) {
    const auto known = properties(path);
    if (std::ranges::find(known, name, &Property::name) == known.end()) {
        std::vector<std::string> names;
        for (const auto& property : known) names.push_back(property.name);
        throw Refusal{"there is no '" + name + "' to set here", name_remedy(name, names)};
    }
    std::string state;
    std::size_t place = 0;
    const bool is_transition = transition_at(path, &state, &place) != nullptr;
    Json& at = is_transition ? state_at(state)["transitions"][place] : state_at(path);
    if (!value || value->empty()) {
        at.erase(name);
    } else if (is_list(name) && value->starts_with('[')) {
        at[name] = Json::array();
        for (const auto& item : listed_texts(*value)) at[name].push_back(item.text);
    } else {
        at[name] = *value;
    }
}

std::string NestedChart::text() const { return spaced(json_); }

} // namespace bf::model

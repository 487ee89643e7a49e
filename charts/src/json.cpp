#include "actions.hpp"
#include "tree.hpp"

#include "bf/base/escape.hpp"
#include "bf/base/numbers.hpp"
#include "bf/charts/chart.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace bf::charts {

namespace {

using Json = nlohmann::ordered_json;
using Texts = std::vector<std::string>;

/// Reads the nested mappings and notes all that is wrong with them.
class JsonReader {
  public:
    std::vector<std::string> problems;

    Chart chart(const Json& json, const std::string& folder) {
        Chart chart;
        const std::string what = "the chart";
        const std::string file = json.contains("file") ? text(json["file"], what, "file") : "";
        if (!file.empty()) {
            if (json.contains("states") || json.contains("initial"))
                problems.push_back("the chart has a 'file' and states; the states stand in the file");
            chart = read_scxml(file.front() == '/' ? file : folder + (folder.empty() ? "" : "/") + file);
        }
        each(json, what,
             {"file", "inputs", "events", "parameters", "variables", "outputs", "run_to_completion",
              "initial", "begin", "states"},
             [&](const std::string& key, const Json& value) {
                 if (key == "inputs") chart.inputs = texts(value, what, key);
                 if (key == "events") chart.events = texts(value, what, key);
                 if (key == "parameters") chart.parameters = texts(value, what, key);
                 if (key == "outputs") chart.outputs = texts(value, what, key);
                 if (key == "run_to_completion") chart.is_completed = truth(value, what, key);
                 if (key == "initial") chart.root.initial = texts(value, what, key);
                 if (key == "begin") chart.root.begin = action(value, what, key);
                 if (key == "variables") variables(value, chart.variables);
                 if (key == "states") chart.root.states = states(value, what, false);
             });
        return chart;
    }

  private:
    static std::string described(const Json& value) {
        return escape::shortened(value.is_string() ? "'" + value.get<std::string>() + "'" : value.dump(), 60);
    }
    void report(const std::string& where, const std::string& key, const Json& value,
                const std::string& rule) {
        problems.push_back(where + ": '" + key + "' is " + described(value) + ", but must be " + rule);
    }

    template <class F>
    void each(const Json& map, const std::string& where, const Texts& known, const F& on_entry) {
        if (map.is_null()) return;
        if (!map.is_object()) {
            problems.push_back(where + " is " + described(map) + ", but must be a mapping");
            return;
        }
        for (const auto& [key, value] : map.items()) {
            if (std::ranges::find(known, key) == known.end()) {
                const std::string near = near_name(key, known);
                problems.push_back(
                    where + " has no '" + key + "'; " +
                    (near.empty() ? "it has " + joined_texts(known, ", ") : "did you mean '" + near + "'?"));
            } else {
                on_entry(key, value);
            }
        }
    }
    std::string text(const Json& value, const std::string& where, const std::string& key) {
        if (value.is_string()) return trimmed(value.get<std::string>());
        if (value.is_number() || value.is_boolean()) return value.dump();
        report(where, key, value, "a text");
        return {};
    }
    Texts texts(const Json& value, const std::string& where, const std::string& key) {
        if (!value.is_array()) return {text(value, where, key)};
        Texts all;
        for (const auto& item : value) all.push_back(text(item, where, key));
        return all;
    }
    std::string action(const Json& value, const std::string& where, const std::string& key) {
        return joined_texts(texts(value, where, key), "\n");
    }
    bool truth(const Json& value, const std::string& where, const std::string& key) {
        const std::string said = value.is_structured() ? "" : text(value, where, key);
        if (said != "true" && said != "false") report(where, key, value, "true or false");
        return said == "true";
    }
    void variables(const Json& value, std::vector<std::pair<std::string, double>>& all) {
        if (!value.is_object()) {
            for (const auto& name : texts(value, "the chart", "variables")) all.emplace_back(name, 0);
            return;
        }
        for (const auto& [name, initial] : value.items()) {
            const auto number =
                initial.is_structured() ? std::nullopt : number_of(text(initial, "the chart", "variables"));
            if (!number)
                problems.push_back("the chart: variable '" + name + "' begins with " + described(initial) +
                                   ", but must begin with a number; `begin` may compute another value");
            all.emplace_back(name, number.value_or(0));
        }
    }

    std::vector<State> states(const Json& map, const std::string& where, bool are_regions) {
        std::vector<State> all;
        if (!map.is_object()) {
            problems.push_back(where + ": '" + (are_regions ? "regions" : "states") + "' is " +
                               described(map) + ", but must be a mapping of names to states");
            return all;
        }
        for (const auto& [name, value] : map.items()) all.push_back(state(name, value));
        return all;
    }
    State state(const std::string& name, const Json& json) {
        State state{.name = name};
        const std::string where = "state '" + name + "'";
        Texts to;
        constexpr int deepest = 50;
        if (depth_ >= deepest) {
            problems.push_back(where + " is nested too deeply; 50 levels are the most");
            return state;
        }
        ++depth_;
        if (!is_identifier(name))
            problems.push_back(where +
                               " is no name; begin with a letter and go on with letters, digits and '_'");
        each(json, where,
             {"entry", "during", "exit", "initial", "begin", "states", "regions", "transitions", "final",
              "history", "junction", "to"},
             [&](const std::string& key, const Json& value) {
                 using Kind = State::Kind;
                 if (key == "entry") state.entry = action(value, where, key);
                 if (key == "during") state.during = action(value, where, key);
                 if (key == "exit") state.exit = action(value, where, key);
                 if (key == "initial") state.initial = texts(value, where, key);
                 if (key == "begin") state.begin = action(value, where, key);
                 if (key == "states") state.states = states(value, where, false);
                 if (key == "to") to = texts(value, where, key);
                 if (key == "regions") {
                     state.kind = Kind::parallel;
                     state.states = states(value, where, true);
                 }
                 if (key == "final" && truth(value, where, key)) state.kind = Kind::final;
                 if (key == "junction" && truth(value, where, key)) state.kind = Kind::junction;
                 if (key == "history") {
                     const std::string which = text(value, where, key);
                     if (which != "shallow" && which != "deep") report(where, key, value, "shallow or deep");
                     state.kind = which == "deep" ? Kind::deep_history : Kind::shallow_history;
                 }
                 if (key == "transitions") {
                     if (!value.is_array()) return report(where, key, value, "a list of transitions");
                     for (const auto& item : value)
                         state.transitions.push_back(transition(
                             item, where + ", transition " + std::to_string(state.transitions.size() + 1)));
                 }
             });
        if (json.is_object() && json.contains("regions") && json.contains("states"))
            problems.push_back(where +
                               " has 'states' and 'regions'; regions are active at once, of states one is");
        --depth_;
        if (is_history(state.kind))
            state.initial = to;
        else if (!to.empty())
            problems.push_back(where +
                               " has 'to', which a history has; a state has 'transitions: [{to: ...}]'");
        return state;
    }
    Transition transition(const Json& json, const std::string& where) {
        Transition made;
        if (json.is_string()) {
            made.to = {text(json, where, "to")};
            return made;
        }
        each(json, where, {"to", "on", "if", "after", "every", "do", "internal"},
             [&](const std::string& key, const Json& value) {
                 if (key == "to") made.to = texts(value, where, key);
                 if (key == "on") made.events = texts(value, where, key);
                 if (key == "if") made.condition = text(value, where, key);
                 if (key == "after") made.after = text(value, where, key);
                 if (key == "every") made.every = text(value, where, key);
                 if (key == "do") made.action = action(value, where, key);
                 if (key == "internal") made.is_internal = truth(value, where, key);
             });
        return made;
    }

    int depth_ = 0; ///< of the state that is read
};

} // namespace

Refused::Refused(std::vector<std::string> problems)
    : std::runtime_error(problems.empty() ? "" : problems.front()), problems_(std::move(problems)) {}

Chart read(const std::string& text, const std::string& folder) {
    const Json json = Json::parse(text, nullptr, false);
    if (json.is_discarded())
        throw Refused({"'" + escape::shortened(text, 40) +
                       "' is no chart; write it as a mapping, `chart: {states: {...}}`, or as JSON"});
    JsonReader reader;
    Chart chart = reader.chart(json, folder);
    if (!reader.problems.empty()) throw Refused(std::move(reader.problems));
    return chart;
}

} // namespace bf::charts

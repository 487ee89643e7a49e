#pragma once

#include "bf/model/operation.hpp"

#include <nlohmann/json.hpp>

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace bf::model {

/// Names of states and transitions of a chart before and after an edit; empty: gone. What is in a state goes
/// with it.
using Renamed = std::vector<std::pair<std::string, std::string>>;

/// Edits the chart of a state machine whose states have states inside, which its setting holds as JSON.
/// States have paths, "work.up", and transitions numbers, "work.up.1" for the first one that leaves that
/// state.
class NestedChart {
  public:
    /// Why something cannot be done.
    struct Refusal {
        std::string message, remedy;
    };

    /// Has the block such a chart?
    static bool is_in(const Block& block);
    /// Throws Refusal where the states stand in another file, or are not written as those of a chart.
    explicit NestedChart(const Block& block);

    void require_state(const std::string& path) const;
    /// `inside` is the path of the state around, empty for the chart itself.
    void add_state(const std::string& inside, const std::string& name);
    /// Whatever names the state, transitions, histories, formulas and outputs, follows.
    void rename_state(const std::string& path, const std::string& name);
    /// With the states inside of it, what leads there, histories and junctions that lead nowhere else, and
    /// outputs. Formulas and events that name it stay.
    Renamed remove_state(const std::string& path);
    void connect(const std::string& from, const std::string& to);
    Renamed disconnect(const std::string& transition);
    /// What properties() names; none: it is no longer given.
    void set(const std::string& path, const std::string& name, const std::optional<std::string>& value);
    std::vector<Property> properties(const std::string& path) const;

    /// As the reader writes the setting.
    std::string text() const;

  private:
    using Json = nlohmann::ordered_json;

    const Json* find(const std::string& path) const;
    Json& state_at(const std::string& path);
    [[noreturn]] void refuse_unknown(const std::string& path) const;
    /// The transitions of the state that the path of one begins with, and its place; null: it is none.
    const Json* transition_at(const std::string& path, std::string* state, std::size_t* place) const;
    /// The path of the state that a text means where it stands in the state `from`; empty: none.
    std::string resolved(const std::string& name, const std::string& from) const;
    /// Each text that may name states: goals, initial states, outputs, and names in formulas.
    void each_name(const std::function<void(const std::string& from, std::string& name)>& on_name);
    /// The shortest text that means a state where it stands in another one.
    std::string name_of(const std::string& path, const std::string& from) const;

    Json json_;
};

} // namespace bf::model

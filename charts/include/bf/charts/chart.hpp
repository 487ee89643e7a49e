// State charts as documents: what a person writes, in the model or in a file of SCXML.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace bf::charts {

/// What is wrong with a chart: which state and transition, value, rule and remedy. One text for each mistake.
class Refused : public std::runtime_error {
  public:
    explicit Refused(std::vector<std::string> problems);
    const std::vector<std::string>& problems() const { return problems_; }

  private:
    std::vector<std::string> problems_ = {};
};

/// Formulas and actions are text in the language of formulas; an action is a row of statements, parted by `;`
/// or lines: `x = formula`, `raise event`, `send event after formula`, `cancel event`, and `if formula`,
/// `elseif formula`, `else`, `end`.
struct Transition {
    std::vector<std::string> to = {}; ///< states; empty: none is left
    /// One of these has to happen; `a` is `a.b`, too, and `*` each; empty: none.
    std::vector<std::string> events = {};
    std::string condition = {}; ///< formula; empty: true
    std::string after = {};     ///< formula: the least time in the state [s]; empty: 0
    std::string every = {};     ///< formula: the period in the state with which it is taken [s]; empty: none
    std::string action = {};
    bool is_internal = false; ///< to states within its source: that one is not left
};

struct State {
    enum class Kind { plain, parallel, final, shallow_history, deep_history, junction };

    std::string name = {}; ///< of the chart itself: empty
    Kind kind = Kind::plain;
    std::string entry = {}, during = {}, exit = {}; ///< actions
    std::vector<std::string> initial = {};          ///< the states in which it begins; empty: the first one
    std::string begin = {};                         ///< action on the way to these
    std::vector<Transition> transitions = {};
    std::vector<State> states = {};
};

struct Chart {
    std::vector<std::string> inputs = {};     ///< ports; formulas read them by name
    std::vector<std::string> events = {};     ///< ports: the event happens while the input is true
    std::vector<std::string> parameters = {}; ///< names of the elements of the block's parameter p
    std::vector<std::pair<std::string, double>> variables = {}; ///< with their initial values
    std::vector<std::string> outputs = {};                      ///< variables and states that have a port
    bool is_completed = false; ///< a step ends where nothing more can happen, and not after one transition
    State root = {};
};

/// The chart of a state machine's argument: JSON, as the model's YAML is kept. File names are relative to the
/// folder. Throws Refused.
Chart read(const std::string& text, const std::string& folder);

/// A file of SCXML. Its formulas are those of this project; `_event`, `invoke` and other data models are
/// refused. Events that it does not raise itself are inputs. Throws Refused.
Chart read_scxml(const std::string& file);

/// A transition with the paths of its states, `walk.left`.
struct Arc {
    std::string from = {};
    std::vector<std::string> to = {}; ///< empty: none is left
    const Transition* transition = nullptr;
};

/// All transitions of a chart, in the order of its states. Throws Refused.
std::vector<Arc> arcs(const Chart& chart);

/// The paths of the states that can be active, by number from 1: the elements of the block's output `active`.
/// Throws Refused.
std::vector<std::string> state_paths(const Chart& chart);

/// "on go [u > 1] after 0.2 s / n = n + 1".
std::string label_of(const Transition& transition);

} // namespace bf::charts

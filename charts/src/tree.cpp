#include "tree.hpp"

#include "actions.hpp"

#include "bf/base/names.hpp"
#include "bf/kernels/chart.hpp"

#include <algorithm>
#include <functional>
#include <set>

namespace bf::charts {

namespace k = kernels::chart;

std::string joined_texts(const std::vector<std::string>& texts, const char* between) {
    std::string all;
    for (const auto& text : texts) all += (all.empty() ? "" : between) + text;
    return all;
}

std::string near_name(const std::string& name, const std::vector<std::string>& known) {
    const auto nearest = nearest_first(name, known, 1);
    const bool is_near =
        !nearest.empty() && edit_distance(name, nearest[0]) <= std::max<std::size_t>(1, name.size() / 3);
    return is_near ? nearest[0] : "";
}

Tree::Tree(const Chart& chart) : chart_(chart) {
    number(chart_.root);
    names();
    stop_if_wrong(); // what follows reads the names
    check_structure();
    stop_if_wrong();
}

void Tree::stop_if_wrong() {
    if (!problems_.empty()) throw Refused(std::move(problems_));
}

bool Tree::is_below(int s, int around) const {
    for (s = node(s).parent; s >= 0; s = node(s).parent)
        if (s == around) return true;
    return false;
}

void Tree::number(const State& root) {
    struct Other {
        const State* state;
        int parent;
        std::string path;
    };
    std::vector<Other> others;
    const std::function<void(const State&, int, const std::string&)> visit =
        [&](const State& state, int around, const std::string& its) {
            const int s = static_cast<int>(nodes_.size());
            nodes_.push_back({&state, its, around});
            if (around >= 0) node(around).children.push_back(s);
            for (const State& child : state.states) {
                const std::string name = its.empty() ? child.name : its + "." + child.name;
                if (is_history(child.kind) || child.kind == Kind::junction)
                    others.push_back({&child, s, name});
                else
                    visit(child, s, name);
            }
            node(s).last = static_cast<int>(nodes_.size()) - 1;
        };
    visit(root, -1, "");
    real_ = static_cast<int>(nodes_.size()) - 1;
    for (const auto& other : others) nodes_.push_back({other.state, other.path, other.parent});
    int compounds = 0;
    for (int s = 0; s <= real_; ++s)
        if (is_compound(s)) node(s).compound = compounds++;
    compounds_ = compounds;
    if (real_ > k::chart_most_states)
        refuse("the chart has " + std::to_string(real_) + " states; " + std::to_string(k::chart_most_states) +
               " are the most");
    if (compounds > k::chart_most_compounds)
        refuse("the chart has " + std::to_string(compounds) + " states with states inside; " +
               std::to_string(k::chart_most_compounds) + " are the most");
    // Each of them may choose a transition in the same step.
    if (const int at_once = innermost_at_once(0); at_once > k::chart_most_chosen)
        refuse("the chart has " + std::to_string(at_once) +
               " states without states inside that can be active at once; " +
               std::to_string(k::chart_most_chosen) + " are the most, join regions");
}

int Tree::innermost_at_once(int s) const {
    int sum = 0, most = 1;
    for (const int child : node(s).children) {
        const int its = innermost_at_once(child);
        sum += its;
        most = std::max(most, its);
    }
    return kind(s) == Kind::parallel ? std::max(sum, 1) : most;
}

void Tree::names() {
    std::set<std::string> paths;
    for (std::size_t s = 1; s < nodes_.size(); ++s) {
        if (!paths.insert(nodes_[s].path).second)
            refuse("there is a second " + called(static_cast<int>(s)) + "; rename one of them");
        by_name_[nodes_[s].state->name].push_back(static_cast<int>(s));
        by_path_[nodes_[s].path] = static_cast<int>(s);
    }
    std::set<std::string> taken;
    const auto take = [&](const std::string& name, const std::string& what) {
        if (!is_identifier(name))
            refuse(what + " '" + name +
                   "' is no name; begin with a letter and go on with letters, digits and '_'");
        else if (is_clock(name))
            refuse(what + " '" + name + "' has the name of what formulas know anyway; give it another name");
        else if (!taken.insert(name).second)
            refuse("'" + name +
                   "' is named twice among inputs, parameters and variables; rename one of them");
    };
    for (const auto& name : chart_.inputs) take(name, "the input");
    for (const auto& name : chart_.parameters) take(name, "the parameter");
    for (const auto& [name, initial] : chart_.variables) take(name, "the variable");
    for (const auto& name : chart_.outputs) {
        const bool is_variable =
            std::ranges::find(chart_.variables, name, &std::pair<std::string, double>::first) !=
            chart_.variables.end();
        if (!is_variable && named_state(name, 0) <= 0)
            refuse("the output '" + name + "' is no variable and no state; name it among the 'variables'");
    }
    const int cells = static_cast<int>(chart_.variables.size() + chart_.parameters.size());
    if (cells > k::chart_most_variables || chart_.variables.size() > k::chart_most_variables)
        refuse("the chart has " + std::to_string(cells) + " variables and parameters; " +
               std::to_string(k::chart_most_variables) + " are the most");
}

int Tree::named_state(const std::string& name, int from) const {
    for (int s = from; s >= 0; s = node(s).parent) {
        const auto found = by_path_.find(s == 0 ? name : node(s).path + "." + name);
        if (found != by_path_.end()) return found->second <= real_ ? found->second : 0;
    }
    const auto found = by_name_.find(name);
    const bool is_one = found != by_name_.end() && found->second.size() == 1;
    return is_one && found->second[0] <= real_ ? found->second[0] : 0;
}

int Tree::find(const std::string& name, int from, const std::string& where) {
    if (const auto found = by_path_.find(name); found != by_path_.end()) return found->second;
    for (int s = from; s >= 0; s = node(s).parent) { // relative paths, from the inside out
        const auto found = by_path_.find(s == 0 ? name : node(s).path + "." + name);
        if (found != by_path_.end()) return found->second;
    }
    const auto found = by_name_.find(name);
    if (found != by_name_.end() && found->second.size() == 1) return found->second[0];
    if (found != by_name_.end()) {
        std::vector<std::string> paths;
        for (const int s : found->second) paths.push_back(node(s).path);
        refuse(where + ": there are several states '" + name + "'; write " + joined_texts(paths, " or "));
        return -1;
    }
    std::vector<std::string> paths, known;
    for (const auto& [path, s] : by_path_) paths.push_back(path);
    for (const auto& [its, all] : by_name_) known.push_back(its);
    known.insert(known.end(), paths.begin(), paths.end());
    const std::string near = near_name(name, known);
    refuse(where + ": there is no state '" + name + "'" +
           (near.empty() ? "; the states are " + name_list(paths) : "; did you mean '" + near + "'?"));
    return -1;
}

std::vector<int> Tree::find_all(const std::vector<std::string>& names, int from, const std::string& where) {
    std::vector<int> all;
    for (const auto& name : names)
        if (const int s = find(name, from, where); s >= 0) all.push_back(s);
    return all;
}

void Tree::check_structure() {
    if (node(0).children.empty()) refuse("the chart has no states; write `states: {idle: {}}`");
    for (int s = 1; s < static_cast<int>(nodes_.size()); ++s) {
        const State& state = *node(s).state;
        const Kind its = state.kind, around = kind(node(s).parent);
        const std::string where = called(s);
        const bool is_pseudo = is_history(its) || its == Kind::junction;
        if ((is_pseudo || its == Kind::final) && !state.states.empty())
            refuse(where + " has states inside, which only a plain or parallel state has");
        if (is_pseudo && !(state.entry + state.during + state.exit).empty())
            refuse(where + " has actions, but is never active; let a transition `do` them");
        if (around == Kind::parallel && its == Kind::final)
            refuse(where + " is a final state among regions; put it into a region");
        if (its == Kind::final && !state.transitions.empty())
            refuse(where + " is final and has a transition; nothing leaves a final state");
        if (is_history(its) && state.initial.empty() && state.transitions.empty())
            refuse(where + " is a history and does not say where to go the first time; write `to: STATE`");
        if (is_history(its) && !state.transitions.empty())
            refuse(where + " is a history and has transitions; write `to: STATE`");
        if (its == Kind::junction && state.transitions.empty())
            refuse(where + " is a junction that nothing leaves; give it transitions");
        if (its == Kind::parallel && node(s).children.empty())
            refuse(where + " has no regions; give it at least one");
    }
}

std::string Tree::transition_name(int s, std::size_t i) const {
    const Transition& t = node(s).state->transitions[i];
    return called(s) + ", transition " + std::to_string(i + 1) +
           (t.to.empty() ? " (inside)" : " (to '" + joined_texts(t.to, " ") + "')");
}

namespace {

class Arcs : public Tree {
  public:
    explicit Arcs(const Chart& chart) : Tree(chart) {}

    std::vector<Arc> all() {
        std::vector<Arc> arcs;
        for (int s = 1; s < static_cast<int>(nodes_.size()); ++s)
            for (std::size_t i = 0; i < node(s).state->transitions.size(); ++i) {
                const Transition& t = node(s).state->transitions[i];
                Arc arc{node(s).path, {}, &t};
                for (const int to : find_all(t.to, s, transition_name(s, i))) arc.to.push_back(node(to).path);
                arcs.push_back(std::move(arc));
            }
        stop_if_wrong();
        return arcs;
    }
    std::vector<std::string> paths() const {
        std::vector<std::string> paths;
        for (int s = 1; s <= real_; ++s) paths.push_back(node(s).path);
        return paths;
    }
};

} // namespace

std::vector<Arc> arcs(const Chart& chart) { return Arcs(chart).all(); }
std::vector<std::string> state_paths(const Chart& chart) { return Arcs(chart).paths(); }

std::string label_of(const Transition& t) {
    std::string label;
    const auto add = [&](const std::string& text) { label += (label.empty() ? "" : " ") + text; };
    if (!t.events.empty()) add(joined_texts(t.events, ", "));
    if (!t.condition.empty()) add("[" + t.condition + "]");
    if (!t.after.empty()) add("after " + t.after + " s");
    if (!t.every.empty()) add("every " + t.every + " s");
    std::string action = t.action;
    std::ranges::replace(action, '\n', ';');
    if (!action.empty()) add("/ " + action);
    return label;
}

} // namespace bf::charts

// The states of a chart with their numbers, and what names stand for.
#pragma once

#include "bf/charts/chart.hpp"

#include <map>

namespace bf::charts {

using Kind = State::Kind;

inline bool is_history(Kind kind) { return kind == Kind::shallow_history || kind == Kind::deep_history; }

/// The one that was meant, or an empty text.
std::string near_name(const std::string& name, const std::vector<std::string>& known);
std::string joined_texts(const std::vector<std::string>& texts, const char* between);

/// A state with its number and those around it.
struct Node {
    const State* state = nullptr;
    std::string path; ///< `walk.left`
    int parent = -1, last = 0;
    std::vector<int> children = {}; ///< that may be active
    int compound = 0;
    std::vector<int> transitions = {}; ///< numbers of rows
};

/// States have numbers in the document's order, the chart being 0; histories and junctions come after them.
class Tree {
  public:
    /// Throws Refused.
    explicit Tree(const Chart& chart);

  protected:
    void stop_if_wrong();
    void refuse(const std::string& text) { problems_.push_back(text); }
    std::string called(int s) const {
        return s == 0 ? "the chart" : "state '" + nodes_[static_cast<std::size_t>(s)].path + "'";
    }
    std::string transition_name(int s, std::size_t i) const;
    Node& node(int s) { return nodes_[static_cast<std::size_t>(s)]; }
    const Node& node(int s) const { return nodes_[static_cast<std::size_t>(s)]; }
    Kind kind(int s) const { return node(s).state->kind; }
    bool is_compound(int s) const { return s == 0 || (kind(s) == Kind::plain && !node(s).children.empty()); }
    bool is_below(int s, int around) const;
    static bool is_clock(const std::string& name) {
        return name == "time" || name == "period" || name == "time_in_state";
    }
    /// The state that a formula or an output names; 0: none, or one of several.
    int named_state(const std::string& name, int from) const;
    /// The state of that name as seen from another one: its path from there or from further out, or a name
    /// that is the only one. -1 where there is none, which is noted.
    int find(const std::string& name, int from, const std::string& where);
    std::vector<int> find_all(const std::vector<std::string>& names, int from, const std::string& where);

    const Chart& chart_;
    std::vector<std::string> problems_;
    std::vector<Node> nodes_;
    int real_ = 0, compounds_ = 0; ///< how many may be active, and how many of these have one active child
    std::map<std::string, std::vector<int>> by_name_;
    std::map<std::string, int> by_path_;

  private:
    void number(const State& root);
    /// How many states without states inside can be active at once.
    int innermost_at_once(int s) const;
    void names();
    void check_structure();
};

} // namespace bf::charts

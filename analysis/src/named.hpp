// How quantities of a diagram are found by name: "arm.q", "arm.q[elbow]", "arm.q[2]".
#pragma once

#include "bf/elaborate/diagram.hpp"

#include <functional>
#include <set>
#include <string>
#include <vector>

namespace bf::analysis {

/// Where an input has its values: what it is wired to, if it is; all else has its own.
Node::End origin(const Diagram& d, const Node::End& end);

/// The first operands of a rule may be targets; outputs are so in the rules of outputs alone.
bool is_written(const Diagram& d, int node, Phase phase, const Call::Reference& operand);

/// The state of a block of that path, "block.state"; none: no node.
Node::End find_state(const Diagram& d, const std::string& path);

/// What a name stands for.
struct Named {
    Node::End end; ///< no node: nothing
    std::string path;
    std::string element; ///< "[elbow]", as it was given; empty: all of it
};
/// `look` finds a quantity by its path; what it does not find may end with an element in brackets.
Named named(const std::string& name, const std::function<Node::End(const std::string& path)>& look);
/// Empty: it has no such element.
std::vector<int> elements(const Diagram& d, const Named& named);

/// Numbers of nodes, as they came.
class NodeSet {
  public:
    bool contains(int node) const {
        return node < static_cast<int>(has_.size()) && has_[static_cast<std::size_t>(node)] != 0;
    }
    void insert(int node) {
        if (contains(node)) return;
        if (node >= static_cast<int>(has_.size())) has_.resize(static_cast<std::size_t>(node) + 1);
        has_[static_cast<std::size_t>(node)] = 1;
        nodes_.push_back(node);
    }
    void clear() {
        for (const int node : nodes_) has_[static_cast<std::size_t>(node)] = 0;
        nodes_.clear();
    }
    auto begin() const { return nodes_.begin(); }
    auto end() const { return nodes_.end(); }

  private:
    std::vector<char> has_;
    std::vector<int> nodes_;
};

/// Those nodes, and all that are reached from them: `visit(node, go)` calls `go` of each neighbour.
template <class Nodes = std::set<int>, class Visit> Nodes reached(Nodes nodes, Visit&& visit) {
    std::vector<int> pending(nodes.begin(), nodes.end());
    while (!pending.empty()) {
        const int node = pending.back();
        pending.pop_back();
        visit(node, [&](int other) {
            if (nodes.contains(other)) return;
            nodes.insert(other);
            pending.push_back(other);
        });
    }
    return nodes;
}

} // namespace bf::analysis

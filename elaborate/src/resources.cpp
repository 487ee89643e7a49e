// Blocks get the resources that other blocks of their subsystem, or of one around it, provide. What several
// would set in one step is refused.
#include "stages.hpp"

#include <algorithm>
#include <map>
#include <string_view>
#include <unordered_map>
#include <unordered_set>

namespace bf::elaboration {

namespace {

class Binding {
  public:
    explicit Binding(Elaboration& elaboration) : e_(elaboration), scopes_(e_.diagram.nodes.size()) {
        for (const auto& scope : e_.scopes)
            for (const int n : scope.nodes) scopes_[static_cast<std::size_t>(n)] = &scope;
    }

    void run() {
        for (std::size_t n = 0; n < scopes_.size(); ++n) bind(static_cast<int>(n));
    }

  private:
    /// Binds what a block requires, and then makes what it provides.
    void bind(int index, int depth = 0) {
        DiagramNode& node = e_.node(index);
        const auto& requirements = node.block->declaration().requirements;
        const auto& required = node.block->resolution().required;
        if (depth > 100) {
            e_.report.add(node.where, node.path, "resources need each other in a circle");
            return;
        }
        bool is_complete = true;
        for (std::size_t r = 0; r < requirements.size(); ++r) {
            const std::string& type = requirements[r].type;
            if (required[r]) continue;
            std::string found_twice;
            const auto from = provider(scopes_[static_cast<std::size_t>(index)], index, type, found_twice);
            if (!found_twice.empty())
                e_.report.add(node.where, node.path,
                              "finds more than one " + type + " around it: " + found_twice,
                              "keep one of them in this subsystem");
            if (from.node < 0) {
                e_.report.add(node.where, node.path,
                              "needs a " + type + ", and no enclosing subsystem has one",
                              "add a block that provides it beside this block or in a subsystem around it");
                is_complete = false;
                continue;
            }
            bind(from.node, depth + 1);
            const auto& made = e_.resolution(from.node).provided[static_cast<std::size_t>(from.slot)];
            if (!made) {
                is_complete = false;
                continue;
            }
            require(*node.block, static_cast<int>(r), made);
            node.providers[r] = from;
        }
        if (!is_complete || failed_.contains(index)) return;
        try {
            provide(*node.block);
        } catch (const std::exception& error) {
            failed_.insert(index);
            e_.report.add(node.where, node.path, error.what());
        }
    }

    /// The nearest enclosing subsystem that offers the resource; several at the same level are an error.
    Node::End provider(const Scope* scope, int user, const std::string& type, std::string& found_twice) {
        for (; scope; scope = scope->parent) {
            Node::End found;
            for (const auto& candidate : providers_of(*scope, type)) {
                if (candidate.node == user) continue;
                if (found.node >= 0) {
                    found_twice = e_.node(found.node).path + " and " + e_.node(candidate.node).path;
                    break;
                }
                found = candidate;
            }
            if (found.node >= 0) return found;
        }
        return {};
    }
    /// The blocks that stand directly in the subsystem and offer the resource. Listed once, as each block
    /// that needs one asks.
    const std::vector<Node::End>& providers_of(const Scope& scope, const std::string& type) {
        const auto [known, is_new] = providers_.try_emplace(&scope);
        if (is_new)
            for (const int n : scope.nodes) {
                const auto& provisions = e_.node(n).block->declaration().provisions;
                for (std::size_t p = 0; p < provisions.size(); ++p)
                    known->second[provisions[p].type].push_back({n, static_cast<int>(p)});
            }
        return known->second[type];
    }

    Elaboration& e_;
    std::vector<const Scope*> scopes_; ///< of the blocks
    std::unordered_map<const Scope*, std::unordered_map<std::string, std::vector<Node::End>>> providers_;
    std::unordered_set<int> failed_;
};

} // namespace

void bind_resources(Elaboration& e) { Binding(e).run(); }

void check_claims(Elaboration& e) {
    const auto stands_in = [&](int condition, int around) {
        for (; condition >= 0; condition = e.diagram.conditions[static_cast<std::size_t>(condition)].parent)
            if (condition == around) return true;
        return false;
    };
    std::map<std::pair<const void*, std::string_view>, std::vector<int>> claimed;
    for (int n = 0; n < static_cast<int>(e.diagram.nodes.size()); ++n)
        for (const Claim& claim : e.resolution(n).claims) {
            const DiagramNode& node = e.node(n);
            if (claim.input >= 0 && node.sources[static_cast<std::size_t>(claim.input)].node < 0) continue;
            auto& others = claimed[{claim.of, claim.what}];
            const auto other = std::find_if(others.begin(), others.end(), [&](int o) {
                return stands_in(e.node(o).condition, node.condition) ||
                       stands_in(node.condition, e.node(o).condition);
            });
            const int first = other == others.end() ? -1 : *other;
            others.push_back(n);
            if (first < 0) continue;
            e.report.add(node.where, node.path,
                         "sets " + claim.what + ", which " + e.node(first).path +
                             " sets in the same step, so that the one that runs later would undo the other",
                         "keep one of them, or put each into a conditional subsystem of its own");
            break; // of the same other block there is as much to say
        }
}

} // namespace bf::elaboration

// Blocks get the resources that other blocks of their subsystem, or of one around it, provide.
#include "stages.hpp"

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

} // namespace bf::elaboration

// What a simulation takes over from another one.
#pragma once

#include "bf/engine/simulation.hpp"

#include <memory>
#include <string>
#include <vector>

namespace bf {

/// By node of `to`, the node of `from` that it was, of the same type; -1: there is none.
std::vector<int> counterparts(const Diagram& from, const Diagram& to, const Origin& origin);
/// The path before, as far as it is known.
std::optional<std::string> path_before(const Origin& origin, const std::string& path);

/// All that is searched for and allocated when one simulation goes on where another one is, so that going on
/// itself only copies and exchanges.
struct Simulation::Succession {
    struct Copy {
        void* to;
        const void* from;
        std::size_t bytes;
    };

    /// Of a simulation that goes on from another one; that one goes on, too.
    Succession(const Simulation& from, const Diagram& to, const Origin& origin)
        : from(from), its(counterparts(from.diagram_, to, origin)) {}
    /// Of one that takes the place of the other. Throws RunError with what cannot go on, by the block's name.
    Succession(Simulation* replaced, const Diagram& to, const Origin& origin);

    /// As a context takes them: what goes on is not opened again.
    std::vector<Node> context_nodes(const Diagram& to) const;
    /// Addresses of what has a value in both, but constants.
    void find_copies(Simulation& to, const Origin& origin);

    const Simulation& from;
    const std::vector<int> its; ///< counterparts
    std::vector<Copy> copies;
    /// By node, where the place is taken: does it go on with what it has opened, is an object of it not there
    /// before? Such blocks have no constant outputs.
    std::vector<char> is_kept, is_absent;
    Simulation* replaced = nullptr;
    Context::Exchange objects;

  private:
    bool is_unchanged(const Diagram& to, int node) const;
};

} // namespace bf

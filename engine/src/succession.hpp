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

/// Whether what has the one path in the first diagram is what has the other one in the second.
using SamePath = std::function<bool(const std::string& before, const std::string& now)>;
/// Of slots whose numbers stand for names (see About::value_names), by the number in `was`, from 1, the
/// number of the same name in `is`; 0: it is gone. Empty where numbers stand for themselves.
std::vector<int> numbers_now(const Diagram& from, const Node::End& was, const Diagram& to,
                             const Node::End& is, const SamePath& is_same);
/// The number that stands now for what `number` stood for, which may be nothing; none: that is gone.
std::optional<double> number_now(const std::vector<int>& numbers, double number) noexcept;

/// All that is searched for and allocated when one simulation goes on where another one is, so that going on
/// itself only copies and exchanges.
struct Simulation::Succession {
    struct Copy {
        void* to;
        const void* from;
        std::size_t bytes;
    };
    /// A value of a slot whose numbers stand for names, see About::value_names.
    struct Number {
        std::vector<void*> to; ///< also the next state
        const void* from;
        Type type;
        int count;
        std::vector<int> numbers; ///< numbers_now
    };
    /// A block with such slots goes on where all that they stand for is still there, and else begins anew.
    struct Named {
        std::vector<Copy> copies;
        std::vector<Number> numbers;
        void take_over() const noexcept;
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
    std::vector<Named> named;
    /// By node, where the place is taken: does it go on with what it has opened, is an object of it not there
    /// before? Such blocks have no constant outputs.
    std::vector<char> is_kept, is_absent;
    Simulation* replaced = nullptr;
    Context::Exchange objects;

  private:
    bool is_unchanged(const Diagram& to, int node) const;
};

} // namespace bf

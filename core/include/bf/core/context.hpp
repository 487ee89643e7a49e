// All data of one running diagram, and its blocks' rules bound to that data.
#pragma once

#include "bf/core/block.hpp"

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace bf {

/// One resolved block of a diagram and what its inputs and resources are wired to.
struct Node {
    const Block* block = nullptr;
    Block::Methods methods;
    /// The end of a wire: slot `slot` of node `node`; node -1: nothing.
    struct End {
        int node = -1, slot = -1;
    };
    std::vector<End>
        sources; ///< one per slot; used for inputs. Unconnected inputs own memory with their initial value
    std::vector<End> providers; ///< one per requirement: the node and its provision
    int clock = 0;              ///< which of the context's clocks the block sees
    /// Who opens the live objects of requirements and of provisions, where they are shared with somebody
    /// outside the context; one each, or none at all. What is borrowed for a requirement its owner saves.
    std::vector<std::function<Object()>> borrowed = {}, shared = {};
    bool awaits_objects = false; ///< has none before an exchange brings another context's
};

/// One bound call: a rule or a method of a block, ready to run.
struct Task {
    Call::Run run = nullptr;
    const void* data = nullptr;
    int count = 0;
    Status operator()() const { return run(data, count); }
};

/// Doubles that are copied, one after the other.
struct Move {
    double* to;
    const double* from;
    int count;
};

/// Becomes one with what is moved next, if it goes on there and writes nothing that is read then.
bool join(Move& move, const Move& next);

/// Owns signals, parameters, states, workspaces and opened resources of all nodes. Construction allocates
/// everything that a run will need.
class Context {
  public:
    /// The nodes' blocks must be resolved and outlive the context. Throws what opening a resource throws.
    Context(const std::vector<Node>& nodes, int clocks = 1);
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    /// Memory outside the context for one slot: `next` for its next state, `rate` for its derivative. An
    /// input with memory outside counts as connected where `connects`. To be said before a task of the node
    /// is bound.
    struct Memory {
        void *now = nullptr, *next = nullptr, *rate = nullptr;
        bool connects = false;
    };
    void use_memory(int node, int slot, const Memory& memory);

    /// Number of activities of a node in a phase (rules plus the overridden method).
    int activities(int node, Phase phase) const;
    /// Binds activity i of a node in a phase. Valid as long as the context.
    Task task(int node, Phase phase, int i);
    /// What that task does, where it does nothing but copy doubles from place to place; else none.
    std::vector<Move> moves(const Task& task, int node, Phase phase, int i) const;

    /// A quantity := what is at `source`, of which one element expands, or `values` where that is none. Of a
    /// state x⁻ and x⁺ agree afterwards.
    void set(const Node::End& quantity, const Node::End& source, const std::vector<double>& values);
    /// States have their declared initial values.
    void set_states(int node);
    /// The block's own `reset` changes them; x⁻ and x⁺ agree afterwards.
    Status reset(int node);
    /// Both.
    Status initialize(int node) { return set_states(node), reset(node); }
    /// The block's answer to its guards, by its tasks of that phase: x := x⁺ for all its states, which begin
    /// as x⁻.
    Status event(int node, std::span<const Task> tasks);
    /// x := next x for the discrete states of one node.
    void commit(int node);
    void start(int node);
    void stop(int node) noexcept;

    void* data(int node, int slot) { return frames_[static_cast<std::size_t>(node)].now[slot]; }
    const void* data(int node, int slot) const { return frames_[static_cast<std::size_t>(node)].now[slot]; }
    void* next_data(int node, int slot) { return frames_[static_cast<std::size_t>(node)].next[slot]; }
    Clock& clock(int i) { return clocks_[static_cast<std::size_t>(i)]; }
    const Frame& frame(int node) const { return frames_[static_cast<std::size_t>(node)]; }

    /// The continuous state vector of the whole diagram and its derivative, in node order. All double.
    std::span<double> continuous_state();
    std::span<double> continuous_rate();

    /// Signals, states and outside states: everything a run needs to go on bit for bit.
    std::size_t snapshot_size() const; ///< bytes
    void save(std::byte* to) const;
    void restore(const std::byte* from);
    /// The first node with outside state that cannot be saved, or -1.
    int refuses_snapshot() const;
    /// All nodes that own such a state or use one through a resource: what they compute depends on more than
    /// the diagram.
    std::vector<int> devices() const;

    /// The nodes that own such a state, saved or not.
    std::vector<int> outside() const;

    std::size_t signal_bytes() const, parameter_bytes() const, state_bytes() const;

    /// Objects that change their contexts, found before.
    struct Exchange {
        struct Pair {
            Object *own, *other;
        };
        struct User {
            void** pointer;
            const Object* object;
        };
        std::vector<Pair> pairs;
        std::vector<User> users; ///< of this context
        /// Afterwards nothing of those nodes is to be called in the other context, which keeps alive what
        /// their objects were made from. Allocates nothing.
        void make() noexcept;
    };
    /// Of nodes that await objects, and what each of them was in another context: of the same type and
    /// arguments. Both contexts outlive it.
    Exchange exchange(Context& other, std::span<const std::pair<int, int>> nodes);

  private:
    /// f(number in the declaration) of those objects of a node that do not come from another node.
    template <class F> static void for_each_own_object(const Node& node, F&& f);
    Object* objects_of(int node);
    template <class F> Status write_states(int node, F&& write);
    struct Arena;
    struct NodeTables;
    struct MethodCall;
    std::vector<Node> nodes_;
    std::vector<Clock> clocks_;
    std::vector<Frame> frames_;
    std::vector<void*> pointers_; // the tables that frames point into
    std::vector<Size> sizes_;
    std::vector<std::uint8_t> connected_;
    std::vector<Object> objects_; // owned, in order of declaration
    std::vector<int> object_nodes_;
    std::unique_ptr<Arena> signals_, parameters_, discrete_, discrete_next_, continuous_, continuous_next_,
        rates_, work_;
    std::vector<std::unique_ptr<Operand[]>> operands_;
    std::vector<std::unique_ptr<MethodCall>> calls_;
    bool has_memory_outside_ = false;
};

/// What the states of a node begin with: f(state, source, values), as Context::set takes them.
template <class F> void for_each_initial(const Block& block, int node, F&& f) {
    const auto& slots = block.resolution().slots;
    for (int i = 0; i < static_cast<int>(slots.size()); ++i)
        if (const Slot& slot = slots[static_cast<std::size_t>(i)]; is_state(slot.role))
            f(Node::End{node, i}, slot.initial_from < 0 ? Node::End() : Node::End{node, slot.initial_from},
              slot.initial);
}

/// Copies `values` (column-major; one element expands; empty: zeros) into `count` elements of `type`.
/// Values are rounded to the nearest and saturated for integer types.
void write_values(void* to, Type type, int count, const std::vector<double>& values);
/// Element i as a double.
double read_value(const void* from, Type type, int i);

} // namespace bf

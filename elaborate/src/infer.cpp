// Sizes and types spread along the wires, forwards and backwards, until nothing new is learned.
#include "stages.hpp"

#include <deque>
#include <unordered_set>

namespace bf::elaboration {

namespace {

class Spreading {
  public:
    explicit Spreading(Elaboration& elaboration) : e_(elaboration), queued_(e_.diagram.nodes.size(), true) {
        consumers_.resize(queued_.size());
        for (std::size_t n = 0; n < queued_.size(); ++n) {
            queue_.push_back(static_cast<int>(n));
            for (std::size_t i = 0; i < e_.diagram.nodes[n].sources.size(); ++i)
                if (const auto& from = e_.diagram.nodes[n].sources[i]; from.node >= 0)
                    consumers_[static_cast<std::size_t>(from.node)].push_back(
                        {static_cast<int>(n), static_cast<int>(i)});
        }
    }

    void run() {
        drain();
        // What the wiring leaves open has the usual meaning: numbers are double.
        for (std::size_t n = 0; n < queued_.size(); ++n) {
            auto& d = e_.declaration(static_cast<int>(n));
            bool learned = false;
            for (std::size_t i = 0; i < d.slots.size(); ++i)
                if (!d.slots[i].type_known) learned = offer(d, static_cast<int>(i), Type::float64) || learned;
            if (learned) push(static_cast<int>(n));
            drain();
        }
        // An optional input that nobody wires is a scalar, unless the block knows better.
        for (std::size_t n = 0; n < queued_.size(); ++n) {
            auto& d = e_.declaration(static_cast<int>(n));
            for (std::size_t i = 0; i < d.slots.size(); ++i)
                if (d.slots[i].role == Role::input && !d.slots[i].size_known &&
                    e_.node(static_cast<int>(n)).sources[i].node < 0) {
                    offer(d, static_cast<int>(i), Size{});
                    push(static_cast<int>(n));
                    drain();
                }
        }
        for (std::size_t n = 0; n < queued_.size(); ++n) report_open(static_cast<int>(n));
    }

  private:
    void push(int node) {
        if (queued_[static_cast<std::size_t>(node)]) return;
        queued_[static_cast<std::size_t>(node)] = true;
        queue_.push_back(node);
    }

    void drain() {
        while (!queue_.empty()) {
            const int n = queue_.front();
            queue_.pop_front();
            queued_[static_cast<std::size_t>(n)] = false;
            try {
                propagate(*e_.node(n).block);
            } catch (const std::exception& error) { // also what a resource says, e.g. an unknown frame
                report(n, error.what());
            }
            for (const auto& to : consumers_[static_cast<std::size_t>(n)])
                share(e_.node(to.node).sources[static_cast<std::size_t>(to.slot)], to);
            const auto& sources = e_.node(n).sources;
            for (std::size_t i = 0; i < sources.size(); ++i)
                if (sources[i].node >= 0) share(sources[i], {n, static_cast<int>(i)});
        }
    }

    /// One wire: each end learns from the other.
    void share(const Node::End& from, const Node::End& to) {
        auto& source = e_.declaration(from.node);
        auto& target = e_.declaration(to.node);
        Slot& a = source.slots[static_cast<std::size_t>(from.slot)];
        Slot& b = target.slots[static_cast<std::size_t>(to.slot)];
        const auto tell = [&](Declaration& d, const Node::End& end, auto news) {
            try {
                if (offer(d, end.slot, news)) push(end.node);
            } catch (const ResolutionError& error) {
                report(to.node, std::string(error.what()) + " (" + e_.diagram.end_path(from) + " -> " +
                                    e_.diagram.end_path(to) + ")");
            }
        };
        if (a.size_known && !(b.size_known && b.size == a.size) && !is_told(to, 0))
            tell(target, to, a.size);
        else if (!a.size_known && b.size_known)
            tell(source, from, b.size);
        const bool a_knows = knows_type(source, a), b_knows = knows_type(target, b);
        if (a_knows && !is_told(to, 1))
            tell(target, to, type_of_slot(source, a));
        else if (!a_knows && b_knows)
            tell(source, from, type_of_slot(target, b));
    }

    static bool knows_type(const Declaration& d, const Slot& s) {
        return s.type_symbol < 0 || d.types[static_cast<std::size_t>(s.type_symbol)].known;
    }
    static Type type_of_slot(const Declaration& d, const Slot& s) {
        return s.type_symbol < 0 ? s.type : d.types[static_cast<std::size_t>(s.type_symbol)].type;
    }

    /// Each input hears its source's size and type once.
    bool is_told(const Node::End& to, int what) {
        const std::uint64_t key =
            (static_cast<std::uint64_t>(to.node) << 24 | static_cast<std::uint64_t>(to.slot) << 1) |
            static_cast<std::uint64_t>(what);
        return !told_.insert(key).second;
    }

    void report(int node, const std::string& text) {
        if (reported_.insert(text + e_.node(node).path).second)
            e_.report.add(e_.node(node).where, e_.node(node).path, text);
    }

    void report_open(int n) {
        if (!e_.report.is_empty()) return; // what is open then follows from what was reported
        const auto& d = e_.declaration(n);
        for (const int i : unresolved(d)) {
            const Slot& slot = d.slots[static_cast<std::size_t>(i)];
            e_.report.add(e_.node(n).where, e_.node(n).path,
                          std::string("the size of ") + name(slot.role) + " '" + slot.name +
                              "' cannot be found from the wiring",
                          "connect the block, or give a parameter with the wanted size");
        }
        for (const auto& slot : d.slots) {
            const int count = slot.size.count();
            if (slot.role == Role::parameter && slot.initial.size() > 1 &&
                static_cast<int>(slot.initial.size()) != count)
                e_.report.add(e_.node(n).where, e_.node(n).path,
                              "parameter '" + slot.name + "' has " + std::to_string(slot.initial.size()) +
                                  " elements, but needs " + std::to_string(count),
                              "give one element or " + std::to_string(count));
            if (slot.initial_from >= 0) {
                const Slot& from = d.slots[static_cast<std::size_t>(slot.initial_from)];
                if (from.size.count() != 1 && from.size.count() != count)
                    e_.report.add(e_.node(n).where, e_.node(n).path,
                                  "parameter '" + from.name + "' has " + std::to_string(from.size.count()) +
                                      " elements, but the state '" + slot.name + "' needs " +
                                      std::to_string(count),
                                  "give one element or " + std::to_string(count));
            }
        }
        for (const auto* rules : {&d.output_rules, &d.update_rules, &d.derivative_rules})
            for (const Call& call : *rules)
                if (call.symbols == 1 && !call.run[static_cast<std::size_t>(d.types[0].type)])
                    e_.report.add(e_.node(n).where, e_.node(n).path,
                                  "the block does not work on signals of type " +
                                      std::string(bf::name(d.types[0].type)),
                                  "insert a Convert block before it");
    }

    Elaboration& e_;
    std::deque<int> queue_;
    std::vector<bool> queued_;
    std::vector<std::vector<Node::End>> consumers_;
    std::unordered_set<std::uint64_t> told_;
    std::unordered_set<std::string> reported_;
};

} // namespace

void infer_shapes(Elaboration& e) { Spreading(e).run(); }

} // namespace bf::elaboration

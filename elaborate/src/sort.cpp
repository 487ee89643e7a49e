// The plan: output activities in the order of the data, ties broken by document order.
#include "stages.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <set>

namespace bf::elaboration {

namespace {

class Sorting {
  public:
    explicit Sorting(Elaboration& elaboration)
        : e_(elaboration), nodes_(e_.diagram.nodes), plan_(e_.diagram.plan) {}

    void run() {
        make_vertices();
        make_edges();
        for (int loop = static_cast<int>(plan_.loops.size()); loop-- > 0;) {
            auto& outputs = order(loop);
            plan_.loops[static_cast<std::size_t>(loop)].outputs = std::move(outputs);
        }
        plan_.outputs = std::move(order(-1));
        const auto updates = [](const Declaration& d, const Block::Methods& m) {
            return static_cast<int>(d.update_rules.size()) + m.update;
        };
        plan_.updates = collect(-1, updates);
        for (std::size_t loop = 0; loop < subsystem_loops_; ++loop)
            plan_.loops[loop].updates = collect(static_cast<int>(loop), updates);
        plan_.derivatives = collect(-1, [](const Declaration& d, const Block::Methods& m) {
            return static_cast<int>(d.derivative_rules.size()) + m.derivative;
        });
        plan_.guards = collect(-1, [](const Declaration& d, const Block::Methods& m) {
            return static_cast<int>(d.guard_rules.size()) + m.guards;
        });
        // Where shapes cannot be told, loops are looked for before there are rates.
        std::erase_if(plan_.guards, [&](const Segment& segment) {
            return segment.rate < 0 ||
                   !e_.diagram.rates[static_cast<std::size_t>(segment.rate)].is_continuous;
        });
    }

  private:
    struct Edge {
        int from, to;
        int from_slot, to_slot; ///< for the report; -1: not a wire; of a condition: the number of its signal
    };
    /// What runs together: rate and condition.
    using Group = std::pair<int, int>;

    static int count(const Declaration& d, const Block::Methods& methods) {
        return static_cast<int>(d.output_rules.size()) + methods.output;
    }

    void make_vertices() {
        subsystem_loops_ = plan_.loops.size();
        first_.resize(nodes_.size());
        for (std::size_t n = 0; n < nodes_.size(); ++n) {
            first_[n] = static_cast<int>(vertices_.size());
            for (int i = 0; i < count(nodes_[n].block->declaration(), nodes_[n].methods); ++i)
                vertices_.push_back({static_cast<int>(n), i});
        }
        const auto& conditions = e_.diagram.conditions;
        condition_vertex_.assign(conditions.size(), -1);
        for (std::size_t c = 1; c < conditions.size(); ++c) {
            condition_vertex_[c] = static_cast<int>(vertices_.size());
            vertices_.push_back({-1, 0, static_cast<int>(c)});
        }
        for (std::size_t l = 0; l < plan_.loops.size(); ++l) add_loop_vertex(static_cast<int>(l));
    }

    void add_loop_vertex(int loop) {
        loop_vertex_.push_back(static_cast<int>(vertices_.size()));
        vertices_.push_back({-1, 0, 0, loop});
    }

    /// The loop that an activity stands in. What is constant runs once, before all loops.
    int loop_of(int v) const {
        const auto& a = vertices_[static_cast<std::size_t>(v)];
        if (const auto moved = in_algebraic_.find(v); moved != in_algebraic_.end()) return moved->second;
        if (a.loop >= 0) return plan_.loops[static_cast<std::size_t>(a.loop)].parent;
        if (a.node < 0) return e_.diagram.conditions[static_cast<std::size_t>(a.condition)].loop;
        const auto& node = nodes_[static_cast<std::size_t>(a.node)];
        return node.rate == constant_rate ? -1 : node.loop;
    }

    /// The activity of the given loop's body that contains v, or -1.
    int lifted(int v, int loop) const {
        while (loop_of(v) != loop) {
            if (loop_of(v) < 0) return -1;
            v = loop_vertex_[static_cast<std::size_t>(loop_of(v))];
        }
        return v;
    }

    /// The activity that completes an output; -1 for an output that is only memory (a root input).
    int writer(const Node::End& end) const {
        if (end.node < 0) return -1;
        const auto& node = nodes_[static_cast<std::size_t>(end.node)];
        const auto& rules = node.block->declaration().output_rules;
        for (std::size_t i = rules.size(); i-- > 0;)
            if (rules[i].writes(end.slot))
                return first_[static_cast<std::size_t>(end.node)] + static_cast<int>(i);
        return node.methods.output
                   ? first_[static_cast<std::size_t>(end.node)] + static_cast<int>(rules.size())
                   : -1;
    }

    void link(int from, int to, int from_slot = -1, int to_slot = -1) {
        if (from >= 0 && to >= 0) edges_.push_back({from, to, from_slot, to_slot});
    }

    void make_edges() {
        for (std::size_t n = 0; n < nodes_.size(); ++n) {
            const auto& node = nodes_[n];
            const auto& d = node.block->declaration();
            const auto& rules = d.output_rules;
            for (std::size_t i = 0; i < rules.size(); ++i) {
                const int to = first_[n] + static_cast<int>(i);
                for (const auto& operand : rules[i].operands)
                    if (operand.source == Call::Source::slot &&
                        d.slots[static_cast<std::size_t>(operand.slot)].role == Role::input)
                        if (const auto& from = node.sources[static_cast<std::size_t>(operand.slot)];
                            from.node >= 0)
                            link(writer(from), to, from.slot, operand.slot);
                // Rules that share a workspace or an output keep the order in which the block declares them.
                for (std::size_t before = 0; before < i; ++before)
                    if (share_memory(d, rules[before], rules[i]))
                        link(first_[n] + static_cast<int>(before), to);
            }
            if (node.methods.output) {
                const int to = first_[n] + static_cast<int>(rules.size());
                for (std::size_t i = 0; i < d.slots.size(); ++i)
                    if (d.slots[i].role == Role::input && node.sources[i].node >= 0 &&
                        reads(node, static_cast<int>(i)))
                        link(writer(node.sources[i]), to, node.sources[i].slot, static_cast<int>(i));
            }
            // Nothing of a conditional subsystem runs before its condition was looked at, but what is
            // constant runs before all loops.
            const auto& around = e_.diagram.conditions[static_cast<std::size_t>(node.condition)];
            if (node.condition > 0 && !(node.rate == constant_rate && around.loop >= 0))
                for (int v = first_[n]; v < first_[n] + count(d, node.methods); ++v)
                    link(condition_vertex_[static_cast<std::size_t>(node.condition)], v);
            if (merges(node))
                for (std::size_t i = 0; i < rules.size(); ++i)
                    link(condition_vertex_[static_cast<std::size_t>(merged(node, i).second)],
                         first_[n] + static_cast<int>(i));
        }
        for (std::size_t c = 1; c < e_.diagram.conditions.size(); ++c) {
            const auto& condition = e_.diagram.conditions[c];
            int number = 0;
            for (const auto& signal : {condition.enable, condition.trigger, condition.reset})
                link(writer(signal), condition_vertex_[c], signal.slot, number++);
            if (condition.parent > 0)
                link(condition_vertex_[static_cast<std::size_t>(condition.parent)], condition_vertex_[c]);
        }
        for (std::size_t l = 0; l < plan_.loops.size(); ++l) {
            const auto& loop = plan_.loops[l];
            for (const auto& signal : {loop.count, loop.initial})
                link(writer(signal), loop_vertex_[l], signal.slot);
            if (loop.condition > 0)
                link(condition_vertex_[static_cast<std::size_t>(loop.condition)], loop_vertex_[l]);
        }
    }

    /// Do both rules touch the same memory, one of them writing?
    static bool share_memory(const Declaration& d, const Call& a, const Call& b) {
        const auto touches = [](const Call& call, int slot) { return call.writes(slot) || call.reads(slot); };
        for (std::size_t i = 0; i < d.slots.size(); ++i) {
            const int slot = static_cast<int>(i);
            if (d.slots[i].role != Role::output && d.slots[i].role != Role::workspace) continue;
            if ((a.writes(slot) && touches(b, slot)) || (b.writes(slot) && touches(a, slot))) return true;
        }
        return false;
    }

    /// Does the block's output method read the input? Asked per output where the block says so.
    static bool reads(const DiagramNode& node, int input) {
        const auto& slots = node.block->resolution().slots;
        const bool is_bound = node.block->resolution().is_bound();
        bool has_output = false;
        for (std::size_t o = 0; o < slots.size(); ++o)
            if (slots[o].role == Role::output) {
                has_output = true;
                if (is_bound && node.block->feedthrough(static_cast<int>(o), input)) return true;
            }
        return !(has_output && is_bound) && slots[static_cast<std::size_t>(input)].feedthrough;
    }

    /// A Merge takes over each of its inputs when the subsystem runs that computes it.
    static bool merges(const DiagramNode& node) { return node.block->declaration().traits.merges; }
    Group merged(const DiagramNode& node, std::size_t rule) const {
        const auto& input = node.block->declaration().output_rules[rule].operands.back();
        const int from = node.sources[static_cast<std::size_t>(input.slot)].node;
        const auto& source =
            from < 0 ? node : nodes_[static_cast<std::size_t>(from)]; // open in a wrong model
        return {source.rate, source.condition};
    }

    Group group(int v) const {
        const auto& a = vertices_[static_cast<std::size_t>(v)];
        if (a.node >= 0) {
            const auto& node = nodes_[static_cast<std::size_t>(a.node)];
            return merges(node) ? merged(node, static_cast<std::size_t>(a.index))
                                : Group{node.rate, node.condition};
        }
        if (a.loop >= 0) {
            const auto& loop = plan_.loops[static_cast<std::size_t>(a.loop)];
            return {loop.rate, loop.condition};
        }
        const auto& condition = e_.diagram.conditions[static_cast<std::size_t>(a.condition)];
        return {condition.rate, condition.parent};
    }

    /// The body of a loop, or the whole diagram (-1), as Kahn's algorithm puts it in order. Among what is
    /// ready, the running segment goes on as long as it can; otherwise the first in document order.
    std::vector<Segment>& order(int loop) {
        while (true) {
            make_level(loop);
            sorted_.clear();
            std::fill(open_.begin(), open_.end(), 0);
            for (const auto& edge : level_edges_) ++open_[static_cast<std::size_t>(edge.to)];
            for (const int v : level_)
                if (open_[static_cast<std::size_t>(v)] == 0) make_ready(v);
            std::size_t done = 0;
            bool is_restarted = false;
            Group current{-1, -1};
            for (int loops = 0; done < level_.size() && loops < most_loops;) {
                if (ready_.empty()) {
                    if (solve_loops(loop)) {
                        is_restarted = true;
                        break;
                    }
                    break_loop();
                    ++loops;
                    continue;
                }
                auto chosen = ready_.find(current);
                if (chosen == ready_.end())
                    chosen = std::min_element(ready_.begin(), ready_.end(), [](const auto& a, const auto& b) {
                        return a.second.front() < b.second.front();
                    });
                if (chosen->first != current || sorted_.empty()) {
                    current = chosen->first;
                    sorted_.push_back({current.first, current.second, {}});
                }
                auto& heap = chosen->second;
                std::pop_heap(heap.begin(), heap.end(), std::greater<>());
                const int v = heap.back();
                heap.pop_back();
                if (heap.empty()) ready_.erase(chosen);
                sorted_.back().activities.push_back(vertices_[static_cast<std::size_t>(v)]);
                ++done;
                for (int i = begin_[static_cast<std::size_t>(v)]; i < begin_[static_cast<std::size_t>(v) + 1];
                     ++i)
                    if (const int to = level_edges_[static_cast<std::size_t>(i)].to;
                        --open_[static_cast<std::size_t>(to)] == 0)
                        make_ready(to);
            }
            ready_.clear();
            if (!is_restarted) return sorted_;
        }
    }

    void make_ready(int v) {
        auto& heap = ready_[group(v)];
        heap.push_back(v);
        std::push_heap(heap.begin(), heap.end(), std::greater<>());
    }

    /// The activities of one loop's body, and the edges between them, grouped by where they begin.
    void make_level(int loop) {
        level_.clear();
        open_.resize(vertices_.size());
        for (std::size_t v = 0; v < vertices_.size(); ++v)
            if (loop_of(static_cast<int>(v)) == loop) level_.push_back(static_cast<int>(v));
        std::vector<Edge> found;
        found.reserve(edges_.size());
        for (const Edge& edge : edges_) {
            Edge lift = edge;
            if (!plan_.loops.empty()) {
                lift.from = lifted(edge.from, loop);
                lift.to = lifted(edge.to, loop);
            }
            if (lift.from < 0 || lift.to < 0 || (lift.from == lift.to && lift.from != edge.from)) continue;
            if (torn_.contains({edge.from, edge.to})) continue;
            found.push_back(lift);
        }
        begin_.assign(vertices_.size() + 1, 0);
        for (const Edge& edge : found) ++begin_[static_cast<std::size_t>(edge.from) + 1];
        for (std::size_t v = 0; v < vertices_.size(); ++v) begin_[v + 1] += begin_[v];
        level_edges_.resize(found.size());
        std::vector<int> next(begin_.begin(), begin_.end() - 1);
        for (const Edge& edge : found)
            level_edges_[static_cast<std::size_t>(next[static_cast<std::size_t>(edge.from)]++)] = edge;
    }

    /// Activities that read only x⁻ and outputs need no order: document order, by rate and condition.
    template <class Count> std::vector<Segment> collect(int loop, Count activities) const {
        std::vector<Segment> segments;
        std::map<Group, std::size_t> known;
        for (std::size_t n = 0; n < nodes_.size(); ++n) {
            const auto& node = nodes_[n];
            if (node.loop != loop || node.rate == constant_rate) continue;
            const int found = activities(node.block->declaration(), node.methods);
            if (found == 0) continue;
            const auto [place, is_new] = known.try_emplace({node.rate, node.condition}, segments.size());
            if (is_new) segments.push_back({node.rate, node.condition, {}});
            for (int i = 0; i < found; ++i)
                segments[place->second].activities.push_back({static_cast<int>(n), i});
        }
        return segments;
    }

    std::string vertex_path(int v) const {
        const auto& a = vertices_[static_cast<std::size_t>(v)];
        return a.node >= 0   ? nodes_[static_cast<std::size_t>(a.node)].path
               : a.loop >= 0 ? plan_.loops[static_cast<std::size_t>(a.loop)].path
                             : e_.diagram.conditions[static_cast<std::size_t>(a.condition)].path;
    }

    std::string port_path(int v, int slot) const {
        static constexpr std::array controls{model::enable_port, model::trigger_port, model::reset_port};
        const auto& a = vertices_[static_cast<std::size_t>(v)];
        if (slot < 0 || a.loop >= 0) return vertex_path(v);
        if (a.node < 0) return vertex_path(v) + "." + std::string(controls[static_cast<std::size_t>(slot)]);
        return e_.diagram.end_path({a.node, slot});
    }

    /// Turns an algebraic loop that waits for no other one into a loop that is solved, where the model asks
    /// for that. True when there is something new to sort.
    bool solve_loops(int loop) {
        if (!e_.diagram.solves_algebraic_loops) return false;
        for (const auto& members : first_components())
            if (is_solvable(members)) {
                add_algebraic(with_beginnings(members), loop);
                return true;
            }
        return false;
    }

    /// Strongly connected components among the waiting activities that wait for no other component (Tarjan,
    /// 1972).
    std::vector<std::vector<int>> first_components() const {
        const std::size_t n = vertices_.size();
        std::vector<int> index(n, -1), low(n, 0), component(n, -1), stack,
            edge(begin_.begin(), begin_.end() - 1);
        std::vector<std::vector<int>> components;
        int counter = 0;
        const auto at = [](auto& list, int v) -> auto& { return list[static_cast<std::size_t>(v)]; };
        for (const int root : level_) {
            if (at(open_, root) == 0 || at(index, root) >= 0) continue;
            std::vector<int> path{root};
            while (!path.empty()) {
                const int v = path.back();
                if (at(index, v) < 0) {
                    at(index, v) = at(low, v) = counter++;
                    stack.push_back(v);
                }
                bool is_descending = false;
                for (int& i = at(edge, v); i < begin_[static_cast<std::size_t>(v) + 1]; ++i) {
                    const int to = at(level_edges_, i).to;
                    if (at(open_, to) == 0) continue;
                    if (at(index, to) < 0) {
                        path.push_back(to);
                        is_descending = true;
                        break;
                    }
                    if (at(component, to) < 0) at(low, v) = std::min(at(low, v), at(low, to));
                }
                if (is_descending) continue;
                if (at(low, v) == at(index, v)) {
                    auto& members = components.emplace_back();
                    for (int w = -1; w != v;) {
                        w = stack.back();
                        stack.pop_back();
                        at(component, w) = static_cast<int>(components.size()) - 1;
                        members.push_back(w);
                    }
                    std::sort(members.begin(), members.end());
                }
                path.pop_back();
            }
        }
        std::vector<bool> waits(components.size(), false), is_loop(components.size(), false);
        for (const int v : level_)
            for (int i = begin_[static_cast<std::size_t>(v)]; i < begin_[static_cast<std::size_t>(v) + 1];
                 ++i) {
                const int from = at(component, v), to = at(component, at(level_edges_, i).to);
                if (from < 0 || to < 0) continue;
                if (from == to)
                    is_loop[static_cast<std::size_t>(to)] = true;
                else
                    waits[static_cast<std::size_t>(to)] = true;
            }
        std::vector<std::vector<int>> first;
        for (std::size_t c = 0; c < components.size(); ++c)
            if (is_loop[c] && !waits[c]) first.push_back(std::move(components[c]));
        return first;
    }

    /// All of one rate and condition, with unknowns of type double, and no loop or condition among them.
    bool is_solvable(const std::vector<int>& members) const {
        return std::all_of(members.begin(), members.end(), [&](int v) {
            const auto& a = vertices_[static_cast<std::size_t>(v)];
            if (a.node < 0 || group(v) != group(members.front())) return false;
            const auto& node = nodes_[static_cast<std::size_t>(a.node)];
            const auto& slots = node.block->resolution().slots;
            return std::all_of(slots.begin(), slots.end(), [](const Slot& slot) {
                return slot.role != Role::output || slot.type == Type::float64;
            });
        });
    }

    /// With the rules of a block that a member goes on from, as one that adds to an output does from the one
    /// that began it: they run anew with it.
    std::vector<int> with_beginnings(std::vector<int> members) const {
        for (std::size_t m = 0; m < members.size(); ++m) {
            const auto& a = vertices_[static_cast<std::size_t>(members[m])];
            const auto& d = nodes_[static_cast<std::size_t>(a.node)].block->declaration();
            const auto& rules = d.output_rules;
            if (static_cast<std::size_t>(a.index) >= rules.size()) continue;
            const Call& rule = rules[static_cast<std::size_t>(a.index)];
            for (int before = 0; before < a.index; ++before) {
                const bool begins = std::any_of(d.slots.begin(), d.slots.end(), [&](const auto& declared) {
                    const int slot = static_cast<int>(&declared - d.slots.data());
                    return declared.role != Role::input && rule.reads(slot) && rule.writes(slot) &&
                           rules[static_cast<std::size_t>(before)].writes(slot);
                });
                const int v = first_[static_cast<std::size_t>(a.node)] + before;
                if (begins && std::find(members.begin(), members.end(), v) == members.end())
                    members.push_back(v);
            }
        }
        std::sort(members.begin(), members.end());
        return members;
    }

    void add_algebraic(const std::vector<int>& members, int loop) {
        Loop solved;
        solved.kind = Loop::Kind::algebraic;
        solved.parent = loop;
        solved.path = vertex_path(members.front());
        std::tie(solved.rate, solved.condition) = group(members.front());
        const int id = static_cast<int>(plan_.loops.size());
        for (const int v : members) {
            in_algebraic_[v] = id;
            const int node = vertices_[static_cast<std::size_t>(v)].node;
            if (solved.nodes.empty() || solved.nodes.back() != node) solved.nodes.push_back(node);
        }
        // Wires that lead backwards in document order are cut: what they carry is unknown.
        const std::set<int> inside(members.begin(), members.end());
        for (const int v : members)
            for (int i = begin_[static_cast<std::size_t>(v)]; i < begin_[static_cast<std::size_t>(v) + 1];
                 ++i) {
                const Edge& edge = level_edges_[static_cast<std::size_t>(i)];
                if (edge.to > v || !inside.contains(edge.to)) continue;
                torn_.insert({edge.from, edge.to});
                const Node::End end{vertices_[static_cast<std::size_t>(v)].node, edge.from_slot};
                const bool is_known =
                    std::any_of(solved.unknowns.begin(), solved.unknowns.end(),
                                [&](const auto& u) { return u.node == end.node && u.slot == end.slot; });
                if (!is_known) solved.unknowns.push_back(end);
            }
        plan_.loops.push_back(std::move(solved));
        add_loop_vertex(id);
        plan_.loops.back().outputs = std::move(order(id));
    }

    /// Reports one loop among the activities that wait for each other, and lets its members run, so
    /// that other loops are found too.
    void break_loop() {
        std::map<int, const Edge*> before; // one that each waits for
        for (const Edge& edge : level_edges_)
            if (open_[static_cast<std::size_t>(edge.from)] > 0 &&
                open_[static_cast<std::size_t>(edge.to)] > 0)
                before.try_emplace(edge.to, &edge);
        // Walking backwards, one must come twice.
        int v = before.begin()->first;
        for (std::set<int> walked; walked.insert(v).second;) v = before.at(v)->from;
        int first = v;
        for (int w = before.at(v)->from; w != v; w = before.at(w)->from) first = std::min(first, w);
        std::vector<std::string> hops;
        std::vector<int> members;
        int w = first;
        do {
            members.push_back(w);
            const Edge* edge = before.at(w);
            if (edge->from_slot >= 0)
                hops.push_back(port_path(edge->from, edge->from_slot) + " -> " + port_path(w, edge->to_slot));
            w = edge->from;
        } while (w != first);
        std::string text;
        for (auto hop = hops.rbegin(); hop != hops.rend(); ++hop) text += (text.empty() ? "" : ", ") + *hop;
        const int node = vertices_[static_cast<std::size_t>(first)].node;
        e_.report.add(
            node >= 0 ? nodes_[static_cast<std::size_t>(node)].where : e_.model.where, vertex_path(first),
            "algebraic loop: " + text +
                (e_.diagram.solves_algebraic_loops ? " (not solved: that needs blocks of one rate, under one "
                                                     "condition, with outputs of type double)"
                                                   : ""),
            "break it with a block whose output does not depend on its input in the same step, e.g. a "
            "UnitDelay on one of these wires");
        for (const int member : members) {
            open_[static_cast<std::size_t>(member)] = 0;
            make_ready(member);
        }
    }

    Elaboration& e_;
    std::vector<DiagramNode>& nodes_;
    Plan& plan_;
    std::size_t subsystem_loops_ = 0; ///< those of subsystems; algebraic ones follow
    std::vector<Activity> vertices_;
    std::vector<Edge> edges_;
    std::vector<int> first_, condition_vertex_, loop_vertex_;
    std::unordered_map<int, int> in_algebraic_; ///< activity -> algebraic loop
    std::set<std::pair<int, int>> torn_;        ///< edges that algebraic loops cut
    // The level that is being sorted.
    std::vector<int> level_;
    std::vector<Edge> level_edges_;
    std::vector<int> begin_;                  ///< of each activity's edges
    std::vector<int> open_;                   ///< activities that each still waits for
    std::map<Group, std::vector<int>> ready_; ///< heaps, the first in document order on top
    std::vector<Segment> sorted_;
    static constexpr int most_loops = 20; ///< reported at once
};

} // namespace

void sort(Elaboration& e) { Sorting(e).run(); }

} // namespace bf::elaboration

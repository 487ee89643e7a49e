// The plan: output activities in the order of the data, ties broken by document order.
#include "stages.hpp"

#include <algorithm>
#include <map>
#include <queue>
#include <set>

namespace bf::elaboration {

namespace {

class Sorting {
  public:
    explicit Sorting(Elaboration& elaboration) : e_(elaboration), nodes_(e_.diagram.nodes) {}

    void run() {
        make_vertices();
        make_edges();
        order();
        collect(e_.diagram.plan.updates, [](const Declaration& d, const Block::Methods& m) {
            return static_cast<int>(d.update_rules.size()) + m.update;
        });
        collect(e_.diagram.plan.derivatives, [](const Declaration& d, const Block::Methods& m) {
            return static_cast<int>(d.derivative_rules.size()) + m.derivative;
        });
        collect(e_.diagram.plan.guards, [](const Declaration& d, const Block::Methods& m) {
            return static_cast<int>(d.guard_rules.size()) + m.guards;
        });
        std::erase_if(e_.diagram.plan.guards, [&](const Segment& segment) {
            return !e_.diagram.rates[static_cast<std::size_t>(segment.rate)].is_continuous;
        });
    }

  private:
    struct Edge {
        int to;
        int from_slot, to_slot; // for the report; -1: not a wire
    };

    static int count(const Declaration& d, const Block::Methods& methods) {
        return static_cast<int>(d.output_rules.size()) + methods.output;
    }

    void make_vertices() {
        first_.resize(nodes_.size());
        for (std::size_t n = 0; n < nodes_.size(); ++n) {
            first_[n] = static_cast<int>(vertices_.size());
            for (int i = 0; i < count(nodes_[n].block->declaration(), nodes_[n].methods); ++i)
                vertices_.push_back({static_cast<int>(n), i, 0});
        }
        const auto& conditions = e_.diagram.conditions;
        condition_vertex_.assign(conditions.size(), -1);
        for (std::size_t c = 1; c < conditions.size(); ++c) {
            condition_vertex_[c] = static_cast<int>(vertices_.size());
            vertices_.push_back({-1, 0, static_cast<int>(c)});
        }
        edges_.resize(vertices_.size());
    }

    /// The activity that completes an output; -1 for an output that is only memory (a root input).
    int writer(const Node::End& end) const {
        const auto& node = nodes_[static_cast<std::size_t>(end.node)];
        const auto& rules = node.block->declaration().output_rules;
        for (std::size_t i = rules.size(); i-- > 0;)
            if (rules[i].writes(end.slot))
                return first_[static_cast<std::size_t>(end.node)] + static_cast<int>(i);
        return node.methods.output
                   ? first_[static_cast<std::size_t>(end.node)] + static_cast<int>(rules.size())
                   : -1;
    }

    void link(int from, int to, int from_slot, int to_slot) {
        if (from >= 0 && to >= 0) edges_[static_cast<std::size_t>(from)].push_back({to, from_slot, to_slot});
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
                        link(first_[n] + static_cast<int>(before), to, -1, -1);
            }
            if (node.methods.output) {
                const int to = first_[n] + static_cast<int>(rules.size());
                for (std::size_t i = 0; i < d.slots.size(); ++i)
                    if (d.slots[i].role == Role::input && node.sources[i].node >= 0 &&
                        reads(node, static_cast<int>(i)))
                        link(writer(node.sources[i]), to, node.sources[i].slot, static_cast<int>(i));
            }
            // Nothing of a conditional subsystem runs before its condition was looked at.
            if (node.condition > 0)
                for (int v = first_[n]; v < first_[n] + count(d, node.methods); ++v)
                    link(condition_vertex_[static_cast<std::size_t>(node.condition)], v, -1, -1);
        }
        for (std::size_t c = 1; c < e_.diagram.conditions.size(); ++c) {
            const auto& condition = e_.diagram.conditions[c];
            if (condition.enable.node >= 0)
                link(writer(condition.enable), condition_vertex_[c], condition.enable.slot, -1);
            if (condition.parent > 0)
                link(condition_vertex_[static_cast<std::size_t>(condition.parent)], condition_vertex_[c], -1,
                     -1);
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
        const auto& slots = node.block->declaration().slots;
        bool has_output = false;
        for (std::size_t o = 0; o < slots.size(); ++o)
            if (slots[o].role == Role::output) {
                has_output = true;
                if (node.block->feedthrough(static_cast<int>(o), input)) return true;
            }
        return !has_output && slots[static_cast<std::size_t>(input)].feedthrough;
    }

    std::pair<int, int> group(int v) const {
        const auto& a = vertices_[static_cast<std::size_t>(v)];
        if (a.node >= 0)
            return {nodes_[static_cast<std::size_t>(a.node)].rate,
                    nodes_[static_cast<std::size_t>(a.node)].condition};
        const auto& condition = e_.diagram.conditions[static_cast<std::size_t>(a.condition)];
        return {condition.rate, condition.parent};
    }

    /// Kahn's algorithm. Among what is ready, the running segment goes on as long as it can; otherwise the
    /// first in document order.
    void order() {
        open_.assign(vertices_.size(), 0);
        for (const auto& list : edges_)
            for (const auto& edge : list) ++open_[static_cast<std::size_t>(edge.to)];
        for (std::size_t v = 0; v < vertices_.size(); ++v)
            if (open_[v] == 0) ready_[group(static_cast<int>(v))].insert(static_cast<int>(v));
        auto& segments = e_.diagram.plan.outputs;
        std::pair<int, int> current{-1, -1};
        std::size_t done = 0;
        for (int loops = 0; done < vertices_.size() && loops < most_loops;) {
            if (ready_.empty()) {
                break_loop();
                ++loops;
                continue;
            }
            auto chosen = ready_.find(current);
            if (chosen == ready_.end())
                chosen = std::min_element(ready_.begin(), ready_.end(), [](const auto& a, const auto& b) {
                    return *a.second.begin() < *b.second.begin();
                });
            if (chosen->first != current || segments.empty()) {
                current = chosen->first;
                segments.push_back({current.first, current.second, {}});
            }
            const int v = *chosen->second.begin();
            chosen->second.erase(chosen->second.begin());
            if (chosen->second.empty()) ready_.erase(chosen);
            segments.back().activities.push_back(vertices_[static_cast<std::size_t>(v)]);
            ++done;
            for (const auto& edge : edges_[static_cast<std::size_t>(v)])
                if (--open_[static_cast<std::size_t>(edge.to)] == 0) ready_[group(edge.to)].insert(edge.to);
        }
    }

    /// Activities that read only x⁻ and outputs need no order: document order, by rate and condition.
    template <class Count> void collect(std::vector<Segment>& segments, Count activities) {
        std::map<std::pair<int, int>, std::size_t> known;
        for (std::size_t n = 0; n < nodes_.size(); ++n) {
            const auto& node = nodes_[n];
            const int found = activities(node.block->declaration(), node.methods);
            if (found == 0 || node.rate == constant_rate) continue;
            const auto [place, is_new] = known.try_emplace({node.rate, node.condition}, segments.size());
            if (is_new) segments.push_back({node.rate, node.condition, {}});
            for (int i = 0; i < found; ++i)
                segments[place->second].activities.push_back({static_cast<int>(n), i, 0});
        }
    }

    std::string vertex_path(int v) const {
        const auto& a = vertices_[static_cast<std::size_t>(v)];
        return a.node >= 0 ? nodes_[static_cast<std::size_t>(a.node)].path
                           : e_.diagram.conditions[static_cast<std::size_t>(a.condition)].path;
    }

    std::string port_path(int v, int slot) const {
        const auto& a = vertices_[static_cast<std::size_t>(v)];
        if (a.node < 0) return vertex_path(v) + "." + std::string(model::enable_port);
        return slot < 0 ? vertex_path(v) : e_.diagram.end_path({a.node, slot});
    }

    /// Reports one loop among the activities that wait for each other, and lets its members run, so
    /// that other loops are found too.
    void break_loop() {
        std::map<int, std::pair<int, const Edge*>> before; // one that each waits for
        for (std::size_t v = 0; v < vertices_.size(); ++v)
            if (open_[v] > 0)
                for (const auto& edge : edges_[v])
                    if (open_[static_cast<std::size_t>(edge.to)] > 0)
                        before.try_emplace(edge.to, static_cast<int>(v), &edge);
        // Walking backwards, one must come twice.
        int v = before.begin()->first;
        for (std::set<int> walked; walked.insert(v).second;) v = before.at(v).first;
        int first = v;
        for (int w = before.at(v).first; w != v; w = before.at(w).first) first = std::min(first, w);
        std::vector<std::string> hops;
        std::vector<int> members;
        int w = first;
        do {
            members.push_back(w);
            const auto& [from, edge] = before.at(w);
            if (edge->from_slot >= 0)
                hops.push_back(port_path(from, edge->from_slot) + " -> " + port_path(w, edge->to_slot));
            w = from;
        } while (w != first);
        std::string text;
        for (auto hop = hops.rbegin(); hop != hops.rend(); ++hop) text += (text.empty() ? "" : ", ") + *hop;
        const int node = vertices_[static_cast<std::size_t>(first)].node;
        e_.report.add(
            node >= 0 ? nodes_[static_cast<std::size_t>(node)].where : e_.model.where, vertex_path(first),
            "algebraic loop: " + text,
            "break it with a block whose output does not depend on its input in the same step, e.g. a "
            "UnitDelay on one of these wires");
        for (const int member : members) {
            open_[static_cast<std::size_t>(member)] = 0;
            ready_[group(member)].insert(member);
        }
    }

    Elaboration& e_;
    std::vector<DiagramNode>& nodes_;
    std::vector<Activity> vertices_;
    std::vector<std::vector<Edge>> edges_;
    std::vector<int> first_, condition_vertex_;
    std::vector<int> open_; ///< activities that each still waits for
    std::map<std::pair<int, int>, std::set<int>> ready_;
    static constexpr int most_loops = 20; ///< reported at once
};

} // namespace

void sort(Elaboration& e) { Sorting(e).run(); }

} // namespace bf::elaboration

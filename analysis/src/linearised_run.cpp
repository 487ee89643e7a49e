#include "linearised_run.hpp"

#include "bf/core/differenced.hpp"
#include "bf/program/program.hpp"
#include "differential.hpp"
#include "look.hpp"
#include "named.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <utility>

namespace bf::analysis {

namespace {

const std::vector<Slot>& slots_of(const DiagramNode& node) { return node.block->resolution().slots; }

void check_steps(const Diagram& d) {
    for (const auto& node : d.nodes) {
        for (const auto& slot : slots_of(node))
            if (slot.role == Role::continuous_state)
                throw RunError(node.path +
                               ": gradients go through continuous states where all blocks of the model are "
                               "rules; give the block its discrete counterpart");
        if (node.block->answers(node.methods))
            throw RunError(node.path + ": events are not differentiated over a run");
    }
    if (d.conditions.size() > 1)
        throw RunError(d.conditions[1].path + ": conditional subsystems are differentiated over a run where "
                                              "all blocks of the model are rules");
}

/// What blocks hand on outside of the diagram has derivatives only where the owner is Differenced: others are
/// refused where they lie between what moves and the cost. Blocks that share a resource read and write it.
void check_outside(const Diagram& d, const Context& context, const std::set<int>& moved, int cost) {
    std::set<int> owners;
    for (const int n : context.outside()) owners.insert(n);
    std::set<int> unknown = owners;
    for (const int n : context.devices()) unknown.insert(n);
    const auto block = [&](int n) { return d.nodes[static_cast<std::size_t>(n)].block.get(); };
    const auto is_known = [&](int n) {
        if (dynamic_cast<const Differenced*>(block(n))) return true;
        const auto* started = dynamic_cast<const WarmStarted*>(block(n));
        if (started && started->is_exact()) return true;
        const auto& providers = d.nodes[static_cast<std::size_t>(n)].providers;
        return !owners.contains(n) && std::any_of(providers.begin(), providers.end(), [&](const auto& its) {
            return its.node >= 0 && dynamic_cast<const Differenced*>(block(its.node));
        });
    };
    std::erase_if(unknown, is_known);
    if (unknown.empty()) return;
    std::vector<std::set<int>> after(d.nodes.size()), before(d.nodes.size());
    const auto lead = [&](int from, int to) {
        after[static_cast<std::size_t>(from)].insert(to);
        before[static_cast<std::size_t>(to)].insert(from);
    };
    for (int n = 0; n < static_cast<int>(d.nodes.size()); ++n) {
        for (const auto& source : d.nodes[static_cast<std::size_t>(n)].sources)
            if (source.node >= 0) lead(source.node, n);
        for (const auto& provider : d.nodes[static_cast<std::size_t>(n)].providers)
            if (owners.contains(provider.node)) {
                lead(provider.node, n);
                lead(n, provider.node);
            }
    }
    const auto along = [](const std::vector<std::set<int>>& next) {
        return [&next](int node, auto&& go) {
            for (const int other : next[static_cast<std::size_t>(node)]) go(other);
        };
    };
    const auto driven = reached(moved, along(after)), seen = reached({cost}, along(before));
    for (const int n : unknown)
        if (driven.contains(n) && seen.contains(n))
            throw RunError(d.nodes[static_cast<std::size_t>(n)].path +
                           ": its state lives outside of the diagram, and no derivative of it is known; "
                           "leave it out of the path to the cost, or let its block be bf::Differenced");
}

} // namespace

void go_along(const Simulation& like, const std::vector<Element>& by, const Element& cost,
              const Horizon& horizon, Gradient& result) {
    const Diagram& d = like.diagram();
    check_steps(d);
    Simulation run(d);
    for (int n = 0; n < static_cast<int>(d.nodes.size()); ++n) {
        const auto& node = d.nodes[static_cast<std::size_t>(n)];
        for (int s = 0; s < static_cast<int>(slots_of(node).size()); ++s) {
            const Slot& slot = d.slot({n, s});
            if (slot.role == Role::parameter || node.block->declaration().traits.is_root_input)
                std::memcpy(run.context().data(n, s), like.context().data(n, s),
                            static_cast<std::size_t>(slot.size.count() * bytes(slot.type)));
        }
    }
    run.start();

    const auto count = static_cast<int>(by.size());
    Differential differential(run, count, false);
    differential.follow_outside();
    std::map<std::pair<int, int>, Matrix> seeds;
    for (int i = 0; i < count; ++i) {
        const auto& [end, number, name, unit] = by[static_cast<std::size_t>(i)];
        const Slot& slot = d.slot(end);
        const auto& node = d.nodes[static_cast<std::size_t>(end.node)];
        if (slot.role == Role::parameter && node.methods.reset)
            throw RunError(name + ": its block begins with states of which no derivative is known");
        if (slot.role == Role::parameter) differential.follow(end);
        auto& rows =
            seeds.try_emplace({end.node, end.slot}, Matrix::Zero(slot.size.count(), count)).first->second;
        rows(number, i) = 1;
        result.at[i] = read_value(run.context().data(end.node, end.slot), slot.type, number);
    }
    for (const auto& [end, rows] : seeds) differential.set({end.first, end.second}, rows);
    std::set<int> moved;
    for (const auto& place : by) moved.insert(place.end.node);
    const auto program = program::lower(d);
    for (const auto& set : program.sets) { // initial states
        if (set.source.node < 0) continue;
        const auto found = seeds.find({set.source.node, set.source.slot});
        if (found == seeds.end()) continue;
        const int elements = d.slot(set.quantity).size.count();
        // A state may be a seed itself: it then begins at the parameter and what is added to it.
        const auto own = seeds.find({set.quantity.node, set.quantity.slot});
        Matrix rows = own == seeds.end() ? Matrix::Zero(elements, count) : own->second;
        if (found->second.rows() == elements)
            rows += found->second;
        else
            rows += found->second.replicate(elements, 1);
        differential.set(set.quantity, rows);
        moved.insert(set.quantity.node);
    }
    check_outside(d, run.context(), moved, cost.end.node);

    Matrix slopes = Matrix::Zero(1, count);
    std::vector<std::byte> before(run.context().snapshot_size());
    const auto last = horizon.steps + (horizon.counts_end ? 1 : 0);
    for (std::int64_t k = 0; k < last; ++k) {
        horizon.begin_step(k);
        const Status status = step_with(run, [&] {
            run.context().save(before.data());
            const auto runs = [&](int node) {
                const auto& rate =
                    d.rates[static_cast<std::size_t>(d.nodes[static_cast<std::size_t>(node)].rate)];
                return rate.is_continuous || (k >= rate.offset && (k - rate.offset) % rate.ticks == 0);
            };
            if (k == 0) differential.constants();
            differential.outputs(runs);
            const double value = read_value(run.context().data(cost.end.node, cost.end.slot),
                                            d.slot(cost.end).type, cost.number);
            const Matrix its = differential.rows(cost.end).row(cost.number);
            if (horizon.counts_end) {
                result.cost = value;
                slopes = its;
            } else {
                result.cost += horizon.step * value;
                slopes += horizon.step * its;
            }
            differential.updates(runs);
            differential.commit();
            run.context().restore(before.data());
        });
        if (!status) throw RunError(run.failure());
    }
    run.stop();
    result.slopes = slopes.transpose();
    result.has_corner = !differential.kinks().empty();
    for (const int node : differential.differenced())
        result.differenced.push_back(d.nodes[static_cast<std::size_t>(node)].path);
}

} // namespace bf::analysis

// Parts of the order that run several times in a step.
#include "states.hpp"

#include <algorithm>
#include <cmath>

namespace bf {

void Simulation::bind_loops() {
    const auto& loops = diagram_.plan.loops;
    for (const auto& loop : loops)
        loops_.push_back(std::make_unique<LoopState>(
            LoopState{this, &loop, diagram_.runs_once(loop), {}, {}, {}, {}, {}, nullptr}));
    for (std::size_t l = 0; l < loops.size(); ++l) {
        auto& state = *loops_[l];
        state.outputs = bound(loops[l].outputs, Phase::output);
        state.updates = bound(loops[l].updates, Phase::update);
        for (const auto& condition : diagram_.conditions)
            for (int at = condition.loop; condition.triggered_rate >= 0 && at >= 0;
                 at = loops[static_cast<std::size_t>(at)].parent)
                if (at == static_cast<int>(l))
                    state.triggered.push_back(static_cast<std::size_t>(condition.triggered_rate));
        state.has_run.resize(state.triggered.size());
        for (const auto& segment : loops[l].updates) state.commits.push_back(commits_of(segment));
        if (loops[l].kind != Loop::Kind::algebraic) continue;
        std::vector<std::span<double>> unknowns;
        for (const auto& end : loops[l].unknowns)
            unknowns.emplace_back(static_cast<double*>(context_.data(end.node, end.slot)),
                                  static_cast<std::size_t>(diagram_.slot(end).size.count()));
        state.solver =
            std::make_unique<AlgebraicSolver>(std::move(unknowns), [&state] { return state.iterate(); });
    }
}

Task Simulation::loop_task(int loop) {
    return {
        [](const void* p, int) { return const_cast<LoopState*>(static_cast<const LoopState*>(p))->run(); },
        loops_[static_cast<std::size_t>(loop)].get(), 0};
}

/// The body once: outputs, then updates. Where it fails, status_ says why.
bool Simulation::LoopState::iterate() {
    Simulation& s = *simulation;
    for (const std::size_t rate : triggered) s.clear_trigger(rate);
    for (const auto& segment : outputs)
        if (s.is_due(segment.rate, segment.condition) && !s.run(segment)) return false;
    for (const auto& segment : updates)
        if (s.is_due(segment.rate, segment.condition) && !s.run(segment)) return false;
    for (const auto& segment : commits)
        if (s.is_due(segment.rate, segment.condition) && !s.commit(segment)) return false;
    for (std::size_t i = 0; i < triggered.size(); ++i)
        if (s.hit_[triggered[i]]) has_run[i] = 1;
    return true;
}

Status Simulation::LoopState::run() {
    std::fill(has_run.begin(), has_run.end(), std::uint8_t{0});
    const Status status = run_iterations();
    for (std::size_t i = 0; i < triggered.size(); ++i) simulation->hit_[triggered[i]] = has_run[i];
    return status;
}

Status Simulation::LoopState::run_iterations() {
    Simulation& s = *simulation;
    const auto is_on = [&](const Node::End& end) {
        return read_value(s.context_.data(end.node, end.slot), s.diagram_.slot(end).type, 0) > 0;
    };
    if (loop->kind == Loop::Kind::algebraic) {
        if (solver->solve()) return ok;
        s.failed_node_ = loop->nodes.front();
        return s.status_ ? solver->failure() : s.status_;
    }
    if (runs_once && s.is_again_) return ok;
    if (const Status status = s.reset_nodes(loop->resets_states ? loop->nodes : loop->counters); !status)
        return status;
    const bool is_while = loop->kind == Loop::Kind::while_loop;
    if (is_while && loop->initial.node >= 0 && !is_on(loop->initial)) return ok;
    double most = loop->iterations;
    if (loop->count.node >= 0)
        most = std::floor(read_value(s.context_.data(loop->count.node, loop->count.slot),
                                     s.diagram_.slot(loop->count).type, 0));
    for (double i = 1; i <= most; ++i) {
        if (!iterate()) return s.status_;
        if (is_while && !is_on(loop->again)) return ok;
    }
    if (!is_while) return ok;
    s.failed_node_ = loop->nodes.front();
    return Status::failure(
        "the while loop around it did not end within {} iterations: look at the condition of its "
        "While, or let it allow more",
        loop->iterations);
}

} // namespace bf

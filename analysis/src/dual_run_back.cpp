// Reverse differentiation of a run. Source: Griewank and Walther, Evaluating Derivatives, 2nd ed., §3.2.
#include "bf/analysis/linear_system.hpp"
#include "bf/engine/fixed_step.hpp"
#include "dual_run.hpp"

#include <algorithm>

namespace bf::analysis {

namespace {

constexpr auto lanes = static_cast<std::size_t>(Dual::directions);

std::size_t at(int i) { return static_cast<std::size_t>(i); }

} // namespace

DualRun::Checkpoint DualRun::checkpoint() const {
    Checkpoint now{{}, {}, until_hit_, flags_, steps_};
    for (const Dual& cell : cells_) now.cells.push_back(cell.value);
    for (const Dual& clock : clocks_) now.clocks.push_back(clock.value);
    return now;
}

void DualRun::restore(const Checkpoint& checkpoint) {
    std::copy(checkpoint.cells.begin(), checkpoint.cells.end(), cells_.begin());
    std::copy(checkpoint.clocks.begin(), checkpoint.clocks.end(), clocks_.begin());
    until_hit_ = checkpoint.until_hit;
    flags_ = checkpoint.flags;
    steps_ = checkpoint.steps;
}

// ---- what was done

void DualRun::remember(bool does) {
    is_remembered_ = does;
    adjoints_.resize(cells_.size());
    of_start_.resize(at(states_));
}

void DualRun::note(Done::Op op, int a, int b, int count) {
    if (op == Done::Op::clock) overwritten_.push_back(clocks_[at(a)].value);
    done_.push_back({op, a, b, count});
}

void DualRun::note_values(int first, int count) {
    for (int e = 0; e < count; ++e) overwritten_.push_back(cells_[at(first + e)].value);
}

void DualRun::take_back(int first, int count) {
    std::copy(overwritten_.end() - count, overwritten_.end(), cells_.begin() + first);
    overwritten_.resize(overwritten_.size() - at(count));
}

/// f(cells) for each run of a kernel of those that tell its whole derivative: the first of the cells that
/// move in each lane, and how many. Where each result depends on the elements beside it alone, all of an
/// operand move in one lane.
template <class F> void DualRun::for_each_chunk(const Bound& task, F&& f) const {
    std::vector<std::pair<int, int>> chunk; // cells that move, a lane each
    const auto is_beside = [&](const std::pair<int, int>& operand) {
        return task.structure == Structure::elementwise && operand.second > 1 &&
               std::all_of(task.writes.begin(), task.writes.end(),
                           [&](const auto& result) { return result.second == operand.second; });
    };
    const auto flush = [&] {
        if (!chunk.empty()) f(chunk);
        chunk.clear();
    };
    for (const auto& operand : task.reads) {
        if (is_fixed_[at(operand.first)]) continue;
        const int moves = is_beside(operand) ? 1 : operand.second;
        for (int e = 0; e < moves; ++e) {
            chunk.emplace_back(operand.first + e, moves < operand.second ? operand.second : 1);
            if (chunk.size() == lanes) flush();
        }
    }
    flush();
}

/// Y = A B gives Ȳ Bᵀ to Ā and Aᵀ Ȳ to B̄.
void DualRun::go_back_through_product(const Bound& task) {
    const kernels::View<Dual>&y = task.views[0], &A = task.views[1], &B = task.views[2];
    const auto values = [](const kernels::View<Dual>& view) {
        Matrix all(view.rows, view.cols);
        for (int e = 0; e < view.size(); ++e) all.data()[e] = view[e].value;
        return all;
    };
    const auto add = [&](int cell, const kernels::View<Dual>& view, const Matrix& more) {
        if (cell < 0) return; // a constant
        Eigen::Map<Matrix>(adjoints_.data() + cell, view.rows, view.cols) += more;
    };
    const Eigen::Map<const Matrix> of_result(of_results_.data(), y.rows, y.cols);
    add(task.factors[0], A, of_result * values(B).transpose());
    add(task.factors[1], B, values(A).transpose() * of_result);
}

void DualRun::go_back(const Bound& task) {
    of_results_.clear();
    bool matters = false;
    for (const auto& [first, count] : task.writes)
        for (int e = 0; e < count; ++e) {
            double& adjoint = adjoints_[at(first + e)];
            matters |= adjoint != 0;
            of_results_.push_back(std::exchange(adjoint, 0));
        }
    const auto values = overwritten_.end() - static_cast<std::ptrdiff_t>(of_results_.size());
    const auto undo = [&] { // with the slopes, too
        auto value = values;
        for (const auto& [first, count] : task.writes)
            for (int e = 0; e < count; ++e) cells_[at(first + e)] = *value++;
    };
    undo();
    if (matters && task.is_product)
        go_back_through_product(task);
    else if (matters &&
             task.structure == Structure::move) { // the kernel itself tells from where each result is
        for (const auto& [first, count] : task.reads)
            for (int e = 0; e < count; ++e) cells_[at(first + e)].slope[0] = 1 + first + e;
        task.run(task.views, task.list);
        std::size_t r = 0;
        for (const auto& [first, count] : task.writes)
            for (int e = 0; e < count; ++e, ++r)
                if (const double from = cells_[at(first + e)].slope[0]; from != 0)
                    adjoints_[static_cast<std::size_t>(from) - 1] += of_results_[r];
        undo();
        for (const auto& [first, count] : task.reads)
            for (int e = 0; e < count; ++e) cells_[at(first + e)].slope = {};
    } else if (matters)
        for_each_chunk(task, [&](const std::vector<std::pair<int, int>>& chunk) {
            for (std::size_t lane = 0; lane < chunk.size(); ++lane)
                for (int e = 0; e < chunk[lane].second; ++e)
                    cells_[at(chunk[lane].first + e)].slope[lane] = 1;
            task.run(task.views, task.list);
            std::array<double, lanes> sums{};
            std::size_t r = 0;
            for (const auto& [first, count] : task.writes)
                for (int e = 0; e < count; ++e, ++r) {
                    const double adjoint = of_results_[r];
                    if (adjoint == 0) continue; // however steep it is
                    const auto& slope = cells_[at(first + e)].slope;
                    for (std::size_t lane = 0; lane < chunk.size(); ++lane)
                        if (chunk[lane].second == 1)
                            sums[lane] += adjoint * slope[lane];
                        else
                            adjoints_[at(chunk[lane].first + e)] += adjoint * slope[lane];
                }
            undo();
            for (std::size_t lane = 0; lane < chunk.size(); ++lane) {
                if (chunk[lane].second == 1) adjoints_[at(chunk[lane].first)] += sums[lane];
                for (int e = 0; e < chunk[lane].second; ++e) cells_[at(chunk[lane].first + e)].slope = {};
            }
        });
    overwritten_.resize(overwritten_.size() - of_results_.size());
}

void DualRun::go_back(std::size_t to) {
    using Op = Done::Op;
    const kernels::ButcherTableau& method =
        *with_tableau(d_.solver.method, []<const kernels::ButcherTableau & its> { return &its; });
    const auto of_slope = [&](int stage) { return of_slopes_.begin() + stage * states_; };
    const auto adjoint = [&](int cell) { return adjoints_.begin() + cell; };
    for (; done_.size() > to; done_.pop_back()) {
        const Done& last = done_.back();
        switch (last.op) {
        case Op::task: go_back(bound_[at(last.a)]); break;
        case Op::move:
        case Op::spread:
            for (int e = 0; e < last.count; ++e)
                *adjoint(last.b + (last.op == Op::move ? e : 0)) += std::exchange(*adjoint(last.a + e), 0);
            take_back(last.a, last.count);
            break;
        case Op::fill:
            std::fill_n(adjoint(last.a), last.count, 0.0);
            take_back(last.a, last.count);
            break;
        case Op::clock:
            clocks_[at(last.a)] = overwritten_.back();
            overwritten_.pop_back();
            break;
        // x⁺ = x + h Σ b_j k_j, with k_j the slopes at x_j = x + h Σ a_ji k_i.
        case Op::step:
            of_slopes_.assign(at(method.stages * states_), 0);
            for (int e = 0; e < states_; ++e) {
                const double x = std::exchange(*adjoint(first_state_ + e), 0);
                of_start_[at(e)] = x;
                for (int j = 0; j < method.stages; ++j) of_slope(j)[e] += d_.step * method.b[j] * x;
            }
            break;
        case Op::slope:
            take_back(first_state_, states_);
            for (int e = 0; e < states_; ++e) *adjoint(first_rate_ + e) += of_slope(last.a)[e];
            break;
        case Op::stage:
            for (int e = 0; e < states_; ++e) {
                if (last.a == 0) {
                    *adjoint(first_state_ + e) += of_start_[at(e)];
                    continue;
                }
                const double x = std::exchange(*adjoint(first_state_ + e), 0);
                of_start_[at(e)] += x;
                for (int i = 0; i < last.a; ++i) of_slope(i)[e] += d_.step * method.a[last.a][i] * x;
            }
            break;
        }
    }
}

DualRun::Work DualRun::work(std::size_t since) const {
    Work all;
    for (auto i = since; i < done_.size(); ++i) {
        if (done_[i].op != Done::Op::task) continue;
        const Bound& task = bound_[at(done_[i].a)];
        double once = 1;
        for (const auto* cells : {&task.reads, &task.writes})
            for (const auto& [first, count] : *cells) once += count;
        all.forwards += once;
        if (task.structure == Structure::move || task.is_product)
            all.backwards += 2 * once;
        else
            for_each_chunk(task, [&](const auto&) { all.backwards += once; });
    }
    return all;
}

} // namespace bf::analysis

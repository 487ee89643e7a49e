// Blocks whose state lives outside of the diagram, as that of a physics world.
#include "bf/core/differenced.hpp"
#include "differential.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace bf::analysis {

namespace {

/// The states outside, which are the last part of a snapshot.
double* outside(std::vector<std::byte>& snapshot, std::size_t count) {
    return reinterpret_cast<double*>(snapshot.data() + snapshot.size() - count * sizeof(double));
}

} // namespace

void Differential::follow_outside() {
    for (int n = 0; n < static_cast<int>(d_.nodes.size()); ++n)
        if (dynamic_cast<const Differenced*>(d_.nodes[static_cast<std::size_t>(n)].block.get()))
            owners_.insert(n);
    moves_outside_ = owners_;
    for (int n = 0; n < static_cast<int>(d_.nodes.size()); ++n)
        for (const auto& provider : d_.nodes[static_cast<std::size_t>(n)].providers)
            if (owners_.contains(provider.node)) moves_outside_.insert(n);
    for (const int node : moves_outside_) devices_.erase(node);
}

/// Central differences along each seed of what a block reads and of the states outside, of what it writes and
/// of these states afterwards.
void Differential::with_outside(const Plan& plan) {
    const int node = plan.node;
    const auto &from = read_, &to = plan.writes;
    const std::size_t inside = context_.signal_bytes() + context_.parameter_bytes() + context_.state_bytes() +
                               d_.rates.size() * sizeof(Clock);
    std::vector<std::byte> here(context_.snapshot_size()), there(here.size());
    const std::size_t numbers = (here.size() - inside) / sizeof(double);
    context_.save(here.data());
    const auto saved = [numbers](std::vector<std::byte>& snapshot) {
        return Eigen::Map<Vector>(outside(snapshot, numbers), static_cast<Eigen::Index>(numbers));
    };
    const Vector state = saved(here);
    std::vector<SlopeRow> moving;
    rows(from, moving);
    for (int i = 0; i < static_cast<int>(numbers); ++i) moving.push_back(outside_.row(i));
    const auto seeds = seeds_of(moving);
    std::vector<Vector> values;
    Eigen::Index results = 0;
    for (const auto& part : from) {
        auto& all = values.emplace_back(part.count);
        for (int e = 0; e < part.count; ++e) all[e] = read_value(part.data, part.type, e);
    }
    for (const auto& part : to) results += part.count;

    const auto say = [this](bool begins) {
        for (const int owner : owners_)
            dynamic_cast<const Differenced&>(*d_.nodes[static_cast<std::size_t>(owner)].block)
                .difference(Now(context_.frame(owner)), begins);
    };
    const Task& task = this->task(plan);
    const auto count = static_cast<Eigen::Index>(seeds.size());
    Matrix written = Matrix::Zero(results, count), after = Matrix::Zero(state.size(), count);
    const Matrix moved = outside_.spread(static_cast<int>(numbers), columns());
    Vector put[2], sides[2], results_of[2] = {Vector(results), Vector(results)};
    std::vector<Matrix> read;
    for (const auto& part : from) read.push_back(slopes(part.slopes).spread(part.count, columns()));
    const std::shared_ptr<void> end(nullptr, [&](void*) {
        say(false);
        context_.restore(here.data());
    });
    say(true);
    for (Eigen::Index c = 0; c < count; ++c) {
        const int seed = seeds[static_cast<std::size_t>(c)];
        double most = 0;
        const auto count_in = [&](const auto& direction, const Vector& at) {
            for (Eigen::Index i = 0; i < at.size(); ++i)
                if (direction[i] != 0)
                    most = std::max(most, std::abs(direction[i]) / std::max(1.0, std::abs(at[i])));
        };
        count_in(moved.col(seed), state);
        for (std::size_t p = 0; p < from.size(); ++p) count_in(read[p].col(seed), values[p]);
        const double step = std::cbrt(std::numeric_limits<double>::epsilon()) / most;
        for (const double side : {1.0, -1.0}) {
            const int s = side < 0;
            there = here;
            put[s] = state + side * step * moved.col(seed);
            saved(there) = put[s];
            context_.restore(there.data());
            for (std::size_t p = 0; p < from.size(); ++p)
                for (int e = 0; e < from[p].count; ++e)
                    write_real(from[p].data, from[p].type, e, values[p][e] + side * step * read[p](e, seed));
            if (!task())
                fail(node, "it fails beside this operating point, so that its derivative cannot be found");
            context_.save(there.data());
            sides[s] = saved(there);
            Eigen::Index i = 0;
            for (const auto& part : to)
                for (int e = 0; e < part.count; ++e) results_of[s][i++] = read_value(part.data, part.type, e);
        }
        // Limits may be infinite, and what is not used NaN: they do not move.
        const auto slope = [step](double above, double below) {
            const bool is_still = above == below || (std::isnan(above) && std::isnan(below));
            return is_still ? 0 : (above - below) / (2 * step);
        };
        for (Eigen::Index i = 0; i < results; ++i) written(i, c) = slope(results_of[0][i], results_of[1][i]);
        // What the call leaves alone, as the states of other owners, keeps its slopes to the last digit.
        for (Eigen::Index i = 0; i < state.size(); ++i)
            if (sides[0][i] == put[0][i] && sides[1][i] == put[1][i])
                after(i, c) = moved(i, seed);
            else if (std::isfinite(state[i]))
                after(i, c) = slope(sides[0][i], sides[1][i]);
    }
    if (count > 0) differenced_.insert(node);
    if (!written.allFinite() || !after.allFinite())
        fail(node, "its derivative is not finite at this operating point; choose another one");
    outside_.assign(after, seeds, memory_);
    Eigen::Index i = 0;
    for (const auto& part : to) {
        if (is_real(part.type))
            slopes(part.slopes).assign(written.middleRows(i, part.count), seeds, memory_);
        else
            slopes(part.slopes).clear();
        i += part.count;
    }
}

} // namespace bf::analysis

#include "bf/qp/hierarchy.hpp"

#include "least_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

namespace bf::qp {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using RowMajor = Hierarchy::RowMajor;

double largest(const Eigen::Ref<const VectorXd>& v) { return v.size() > 0 ? v.cwiseAbs().maxCoeff() : 0.0; }

/// The reflection 1 - tau v vᵀ that maps x to (±|x|, 0, ...); v overwrites x. Returns the first element of
/// the image.
template <class Vector> double make_reflection(Vector&& x, double& tau) {
    const double norm = x.norm(), first = x[0];
    if (norm == 0.0) {
        tau = 0.0;
        return 0.0;
    }
    const double image = first > 0.0 ? -norm : norm;
    x[0] = first - image;
    tau = 1.0 / (norm * (norm + std::abs(first))); // 2/|v|²
    return image;
}

} // namespace

struct Hierarchy::Content {
    Content(int variables, std::vector<int> rows_of_levels, const Options& with);

    int rows(int level) const {
        return first[static_cast<std::size_t>(level) + 1] - first[static_cast<std::size_t>(level)];
    }
    bool is_equality(Index row) const { return lower[row] == upper[row]; }
    bool counts(Index row) const {
        return weight[row] > 0.0 && !(lower[row] == -infinity && upper[row] == infinity);
    }
    auto entries(Index row) const {
        return A.row(row).segment(begin[static_cast<std::size_t>(row)], length(row));
    }
    Index length(Index row) const {
        return end[static_cast<std::size_t>(row)] - begin[static_cast<std::size_t>(row)];
    }
    double value(Index row, const VectorXd& at) const {
        return entries(row).dot(at.segment(begin[static_cast<std::size_t>(row)], length(row)));
    }
    /// to = a times the free directions
    template <class Row> void project(Index row, Row&& to) const {
        if (length(row) == 0) {
            to.setZero();
            return;
        }
        to.noalias() = entries(row).lazyProduct(
            Z.block(begin[static_cast<std::size_t>(row)], fixed, length(row), free()));
    }
    Index free() const { return n - fixed; }

    bool find_spans(Result& result);
    void begin_level(int level);
    void triangularise(double tolerance);
    void least_squares();
    bool holds(Index row, const VectorXd& at) const;
    bool hold(const std::vector<Index>& rows, const VectorXd& at) const;
    Status program(int level, Result& result);
    Status program(int level, double weight_of_w, Result& result);
    void go(const Eigen::Ref<const VectorXd>& step);
    void keep_soft();
    Status least_norm(Result& result);
    bool hard_level(Result& result);
    Status soft_level(int level, Result& result);
    void measure();
    void solve_transposed(Eigen::Ref<Eigen::RowVectorXd> row) const;
    void solve_factor(Eigen::Ref<VectorXd> y) const;

    static constexpr double infinity = std::numeric_limits<double>::infinity();

    Options options;
    Index n, total;
    std::vector<int> first; ///< row of each level, and behind the last
    RowMajor A;
    VectorXd lower, upper, weight;
    VectorXd least, most;          ///< the bounds, and what former levels left of them
    bool feasible = false;         ///< x keeps the hard inequalities
    std::vector<Index> begin, end; ///< of each row's entries

    VectorXd x, trial; ///< the solution so far, and with the least-squares step of this level
    Eigen::MatrixXd Z; ///< orthonormal; the directions from column `fixed` on are free
    Index fixed = 0;

    RowMajor B;       ///< the level's equalities in the free directions, then their lower triangle L
    VectorXd c, size; ///< what they miss, and how long each was
    Index equalities = 0, rank = 0;
    RowMajor R; ///< a square factor of B's first `rank` columns: L itself, or R of Q R = L
    bool is_upper = false;
    VectorXd y, tau, work;

    std::vector<Index> kept; ///< inequalities of former levels
    std::vector<Index> soft; ///< of this one
    RowMajor G;
    VectorXd low, high, shifted_low, shifted_high, u, center, step;
    std::vector<std::vector<signed char>> active; ///< by level (the last: least |x|) and row
    std::vector<signed char> of_program;
    std::optional<LeastDistance> least_distance;
    VectorXd violation;
};

Hierarchy::Content::Content(int variables, std::vector<int> rows_of_levels, const Options& with)
    : options(with), n(variables), total(0), first{0} {
    options.validate();
    if (variables < 1 || rows_of_levels.empty())
        throw std::invalid_argument("a hierarchy needs a variable and a level of hard rows, even of none");
    int largest = 0;
    for (const int count : rows_of_levels) {
        if (count < 0)
            throw std::invalid_argument("a level of a hierarchy has " + std::to_string(count) + " rows");
        first.push_back(first.back() + count);
        largest = std::max(largest, count);
    }
    total = first.back();
    A.setZero(total, n);
    lower.setZero(total);
    upper.setZero(total);
    least = most = lower;
    weight.setOnes(total);
    begin.resize(static_cast<std::size_t>(total));
    end = begin;
    x.setZero(n);
    trial = step = x;
    Z.setIdentity(n, n);
    B.setZero(largest, n);
    c.setZero(largest);
    size = c;
    R.setZero(std::max<Index>(largest, 1), n);
    y.setZero(std::max<Index>(largest, n));
    tau = work = y;
    kept.reserve(static_cast<std::size_t>(total));
    soft.reserve(static_cast<std::size_t>(largest));
    const Index widest = n + largest;
    G.setZero(total, widest);
    low.setZero(total);
    high = shifted_low = shifted_high = low;
    u.setZero(widest);
    center = u;
    active.assign(rows_of_levels.size() + 1, std::vector<signed char>(static_cast<std::size_t>(total)));
    of_program.resize(static_cast<std::size_t>(total));
    qp::Options of_solver;
    of_solver.tolerance = options.tolerance;
    least_distance.emplace(static_cast<int>(widest), static_cast<int>(std::max<Index>(total, 1)), of_solver);
    violation.setZero(static_cast<Index>(rows_of_levels.size()) - 1);
}

/// Where each row's entries are that are not zero; false with the fault at what no number can be.
bool Hierarchy::Content::find_spans(Result& result) {
    const auto at_fault = [&](Fault fault, Index row, Index column) {
        result.fault = fault;
        result.level = 0;
        while (row >= first[static_cast<std::size_t>(result.level) + 1]) ++result.level;
        result.status = fault == Fault::crossing && result.level == 0 ? Status::infeasible // it must hold
                                                                      : Status::internal_error;
        result.row = static_cast<int>(row) - first[static_cast<std::size_t>(result.level)];
        result.column = static_cast<int>(column);
        return false;
    };
    for (Index row = 0; row < total; ++row) {
        const auto a = A.row(row);
        if (!(a.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= Hierarchy::largest_entry)) {
            Index column = 0;
            while (std::abs(a[column]) <= Hierarchy::largest_entry) ++column;
            return at_fault(Fault::matrix, row, column);
        }
        if (std::isnan(lower[row]) || std::isnan(upper[row]) || lower[row] == infinity ||
            upper[row] == -infinity)
            return at_fault(Fault::bound, row, -1);
        if (!(weight[row] >= 0.0 && weight[row] <= Hierarchy::largest_entry))
            return at_fault(Fault::weight, row, -1);
        if (weight[row] > 0.0 && lower[row] > upper[row]) return at_fault(Fault::crossing, row, -1);
        Index from = 0, to = n;
        while (from < to && a[from] == 0.0) ++from;
        while (from < to && a[to - 1] == 0.0) --to;
        begin[static_cast<std::size_t>(row)] = from;
        end[static_cast<std::size_t>(row)] = to;
    }
    return true;
}

/// The equalities of a level in the free directions, each times the root of its weight; its inequalities.
void Hierarchy::Content::begin_level(int level) {
    equalities = 0;
    soft.clear();
    for (Index row = first[static_cast<std::size_t>(level)]; row < first[static_cast<std::size_t>(level) + 1];
         ++row) {
        if (!counts(row)) continue;
        if (!is_equality(row)) {
            (level == 0 ? kept : soft).push_back(row);
            continue;
        }
        const double root = level == 0 ? 1.0 : std::sqrt(weight[row]);
        auto b = B.row(equalities).head(free());
        project(row, b);
        b *= root;
        c[equalities] = root * (lower[row] - value(row, x));
        size[equalities] = root * entries(row).norm();
        ++equalities;
    }
}

/// B = L Qᵀ with L lower trapezoidal of `rank` columns: rows change places so that each next one has most
/// left of itself. The free directions are turned alike.
void Hierarchy::Content::triangularise(double tolerance) {
    const Index m = equalities, d = free();
    for (rank = 0; rank < std::min(m, d); ++rank) {
        Index pivot = -1;
        double longest = tolerance;
        for (Index i = rank; i < m; ++i) {
            const double left = size[i] > 0.0 ? B.row(i).segment(rank, d - rank).norm() / size[i] : 0.0;
            if (left > longest) {
                longest = left;
                pivot = i;
            }
        }
        if (pivot < 0) break;
        if (pivot != rank) {
            B.row(pivot).head(d).swap(B.row(rank).head(d));
            std::swap(c[pivot], c[rank]);
            std::swap(size[pivot], size[rank]);
        }
        auto v = B.row(rank).segment(rank, d - rank);
        double factor = 0.0;
        const double image = make_reflection(v, factor);
        for (Index i = rank + 1; i < m; ++i) {
            auto b = B.row(i).segment(rank, d - rank);
            b -= (factor * b.dot(v)) * v;
        }
        auto turned = Z.rightCols(d - rank);
        work.head(n).setZero();
        for (Index j = 0; j < d - rank; ++j) work.head(n) += v[j] * turned.col(j);
        for (Index j = 0; j < d - rank; ++j) turned.col(j) -= (factor * v[j]) * work.head(n);
        v.setZero();
        v[0] = image;
    }
}

/// y = argmin |L y - c|, and the factor R of |L y - c|² = |R (y - its argmin)|² + const.
void Hierarchy::Content::least_squares() {
    const Index m = equalities, r = rank;
    R.topLeftCorner(m, r) = B.topLeftCorner(m, r);
    auto rest = tau.head(m);
    rest = c.head(m);
    is_upper = m > r;
    if (is_upper) {
        for (Index j = 0; j < r; ++j) {
            auto v = R.col(j).segment(j, m - j);
            double factor = 0.0;
            const double image = make_reflection(v, factor);
            for (Index k = j + 1; k < r; ++k) {
                auto column = R.col(k).segment(j, m - j);
                column -= (factor * column.dot(v)) * v;
            }
            rest.tail(m - j) -= (factor * rest.tail(m - j).dot(v)) * v;
            v[0] = image;
        }
    }
    y.head(r) = rest.head(r);
    solve_factor(y.head(r));
}

/// y = R⁻¹ y
void Hierarchy::Content::solve_factor(Eigen::Ref<VectorXd> v) const {
    const Index r = v.size();
    if (is_upper) {
        for (Index i = r; i-- > 0;)
            v[i] = (v[i] - R.row(i).segment(i + 1, r - i - 1).dot(v.tail(r - i - 1))) / R(i, i);
    } else {
        for (Index i = 0; i < r; ++i) v[i] = (v[i] - R.row(i).head(i).dot(v.head(i))) / R(i, i);
    }
}

/// g = g R⁻¹
void Hierarchy::Content::solve_transposed(Eigen::Ref<Eigen::RowVectorXd> g) const {
    const Index r = g.size();
    if (is_upper) {
        for (Index i = 0; i < r; ++i) {
            g[i] /= R(i, i);
            g.tail(r - i - 1) -= g[i] * R.row(i).segment(i + 1, r - i - 1);
        }
    } else {
        for (Index i = r; i-- > 0;) {
            g[i] /= R(i, i);
            g.head(i) -= g[i] * R.row(i).head(i);
        }
    }
}

/// x moves by Z times the step, whose length says how many of the free directions it takes.
void Hierarchy::Content::go(const Eigen::Ref<const VectorXd>& by) {
    for (Index j = 0; j < by.size(); ++j) x += by[j] * Z.col(fixed + j);
}

bool Hierarchy::Content::holds(Index row, const VectorXd& at) const {
    const double a = value(row, at);
    return a >= least[row] - options.tolerance && a <= most[row] + options.tolerance;
}
bool Hierarchy::Content::hold(const std::vector<Index>& rows, const VectorXd& at) const {
    return std::all_of(rows.begin(), rows.end(), [&](Index row) { return holds(row, at); });
}

/// The step of least cost of this level under the inequalities: y = argmin + R⁻¹ u for the directions that
/// its equalities determine, w for the other free ones, one slack for each inequality of its own. The cost ½
/// |u|² + ½ |slack|² knows no w, so that w is held near a centre which follows it (proximal point
/// iterations). The less it is held, the fewer of them, and the nearer are rows of many w to depending on
/// each other.
Status Hierarchy::Content::program(int level, Result& result) {
    double longest = 0.0;
    for (Index i = 0; i < equalities; ++i) longest = std::max(longest, size[i]);
    for (const Index row : soft) longest = std::max(longest, std::sqrt(weight[row]) * entries(row).norm());
    if (longest == 0.0) longest = 1.0;
    const Status status = program(level, 0.03 * longest, result);
    return status == Status::solved || status == Status::iteration_limit ? status
                                                                         : program(level, longest, result);
}

Status Hierarchy::Content::program(int level, double weight_of_w, Result& result) {
    const Index r = rank, d = free(), slacks = static_cast<Index>(soft.size());
    const Index variables = d + slacks, rows = static_cast<Index>(kept.size()) + slacks;
    Eigen::Map<RowMajor> g(G.data(), rows, variables);
    auto& start = active[static_cast<std::size_t>(level)];
    Index i = 0;
    for (const auto* list : {&kept, &soft})
        for (const Index row : *list) {
            auto of_row = g.row(i);
            auto in_free = of_row.head(d);
            project(row, in_free);
            of_program[static_cast<std::size_t>(i)] = start[static_cast<std::size_t>(row)];
            if (in_free.norm() <= options.rank_tolerance * entries(row).norm()) { // nothing moves it any more
                of_row.setZero();
                low[i] = -infinity;
                high[i] = infinity;
                of_program[static_cast<std::size_t>(i++)] = 0;
                if (list == &kept && !feasible && !holds(row, x)) return Status::infeasible;
                continue;
            }
            const double a = value(row, x), by_y = of_row.head(r).dot(y.head(r));
            double from = least[row] - a, to = most[row] - a;
            of_row.tail(slacks).setZero();
            double root = 1.0;
            if (list == &kept) {
                if (feasible) { // but for rounding
                    from = std::min(from, 0.0);
                    to = std::max(to, 0.0);
                }
            } else {
                root = std::sqrt(weight[row]);
                of_row.head(d) *= root;
                of_row[d + i - static_cast<Index>(kept.size())] = 1.0;
            }
            low[i] = root * (from - by_y);
            high[i] = root * (to - by_y);
            solve_transposed(of_row.head(r));
            of_row.segment(r, d - r) /= weight_of_w;
            ++i;
        }

    auto w = center.head(d - r);
    w.setZero();
    Status status = Status::solved;
    for (int round = 0; round < 200; ++round) {
        for (Index k = 0; k < rows; ++k) {
            const double moved = g.row(k).segment(r, d - r).dot(w);
            shifted_low[k] = low[k] - moved;
            shifted_high[k] = high[k] - moved;
        }
        status = least_distance->solve(static_cast<int>(variables), static_cast<int>(rows), G.data(),
                                       shifted_low.data(), shifted_high.data(), of_program.data(), u.data(),
                                       result.iterations, options.max_iterations, round > 0);
        if (status != Status::solved) break;
        if (d == r) break;
        w += u.segment(r, d - r);
        const double moved = u.segment(r, d - r).cwiseAbs().maxCoeff();
        if (moved <= 1e-9 * std::max(largest(w), std::max(largest(u.head(r)), largest(u.segment(d, slacks)))))
            break;
    }
    i = 0;
    for (const auto* list : {&kept, &soft})
        for (const Index row : *list)
            start[static_cast<std::size_t>(row)] = of_program[static_cast<std::size_t>(i++)];
    if (status != Status::solved) return status;
    solve_factor(u.head(r));
    step.head(r) = y.head(r) + u.head(r);
    step.segment(r, d - r) = w / weight_of_w;
    return Status::solved;
}

/// Inequalities of this level that stay violated are equalities from now on; the others keep their bounds, or
/// what they have of them.
void Hierarchy::Content::keep_soft() {
    equalities = 0;
    for (const Index row : soft) {
        const double a = value(row, x);
        const double threshold = 1e3 * options.tolerance;
        if (free() > 0 && (a < least[row] - threshold || a > most[row] + threshold)) {
            project(row, B.row(equalities).head(free()));
            size[equalities++] = entries(row).norm();
        } else {
            kept.push_back(row);
            least[row] = std::min(least[row], a);
            most[row] = std::max(most[row], a);
        }
    }
    if (equalities == 0) return;
    triangularise(options.rank_tolerance);
    fixed += rank;
}

bool Hierarchy::Content::hard_level(Result& result) {
    begin_level(0);
    if (equalities > 0) {
        triangularise(1e-9); // what must hold is not given up easily
        least_squares();
        go(y.head(rank));
        fixed += rank;
    }
    double worst = 0.0;
    for (Index row = 0; row < first[1]; ++row) {
        if (!counts(row) || !is_equality(row)) continue;
        const double missing = std::abs(lower[row] - value(row, x));
        const double allowed =
            options.tolerance * (1.0 + std::abs(lower[row]) + entries(row).norm() * largest(x));
        if (missing <= std::max(worst, allowed)) continue;
        worst = missing;
        result.status = Status::infeasible;
        result.fault = Fault::dependent;
        result.level = 0;
        result.row = static_cast<int>(row);
    }
    if (result.status == Status::solved && free() == 0 && !hold(kept, x)) result.status = Status::infeasible;
    return result.status == Status::solved;
}

Status Hierarchy::Content::soft_level(int level, Result& result) {
    if (free() == 0) return Status::solved;
    begin_level(level);
    rank = 0;
    if (equalities > 0) {
        triangularise(options.rank_tolerance);
        least_squares();
    }
    trial = x;
    for (Index j = 0; j < rank; ++j) trial += y[j] * Z.col(fixed + j);
    if (hold(kept, trial) && hold(soft, trial)) {
        x = trial;
    } else {
        if (const Status status = program(level, result); status != Status::solved) return status;
        go(step.head(free()));
    }
    feasible = true;
    fixed += rank;
    keep_soft();
    return Status::solved;
}

/// What no level asks for: the x of least norm.
Status Hierarchy::Content::least_norm(Result& result) {
    const Index d = free(), rows = static_cast<Index>(kept.size());
    if (d == 0) return Status::solved;
    y.head(d).noalias() = -Z.rightCols(d).transpose().lazyProduct(x);
    trial = x;
    for (Index j = 0; j < d; ++j) trial += y[j] * Z.col(fixed + j);
    if (hold(kept, trial)) {
        x = trial;
        return Status::solved;
    }
    Eigen::Map<RowMajor> g(G.data(), rows, d);
    auto& start = active.back();
    for (Index i = 0; i < rows; ++i) {
        const Index row = kept[static_cast<std::size_t>(i)];
        project(row, g.row(i));
        of_program[static_cast<std::size_t>(i)] = start[static_cast<std::size_t>(row)];
        if (g.row(i).norm() <= options.rank_tolerance * entries(row).norm()) {
            g.row(i).setZero();
            low[i] = -infinity;
            high[i] = infinity;
            of_program[static_cast<std::size_t>(i)] = 0;
            if (!feasible && !holds(row, x)) return Status::infeasible;
            continue;
        }
        const double a = value(row, x), by_y = g.row(i).dot(y.head(d));
        low[i] = std::min(least[row] - a, feasible ? 0.0 : infinity) - by_y;
        high[i] = std::max(most[row] - a, feasible ? 0.0 : -infinity) - by_y;
    }
    const Status status =
        least_distance->solve(static_cast<int>(d), static_cast<int>(rows), G.data(), low.data(), high.data(),
                              of_program.data(), u.data(), result.iterations, options.max_iterations);
    for (Index i = 0; i < rows; ++i)
        start[static_cast<std::size_t>(kept[static_cast<std::size_t>(i)])] =
            of_program[static_cast<std::size_t>(i)];
    if (status != Status::solved) return status;
    step.head(d) = y.head(d) + u.head(d);
    go(step.head(d));
    return Status::solved;
}

void Hierarchy::Content::measure() {
    for (Index level = 1; level <= violation.size(); ++level) {
        double sum = 0.0;
        for (Index row = first[static_cast<std::size_t>(level)];
             row < first[static_cast<std::size_t>(level) + 1]; ++row) {
            if (!counts(row)) continue;
            const double a = value(row, x), missing = std::max({lower[row] - a, a - upper[row], 0.0});
            sum += weight[row] * missing * missing;
        }
        violation[level - 1] = std::sqrt(sum);
    }
}

void Hierarchy::Options::validate() const {
    qp::Options{.max_iterations = max_iterations, .tolerance = tolerance}.validate();
    if (!(rank_tolerance > 0.0 && rank_tolerance < 1.0))
        throw std::invalid_argument("rank_tolerance is " + std::to_string(rank_tolerance) +
                                    ", but must lie between 0 and 1");
}

Hierarchy::Hierarchy(int variables, std::vector<int> rows, const Options& options)
    : content_(std::make_unique<Content>(variables, std::move(rows), options)) {}
Hierarchy::~Hierarchy() = default;
Hierarchy::Hierarchy(Hierarchy&&) noexcept = default;

Hierarchy::Rows Hierarchy::level(int k) noexcept {
    auto& c = *content_;
    const Index from = c.first[static_cast<std::size_t>(k)], rows = c.rows(k);
    return {{c.A.data() + from * c.n, rows, c.n},
            {c.lower.data() + from, rows},
            {c.upper.data() + from, rows},
            {c.weight.data() + from, rows}};
}
int Hierarchy::levels() const noexcept { return static_cast<int>(content_->violation.size()); }
const VectorXd& Hierarchy::violation() const noexcept { return content_->violation; }

Hierarchy::Result Hierarchy::solve(Eigen::Ref<VectorXd> x) noexcept {
    auto& c = *content_;
    Result result;
    if (!c.find_spans(result)) return result;
    c.x.setZero();
    c.Z.setIdentity();
    c.fixed = 0;
    c.kept.clear();
    c.least = c.lower;
    c.most = c.upper;
    c.feasible = false;
    if (!c.hard_level(result)) return result;
    for (int level = 1; level <= levels(); ++level) {
        result.status = c.soft_level(level, result);
        if (result.status != Status::solved) break;
        result.levels = level;
    }
    if (result.status == Status::solved) result.status = c.least_norm(result);
    if (result.status == Status::infeasible && c.feasible) result.status = Status::internal_error;
    if (!c.x.allFinite()) { // bounds of numbers that cannot be computed with
        result.status = Status::internal_error;
        result.levels = 0;
    }
    if (result.status != Status::solved && result.levels == 0) return result;
    c.measure();
    x = c.x;
    return result;
}

void Hierarchy::reset() noexcept {
    for (auto& rows : content_->active) std::fill(rows.begin(), rows.end(), static_cast<signed char>(0));
}
int Hierarchy::state_size() const noexcept {
    return static_cast<int>(content_->active.size()) * static_cast<int>(content_->total);
}
void Hierarchy::save(double* state) const noexcept {
    for (const auto& rows : content_->active) state = std::copy(rows.begin(), rows.end(), state);
}
void Hierarchy::restore(const double* state) noexcept {
    for (auto& rows : content_->active)
        for (auto& row : rows) row = static_cast<signed char>(*state++);
}

} // namespace bf::qp

#include <Eigen/Dense>
#include <bf/qp/hierarchy.hpp>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace bf::qp::test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Level {
    MatrixXd A;
    VectorXd lower, upper, weight;
};
using Levels = std::vector<Level>;

MatrixXd random_matrix(std::mt19937& random, int rows, int columns) {
    std::normal_distribution<double> normal;
    return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

Level equalities(std::mt19937& random, int rows, int columns) {
    const VectorXd b = random_matrix(random, rows, 1);
    return {random_matrix(random, rows, columns), b, b, VectorXd::Ones(rows)};
}

/// Rows of all kinds; those of a hard level hold at `inside`.
Level any_rows(std::mt19937& random, int rows, int columns, const VectorXd& inside, bool is_hard) {
    Level level = equalities(random, rows, columns);
    level.weight = (0.5 * random_matrix(random, rows, 1)).array().exp();
    std::uniform_int_distribution<int> kind(0, 4);
    for (int i = 0; i < rows; ++i) {
        if (i % 3 == 1) level.A.row(i).head(columns / 2).setZero();
        if (i % 3 == 2) level.A.row(i).tail(columns / 2).setZero();
        const double center = is_hard ? level.A.row(i).dot(inside) : 2.0 * level.lower[i];
        const double half = std::abs(level.lower[i]);
        level.lower[i] = center - half;
        level.upper[i] = center + half;
        switch (kind(random)) {
        case 0: level.lower[i] = -infinity; break;
        case 1: level.upper[i] = infinity; break;
        case 2: level.lower[i] = level.upper[i] = center; break;
        default: break;
        }
    }
    return level;
}

Hierarchy make(const Levels& levels, const Hierarchy::Options& options = {}) {
    std::vector<int> rows;
    for (const Level& level : levels) rows.push_back(static_cast<int>(level.A.rows()));
    return {static_cast<int>(levels[0].A.cols()), rows, options};
}

void load(Hierarchy& hierarchy, const Levels& levels) {
    for (std::size_t k = 0; k < levels.size(); ++k) {
        auto rows = hierarchy.level(static_cast<int>(k));
        rows.A = levels[k].A;
        rows.lower = levels[k].lower;
        rows.upper = levels[k].upper;
        rows.weight = levels[k].weight;
    }
}

double violation(const Level& level, const VectorXd& x) {
    const VectorXd a = level.A * x;
    return std::sqrt(
        (level.weight.array() * (level.lower - a).cwiseMax(a - level.upper).cwiseMax(0.0).array().square())
            .sum());
}

/// x = x + N (A N)⁺ (b - A x), N = N null(A N), level by level: the recursion of Siciliano and Slotine by
/// SVD.
VectorXd null_space_recursion(const Levels& levels) {
    const auto n = levels[0].A.cols();
    VectorXd x = VectorXd::Zero(n);
    MatrixXd N = MatrixXd::Identity(n, n);
    for (const Level& level : levels) {
        if (level.A.rows() == 0 || N.cols() == 0) continue;
        const VectorXd root = level.weight.cwiseSqrt();
        const MatrixXd A = root.asDiagonal() * level.A;
        Eigen::JacobiSVD<MatrixXd> svd(A * N, Eigen::ComputeFullU | Eigen::ComputeFullV);
        svd.setThreshold(1e-9);
        x += N * svd.solve(root.cwiseProduct(level.lower) - A * x);
        N = (N * svd.matrixV().rightCols(N.cols() - svd.rank())).eval();
    }
    return x;
}

/// What is left of the gradient of a level's cost at x that no multipliers of the rows before it balance:
/// free ones of equalities and of rows that stay violated, of one sign where a bound is reached. Zero proves
/// that the level's violation is the least under what holds and what the former levels reached, wherever the
/// multipliers come from.
double without_multipliers(const Levels& levels, std::size_t k, const VectorXd& x) {
    const auto n = x.size();
    MatrixXd N(n, 0);
    std::vector<double> low, high;
    const auto add = [&](const VectorXd& row, double from, double to) {
        N.conservativeResize(n, N.cols() + 1);
        N.rightCols(1) = row;
        low.push_back(from);
        high.push_back(to);
    };
    VectorXd gradient = VectorXd::Zero(n);
    for (std::size_t j = 0; j <= k; ++j) {
        const Level& level = levels[j];
        for (Eigen::Index i = 0; i < level.A.rows(); ++i) {
            const VectorXd a = level.A.row(i);
            const double value = a.dot(x), over = value - level.upper[i], under = level.lower[i] - value;
            if (j == k)
                gradient += level.weight[i] * (std::max(over, 0.0) - std::max(under, 0.0)) * a;
            else if (level.lower[i] == level.upper[i] || std::max(over, under) > 1e-5)
                add(a, -infinity, infinity);
            else if (over > -1e-5)
                add(a, 0.0, infinity);
            else if (under > -1e-5)
                add(a, -infinity, 0.0);
        }
    }
    const int m = static_cast<int>(N.cols());
    VectorXd y = VectorXd::Zero(std::max(m, 1));
    if (m == 0) return gradient.norm();
    const MatrixXd H = N.transpose() * N + 1e-13 * MatrixXd::Identity(m, m);
    const VectorXd g = N.transpose() * gradient;
    const VectorXd from = Eigen::Map<VectorXd>(low.data(), m), to = Eigen::Map<VectorXd>(high.data(), m);
    Problem problem{.H = H, .g = g, .lb = from, .ub = to};
    const Result result = make_daqp(m, 0)->solve(problem, y);
    EXPECT_EQ(result.status, Status::solved) << describe(result);
    return (gradient + N * y.cwiseMax(from).cwiseMin(to)).norm();
}

} // namespace

TEST(Hierarchy, IsTheRecursionByNullSpacesWhereAllRowsAreEqualities) {
    std::mt19937 random(1);
    for (int k = 0; k < 60; ++k) {
        const int n = 5 + k % 20;
        Levels levels{equalities(random, k % 4, n)};
        for (int i = 1; i <= 3; ++i) {
            levels.push_back(equalities(random, 1 + (k * i) % 9, n));
            levels.back().weight = random_matrix(random, levels.back().A.rows(), 1).array().exp();
        }
        if (k % 3 == 1) levels[2].A.row(0) = levels[1].A.row(0);                  // conflict between levels
        if (k % 3 == 2) levels[3].A.bottomRows(1) = 2.0 * levels[3].A.topRows(1); // within one, if it has two
        Hierarchy hierarchy = make(levels);
        load(hierarchy, levels);
        VectorXd x(n);
        const auto result = hierarchy.solve(x);
        ASSERT_EQ(result.status, Status::solved) << k;
        EXPECT_EQ(result.levels, 3);
        EXPECT_EQ(result.iterations, 0) << "no program was solved";
        const VectorXd expected = null_space_recursion(levels);
        EXPECT_LT((x - expected).norm(), 1e-8 * (1.0 + expected.norm())) << k;
        for (int i = 1; i <= 3; ++i)
            EXPECT_NEAR(hierarchy.violation()[i - 1], violation(levels[static_cast<std::size_t>(i)], x),
                        1e-12);
    }
}

TEST(Hierarchy, OfOneLevelIsTheWeightedLeastSquaresUnderItsEqualities) {
    std::mt19937 random(2);
    for (int k = 0; k < 20; ++k) {
        const int n = 12, hard = 4, m = 20;
        Levels levels{equalities(random, hard, n), equalities(random, m, n)};
        levels[1].weight = (3.0 * random_matrix(random, m, 1)).array().exp();
        Hierarchy hierarchy = make(levels);
        load(hierarchy, levels);
        VectorXd x(n);
        ASSERT_EQ(hierarchy.solve(x).status, Status::solved);
        // [H C'; C 0] [x; multipliers] = [A'W b; d]
        const MatrixXd& A = levels[1].A;
        const auto W = levels[1].weight.asDiagonal();
        MatrixXd kkt = MatrixXd::Zero(n + hard, n + hard);
        kkt.topLeftCorner(n, n) = A.transpose() * W * A;
        kkt.bottomLeftCorner(hard, n) = levels[0].A;
        kkt.topRightCorner(n, hard) = levels[0].A.transpose();
        VectorXd right(n + hard);
        right << A.transpose() * (W * levels[1].lower), levels[0].lower;
        EXPECT_LT((x - kkt.fullPivLu().solve(right).head(n)).norm(), 1e-8) << k;
    }
}

TEST(Hierarchy, ViolatesEachLevelAsLittleAsMultipliersProve) {
    std::mt19937 random(3);
    int violated = 0, programs = 0;
    for (int k = 0; k < 60; ++k) {
        const int n = 6 + k % 7;
        const VectorXd inside = random_matrix(random, n, 1);
        Levels levels{any_rows(random, n - 2, n, inside, true)};
        levels[0].weight.setOnes();
        for (int i = 0; i < 3; ++i) levels.push_back(any_rows(random, 2 + (k + i) % 6, n, inside, false));
        Hierarchy hierarchy = make(levels);
        load(hierarchy, levels);
        VectorXd x(n);
        const auto result = hierarchy.solve(x);
        ASSERT_EQ(result.status, Status::solved) << k;
        programs += result.iterations > 0;
        EXPECT_LT(violation(levels[0], x), 1e-6) << k;
        for (std::size_t i = 1; i <= 3; ++i) {
            const double own = violation(levels[i], x);
            EXPECT_NEAR(own, hierarchy.violation()[static_cast<int>(i) - 1], 1e-12);
            EXPECT_LT(without_multipliers(levels, i, x), 1e-5 * (1.0 + own))
                << "problem " << k << ", level " << i;
            violated += own > 0.01;
        }
    }
    EXPECT_GT(violated, 60) << "the problems are too easy";
    EXPECT_GT(programs, 50);
}

TEST(Hierarchy, ChangesNothingAboveWhenALevelIsAddedBelow) {
    std::mt19937 random(4);
    for (int k = 0; k < 30; ++k) {
        const int n = 9;
        const VectorXd inside = random_matrix(random, n, 1);
        Levels levels{any_rows(random, 6, n, inside, true), any_rows(random, 5, n, inside, false),
                      any_rows(random, 4, n, inside, false)};
        VectorXd x(n), y(n);
        Hierarchy two = make(levels);
        load(two, levels);
        ASSERT_EQ(two.solve(x).status, Status::solved);
        levels.push_back(any_rows(random, 7, n, inside, false));
        Hierarchy three = make(levels);
        load(three, levels);
        ASSERT_EQ(three.solve(y).status, Status::solved);
        EXPECT_NEAR(two.violation()[0], three.violation()[0], 1e-6);
        EXPECT_NEAR(two.violation()[1], three.violation()[1], 1e-6);
    }
}

TEST(Hierarchy, LeavesWhatNoLevelAsksForAtTheLeastNorm) {
    // x1 + x2 = 2 and x3 at least 1, of four.
    Hierarchy hierarchy(4, {1, 1}, {});
    auto hard = hierarchy.level(0), soft = hierarchy.level(1);
    hard.A.row(0) << 0, 0, 1, 0;
    hard.lower[0] = 1.0;
    hard.upper[0] = infinity;
    soft.A.row(0) << 1, 1, 0, 0;
    soft.lower[0] = soft.upper[0] = 2.0;
    VectorXd x(4);
    ASSERT_EQ(hierarchy.solve(x).status, Status::solved);
    EXPECT_LT((x - Eigen::Vector4d(1, 1, 1, 0)).norm(), 1e-8);
    soft.weight[0] = 0.0;
    ASSERT_EQ(hierarchy.solve(x).status, Status::solved);
    EXPECT_LT((x - Eigen::Vector4d(0, 0, 1, 0)).norm(), 1e-8) << "a row of weight 0 asks nothing";
    EXPECT_EQ(hierarchy.violation()[0], 0.0);
    Hierarchy alone(4, {1}, {}); // no level but what must hold
    alone.level(0).A = hard.A;
    alone.level(0).lower = hard.lower;
    alone.level(0).upper = hard.upper;
    ASSERT_EQ(alone.solve(x).status, Status::solved);
    EXPECT_LT((x - Eigen::Vector4d(0, 0, 1, 0)).norm(), 1e-8);
}

TEST(Hierarchy, SharesAViolationThatCannotBeAvoidedByTheWeights) {
    // x at least 1, weight 3, against x at most -1, weight 1: x = 0.5 has the least 3 (1 - x)² + (x + 1)².
    Hierarchy hierarchy(2, {0, 2, 2}, {});
    auto first = hierarchy.level(1), second = hierarchy.level(2);
    first.A << 1, 0, 1, 0;
    first.lower << 1, -infinity;
    first.upper << infinity, -1;
    first.weight << 3, 1;
    second.A << 1, 0, 0, 1;
    second.lower << 9, 2;
    second.upper << 9, 2;
    VectorXd x(2);
    ASSERT_EQ(hierarchy.solve(x).status, Status::solved);
    EXPECT_LT((x - Eigen::Vector2d(0.5, 2)).norm(), 1e-6);
    EXPECT_NEAR(hierarchy.violation()[0], std::sqrt(3.0 * 0.25 + 2.25), 1e-6);
}

TEST(Hierarchy, TakesWeightsAndEntriesOfAllSizesThatItAllows) {
    for (const double weight : {1e-100, 1e-10, 1.0, 1e10, 1e100})
        for (const double entry : {1e-50, 1.0, 1e50, 1e100}) {
            Hierarchy hierarchy(2, {0, 2}, {});
            auto rows = hierarchy.level(1);
            rows.A << entry, 0, 0, 1;
            rows.lower << entry, 2;
            rows.upper = rows.lower;
            rows.weight << weight, 1 / weight;
            VectorXd x(2);
            ASSERT_EQ(hierarchy.solve(x).status, Status::solved) << weight << ' ' << entry;
            EXPECT_LT((x - Eigen::Vector2d(1, 2)).norm(), 1e-9) << weight << ' ' << entry;
        }
}

TEST(Hierarchy, BeginsWithTheActiveRowsOfTheLastSolve) {
    std::mt19937 random(5);
    const int n = 20;
    const VectorXd inside = random_matrix(random, n, 1);
    Levels levels{any_rows(random, 30, n, inside, true), any_rows(random, 8, n, inside, false),
                  any_rows(random, 8, n, inside, false)};
    Hierarchy warm = make(levels), cold = make(levels);
    int of_warm = 0, of_cold = 0;
    for (int k = 0; k < 20; ++k) {
        for (std::size_t i = 1; i < 3; ++i) levels[i].A += 0.01 * random_matrix(random, 8, n);
        load(warm, levels);
        load(cold, levels);
        cold.reset();
        VectorXd x(n), y(n);
        const auto w = warm.solve(x), c = cold.solve(y);
        ASSERT_EQ(w.status, Status::solved);
        ASSERT_EQ(c.status, Status::solved);
        EXPECT_LT((x - y).norm(), 1e-5) << k;
        of_warm += k > 0 ? w.iterations : 0;
        of_cold += k > 0 ? c.iterations : 0;
    }
    EXPECT_LT(2 * of_warm, of_cold);
}

TEST(Hierarchy, GoesOnFromASavedStateBitForBit) {
    std::mt19937 random(6);
    const int n = 12;
    const VectorXd inside = random_matrix(random, n, 1);
    Levels levels{any_rows(random, 16, n, inside, true), any_rows(random, 6, n, inside, false)};
    Hierarchy one = make(levels), other = make(levels);
    VectorXd x(n), y(n);
    load(one, levels);
    ASSERT_EQ(one.solve(x).status, Status::solved);
    std::vector<double> state(static_cast<std::size_t>(one.state_size()));
    one.save(state.data());
    other.restore(state.data());
    levels[1].A += 0.1 * random_matrix(random, 6, n);
    load(one, levels);
    load(other, levels);
    const auto a = one.solve(x), b = other.solve(y);
    EXPECT_EQ(a.iterations, b.iterations);
    EXPECT_EQ(x, y);
    one.reset();
    Hierarchy fresh = make(levels);
    load(fresh, levels);
    one.solve(x);
    fresh.solve(y);
    EXPECT_EQ(x, y);
}

TEST(Hierarchy, SaysWhichRowIsAtFaultAndKeepsX) {
    using Fault = Hierarchy::Fault;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto solve = [](const std::function<void(Hierarchy&)>& spoil, Status status, Fault fault, int level,
                          int row, int column) {
        Hierarchy hierarchy(3, {2, 2}, {});
        hierarchy.level(0).A << 1, 0, 0, 1, 1, 0;
        hierarchy.level(1).A << 0, 1, 0, 0, 0, 1;
        spoil(hierarchy);
        VectorXd x = Eigen::Vector3d(7, 8, 9);
        const auto result = hierarchy.solve(x);
        EXPECT_EQ(result.status, status);
        EXPECT_EQ(result.fault, fault);
        EXPECT_EQ(result.level, level);
        EXPECT_EQ(result.row, row);
        EXPECT_EQ(result.column, column);
        EXPECT_EQ(x, Eigen::Vector3d(7, 8, 9));
    };
    const auto broken = Status::internal_error;
    solve([&](Hierarchy& h) { h.level(1).A(1, 2) = nan; }, broken, Fault::matrix, 1, 1, 2);
    solve([&](Hierarchy& h) { h.level(0).lower[1] = nan; }, broken, Fault::bound, 0, 1, -1);
    solve([&](Hierarchy& h) { h.level(1).lower[0] = infinity; }, broken, Fault::bound, 1, 0, -1);
    solve([&](Hierarchy& h) { h.level(1).upper[0] = -infinity; }, broken, Fault::bound, 1, 0, -1);
    solve([&](Hierarchy& h) { h.level(1).weight[1] = -1; }, broken, Fault::weight, 1, 1, -1);
    solve([&](Hierarchy& h) { h.level(1).weight[1] = 1e308; }, broken, Fault::weight, 1, 1, -1);
    solve([&](Hierarchy& h) { h.level(1).A(0, 1) = -1e300; }, broken, Fault::matrix, 1, 0, 1);
    solve([&](Hierarchy& h) { h.level(0).A(1, 2) = 1e300; }, broken, Fault::matrix, 0, 1, 2);
    solve([&](Hierarchy& h) { h.level(0).lower[1] = 2; }, Status::infeasible, Fault::crossing, 0, 1, -1);
    solve([&](Hierarchy& h) { h.level(1).lower[1] = 2; }, broken, Fault::crossing, 1, 1, -1);
    solve( // a x that overflows
        [&](Hierarchy& h) {
            h.level(1).A(1, 2) = 1e-100;
            h.level(1).lower[1] = h.level(1).upper[1] = 1e300;
        },
        broken, Fault::none, -1, -1, -1);
    solve(
        [&](Hierarchy& h) {
            h.level(0).A.row(1) = h.level(0).A.row(0);
            h.level(0).lower << 1, 2;
            h.level(0).upper << 1, 2;
        },
        Status::infeasible, Fault::dependent, 0, 1, -1);
    solve( // x1 at least 1, x1 + x2 at most 0, and x2 at least 0 cannot be
        [&](Hierarchy& h) {
            h.level(0).lower << 1, -infinity;
            h.level(0).upper << 1, 0.5;
            h.level(0).A.row(1) << 1, 0, 0;
        },
        Status::infeasible, Fault::none, -1, -1, -1);
}

TEST(Hierarchy, KeepsTheLevelsThatWereSolvedWhenALaterOneIsNot) {
    std::mt19937 random(7);
    const int n = 15;
    const VectorXd inside = random_matrix(random, n, 1);
    Levels levels{any_rows(random, 20, n, inside, true), any_rows(random, 7, n, inside, false),
                  any_rows(random, 7, n, inside, false)};
    Hierarchy whole = make(levels);
    load(whole, levels);
    VectorXd x(n), y = VectorXd::Constant(n, 5.0);
    const int needed = whole.solve(x).iterations;
    bool partly = false;
    for (int most = 1; most <= needed; ++most) {
        Hierarchy::Options options;
        options.max_iterations = most;
        Hierarchy brief = make(levels, options);
        load(brief, levels);
        const auto result = brief.solve(y);
        EXPECT_LE(result.iterations, most);
        if (result.status == Status::solved) continue;
        EXPECT_EQ(result.status, Status::iteration_limit);
        if (result.levels == 0) {
            EXPECT_EQ(y, VectorXd::Constant(n, 5.0));
        }
        if (result.levels != 1) continue;
        partly = true;
        EXPECT_NEAR(brief.violation()[0], whole.violation()[0], 1e-6);
    }
    EXPECT_TRUE(partly);
}

TEST(Hierarchy, RefusesImpossibleSizesAndOptions) {
    EXPECT_THROW(Hierarchy(0, {1}, {}), std::invalid_argument);
    EXPECT_THROW(Hierarchy(2, {}, {}), std::invalid_argument);
    EXPECT_THROW(Hierarchy(2, {1, -1}, {}), std::invalid_argument);
    EXPECT_THROW(Hierarchy(2, {1}, {.max_iterations = 0}), std::invalid_argument);
    EXPECT_THROW(Hierarchy(2, {1}, {.tolerance = 0.0}), std::invalid_argument);
    EXPECT_THROW(Hierarchy(2, {1}, {.rank_tolerance = 1.0}), std::invalid_argument);
}

} // namespace bf::qp::test

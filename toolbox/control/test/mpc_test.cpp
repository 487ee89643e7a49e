#include "bf/control/mpc.hpp"

#include <Eigen/Dense>

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <stdexcept>

namespace bf::control::test {
namespace {

using Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

constexpr int n = 4, m = 2;

/// Two masses, coupled by a spring, each pushed by an input; 0.1 s a step.
struct Masses {
    Matrix A = Matrix::Identity(n, n), B = Matrix::Zero(n, m), Q = Matrix::Identity(n, n),
           R = 0.1 * Matrix::Identity(m, m), P = 3.0 * Matrix::Identity(n, n);
    Masses() {
        A(0, 2) = A(1, 3) = 0.1;
        A(2, 0) = A(3, 1) = -0.2;
        A(2, 1) = A(3, 0) = 0.2;
        B(2, 0) = 0.1;
        B(3, 1) = 0.05;
        Q(0, 1) = 0.4; // only the symmetric part counts
    }
};

struct Question {
    VectorXd x, u_reference, disturbance;
    Matrix reference;
};

Question random_question(int columns, std::mt19937& random) {
    std::normal_distribution<double> normal;
    const auto draw = [&](Eigen::Index, Eigen::Index) { return normal(random); };
    return {Matrix::NullaryExpr(n, 1, draw), Matrix::NullaryExpr(m, 1, draw),
            0.1 * Matrix::NullaryExpr(n, 1, draw), Matrix::NullaryExpr(n, columns, draw)};
}

Mpc made(Mpc::Form form, int horizon, std::vector<int> bounded = {}, bool is_soft = false,
         Mpc::Method method = Mpc::Method::daqp, bool limits_rates = false) {
    Mpc::Options options;
    options.limits_rates = limits_rates;
    options.horizon = horizon;
    options.form = form;
    options.bounded = std::move(bounded);
    options.is_soft = is_soft;
    options.method = method;
    const Masses of;
    Mpc mpc(n, m, options);
    mpc.set_model(of.A, of.B, of.Q, of.R, of.P);
    return mpc;
}

qp::Status solve(Mpc& mpc, const Question& of) {
    return mpc.solve(of.x, of.reference, of.u_reference, of.disturbance).status;
}

/// All inputs by the equations of Karush, Kuhn and Tucker over inputs, states and multipliers.
Matrix without_bounds(const Question& question, int N) {
    const Masses of;
    const int variables = N * (n + m), rows = N * n;
    Matrix H = Matrix::Zero(variables, variables), C = Matrix::Zero(rows, variables);
    VectorXd g = VectorXd::Zero(variables), d = VectorXd::Zero(rows);
    for (int k = 0; k < N; ++k) {
        const Matrix cost = k + 1 == N ? of.P : Matrix(0.5 * (of.Q + of.Q.transpose()));
        H.block(k * m, k * m, m, m) = of.R;
        H.block(N * m + k * n, N * m + k * n, n, n) = cost;
        g.segment(k * m, m) = -of.R * question.u_reference;
        g.segment(N * m + k * n, n) = -cost * question.reference.col(k);
        C.block(k * n, N * m + k * n, n, n).setIdentity();
        C.block(k * n, k * m, n, m) = -of.B;
        if (k > 0) C.block(k * n, N * m + (k - 1) * n, n, n) = -of.A;
        d.segment(k * n, n) = question.disturbance;
        if (k == 0) d.head(n) += of.A * question.x;
    }
    Matrix all = Matrix::Zero(variables + rows, variables + rows);
    all << H, C.transpose(), C, Matrix::Zero(rows, rows);
    VectorXd right(variables + rows);
    right << -g, d;
    const VectorXd solution = all.fullPivLu().solve(right);
    return Eigen::Map<const Matrix>(solution.data(), m, N);
}

/// The program of another form: the rates v_k = u_k - u_{k-1} are its variables, so that their limits are its
/// bounds, and inputs and bounded states are rows; solved by another method.
qp::Result in_rates(const Mpc& mpc, const Question& question, int N, const std::vector<int>& bounded,
                    Matrix& inputs) {
    const Masses of;
    const Matrix Q = 0.5 * (of.Q + of.Q.transpose());
    const Matrix sums = Matrix::NullaryExpr(
        N * m, N * m, [](Eigen::Index i, Eigen::Index j) { return j <= i && (i - j) % m == 0 ? 1.0 : 0.0; });
    const VectorXd before = mpc.u_last.replicate(N, 1);
    // x_k = free_k + Γ_k u with u = before + sums v.
    Matrix H = Matrix::Zero(N * m, N * m), Gamma = Matrix::Zero(n, N * m);
    VectorXd g = VectorXd::Zero(N * m), free = question.x;
    const auto c = static_cast<Eigen::Index>(bounded.size());
    Matrix rows(N * (m + c), N * m);
    VectorXd lower(rows.rows()), upper(rows.rows());
    for (int k = 0; k < N; ++k) {
        Gamma = (of.A * Gamma).eval();
        Gamma.middleCols(k * m, m) += of.B;
        free = (of.A * free + question.disturbance).eval();
        const Matrix cost = k + 1 == N ? of.P : Q, in = Gamma * sums;
        const VectorXd at = free + Gamma * before;
        H += in.transpose() * cost * in;
        g += in.transpose() * cost * (at - question.reference.col(k));
        const Matrix input = sums.middleRows(k * m, m);
        H += input.transpose() * of.R * input;
        g += input.transpose() * of.R * (mpc.u_last - question.u_reference);
        rows.middleRows(k * (m + c), m) = input;
        lower.segment(k * (m + c), m) = mpc.u_min - mpc.u_last;
        upper.segment(k * (m + c), m) = mpc.u_max - mpc.u_last;
        for (Eigen::Index i = 0; i < c; ++i) {
            const int state = bounded[static_cast<std::size_t>(i)];
            rows.row(k * (m + c) + m + i) = in.row(state);
            lower[k * (m + c) + m + i] = mpc.x_min[i] - at[state];
            upper[k * (m + c) + m + i] = mpc.x_max[i] - at[state];
        }
    }
    const VectorXd low = mpc.du_min.replicate(N, 1), high = mpc.du_max.replicate(N, 1);
    VectorXd v = VectorXd::Zero(N * m);
    const auto solver = qp::make_proxqp(N * m, static_cast<int>(rows.rows()), {10000, 1e-9});
    const qp::Result result = solver->solve({H, g, rows, lower, upper, low, high}, v);
    const VectorXd u = before + sums * v;
    inputs = Eigen::Map<const Matrix>(u.data(), m, N);
    return result;
}

} // namespace

TEST(Mpc, LimitsRatesAsTheProgramWhoseVariablesTheyAre) {
    std::mt19937 random(6);
    constexpr int N = 8;
    const std::vector<int> bounded{2, 0};
    int at_limit = 0, from_last = 0;
    for (int k = 0; k < 20; ++k) {
        Question question = random_question(N, random);
        question.x *= 0.3;
        const VectorXd last = 0.5 * random_question(N, random).u_reference;
        Matrix expected;
        for (const auto form : {Mpc::Form::condensed, Mpc::Form::sparse}) {
            Mpc mpc = made(form, N, bounded, false, Mpc::Method::daqp, true);
            mpc.u_min.setConstant(-3.0);
            mpc.u_max << 3.0, 2.0;
            mpc.du_min << -0.6, -1.0;
            mpc.du_max << 0.4, 0.7;
            mpc.u_last = last;
            mpc.x_min << -1.5, -2.0;
            mpc.x_max << 1.4, 2.0;
            const auto status = in_rates(mpc, question, N, bounded, expected).status;
            ASSERT_EQ(solve(mpc, question), status) << k;
            if (status != qp::Status::solved) continue;
            EXPECT_LT((mpc.inputs() - expected).cwiseAbs().maxCoeff(), 1e-5) << k;
            Matrix before(m, N);
            before << last, mpc.inputs().leftCols(N - 1);
            const Matrix rates = mpc.inputs() - before;
            at_limit += rates.row(0).maxCoeff() > 0.4 - 1e-6;
            from_last += std::abs(rates(0, 0) - 0.4) < 1e-6 || std::abs(rates(0, 0) + 0.6) < 1e-6;
        }
    }
    EXPECT_GT(at_limit, 10);
    EXPECT_GT(from_last, 4);
}

TEST(Mpc, FindsNoPlanWhereLimitedRatesDoNotLeadIntoTheBounds) {
    const Question question{VectorXd::Zero(n), VectorXd::Zero(m), VectorXd::Zero(n), Matrix::Zero(n, 1)};
    for (const auto form : {Mpc::Form::condensed, Mpc::Form::sparse}) {
        Mpc mpc = made(form, 3, {}, false, Mpc::Method::daqp, true);
        mpc.u_max.setConstant(1.0);
        mpc.du_min.setConstant(-0.5);
        mpc.u_last << 1.4, 0.0;
        ASSERT_EQ(solve(mpc, question), qp::Status::solved);
        EXPECT_NEAR(mpc.inputs()(0, 0), 0.9, 1e-6);
        mpc.u_last << 1.6, 0.0;
        EXPECT_EQ(solve(mpc, question), qp::Status::infeasible);
    }
}

TEST(Mpc, WithoutBoundsIsTheSolutionOfItsOptimalityConditions) {
    std::mt19937 random(1);
    for (const auto form : {Mpc::Form::condensed, Mpc::Form::sparse}) {
        Mpc mpc = made(form, 7);
        for (int k = 0; k < 5; ++k) {
            const Question question = random_question(7, random);
            ASSERT_EQ(solve(mpc, question), qp::Status::solved);
            const Matrix expected = without_bounds(question, 7);
            EXPECT_LT((mpc.inputs() - expected).norm(), 1e-7 * expected.norm());
        }
    }
}

TEST(Mpc, WithTheRegulatorsCostToGoIsTheRegulator) {
    const Masses of;
    Regulator regulator(n, m, Regulator::Time::discrete);
    ASSERT_EQ(regulator.solve(of.A, of.B, of.Q, of.R), Regulator::Status::solved);
    std::mt19937 random(2);
    for (const auto form : {Mpc::Form::condensed, Mpc::Form::sparse}) {
        Mpc mpc = made(form, 3);
        mpc.set_model(of.A, of.B, of.Q, of.R, regulator.X());
        const Question some = random_question(1, random);
        const VectorXd zero = VectorXd::Zero(n);
        ASSERT_EQ(mpc.solve(some.x, zero, VectorXd::Zero(m), zero).status, qp::Status::solved);
        EXPECT_LT((mpc.inputs().col(0) + regulator.K() * some.x).norm(), 1e-8);
    }
}

TEST(Mpc, HasOneSolutionInBothFormsWhereBoundsAreActive) {
    std::mt19937 random(3);
    for (const bool is_soft : {false, true}) {
        Mpc condensed = made(Mpc::Form::condensed, 8, {2, 0}, is_soft),
            sparse = made(Mpc::Form::sparse, 8, {2, 0}, is_soft);
        int active = 0;
        for (int k = 0; k < 20; ++k) {
            Question question = random_question(8, random);
            question.x *= 0.3;
            for (Mpc* mpc : {&condensed, &sparse}) {
                mpc->u_min.setConstant(-3.0);
                mpc->u_max << 3.0, 2.0;
                mpc->x_min << -0.8, -1.2;
                mpc->x_max << 0.7, 0.9;
                mpc->slack_weight << 2.0, 1.0;
                mpc->slack_linear << 0.1, 0.5;
            }
            const auto status = solve(condensed, question);
            ASSERT_EQ(status, solve(sparse, question)) << k;
            if (status != qp::Status::solved) {
                EXPECT_FALSE(is_soft);
                EXPECT_EQ(status, qp::Status::infeasible);
                continue;
            }
            EXPECT_LT((condensed.inputs() - sparse.inputs()).norm(), 1e-5) << k;
            EXPECT_LT((condensed.states() - sparse.states()).norm(), 1e-5) << k;
            const double highest = condensed.states().row(2).maxCoeff();
            if (!is_soft) {
                EXPECT_LT(highest, 0.7 + 1e-5);
            }
            active += highest > 0.7 - 1e-5;
            EXPECT_LE(condensed.inputs().row(1).maxCoeff(), 2.0 + 1e-6);
        }
        EXPECT_GT(active, 2);
    }
}

TEST(Mpc, AgreesWithAMethodOfFirstOrder) {
    std::mt19937 random(4);
    for (const auto form : {Mpc::Form::condensed, Mpc::Form::sparse}) {
        Mpc exact = made(form, 6, {2}, true), approximate = made(form, 6, {2}, true, Mpc::Method::osqp);
        const Question question = random_question(6, random);
        for (Mpc* mpc : {&exact, &approximate}) {
            mpc->u_max.setConstant(1.0);
            mpc->x_max.setConstant(0.2);
            ASSERT_EQ(solve(*mpc, question), qp::Status::solved);
        }
        EXPECT_LT((exact.inputs() - approximate.inputs()).norm(), 1e-3 * exact.inputs().norm());
    }
}

TEST(Mpc, KeepsSoftBoundsWhereItCanAndExceedsThemWhereItMust) {
    Question question{VectorXd::Zero(n), VectorXd::Zero(m), VectorXd::Zero(n), Matrix::Zero(n, 1)};
    question.reference(0, 0) = 1.0;
    for (const auto form : {Mpc::Form::condensed, Mpc::Form::sparse}) {
        Mpc hard = made(form, 10, {2}), soft = made(form, 10, {2}, true);
        for (Mpc* mpc : {&hard, &soft}) {
            mpc->x_max << 0.3;
            mpc->u_min.setConstant(-1.0);
            mpc->slack_linear.setConstant(1e4);
        }
        ASSERT_EQ(solve(hard, question), qp::Status::solved);
        ASSERT_EQ(solve(soft, question), qp::Status::solved);
        EXPECT_NEAR(hard.states().row(2).maxCoeff(), 0.3, 1e-6);
        EXPECT_LT((hard.inputs() - soft.inputs()).norm(), 1e-5) << "the penalty is exact";

        Question fast = question;
        fast.x[2] = 1.0; // it cannot be as slow as 0.3 after one step
        const Matrix before = hard.inputs();
        EXPECT_EQ(solve(hard, fast), qp::Status::infeasible);
        EXPECT_EQ(hard.inputs(), before);
        ASSERT_EQ(solve(soft, fast), qp::Status::solved);
        EXPECT_NEAR(soft.inputs()(0, 0), -1.0, 1e-6) << "brakes as hard as it can";
        EXPECT_LT(soft.states()(2, 9), 0.3 + 1e-6);
    }
}

TEST(Mpc, MovesBeforeAReferenceThatItSeesComing) {
    Question question{VectorXd::Zero(n), VectorXd::Zero(m), VectorXd::Zero(n), Matrix::Zero(n, 10)};
    question.reference.row(0).tail(4).setOnes();
    Mpc mpc = made(Mpc::Form::condensed, 10);
    ASSERT_EQ(solve(mpc, question), qp::Status::solved);
    EXPECT_GT(mpc.inputs()(0, 0), 0.01);
    question.reference.setZero();
    ASSERT_EQ(solve(mpc, question), qp::Status::solved);
    EXPECT_EQ(mpc.inputs().norm(), 0.0);
}

TEST(Mpc, GoesOnFromASavedStateBitForBit) {
    std::mt19937 random(5);
    Mpc mpc = made(Mpc::Form::condensed, 8, {0}, true), other = made(Mpc::Form::condensed, 8, {0}, true);
    for (Mpc* one : {&mpc, &other}) {
        one->u_min.setConstant(-1.0);
        one->u_max.setConstant(1.0);
        one->x_max.setConstant(0.1);
    }
    for (int k = 0; k < 3; ++k) solve(mpc, random_question(8, random));
    VectorXd saved(mpc.state_size());
    mpc.save(saved.data());
    other.restore(saved.data());
    for (int k = 0; k < 3; ++k) {
        const Question question = random_question(8, random);
        EXPECT_EQ(solve(mpc, question), solve(other, question));
        EXPECT_EQ(mpc.inputs(), other.inputs());
    }
}

TEST(Mpc, RefusesWhatIsNoProblem) {
    Mpc::Options options;
    EXPECT_THROW(Mpc(0, 1, options), std::invalid_argument);
    options.bounded = {0, 4};
    EXPECT_THROW(Mpc(4, 1, options), std::invalid_argument);
    options.bounded = {1, 1};
    EXPECT_THROW(Mpc(4, 1, options), std::invalid_argument);
    options.bounded = {1};
    for (const int horizon : {0, 1001, std::numeric_limits<int>::max()}) {
        options.horizon = horizon;
        EXPECT_THROW(Mpc(4, 2, options), std::invalid_argument) << horizon;
    }
    options.horizon = 250;
    options.is_soft = true;
    options.form = Mpc::Form::sparse;
    EXPECT_NO_THROW(options.validate(5, 2)) << "2000 variables";
    EXPECT_THROW(options.validate(6, 2), std::invalid_argument);
    options.form = Mpc::Form::condensed;
    options.is_soft = false;
    Mpc mpc = made(Mpc::Form::condensed, 3);
    Question question{VectorXd::Constant(n, NAN), VectorXd::Zero(m), VectorXd::Zero(n), Matrix::Zero(n, 1)};
    EXPECT_EQ(solve(mpc, question), qp::Status::internal_error);
}

} // namespace bf::control::test

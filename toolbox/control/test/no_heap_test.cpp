#include "bf/control/mpc.hpp"
#include "heap.hpp"

#include <cstdlib>
#include <gtest/gtest.h>

namespace bf::control {
namespace {

using bf::test::heap_calls;

TEST(Control, AllocatesNothingWhileItSolvesOrTakesAnotherModel) {
    constexpr int n = 12, m = 4;
    std::srand(1);
    const Eigen::MatrixXd A = 0.2 * Eigen::MatrixXd::Random(n, n), B = Eigen::MatrixXd::Random(n, m),
                          Q = Eigen::MatrixXd::Identity(n, n), R = Eigen::MatrixXd::Identity(m, m),
                          reference = Eigen::MatrixXd::Random(n, 20), x = Eigen::VectorXd::Random(n),
                          u = Eigen::VectorXd::Zero(m), d = Eigen::VectorXd::Zero(n), second = 1.01 * A;
    for (const auto time : {Regulator::Time::discrete, Regulator::Time::continuous})
        for (const auto form : {Mpc::Form::condensed, Mpc::Form::sparse}) {
            Mpc::Options options;
            options.form = form;
            options.bounded = {0, 3};
            options.is_soft = true;
            Mpc mpc(n, m, options);
            mpc.u_max.setConstant(0.1);
            mpc.x_max.setConstant(0.3);
            Regulator regulator(n, m, time);
            const long before = heap_calls();
            for (const auto* now : {&A, &second}) {
                EXPECT_EQ(regulator.solve(*now, B, Q, R), Regulator::Status::solved);
                mpc.set_model(*now, B, Q, R, regulator.X());
                EXPECT_EQ(mpc.solve(x, reference, u, d).status, qp::Status::solved);
            }
            EXPECT_EQ(heap_calls() - before, 0);
        }
}

} // namespace
} // namespace bf::control

#include "bf/control/mpc.hpp"

#include <cstdlib>
#include <gtest/gtest.h>

// Counts every allocation of the program, C's included; the sanitizers bring an allocator of their own.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)

namespace {
int allocations = 0;
}

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* malloc(std::size_t size) { return ++allocations, __libc_malloc(size); }
void* calloc(std::size_t count, std::size_t size) { return ++allocations, __libc_calloc(count, size); }
void* realloc(void* old, std::size_t size) { return ++allocations, __libc_realloc(old, size); }
}

namespace bf::control {
namespace {

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
            allocations = 0;
            for (const auto* now : {&A, &second}) {
                EXPECT_EQ(regulator.solve(*now, B, Q, R), Regulator::Status::solved);
                mpc.set_model(*now, B, Q, R, regulator.X());
                EXPECT_EQ(mpc.solve(x, reference, u, d).status, qp::Status::solved);
            }
            EXPECT_EQ(allocations, 0);
        }
}

} // namespace
} // namespace bf::control

#endif

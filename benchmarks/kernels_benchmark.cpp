// Kernels of the standard blocks beside Eigen, on the sizes of a humanoid's controller.
#include "bf/kernels/svd.hpp"

#include <Eigen/Dense>
#include <benchmark/benchmark.h>

namespace {

using namespace bf::kernels;
using Matrix = Eigen::MatrixXd;

View<double> view(Matrix& m) { return {m.data(), static_cast<int>(m.rows()), static_cast<int>(m.cols())}; }

void count(benchmark::State& state, double operations) {
    state.counters["flops"] =
        benchmark::Counter(operations * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

template <int M, int N, int P> void kernel_product(benchmark::State& state) {
    Matrix a = Matrix::Random(M, N), b = Matrix::Random(N, P), y(M, P);
    benchmark::DoNotOptimize(a.data());
    for (auto _ : state) {
        MatrixProduct{}(view(y), view(a), view(b));
        benchmark::ClobberMemory();
    }
    count(state, 2.0 * M * N * P);
}

template <int M, int N, int P> void kernel_product_fixed(benchmark::State& state) {
    Matrix a = Matrix::Random(M, N), b = Matrix::Random(N, P), y(M, P);
    benchmark::DoNotOptimize(a.data());
    for (auto _ : state) {
        MatrixProduct{}(FixedView<double, M, P>{y.data()}, FixedView<const double, M, N>{a.data()},
                        FixedView<const double, N, P>{b.data()});
        benchmark::ClobberMemory();
    }
    count(state, 2.0 * M * N * P);
}

template <int M, int N, int P> void eigen_product(benchmark::State& state) {
    Matrix a = Matrix::Random(M, N), b = Matrix::Random(N, P), y(M, P);
    for (auto _ : state) {
        y.noalias() = a * b;
        benchmark::ClobberMemory();
    }
    count(state, 2.0 * M * N * P);
}

BENCHMARK(kernel_product<29, 29, 29>);
BENCHMARK(kernel_product_fixed<29, 29, 29>);
BENCHMARK(eigen_product<29, 29, 29>);
BENCHMARK(kernel_product<23, 12, 23>);
BENCHMARK(kernel_product_fixed<23, 12, 23>);
BENCHMARK(eigen_product<23, 12, 23>);

Matrix positive(int n) {
    const Matrix r = Matrix::Random(n, n);
    return r * r.transpose() + Matrix::Identity(n, n);
}

void kernel_cholesky(benchmark::State& state) {
    Matrix a = positive(29), b = Matrix::Random(29, 12), x(29, 12), work(29, 49);
    for (auto _ : state) benchmark::DoNotOptimize(CholeskySolve{}(view(x), view(a), view(b), view(work)));
}

void eigen_cholesky(benchmark::State& state) {
    Matrix a = positive(29), b = Matrix::Random(29, 12), x(29, 12);
    Eigen::LLT<Matrix> llt(29);
    for (auto _ : state) {
        llt.compute(a);
        x = llt.solve(b);
        benchmark::ClobberMemory();
    }
}

void kernel_truncated_pinv(benchmark::State& state) {
    Matrix a = Matrix::Random(12, 29), y(29, 12), tolerance = Matrix::Constant(1, 1, 1e-5), work(492, 1);
    for (auto _ : state)
        benchmark::DoNotOptimize(TruncatedPinv{}(view(y), view(tolerance), view(a), view(work)));
}

void eigen_svd(benchmark::State& state) {
    Matrix a = Matrix::Random(12, 29);
    Eigen::JacobiSVD<Matrix> svd(12, 29, Eigen::ComputeThinU | Eigen::ComputeThinV);
    for (auto _ : state) benchmark::DoNotOptimize(svd.compute(a));
}

BENCHMARK(kernel_cholesky);
BENCHMARK(eigen_cholesky);
BENCHMARK(kernel_truncated_pinv);
BENCHMARK(eigen_svd);

} // namespace

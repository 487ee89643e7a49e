#include "bf/engine/solver.hpp"

#include <algorithm>
#include <array>

namespace bf {

namespace {

/// Butcher tableau: k_i = f(t + c_i h, x + h Σ_j a_ij k_j), x⁺ = x + h Σ_i b_i k_i.
struct Tableau {
    int order, stages;
    std::array<std::array<double, 6>, 6> a;
    std::array<double, 6> b, c;
};

const Tableau& tableau(SolverMethod method) {
    static const Tableau euler{1, 1, {}, {1}, {0}};
    static const Tableau heun{2, 2, {{{}, {1}}}, {0.5, 0.5}, {0, 1}};
    static const Tableau bogacki_shampine{
        3, 3, {{{}, {0.5}, {0, 0.75}}}, {2. / 9, 1. / 3, 4. / 9}, {0, 0.5, 0.75}};
    static const Tableau rk4{
        4, 4, {{{}, {0.5}, {0, 0.5}, {0, 0, 1}}}, {1. / 6, 1. / 3, 1. / 3, 1. / 6}, {0, 0.5, 0.5, 1}};
    static const Tableau dormand_prince{
        5,
        6,
        {{{},
          {1. / 5},
          {3. / 40, 9. / 40},
          {44. / 45, -56. / 15, 32. / 9},
          {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
          {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656}}},
        {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84},
        {0, 1. / 5, 3. / 10, 4. / 5, 8. / 9, 1}};
    switch (method) {
    case SolverMethod::euler: return euler;
    case SolverMethod::heun: return heun;
    case SolverMethod::bogacki_shampine: return bogacki_shampine;
    case SolverMethod::rk4: return rk4;
    case SolverMethod::dormand_prince: break;
    }
    return dormand_prince;
}

} // namespace

int order(SolverMethod method) { return tableau(method).order; }

FixedStepSolver::FixedStepSolver(SolverMethod method, std::size_t size)
    : method_(method), start_(size),
      slopes_(static_cast<std::size_t>(tableau(method).stages), std::vector<double>(size)) {}

bool FixedStepSolver::step(double t, double h, std::span<double> x, std::span<const double> rate,
                           const std::function<bool(double t)>& derivative) {
    const Tableau& m = tableau(method_);
    std::copy(x.begin(), x.end(), start_.begin());
    const auto stages = static_cast<std::size_t>(m.stages);
    for (std::size_t i = 0; i < stages; ++i) {
        for (std::size_t e = 0; e < x.size(); ++e) {
            double sum = 0;
            for (std::size_t j = 0; j < i; ++j) sum += m.a[i][j] * slopes_[j][e];
            x[e] = start_[e] + h * sum;
        }
        if (!derivative(t + m.c[i] * h)) {
            std::copy(start_.begin(), start_.end(), x.begin());
            return false;
        }
        std::copy(rate.begin(), rate.end(), slopes_[i].begin());
    }
    for (std::size_t e = 0; e < x.size(); ++e) {
        double sum = 0;
        for (std::size_t i = 0; i < stages; ++i) sum += m.b[i] * slopes_[i][e];
        x[e] = start_[e] + h * sum;
    }
    return true;
}

} // namespace bf

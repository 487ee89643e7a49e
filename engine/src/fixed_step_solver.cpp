#include "solvers.hpp"

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
    default: break;
    }
    return dormand_prince;
}

} // namespace

int order(SolverMethod method) { return tableau(method).order; }

namespace {

class FixedStepSolver final : public Solver {
  public:
    FixedStepSolver(SolverMethod method, double step, ContinuousSystem system)
        : Solver(std::move(system)), method_(tableau(method)), step_(step), start_(system_.x.size()),
          slopes_(static_cast<std::size_t>(method_.stages), std::vector<double>(system_.x.size())) {}

    void restart(double) override {}
    void set_history(double, std::span<const double>) override {}

    Outcome advance(double& t, double end) override {
        const double h = step_; // end - t would be rounded
        const auto x = system_.x;
        std::copy(x.begin(), x.end(), start_.begin());
        const auto stages = static_cast<std::size_t>(method_.stages);
        for (std::size_t i = 0; i < stages; ++i) {
            for (std::size_t e = 0; e < x.size(); ++e) {
                double sum = 0;
                for (std::size_t j = 0; j < i; ++j) sum += method_.a[i][j] * slopes_[j][e];
                x[e] = start_[e] + h * sum;
            }
            if (!system_.derivatives(t + method_.c[i] * h)) {
                std::copy(start_.begin(), start_.end(), x.begin());
                return Outcome::failed;
            }
            std::copy(system_.rate.begin(), system_.rate.end(), slopes_[i].begin());
        }
        for (std::size_t e = 0; e < x.size(); ++e) {
            double sum = 0;
            for (std::size_t i = 0; i < stages; ++i) sum += method_.b[i] * slopes_[i][e];
            x[e] = start_[e] + h * sum;
        }
        t = end;
        return Outcome::reached;
    }

  private:
    const Tableau& method_;
    const double step_;
    std::vector<double> start_;
    std::vector<std::vector<double>> slopes_;
};

} // namespace

std::unique_ptr<Solver> make_fixed_step_solver(SolverMethod method, double step, ContinuousSystem system) {
    return std::make_unique<FixedStepSolver>(method, step, std::move(system));
}

std::unique_ptr<Solver> make_solver(const SolverSettings& settings, double step, ContinuousSystem system) {
    switch (settings.method) {
    case SolverMethod::dormand_prince45: return make_dormand_prince(settings, std::move(system));
    case SolverMethod::cvode_bdf:
    case SolverMethod::cvode_adams: return make_cvode(settings, std::move(system));
    default: return make_fixed_step_solver(settings.method, step, std::move(system));
    }
}

} // namespace bf

#include "solvers.hpp"

#include "bf/kernels/runge_kutta.hpp"

#include <vector>

namespace bf {

namespace {

const kernels::ButcherTableau& tableau(SolverMethod method) {
    switch (method) {
    case SolverMethod::euler: return kernels::euler;
    case SolverMethod::heun: return kernels::heun;
    case SolverMethod::bogacki_shampine: return kernels::bogacki_shampine;
    case SolverMethod::rk4: return kernels::rk4;
    default: break;
    }
    return kernels::dormand_prince;
}

} // namespace

int order(SolverMethod method) { return tableau(method).order; }

namespace {

class FixedStepSolver final : public Solver {
  public:
    FixedStepSolver(SolverMethod method, double step, ContinuousSystem system)
        : Solver(std::move(system)), method_(tableau(method)), step_(step), start_(system_.x.size()),
          slopes_(static_cast<std::size_t>(method_.stages) * system_.x.size()) {}

    void restart(double) override {}
    void set_history(double, std::span<const double>) override {}

    Outcome advance(double& t, double end) override {
        // end - t would be rounded, so the step is given.
        if (!kernels::runge_kutta_step(method_, t, step_, static_cast<int>(system_.x.size()),
                                       system_.x.data(), system_.rate.data(), start_.data(), slopes_.data(),
                                       system_.derivatives))
            return Outcome::failed;
        t = end;
        return Outcome::reached;
    }

  private:
    const kernels::ButcherTableau& method_;
    const double step_;
    std::vector<double> start_, slopes_;
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

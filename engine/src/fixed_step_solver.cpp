#include "solvers.hpp"

#include "bf/engine/fixed_step.hpp"

#include <vector>

namespace bf {

namespace {

template <const kernels::ButcherTableau& method> class FixedStepSolver final : public Solver {
  public:
    FixedStepSolver(double step, ContinuousSystem system)
        : Solver(std::move(system)), step_(step), start_(system_.x.size()),
          slopes_(static_cast<std::size_t>(method.stages) * system_.x.size()) {}

    void restart(double) override {}
    void set_history(double, std::span<const double>) override {}

    Outcome advance(double& t, double end) override {
        const auto derivative = [this](int, double at) { return system_.derivatives(at); };
        // end - t would be rounded, so the step is given.
        if (!kernels::runge_kutta_step<method>(t, step_, static_cast<int>(system_.x.size()), system_.x.data(),
                                               system_.rate.data(), start_.data(), slopes_.data(),
                                               derivative))
            return Outcome::failed;
        t = end;
        return Outcome::reached;
    }

  private:
    const double step_;
    std::vector<double> start_, slopes_;
};

} // namespace

int order(SolverMethod method) {
    return with_tableau(method, []<const kernels::ButcherTableau & tableau> { return tableau.order; });
}

std::unique_ptr<Solver> make_fixed_step_solver(SolverMethod method, double step, ContinuousSystem system) {
    return with_tableau(method, [&]<const kernels::ButcherTableau & tableau>() -> std::unique_ptr<Solver> {
        return std::make_unique<FixedStepSolver<tableau>>(step, std::move(system));
    });
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

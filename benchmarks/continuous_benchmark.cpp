// A stiff linear plant of a thousand states on CVODE: as a diagram, and bare.
#include "bf/blocks/standard.hpp"
#include "bf/elaborate/elaborate.hpp"
#include "bf/engine/simulation.hpp"
#include "bf/kernels/matrix.hpp"
#include "bf/model/builder.hpp"

#include <benchmark/benchmark.h>
#include <cmath>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <stdexcept>
#include <sunlinsol/sunlinsol_spgmr.h>
#include <vector>

namespace {

// Heat in a rod of unit length between cold ends: x' = (x_{i-1} - 2 x_i + x_{i+1}) (n+1)^2 / 10^4, begun as a
// half sine.
constexpr int n = 1000;
constexpr double rate = 1e-4 * (n + 1) * (n + 1), seconds = 10, step = 1;
/// The half sine is an eigenvector: it decays with this factor per second.
const double eigenvalue = 2 * rate * (std::cos(std::acos(-1.0) / (n + 1)) - 1);

void check(double found) {
    const double exact = std::exp(eigenvalue * seconds) * std::sin(std::acos(-1.0) * (n / 2) / (n + 1));
    if (!(std::abs(found - exact) < 1e-3)) throw std::runtime_error("the rod has a wrong temperature");
}

void diagram(benchmark::State& state) {
    bf::model::Builder b{"rod"};
    b.step(step);
    b.solver("cvode_bdf");
    b.variable("n", n);
    const auto zero = b.add("zero", "Constant", {{"value", 0}});
    const auto rod =
        b.add("rod", "StateSpace",
              {{"A", std::to_string(rate) + " * (diag(ones(n-1, 1), 1) - 2*eye(n) + diag(ones(n-1, 1), -1))"},
               {"B", "zeros(n, 1)"},
               {"C", "double((1:n) == n/2)"},
               {"initial", "sin(pi*(1:n)/(n+1))"}});
    b.connect(zero, rod);
    bf::Registry registry;
    registry.add(bf::standard_library());
    const auto model = b.build();
    const auto elaborated = bf::elaborate(model, registry);
    const auto y = elaborated.find_signal("rod");
    bf::Simulation simulation(elaborated);
    for (auto _ : state) {
        simulation.start();
        for (int k = 0; k <= static_cast<int>(seconds / step); ++k)
            if (!simulation.step()) throw std::runtime_error(simulation.failure());
        check(*static_cast<const double*>(simulation.context().data(y.node, y.slot)));
    }
}

struct Rod {
    std::vector<double> A = std::vector<double>(static_cast<std::size_t>(n) * n);
    Rod() {
        for (int i = 0; i < n; ++i) {
            A[static_cast<std::size_t>(i) * (n + 1)] = -2 * rate;
            if (i + 1 < n) {
                A[static_cast<std::size_t>(i) * n + static_cast<std::size_t>(i) + 1] = rate;
                A[static_cast<std::size_t>(i + 1) * n + static_cast<std::size_t>(i)] = rate;
            }
        }
    }
    static int derivative(double, N_Vector x, N_Vector dx, void* self) {
        bf::kernels::detail::product(N_VGetArrayPointer(dx), static_cast<Rod*>(self)->A.data(),
                                     N_VGetArrayPointer(x), n, n, 1);
        return 0;
    }
};

void bare(benchmark::State& state) {
    Rod rod;
    for (auto _ : state) {
        SUNContext context = nullptr;
        SUNContext_Create(nullptr, &context);
        N_Vector x = N_VNew_Serial(n, context);
        for (int i = 0; i < n; ++i) N_VGetArrayPointer(x)[i] = std::sin(std::acos(-1.0) * (i + 1) / (n + 1));
        void* cvode = CVodeCreate(CV_BDF, context);
        CVodeInit(cvode, Rod::derivative, 0, x);
        CVodeSetUserData(cvode, &rod);
        CVodeSStolerances(cvode, 1e-6, 1e-9);
        CVodeSetMaxNumSteps(cvode, 1000000);
        SUNLinearSolver linear = SUNLinSol_SPGMR(x, SUN_PREC_NONE, 0, context);
        CVodeSetLinearSolver(cvode, linear, nullptr);
        double t = 0;
        for (int k = 1; k <= static_cast<int>(seconds / step) + 1; ++k) {
            if (k == static_cast<int>(seconds / step) + 1) check(N_VGetArrayPointer(x)[n / 2 - 1]);
            CVode(cvode, k * step, x, &t, CV_NORMAL);
        }
        CVodeFree(&cvode);
        SUNLinSolFree(linear);
        N_VDestroy(x);
        SUNContext_Free(&context);
    }
}

const int registered = [] {
    benchmark::RegisterBenchmark("engine.cvode_1000_states/diagram", diagram)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("engine.cvode_1000_states/bare", bare)->Unit(benchmark::kMillisecond);
    return 0;
}();

} // namespace

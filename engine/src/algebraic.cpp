#include "algebraic.hpp"

#include "sundials.hpp"

#include <algorithm>
#include <cmath>
#include <kinsol/kinsol.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

namespace bf {

namespace {
struct FreeKinsol {
    void operator()(void* memory) const { KINFree(&memory); }
};
constexpr double tolerance = 1e-11; ///< of y - f(y), relative where y is larger than 1
} // namespace

struct AlgebraicSolver::Kinsol {
    std::vector<std::span<double>> unknowns;
    std::function<bool()> evaluate;
    Owned<SUNContext, free_context> context = make_context();
    Owned<N_Vector, N_VDestroy> y, ones, scale; // scale: of 1/y
    Owned<SUNMatrix, SUNMatDestroy> matrix;
    Owned<SUNLinearSolver, SUNLinSolFree> linear;
    std::unique_ptr<void, FreeKinsol> memory;
    bool has_failed = false;

    Kinsol(std::vector<std::span<double>> u, std::function<bool()> f)
        : unknowns(std::move(u)), evaluate(std::move(f)) {
        sunindextype n = 0;
        for (const auto& part : unknowns) n += static_cast<sunindextype>(part.size());
        y.reset(N_VNew_Serial(n, context.get()));
        ones.reset(N_VNew_Serial(n, context.get()));
        N_VConst(1, ones.get());
        scale.reset(N_VNew_Serial(n, context.get()));
        matrix.reset(SUNDenseMatrix(n, n, context.get()));
        linear.reset(SUNLinSol_Dense(y.get(), matrix.get(), context.get()));
        memory.reset(KINCreate(context.get()));
        KINSetErrHandlerFn(
            memory.get(), [](int, const char*, const char*, char*, void*) {}, nullptr);
        KINSetInfoHandlerFn(
            memory.get(), [](const char*, const char*, char*, void*) {}, nullptr);
        KINInit(memory.get(), residual, y.get());
        KINSetUserData(memory.get(), this);
        KINSetLinearSolver(memory.get(), linear.get(), matrix.get());
        KINSetFuncNormTol(memory.get(), tolerance);
        KINSetScaledStepTol(memory.get(), 1e-14);
        KINSetMaxSetupCalls(memory.get(), 1); // a new Jacobian in every iteration
        // Without this KINSOL goes on by at most 1, and that five times, where it begins at 0.
        KINSetMaxNewtonStep(memory.get(), 1e100);
    }

    void read(double* to) const {
        for (const auto& part : unknowns) to = std::copy(part.begin(), part.end(), to);
    }
    void write(const double* from) const {
        for (const auto& part : unknowns) {
            std::copy_n(from, part.size(), part.begin());
            from += part.size();
        }
    }
    /// Of an unknown: one below 1 counts as it is.
    static double scale_of(double size) { return size > 1 && std::isfinite(size) ? 1 / size : 1; }
    /// The sizes that y and f(y) have; false: a block failed.
    bool measure() {
        const double* guess = N_VGetArrayPointer(y.get());
        write(guess);
        if (!evaluate()) return false;
        double* const to = N_VGetArrayPointer(scale.get());
        read(to);
        for (sunindextype i = 0; i < N_VGetLength(y.get()); ++i)
            to[i] = scale_of(std::max(std::abs(guess[i]), std::abs(to[i])));
        return true;
    }
    /// f(y) - y.
    static int residual(N_Vector y, N_Vector f, void* self) {
        auto& k = *static_cast<Kinsol*>(self);
        const double* guess = N_VGetArrayPointer(y);
        k.write(guess);
        if (!k.evaluate()) {
            k.has_failed = true;
            return -1;
        }
        double* result = N_VGetArrayPointer(f);
        k.read(result);
        for (sunindextype i = 0; i < N_VGetLength(y); ++i) {
            result[i] -= guess[i];
            if (!std::isfinite(result[i])) return 1; // KINSOL tries a smaller step
        }
        return 0;
    }
};

AlgebraicSolver::AlgebraicSolver(std::vector<std::span<double>> unknowns, std::function<bool()> evaluate)
    : kinsol_(std::make_unique<Kinsol>(std::move(unknowns), std::move(evaluate))) {}

AlgebraicSolver::~AlgebraicSolver() = default;

bool AlgebraicSolver::solve() {
    Kinsol& k = *kinsol_;
    k.has_failed = false;
    double* y = N_VGetArrayPointer(k.y.get());
    k.read(y);
    const sunindextype n = N_VGetLength(k.y.get());
    int flag = 0;
    // How exact a solution can be, and how large a difference must be to be seen, is known once its size is:
    // another time begins where the last one ended.
    for (int time = 0; time < 3; ++time) {
        for (sunindextype i = 0; i < n; ++i) {
            if (!std::isfinite(y[i])) y[i] = 0;
            N_VGetArrayPointer(k.scale.get())[i] = Kinsol::scale_of(std::abs(y[i]));
        }
        if (time > 0 && !k.measure()) return false;
        KINSetFuncNormTol(k.memory.get(), tolerance / N_VMin(k.scale.get()));
        flag = KINSol(k.memory.get(), k.y.get(), KIN_LINESEARCH, k.scale.get(), k.ones.get());
        if (k.has_failed) return false;
        double norm = 0;
        KINGetFuncNorm(k.memory.get(), &norm);
        if (flag < 0 || !(norm <= 1e-6 * std::max(1.0, N_VMaxNorm(k.y.get())))) continue;
        k.write(y);
        return k.evaluate();
    }
    failure_ =
        Status::failure("the algebraic loop through it has no solution that Newton's method finds (flag {}): "
                        "break the loop with a UnitDelay, or check its equations",
                        flag);
    return false;
}

} // namespace bf

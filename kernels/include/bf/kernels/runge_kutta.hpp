// Explicit Runge-Kutta methods with a fixed step.
#pragma once

namespace bf::kernels {

/// Butcher tableau: k_i = f(t + c_i h, x + h Σ_j a_ij k_j), x⁺ = x + h Σ_i b_i k_i. Sources: Hairer, Nørsett,
/// Wanner, Solving Ordinary Differential Equations I, 2nd ed., §II.1 (Euler, Heun, the classical method) and
/// §II.5 (Dormand-Prince); Bogacki, Shampine, A 3(2) pair of Runge-Kutta formulas, 1989.
struct ButcherTableau {
    int order, stages;
    double a[6][6], b[6], c[6];
};

inline constexpr ButcherTableau euler{1, 1, {}, {1}, {}};
inline constexpr ButcherTableau heun{2, 2, {{}, {1}}, {0.5, 0.5}, {0, 1}};
inline constexpr ButcherTableau bogacki_shampine{
    3, 3, {{}, {0.5}, {0, 0.75}}, {2. / 9, 1. / 3, 4. / 9}, {0, 0.5, 0.75}};
inline constexpr ButcherTableau rk4{
    4, 4, {{}, {0.5}, {0, 0.5}, {0, 0, 1}}, {1. / 6, 1. / 3, 1. / 3, 1. / 6}, {0, 0.5, 0.5, 1}};
inline constexpr ButcherTableau dormand_prince{
    5,
    6,
    {{},
     {1. / 5},
     {3. / 40, 9. / 40},
     {44. / 45, -56. / 15, 32. / 9},
     {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
     {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656}},
    {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84},
    {0, 1. / 5, 3. / 10, 4. / 5, 8. / 9, 1}};

namespace detail {

// Few states, of a size that the compiler knows, stay in registers: pairs of them would be written one by one
// and read together, which waits for memory. Hence the unrolled loops.

/// x = start + Σ_j (h weights_j) k_j, n elements, where k_j are the slopes of the stages before.
template <const ButcherTableau& method, int stage, class T>
void advance(T* __restrict x, const T* __restrict start, T h, const T* __restrict slopes, int n) noexcept {
    constexpr bool is_last = stage == method.stages;
    constexpr const double* weights = is_last ? method.b : method.a[is_last ? 0 : stage];
#pragma GCC unroll 8
    for (int e = 0; e < n; ++e) {
        T sum = 0;
        bool is_first = true;
#pragma GCC unroll 8
        for (int j = 0; j < stage; ++j) {
            if (weights[j] == 0) continue;
            const T term = h * static_cast<T>(weights[j]) * slopes[j * n + e];
            sum = is_first ? term : sum + term;
            is_first = false;
        }
        x[e] = start[e] + sum;
    }
}

template <class T> void copy(T* __restrict to, const T* __restrict from, int n) noexcept {
#pragma GCC unroll 8
    for (int e = 0; e < n; ++e) to[e] = from[e];
}

template <const ButcherTableau& method, int stage, class T, class Derivative>
bool run_stages(T t, T h, int n, T* x, const T* rate, const T* start, T* slopes, Derivative& derivative) {
    if constexpr (stage > 0) advance<method, stage>(x, start, h, slopes, n);
    if constexpr (stage < method.stages) {
        if (!derivative(stage, t + static_cast<T>(method.c[stage]) * h)) return false;
        copy(slopes + stage * n, rate, n);
        return run_stages<method, stage + 1>(t, h, n, x, rate, start, slopes, derivative);
    }
    return true;
}

} // namespace detail

/// x(t) -> x(t + h) for n states. `derivative(stage, time)` computes the derivative of what `x` holds into
/// `rate`, in stage 0 that of x(t); it returns false when the model fails, which ends the step with x as it
/// was at its begin. `start` holds n elements, `slopes` n for each stage; both mean nothing between two
/// calls.
template <const ButcherTableau& method, class T, class Derivative>
bool runge_kutta_step(T t, T h, int n, T* x, const T* rate, T* start, T* slopes, Derivative&& derivative) {
    detail::copy(start, x, n);
    if (detail::run_stages<method, 0>(t, h, n, x, rate, start, slopes, derivative)) return true;
    detail::copy(x, start, n);
    return false;
}

} // namespace bf::kernels

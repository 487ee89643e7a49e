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

/// x = start + h Σ_j weights_j k_j, n elements, where k_j are the first `count` slopes.
template <class T>
void advance(T* __restrict x, const T* __restrict start, T h, const double* weights, int count,
             const T* __restrict slopes, int n) noexcept {
    for (int e = 0; e < n; ++e) x[e] = 0;
    for (int j = 0; j < count; ++j, slopes += n)
        if (const T weight = static_cast<T>(weights[j]); weight != 0)
            for (int e = 0; e < n; ++e) x[e] += weight * slopes[e];
    for (int e = 0; e < n; ++e) x[e] = start[e] + h * x[e];
}

} // namespace detail

/// x(t) -> x(t + h) for n states. `derivative(time)` computes the derivative of what `x` holds into `rate`;
/// it returns false when the model fails, which ends the step with x as it was at its begin. `start` holds n
/// elements, `slopes` n for each stage; both mean nothing between two calls.
template <class T, class Derivative>
bool runge_kutta_step(const ButcherTableau& m, T t, T h, int n, T* x, const T* rate, T* start, T* slopes,
                      Derivative&& derivative) {
    for (int e = 0; e < n; ++e) start[e] = x[e];
    for (int i = 0; i < m.stages; ++i) {
        if (i > 0) detail::advance(x, start, h, m.a[i], i, slopes, n);
        if (!derivative(t + static_cast<T>(m.c[i]) * h)) {
            for (int e = 0; e < n; ++e) x[e] = start[e];
            return false;
        }
        for (int e = 0; e < n; ++e) slopes[i * n + e] = rate[e];
    }
    detail::advance(x, start, h, m.b, m.stages, slopes, n);
    return true;
}

} // namespace bf::kernels

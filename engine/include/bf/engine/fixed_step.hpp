// Which tableau a fixed-step method has.
#pragma once

#include "bf/elaborate/solver_method.hpp"
#include "bf/kernels/runge_kutta.hpp"

namespace bf {

/// f<tableau of the method>().
template <class F> auto with_tableau(SolverMethod method, F&& f) {
    switch (method) {
    case SolverMethod::euler: return f.template operator()<kernels::euler>();
    case SolverMethod::heun: return f.template operator()<kernels::heun>();
    case SolverMethod::bogacki_shampine: return f.template operator()<kernels::bogacki_shampine>();
    case SolverMethod::rk4: return f.template operator()<kernels::rk4>();
    default: return f.template operator()<kernels::dormand_prince>();
    }
}

} // namespace bf

// Which functions of bf/codegen/math.hpp have derivatives: for the generator that asks whether a model has
// some, and for its code that computes them.
#pragma once

#define BF_DIFFERENTIABLE_FUNCTIONS(f)                                                                       \
    f(absolute) f(add) f(clamp) f(divide) f(maximum) f(minimum) f(multiply) f(negate) f(power) f(subtract)   \
        f(sqrt) f(signed_sqrt) f(reciprocal_sqrt) f(exp) f(log) f(log10) f(pow10) f(sin) f(cos) f(tan)       \
            f(asin) f(acos) f(atan) f(sinh) f(cosh) f(tanh) f(asinh) f(acosh) f(atanh) f(floor) f(ceil)      \
                f(round) f(fix) f(atan2) f(hypot)

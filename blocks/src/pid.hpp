// What the continuous and the discrete PID controller have in common.
#pragma once

#include "bf/kernels/pid.hpp"

#include "shapes.hpp"

#include <limits>

namespace bf::blocks {

/// Quantities of a PID controller, see kernels::Pid; `has_setpoint` tells whether it has the inputs r and m
/// with setpoint weights, or their difference e.
class PidQuantities {
  public:
    using Numbers = Array<double>;

    PidQuantities(Block* owner, const AnyShape& shape, bool has_setpoint)
        : anti_windup(owner, "anti_windup",
                      {.initial = "back_calculation",
                       .doc =
                           "while y is at a limit: the integral follows it with the tracking time, or stands "
                           "still (clamping), or grows on",
                       .choices = {"back_calculation", "clamping", "none"}}),
          has_tracking(
              owner, "tracking",
              {.initial = false, .doc = "an input `tracked` that y is to follow, e.g. in manual mode"}),
          P(owner, "P", {.shape = shape, .initial = {1}, .unit = any_unit, .doc = "proportional gain"}),
          I(owner, "I", {.shape = shape, .initial = {0}, .unit = any_unit, .doc = "integral gain, 1/s"}),
          D(owner, "D", {.shape = shape, .initial = {0}, .unit = any_unit, .doc = "derivative gain, s"}),
          N(owner, "N",
            {.shape = shape,
             .initial = {100},
             .minimum = 0,
             .unit = unit<"1/s">,
             .doc = "bandwidth of the derivative filter"}),
          b(owner, "b",
            {.shape = shape, .initial = {1}, .doc = "setpoint weight of P", .present = has_setpoint}),
          c(owner, "c",
            {.shape = shape, .initial = {1}, .doc = "setpoint weight of D", .present = has_setpoint}),
          tracking_time(owner, "tracking_time",
                        {.shape = shape,
                         .initial = {1},
                         .above = 0,
                         .unit = unit<"s">,
                         .doc = "T_t of back-calculation and tracking"}),
          lower(owner, "lower",
                {.shape = shape, .initial = {-infinity}, .unit = any_unit, .doc = "smallest y"}),
          upper(owner, "upper",
                {.shape = shape,
                 .initial = {infinity},
                 .at_least = lower.index(),
                 .unit = any_unit,
                 .doc = "largest y"}),
          initial(owner, "initial",
                  {.shape = shape, .initial = {0}, .unit = any_unit, .doc = "integral part at the start"}),
          r(owner, has_setpoint ? "r" : "e", any(shape, has_setpoint ? "setpoint" : "control error")),
          m(owner, "m", {.shape = shape, .unit = any_unit, .doc = "measurement", .present = has_setpoint}),
          tracked(
              owner, "tracked",
              {.shape = shape, .unit = any_unit, .doc = "signal for y to follow", .present = *has_tracking}),
          y(owner, "y", any(shape, "control signal")) {}

    Argument<std::string> anti_windup;
    Argument<bool> has_tracking;
    Parameter<Numbers> P, I, D, N, b, c, tracking_time, lower, upper, initial;
    Input<Numbers> r, m, tracked;
    Output<Numbers> y;

    /// Declares the kernel with the given targets and states; Rule is OutputRule, UpdateRule or
    /// DerivativeRule.
    template <class Rule, class Y, class SI, class SD, class Period, class XI, class XD>
    void declare(Block* owner, const Y& to_y, const SI& slope_i, const SD& slope_d, const Period& period,
                 double theta_i, double theta_d, const XI& x_i, const XD& x_d) const {
        with_operands(period, theta_i, theta_d, x_i, x_d, [&](const auto&... operands) {
            Rule(owner, kernels::Pid{}, to_y, slope_i, slope_d, operands...);
        });
    }
    /// The guard of a controller in continuous time.
    template <class Branch, class XI, class XD>
    void declare_guard(Block* owner, const Branch& branch, const XI& x_i, const XD& x_d) const {
        with_operands(Constants({0}), 0, 0, x_i, x_d, [&](const auto&... operands) {
            GuardRule(owner, kernels::PidBranch{}, branch, operands...);
        });
    }

  private:
    /// What the kernels read, as arguments of `make`.
    template <class Period, class XI, class XD, class MakeRule>
    void with_operands(const Period& period, double theta_i, double theta_d, const XI& x_i, const XD& x_d,
                       const MakeRule& make) const {
        const auto kind = *anti_windup == "none"       ? kernels::AntiWindup::none
                          : *anti_windup == "clamping" ? kernels::AntiWindup::clamping
                                                       : kernels::AntiWindup::back_calculation;
        const Constants options({double(kind), double(*has_tracking), theta_i, theta_d}), one({1}), none({0});
        const auto rule = [&](const auto& weight_b, const auto& weight_c, const auto& measured,
                              const auto& follow) {
            make(options, P, I, D, N, weight_b, weight_c, tracking_time, lower, upper, period, x_i, x_d, r,
                 measured, follow);
        };
        if (m.is_present())
            *has_tracking ? rule(b, c, m, tracked) : rule(b, c, m, none);
        else
            *has_tracking ? rule(one, one, none, tracked) : rule(one, one, none, none);
    }

    static constexpr double infinity = std::numeric_limits<double>::infinity();
};

} // namespace bf::blocks

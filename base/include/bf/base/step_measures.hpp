// What is said of a step response in a few numbers.
#pragma once

#include <vector>

namespace bf {

struct StepMeasures {
    double overshoot = 0; ///< % of the final value; NaN, as all that is relative to it, where that is 0
    double peak = 0, peak_time = 0; ///< the extreme on the side of the final value, and when [s]
    double undershoot = 0;          ///< how far it goes to the other side of 0 [% of the final value]
    double undershoot_time = 0;     ///< when it is there [s]
    double rise_time = 0;           ///< from 10 % to 90 % of the final value [s]
    /// After which it stays within 2 % of the final value, or of its largest value where that is 0 [s]; NaN:
    /// not within the time.
    double settling_time = 0;
};

/// Of y(t), which begins at 0 and comes to `final`; NaN: it comes to nothing. Between samples a continuous
/// response is a straight line, a sampled one stays where it is. There is at least one sample.
StepMeasures measure_step(const std::vector<double>& time, const std::vector<double>& value, double final,
                          bool is_sampled);

} // namespace bf

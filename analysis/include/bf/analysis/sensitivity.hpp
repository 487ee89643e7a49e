// How near a model's checks are to their limits, and which parameters take them there.
#pragma once

#include "bf/analysis/linear_system.hpp"
#include "bf/elaborate/diagram.hpp"

#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace bf::analysis {

struct SensitivityOptions {
    /// Parameters "block.parameter", and variables, which stand for all of their elements, or one of these,
    /// "K[2]". None: all variables that a run can change, or, where the model has none, all parameters of
    /// blocks that are no checks.
    std::vector<std::string> by = {};
    std::vector<std::string> checks = {}; ///< names of check blocks; none: all that report a number
    double duration = 0;                  ///< s; 0: until the model's own stop
    double step = 1e-4;          ///< of differences, relative to the parameter, or to 1 where it is 0
    bool by_differences = false; ///< of every check: to compare with the exact derivatives
    /// Asked now and then whether to go on; RunError where not.
    std::function<bool()> go_on = {};
};

struct Sensitivities {
    std::vector<std::string> names; ///< of the numbers: "controller.pid.P", "Gain.Kp", "lqr.K[1][2]"
    Vector at;                      ///< their values
    Vector least, most;             ///< their own limits; infinite where there are none
    struct Check {
        std::string name;
        double value = 0;                           ///< at the end of the run
        double lower = -INFINITY, upper = INFINITY; ///< its limits
        bool has_passed = false;
        /// To the nearer limit, negative beyond it; infinite without one.
        double distance = INFINITY;
        Vector slopes;           ///< of the value, by each number
        Vector distance_slopes;  ///< of the distance, which changes with the limit, too; 0 without one
        std::string differenced; ///< why the slopes are differences of runs; empty: they are exact
        bool has_corner = false; ///< a jump or corner was met on the way: slopes are those of one side

        /// Change of number i that takes the distance to 0 if it goes on as it begins; infinite: none does.
        double change_to_limit(Eigen::Index i) const;
    };
    std::vector<Check> checks; ///< those nearest to their limits, by relative changes of a number, first
};

/// Runs the model. Where `gradient` goes through it, derivatives of the value are exact; elsewhere they are
/// central differences of two runs for each number, and `differenced` says why. What a variable does is the
/// sum over the parameters that follow from it, of which its own expressions are differenced.
///
/// Throws RunError: no check that reports a number; unknown names; variables that are fixed; a run that
/// fails.
Sensitivities sensitivities(const Diagram& diagram, const SensitivityOptions& options);

} // namespace bf::analysis

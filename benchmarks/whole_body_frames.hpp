// The frames whose poses, Jacobians and bias accelerations the whole-body steps ask for.
#pragma once

#include <string>
#include <vector>

namespace bf::benchmarks {

/// Those of a balancing controller, whose step has 12 quantities.
inline const std::vector<std::string> two_soles{"l_sole", "r_sole"};
/// Of a step that has 30.
inline const std::vector<std::string> eight_frames{"l_sole", "r_sole", "l_hand",      "r_hand",
                                                   "head",   "chest",  "l_upper_leg", "r_upper_leg"};

} // namespace bf::benchmarks

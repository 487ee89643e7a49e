#pragma once

#include "urdf.hpp"

#include <mujoco/mujoco.h>
#include <string>
#include <vector>

namespace bf::physics {

/// Gives every link an inertia that a body can have, and every moving one mass; joints that do not move are
/// gone from `spec`. Appends a line for each link that is changed. Throws std::runtime_error for a link that
/// is too far from any possible one.
///
/// A body's inertia I belongs to a distribution of mass with the second moments S = tr(I)/2 1 - I >= 0
/// (Wensing, Kim and Slotine 2018). Where S has a negative eigenvalue it becomes 1e-6 tr(I), and I = tr(S) 1
/// - S. This changes I by no more than half its largest principal moment when I has no negative one; more
/// than three quarters is refused.
void repair_inertias(mjSpec* spec, const Urdf& urdf, std::vector<std::string>& warnings);

} // namespace bf::physics

#include "bf/trajectory/joint_trajectory.hpp"

#include <cstdlib>
#include <gtest/gtest.h>

// Counts every allocation of the program; the sanitizers bring an allocator of their own.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)

namespace {
int allocations = 0;
}

extern "C" {
void* __libc_malloc(std::size_t);
void* malloc(std::size_t size) { return ++allocations, __libc_malloc(size); }
}

namespace bf::trajectory {
namespace {

TEST(JointTrajectory, AllocatesNothingWhilePlanning) {
    using Timing = JointTrajectory::Timing;
    for (const Timing timing : {Timing::time_optimal, Timing::minimum_jerk})
        for (const auto how :
             {JointTrajectory::Synchronisation::time, JointTrajectory::Synchronisation::phase}) {
            JointTrajectory motion(23, timing, how);
            Eigen::VectorXd p(23), v(23), a(23);
            allocations = 0;
            for (int k = 0; k < 5; ++k) {
                motion.question.target.setLinSpaced(-1.0, 0.3 + k);
                EXPECT_EQ(motion.plan(), JointTrajectory::Status::planned);
                motion.at(0.3 * motion.duration(), p, v, a);
                motion.question.position = p;
                motion.question.velocity = v;
                motion.question.acceleration = a;
            }
            EXPECT_EQ(allocations, 0);
        }
}

} // namespace
} // namespace bf::trajectory

#endif

#include "bf/trajectory/joint_trajectory.hpp"
#include "heap.hpp"

#include <gtest/gtest.h>

namespace bf::trajectory {
namespace {

using bf::test::heap_calls;

TEST(JointTrajectory, AllocatesNothingWhilePlanning) {
    using Timing = JointTrajectory::Timing;
    for (const Timing timing : {Timing::time_optimal, Timing::minimum_jerk})
        for (const auto how :
             {JointTrajectory::Synchronisation::time, JointTrajectory::Synchronisation::phase}) {
            JointTrajectory motion(23, timing, how);
            Eigen::VectorXd p(23), v(23), a(23);
            const long before = heap_calls();
            for (int k = 0; k < 5; ++k) {
                motion.question.target.setLinSpaced(-1.0, 0.3 + k);
                EXPECT_EQ(motion.plan(), JointTrajectory::Status::planned);
                motion.at(0.3 * motion.duration(), p, v, a);
                motion.question.position = p;
                motion.question.velocity = v;
                motion.question.acceleration = a;
            }
            EXPECT_EQ(heap_calls() - before, 0);
        }
}

} // namespace
} // namespace bf::trajectory

// Workers without threads, as published pages have them.
#include "bf/service/worker.hpp"

#include <gtest/gtest.h>
#include <stdexcept>
#include <vector>

namespace bf::service {
namespace {

using Clock = std::chrono::steady_clock;

TEST(Turns, NothingHappensBeforeTheFirstTask) {
    int turns = 0;
    const Worker worker([&](bool) { return ++turns, Worker::never; });
    EXPECT_EQ(Worker::turn_all(), Worker::never);
    EXPECT_EQ(turns, 0);
}

TEST(Turns, ATaskWaitsForTheLoopOfEvents) {
    std::vector<int> done;
    Worker worker([&](bool was_asked) { return done.push_back(was_asked ? 10 : 11), Worker::never; });
    worker.post([&] { done.push_back(1); });
    worker.post([&] { done.push_back(2); });
    EXPECT_TRUE(done.empty());
    EXPECT_EQ(Worker::turn_all(), Worker::never);
    EXPECT_EQ(done, (std::vector{1, 2, 10}));
}

TEST(Turns, ACallIsDoneAtOnceAfterWhatWasPostedBefore) {
    std::vector<int> done;
    Worker worker;
    worker.post([&] { done.push_back(1); });
    worker.call([&] { done.push_back(2); });
    EXPECT_EQ(done, (std::vector{1, 2}));
}

TEST(Turns, ACallThrowsWhatItsTaskThrowsAndTheWorkerGoesOn) {
    Worker worker;
    EXPECT_THROW(worker.call([] { throw std::invalid_argument("no"); }), std::invalid_argument);
    bool is_done = false;
    worker.call([&] { is_done = true; });
    EXPECT_TRUE(is_done);
}

TEST(Turns, ATurnComesWhenItsTimeHasCome) {
    int turns = 0;
    const auto later = Clock::now() + std::chrono::hours(1);
    Worker worker([&](bool) { return ++turns < 3 ? Worker::at_once : later; });
    worker.post([] {});
    EXPECT_LE(Worker::turn_all(), Clock::now());
    EXPECT_LE(Worker::turn_all(), Clock::now());
    EXPECT_EQ(Worker::turn_all(), later);
    EXPECT_EQ(Worker::turn_all(), later);
    EXPECT_EQ(turns, 3);
}

TEST(Turns, ATaskMayPostToItsOwnWorker) {
    std::vector<int> done;
    Worker worker;
    worker.post([&] {
        done.push_back(1);
        worker.post([&] { done.push_back(2); });
    });
    while (Worker::turn_all() != Worker::never) {
    }
    EXPECT_EQ(done, (std::vector{1, 2}));
}

TEST(Turns, ATaskMayEndAnotherWorkerWhoseTurnIsDue) {
    // Whichever comes first ends the other one.
    std::unique_ptr<Worker> one = std::make_unique<Worker>(), other = std::make_unique<Worker>();
    int done = 0;
    one->post([&] { ++done, other.reset(); });
    other->post([&] { ++done, one.reset(); });
    Worker::turn_all();
    EXPECT_EQ(done, 1);
}

} // namespace
} // namespace bf::service

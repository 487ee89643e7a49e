#include "bf/realtime/pacer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <thread>

namespace bf::realtime {
namespace {

constexpr Nanoseconds period = 20'000'000;

void sleep(double periods) { sleep_until(now() + static_cast<Nanoseconds>(periods * period)); }
/// Uses the processor, however often it is taken away.
void compute(double periods) {
    const Nanoseconds end = now(CLOCK_THREAD_CPUTIME_ID) + static_cast<Nanoseconds>(periods * period);
    while (now(CLOCK_THREAD_CPUTIME_ID) < end) {
    }
}

/// Runs steps that do what `act` does with their number; the releases at which they began.
std::vector<Nanoseconds> pace(Pacer& pacer, int steps, const std::function<void(int)>& act) {
    std::vector<Nanoseconds> releases;
    pacer.start();
    for (int k = 0; k < steps && pacer.wait(); ++k) {
        releases.push_back(pacer.release());
        act(k);
        pacer.end_step();
    }
    return releases;
}

std::int64_t misses(const Pacer& pacer, Cause cause) {
    return pacer.statistics().misses[static_cast<std::size_t>(cause)];
}

TEST(Pacer, NeverBeginsAStepBeforeItsRelease) {
    Pacer pacer(2'000'000, Overrun::skip);
    pacer.start();
    const Nanoseconds first = pacer.release();
    for (int k = 0; k < 20 && pacer.wait(); ++k) {
        EXPECT_GE(now(), pacer.release());
        EXPECT_EQ((pacer.release() - first) % 2'000'000, 0) << "releases lie on one grid";
        pacer.end_step();
    }
    EXPECT_EQ(pacer.statistics().steps, 20);
    EXPECT_EQ(pacer.statistics().latency.count(), 20);
    EXPECT_EQ(pacer.statistics().jitter.count(), 19);
}

TEST(Pacer, CallsALongComputationByItsName) {
    Pacer pacer(period, Overrun::skip);
    pace(pacer, 2, [](int k) { compute(k == 0 ? 1.2 : 0); });
    EXPECT_EQ(misses(pacer, Cause::computation), 1);
    ASSERT_FALSE(pacer.statistics().first_misses.empty());
    EXPECT_EQ(pacer.statistics().first_misses[0].step, 0);
    EXPECT_EQ(pacer.statistics().first_misses[0].cause, Cause::computation);
    EXPECT_GT(pacer.statistics().computation.max(), period);
}

TEST(Pacer, TellsWaitingInsideAStepFromComputing) {
    Pacer pacer(period, Overrun::skip);
    pace(pacer, 2, [](int k) { sleep(k == 0 ? 1.2 : 0); });
    EXPECT_EQ(misses(pacer, Cause::computation), 0);
    EXPECT_GE(misses(pacer, Cause::interruption), 1);
}

TEST(Pacer, TellsALateWakeUpFromALongStep) {
    Pacer pacer(period, Overrun::skip);
    pacer.start();
    sleep(2.5); // what a machine does that wakes too late
    pacer.wait();
    pacer.end_step();
    EXPECT_EQ(misses(pacer, Cause::wakeup), 1);
    EXPECT_EQ(pacer.statistics().missed(), 1);
}

TEST(Overruns, SkipLeavesOutWhatHasPassed) {
    Pacer pacer(period, Overrun::skip);
    const auto releases = pace(pacer, 2, [](int k) { sleep(k == 0 ? 2.5 : 0); });
    const auto left_out = (releases[1] - releases[0]) / period - 1;
    EXPECT_GE(left_out, 2);
    EXPECT_EQ((releases[1] - releases[0]) % period, 0);
    EXPECT_GE(pacer.statistics().skipped, left_out);
}

TEST(Overruns, CatchUpMakesEveryStepAndNamesTheBacklog) {
    Pacer pacer(period, Overrun::catch_up);
    const auto releases = pace(pacer, 6, [](int k) { sleep(k == 0 ? 3.5 : 0); });
    for (std::size_t k = 1; k < releases.size(); ++k) EXPECT_EQ(releases[k] - releases[k - 1], period);
    EXPECT_EQ(pacer.statistics().skipped, 0);
    EXPECT_GE(misses(pacer, Cause::backlog), 1);
}

TEST(Overruns, StopEndsAtTheFirstMiss) {
    Pacer pacer(period, Overrun::stop);
    const auto releases = pace(pacer, 10, [](int k) { sleep(k == 1 ? 1.5 : 0); });
    ASSERT_EQ(pacer.statistics().missed(), 1);
    EXPECT_EQ(releases.size(), static_cast<std::size_t>(pacer.statistics().first_misses[0].step) + 1);
}

TEST(Overruns, DegradeLeavesOutWorkThatMayWaitForAHundredSteps) {
    Pacer pacer(period / 10, Overrun::degrade);
    EXPECT_FALSE(pacer.is_degraded());
    std::vector<bool> degraded;
    pace(pacer, 3, [&](int k) {
        degraded.push_back(pacer.is_degraded());
        sleep(k == 0 ? 0.3 : 0);
    });
    EXPECT_EQ(degraded, (std::vector<bool>{false, true, true}));
    EXPECT_EQ(pacer.statistics().degraded, 2);
    // Until so many steps in a row were in time; the machine may miss some of its own.
    for (int k = 0; k < 5000 && pacer.is_degraded() && pacer.wait(); ++k) pacer.end_step();
    EXPECT_FALSE(pacer.is_degraded());
    EXPECT_GE(pacer.statistics().degraded, 99);
}

TEST(Histogram, PercentilesAreThoseOfTheSortedValues) {
    Histogram histogram;
    std::vector<Nanoseconds> values;
    std::mt19937_64 random(1);
    std::lognormal_distribution<double> times(9, 2);
    for (int i = 0; i < 20000; ++i) values.push_back(static_cast<Nanoseconds>(times(random)));
    for (const auto value : values) histogram.add(value);
    std::sort(values.begin(), values.end());
    EXPECT_EQ(histogram.max(), values.back());
    for (const double p : {0.0, 0.01, 0.5, 0.9, 0.99, 0.9999, 1.0}) {
        const double rank = std::max(std::ceil(p * static_cast<double>(values.size())), 1.0);
        const auto exact = static_cast<double>(values[static_cast<std::size_t>(rank) - 1]);
        EXPECT_GE(static_cast<double>(histogram.percentile(p)), exact) << p;
        EXPECT_LE(static_cast<double>(histogram.percentile(p)), exact * 33 / 32) << p;
    }
}

TEST(Histogram, HoldsEveryTime) {
    for (const Nanoseconds value : {Nanoseconds{0}, Nanoseconds{31}, Nanoseconds{32}, Nanoseconds{63},
                                    Nanoseconds{64}, Nanoseconds{INT64_MAX}}) {
        Histogram histogram;
        histogram.add(value);
        EXPECT_EQ(histogram.percentile(0.5), value);
    }
    Histogram empty;
    EXPECT_EQ(empty.percentile(0.99), 0);
    empty.add(-5);
    EXPECT_EQ(empty.max(), 0);
}

TEST(Histogram, CountsInRowsForPeople) {
    Histogram histogram;
    for (const Nanoseconds value : {0ll, 999ll, 1500ll, 1600ll, 30'000ll, 9'000'000'000ll})
        histogram.add(value);
    const auto rows = histogram.rows();
    ASSERT_EQ(rows.size(), 20u) << "with the empty rows between";
    EXPECT_EQ(rows[0].from, 0);
    EXPECT_EQ(rows[0].to, 1000);
    EXPECT_EQ(rows[0].count, 2);
    EXPECT_EQ(rows[1].count, 2) << "1 to 2 us";
    EXPECT_EQ(rows[5].from, 20'000);
    EXPECT_EQ(rows[5].to, 50'000);
    EXPECT_EQ(rows[5].count, 1);
    EXPECT_EQ(rows.back().from, 1'000'000'000) << "the last row is open";
    EXPECT_TRUE(Histogram().rows().empty());
}

TEST(Statistics, AreReadWhileTheyAreCounted) {
    constexpr Nanoseconds period = 1000;
    Pacer pacer(period, Overrun::catch_up);
    std::atomic<bool> is_over{false};
    std::thread reader([&] {
        for (std::int64_t before = 0; !is_over;) {
            const std::int64_t steps = pacer.statistics().steps, missed = pacer.statistics().missed();
            std::int64_t counted = 0;
            for (const auto& row : pacer.statistics().computation.rows()) counted += row.count;
            EXPECT_GE(steps, before);
            EXPECT_GE(counted + 1, steps) << "at most a value behind";
            EXPECT_LE(missed, counted + 1);
            before = steps;
        }
    });
    for (pacer.start(); pacer.statistics().steps < 50'000 && pacer.wait(); pacer.end_step()) {
    }
    is_over = true;
    reader.join();
    EXPECT_EQ(pacer.statistics().computation.count(), 50'000);
}

TEST(PeriodHistogram, PutsEachDeviationInItsRow) {
    for (const Nanoseconds value :
         {-3'000'000'000ll, -1'500'000ll, -1000ll, -999ll, -1ll, 0ll, 999ll, 1000ll, 1999ll, 2000ll, 49'999ll,
          700'000'000ll, 1'000'000'000ll, 9'000'000'000ll}) {
        PeriodHistogram histogram;
        histogram.add(value);
        const auto rows = histogram.rows();
        ASSERT_EQ(rows.size(), 1u) << value;
        EXPECT_EQ(rows[0].count, 1);
        EXPECT_TRUE(rows[0].from <= value || value < -1'000'000'000) << value;
        EXPECT_TRUE(value <= rows[0].to || value > 1'000'000'000) << value;
    }
    PeriodHistogram both;
    both.add(-1500);
    both.add(1500);
    EXPECT_EQ(both.rows().size(), 4u) << "with the empty rows between";
    EXPECT_TRUE(PeriodHistogram().rows().empty());
}

TEST(PeriodHistogram, ShowsOneHumpAsOneByItsDensity) {
    PeriodHistogram histogram; // a triangle from -60 to 60 us
    constexpr int n = 1200;
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < n; ++k) histogram.add(50 * (i + k - n) + 75);
    const auto rows = histogram.rows();
    ASSERT_EQ(rows.front().from, -100'000);
    ASSERT_EQ(rows.back().to, 100'000);
    bool has_dip = false; // of counts, since rows near 0 are narrow
    for (std::size_t i = 1; i < rows.size(); ++i) {
        const bool rises = rows[i].to <= 0;
        if (rises) {
            EXPECT_LT(rows[i - 1].density(), rows[i].density()) << rows[i].from;
        } else if (rows[i].from > 0) {
            EXPECT_GT(rows[i - 1].density(), rows[i].density()) << rows[i].from;
        }
        has_dip |= rises && rows[i].count < rows[i - 1].count;
    }
    EXPECT_TRUE(has_dip);
    EXPECT_DOUBLE_EQ((HistogramRow{-5000, -2000, 12}).density(), 4);
}

TEST(PreparedThread, NamesTheRemedyForWhatIsRefused) {
    std::vector<std::string> refused;
    std::thread([&] { refused = prepare_thread({0, 100'000, false, 0}); }).join();
    ASSERT_EQ(refused.size(), 1u);
    EXPECT_EQ(refused[0].substr(0, 28), "processor 100000 was refused") << refused[0];
    EXPECT_NE(refused[0].find("nproc"), std::string::npos);
}

TEST(PreparedThread, IsLeftAloneByDefault) {
    std::thread([] {
        EXPECT_TRUE(prepare_thread({0, -1, false, 1 << 16}).empty());
        sched_param parameter;
        int policy;
        pthread_getschedparam(pthread_self(), &policy, &parameter);
        EXPECT_EQ(policy, SCHED_OTHER);
    }).join();
}

} // namespace
} // namespace bf::realtime

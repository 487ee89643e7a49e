// What happened in a loop against the clock: histograms, missed deadlines and their causes.
//
// C++17 and no other header of BlockFactory: generated projects carry a copy of this file.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace bf::realtime {

using Nanoseconds = std::int64_t;

/// A number that one thread counts and any other may read meanwhile, without a lock and at no cost for it.
class Counter {
  public:
    Counter() noexcept = default;
    Counter(const Counter& other) noexcept : n_(other) {}
    Counter& operator=(const Counter& other) noexcept { return *this = std::int64_t{other}; }
    Counter& operator=(std::int64_t n) noexcept {
        n_.store(n, std::memory_order_relaxed);
        return *this;
    }
    Counter& operator+=(std::int64_t n) noexcept { return *this = *this + n; }
    Counter& operator++() noexcept { return *this += 1; }
    operator std::int64_t() const noexcept { return n_.load(std::memory_order_relaxed); }

  private:
    std::atomic<std::int64_t> n_{0};
};

/// Values in [from, to) ns; the outermost rows are open.
struct HistogramRow {
    Nanoseconds from, to;
    std::int64_t count;

    /// Count per us of width: rows of unequal widths show one hump as one.
    double density() const noexcept {
        return 1000 * static_cast<double>(count) / static_cast<double>(to - from);
    }
};

/// The rows of histograms for people end at 1, 2, 5, 10 ... us.
class RowEdges {
  public:
    static constexpr int count = 19; ///< 1 us ... 1 s
    static Nanoseconds at(int i) noexcept {
        static constexpr int leading[] = {1, 2, 5};
        Nanoseconds edge = 1000 * leading[i % 3];
        for (; i >= 3; i -= 3) edge *= 10;
        return edge;
    }
    /// The number of the first edge above a size.
    static int above(Nanoseconds size) noexcept {
        int i = 0;
        while (i < count && size >= at(i)) ++i;
        return i;
    }
    /// Drops empty rows at both ends.
    static std::vector<HistogramRow> trimmed(std::vector<HistogramRow> rows) {
        const auto holds = [](const HistogramRow& row) { return row.count > 0; };
        rows.erase(std::find_if(rows.rbegin(), rows.rend(), holds).base(), rows.end());
        rows.erase(rows.begin(), std::find_if(rows.begin(), rows.end(), holds));
        return rows;
    }
};

/// Counts durations in buckets of a width of 1/32 of their value: any percentile from fixed memory. What
/// another thread reads while one counts may be a value behind.
class Histogram {
  public:
    void add(Nanoseconds value) noexcept {
        value = std::max<Nanoseconds>(value, 0);
        ++counts_[bucket(static_cast<std::uint64_t>(value))];
        ++count_;
        if (value > max_) max_ = value;
    }
    std::int64_t count() const noexcept { return count_; }
    Nanoseconds max() const noexcept { return max_; }
    /// The least value that the share `p` (0 ... 1) of all values does not exceed; at most 1/32 too large.
    Nanoseconds percentile(double p) const noexcept {
        const double wanted = p * static_cast<double>(count());
        double seen = 0;
        for (std::size_t i = 0; i < counts_.size(); ++i) {
            seen += static_cast<double>(counts_[i]);
            if (seen >= wanted && seen > 0) return std::min(last_in(i), max());
        }
        return max();
    }
    /// The rows that hold anything, and those between them; a value may be counted in the row below its own
    /// where it is at most 1/32 above the edge.
    std::vector<HistogramRow> rows() const {
        std::vector<HistogramRow> rows;
        for (int i = 0; i <= RowEdges::count; ++i)
            rows.push_back({i == 0 ? 0 : RowEdges::at(i - 1), RowEdges::at(i), 0});
        for (std::size_t i = 0; i < counts_.size(); ++i)
            if (counts_[i] > 0)
                rows[static_cast<std::size_t>(RowEdges::above(first_in(i)))].count += counts_[i];
        return RowEdges::trimmed(std::move(rows));
    }

  private:
    static std::size_t bucket(std::uint64_t value) noexcept {
        if (value < 32) return static_cast<std::size_t>(value);
        const int shift = 58 - __builtin_clzll(value); // value >> shift lies in [32, 63]
        return static_cast<std::size_t>(shift) * 32 + static_cast<std::size_t>(value >> shift);
    }
    static Nanoseconds first_in(std::size_t bucket) noexcept {
        return bucket > 0 ? last_in(bucket - 1) + 1 : 0;
    }
    static Nanoseconds last_in(std::size_t bucket) noexcept {
        if (bucket < 64) return static_cast<Nanoseconds>(bucket);
        const auto shift = bucket / 32 - 1;
        return static_cast<Nanoseconds>(((bucket % 32 + 33) << shift) - 1);
    }
    std::array<Counter, 1888> counts_{};
    Counter count_, max_;
};

/// Counts how far periods were from the one asked for, to both sides.
class PeriodHistogram {
  public:
    void add(Nanoseconds deviation) noexcept {
        const int i = RowEdges::above(deviation < 0 ? -deviation : deviation);
        ++counts_[static_cast<std::size_t>(deviation < 0 ? edges - i : edges + 1 + i)];
    }
    /// The rows that hold anything, and those between them.
    std::vector<HistogramRow> rows() const {
        std::vector<HistogramRow> rows;
        for (int row = 0; row < 2 * edges + 2; ++row) {
            const int i = row - edges - 1; // -1: just below the period
            rows.push_back({i < 0    ? -RowEdges::at(-i - 1)
                            : i == 0 ? 0
                                     : RowEdges::at(i - 1),
                            i < -1    ? -RowEdges::at(-i - 2)
                            : i == -1 ? 0
                                      : RowEdges::at(i),
                            counts_[static_cast<std::size_t>(row)]});
        }
        return RowEdges::trimmed(std::move(rows));
    }

  private:
    static constexpr int edges = RowEdges::count;
    std::array<Counter, 2 * edges + 2> counts_{};
};

/// Why a step ended after its deadline.
enum class Cause {
    computation,  ///< the step used the processor for longer than a period
    interruption, ///< the step would have had time enough, but waited or lost the processor
    wakeup,       ///< the thread was woken too late
    backlog       ///< an earlier miss left no time (catch-up)
};
/// By which programs call it.
inline const char* name(Cause cause) {
    static constexpr const char* names[] = {"computation", "interruption", "wakeup", "backlog"};
    return names[static_cast<int>(cause)];
}
inline const char* text(Cause cause) {
    static constexpr const char* texts[] = {"own computation too long",
                                            "interrupted or waiting inside the step", "woken too late",
                                            "behind after an earlier miss"};
    return texts[static_cast<int>(cause)];
}

/// What happened in a run. Times in ns. All but `first_misses` may be read while the loop counts.
struct Statistics {
    struct Miss {
        std::int64_t step;
        Cause cause;
        Nanoseconds late, latency, computation;
    };
    Nanoseconds period = 0;
    Counter steps;
    Counter skipped;                 ///< releases that were left out
    Counter degraded;                ///< steps without the work that may wait
    std::array<Counter, 4> misses{}; ///< by cause
    std::vector<Miss> first_misses;  ///< the first 100
    Histogram latency;               ///< from a release to the beginning of its step
    Histogram computation;           ///< from the beginning to the end of a step
    Histogram response;              ///< from a release to the end of its step; above the period: missed
    Histogram jitter;                ///< |time between two beginnings - their releases' distance|
    PeriodHistogram periods;

    Statistics() { first_misses.reserve(100); }
    std::int64_t missed() const { return misses[0] + misses[1] + misses[2] + misses[3]; }
};

/// A table for people, lines indented by two blanks.
inline std::string report(const Statistics& s) {
    char line[200];
    std::string text;
    const auto add = [&](const char* format, auto... values) {
        std::snprintf(line, sizeof line, format, values...);
        text += line;
    };
    const auto us = [](Nanoseconds t) { return static_cast<double>(t) / 1000; };
    const auto row = [&](const char* name, const Histogram& h) {
        add("  %-18s %10.1f %10.1f %10.1f %10.1f\n", name, us(h.percentile(0.5)), us(h.percentile(0.99)),
            us(h.percentile(0.9999)), us(h.max()));
    };
    add("  period of %g us, %lld steps\n", us(s.period), static_cast<long long>(s.steps));
    add("  %-18s %10s %10s %10s %10s\n", "us", "p50", "p99", "p99.99", "worst");
    row("wake-up latency", s.latency);
    row("step", s.computation);
    row("both", s.response);
    row("period's deviation", s.jitter);
    double most = 0;
    const auto rows = s.periods.rows();
    for (const auto& r : rows) most = std::max(most, r.density());
    if (!rows.empty()) text += "  deviation of the period, us; bars: steps per us\n";
    for (const auto& r : rows) {
        const std::string bar(static_cast<std::size_t>(40 * r.density() / most), '#');
        add("  %+10g to %+8g %12lld %s\n", us(r.from), us(r.to), static_cast<long long>(r.count),
            bar.c_str());
    }
    add("  deadlines missed: %lld of %lld\n", static_cast<long long>(s.missed()),
        static_cast<long long>(s.steps));
    for (std::size_t i = 0; i < s.misses.size(); ++i)
        if (s.misses[i] > 0)
            add("    %lld: %s\n", static_cast<long long>(s.misses[i]), realtime::text(static_cast<Cause>(i)));
    for (std::size_t i = 0; i < std::min<std::size_t>(s.first_misses.size(), 5); ++i) {
        const auto& m = s.first_misses[i];
        add("    step %lld: %.1f us late (woken after %.1f us, step took %.1f us): %s\n",
            static_cast<long long>(m.step), us(m.late), us(m.latency), us(m.computation),
            realtime::text(m.cause));
    }
    if (s.skipped > 0) add("  periods skipped: %lld\n", static_cast<long long>(s.skipped));
    if (s.degraded > 0) add("  steps degraded: %lld\n", static_cast<long long>(s.degraded));
    return text;
}

} // namespace bf::realtime

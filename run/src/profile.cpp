#include "bf/run/profile.hpp"

#include "bf/base/escape.hpp"
#include "bf/base/numbers.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <ostream>

namespace bf {

namespace {

std::int64_t now() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

std::string period_text(double period) {
    if (period == 0) return "continuous";
    return number_text(period) + " s";
}

} // namespace

Profiler::Profiler(Run& run, std::size_t events) : run_(run), rates_(run.rates()), events_(events) {
    run.visit_tasks([&](Task& task, Phase phase, const std::string& block, int rate) {
        entries_.push_back({this, task, phase, block, rate, 0, 0});
        task = {timed, &entries_.back(), 0};
    });
    // The cost of the timer: what calls of an empty task come to.
    const Task empty{[](const void*, int) { return ok; }, nullptr, 0};
    Entry probe{this, empty, Phase::output, {}, 0, 0, 0};
    constexpr int repetitions = 20000;
    double least_inside = 1e9, least = 1e9;
    for (int batch = 0; batch < 5; ++batch) {
        probe.nanoseconds = 0;
        const std::int64_t begin = now();
        for (int i = 0; i < repetitions; ++i) static_cast<void>(timed(&probe, 0));
        least = std::min(least, static_cast<double>(now() - begin) / repetitions);
        least_inside = std::min(least_inside, static_cast<double>(probe.nanoseconds) / repetitions);
    }
    inside_ns_ = least_inside;
    timer_ns_ = least;
    event_count_ = 0;
    begin_ = now();
}

Profiler::~Profiler() {
    run_.visit_tasks([&](Task& task, Phase, const std::string&, int) {
        if (task.run != timed) return;
        const auto& entry = *static_cast<const Entry*>(task.data);
        if (entry.profiler == this) task = entry.task;
    });
}

Status Profiler::timed(const void* p, int) {
    auto& entry = *const_cast<Entry*>(static_cast<const Entry*>(p));
    const std::int64_t begin = now();
    const Status status = entry.task();
    const std::int64_t duration = now() - begin;
    ++entry.calls;
    entry.nanoseconds += duration;
    Profiler& profiler = *entry.profiler;
    if (!profiler.events_.empty())
        profiler.events_[profiler.event_count_++ % profiler.events_.size()] = {&entry, begin, duration};
    return status;
}

double Profiler::period(int rate) const { return rates_[static_cast<std::size_t>(rate)].period; }

double Profiler::seconds(const Entry& entry) const {
    const double ns = static_cast<double>(entry.nanoseconds) - inside_ns_ * static_cast<double>(entry.calls);
    return std::max(ns, 0.0) * 1e-9;
}

template <class KeyOf> std::vector<Profiler::Row> Profiler::rows(KeyOf&& key_of) const {
    std::map<std::pair<std::string, double>, Row> sums;
    for (const auto& entry : entries_) {
        const std::pair<std::string, double> key{key_of(entry), period(entry.rate)};
        Row& row = sums.try_emplace(key, Row{key.first, key.second}).first->second;
        row.calls += entry.calls;
        row.seconds += seconds(entry);
    }
    std::vector<Row> result;
    for (const auto& [key, row] : sums) result.push_back(row);
    std::stable_sort(result.begin(), result.end(),
                     [](const Row& a, const Row& b) { return a.seconds > b.seconds; });
    return result;
}

std::vector<Profiler::Row> Profiler::blocks() const {
    return rows([](const Entry& entry) { return entry.block; });
}

std::vector<Profiler::Row> Profiler::rates() const {
    return rows([this](const Entry& entry) { return period_text(period(entry.rate)); });
}

std::int64_t Profiler::calls() const {
    std::int64_t sum = 0;
    for (const auto& entry : entries_) sum += entry.calls;
    return sum;
}

void Profiler::write_trace(std::ostream& stream) const {
    static constexpr const char* phases[] = {"output", "update", "derivative", "guards", "event"};
    stream << "{\"displayTimeUnit\":\"ns\",\"traceEvents\":[\n"
           << R"({"name":"process_name","ph":"M","pid":1,"args":{"name":)" << escape::python(run_.name())
           << "}}";
    for (std::size_t rate = 0; rate < rates_.size(); ++rate)
        stream << ",\n"
               << R"({"name":"thread_name","ph":"M","pid":1,"tid":)" << rate << R"(,"args":{"name":)"
               << escape::python(period_text(period(static_cast<int>(rate)))) << "}}";
    const std::size_t kept = std::min(event_count_, events_.size());
    for (std::size_t i = event_count_ - kept; i < event_count_; ++i) {
        const Event& event = events_[i % events_.size()];
        char times[96];
        std::snprintf(times, sizeof times, R"("ts":%.3f,"dur":%.3f)",
                      static_cast<double>(event.begin - begin_) * 1e-3,
                      static_cast<double>(event.duration) * 1e-3);
        stream << ",\n{\"name\":" << escape::python(event.entry->block) << ",\"cat\":\""
               << phases[static_cast<std::size_t>(event.entry->phase)] << R"(","ph":"X","pid":1,"tid":)"
               << event.entry->rate << ',' << times << '}';
    }
    stream << "\n]}\n";
}

} // namespace bf

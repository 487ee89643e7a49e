#include "profile.hpp"

#include <cstdio>
#include <sstream>

namespace bf::tools {

namespace {

std::string time_text(double seconds) {
    char text[32];
    if (seconds >= 1)
        std::snprintf(text, sizeof text, "%.3f s ", seconds);
    else if (seconds >= 1e-3)
        std::snprintf(text, sizeof text, "%.2f ms", seconds * 1e3);
    else if (seconds >= 1e-6)
        std::snprintf(text, sizeof text, "%.2f us", seconds * 1e6);
    else
        std::snprintf(text, sizeof text, "%.1f ns", seconds * 1e9);
    return text;
}

std::string period_text(double period) { return period > 0 ? number(period) + " s" : "continuous"; }

void print_row(double seconds, double wall, const Profiler::Row* row, const char* name) {
    std::printf("  %10s %7.2f %%", time_text(seconds).c_str(), wall > 0 ? 100 * seconds / wall : 0.0);
    if (row)
        std::printf(" %10lld %11s  %-10s", static_cast<long long>(row->calls),
                    time_text(row->calls ? row->seconds / static_cast<double>(row->calls) : 0).c_str(),
                    period_text(row->period).c_str());
    else
        std::printf(" %34s", "");
    std::printf("  %s\n", name);
}

nlohmann::ordered_json to_json(const std::vector<Profiler::Row>& rows) {
    auto list = nlohmann::ordered_json::array();
    for (const auto& row : rows)
        list.push_back(
            {{"name", row.name}, {"period_s", row.period}, {"calls", row.calls}, {"seconds", row.seconds}});
    return list;
}

} // namespace

void print_profile(const Profiler& profiler, double wall) {
    constexpr double least_share = 1e-3;
    constexpr std::size_t most_rows = 40;
    double blocks = 0, small = 0;
    int small_count = 0;
    std::size_t shown = 0;
    std::printf("  %10s %9s %10s %11s  %-10s  %s\n", "time", "of run", "calls", "per call", "period",
                "block");
    for (const auto& row : profiler.blocks()) {
        blocks += row.seconds;
        if (row.seconds < least_share * wall || shown == most_rows) {
            small += row.seconds;
            ++small_count;
            continue;
        }
        ++shown;
        print_row(row.seconds, wall, &row, row.name.c_str());
    }
    if (small_count > 0) print_row(small, wall, nullptr, (std::to_string(small_count) + " more").c_str());
    const double timer = profiler.timer_seconds() * static_cast<double>(profiler.calls());
    print_row(std::max(0.0, wall - blocks - timer), wall, nullptr, "(engine, solver, recording)");
    print_row(timer, wall, nullptr,
              ("(the profiler itself, " + time_text(profiler.timer_seconds()) + " per call)").c_str());
    for (const auto& row : profiler.rates())
        print_row(row.seconds, wall, &row, "(all blocks of this period)");
}

nlohmann::ordered_json profile_json(const Profiler& profiler) {
    return {{"timer_s", profiler.timer_seconds()},
            {"calls", profiler.calls()},
            {"blocks", to_json(profiler.blocks())},
            {"rates", to_json(profiler.rates())}};
}

void write_trace(const Profiler& profiler, OutputFile& file) {
    std::ostringstream text;
    profiler.write_trace(text);
    file.write(text.str());
    file.commit();
}

} // namespace bf::tools

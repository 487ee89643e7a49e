#include "log.hpp"

#include "bf/base/escape.hpp"
#include "bf/base/numbers.hpp"

#include <algorithm>
#include <chrono>

namespace bf::realtime {

namespace {

constexpr std::size_t most_entries = 1000;
constexpr double joined_within = 2; // s

double clock_now() {
    return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::string values_text(const std::vector<double>& values) {
    constexpr std::size_t most = 6;
    if (values.size() == 1) return number_text(values[0]);
    std::string text = "[";
    for (std::size_t i = 0; i < std::min(values.size(), most); ++i)
        text += (i > 0 ? " " : "") + number_text(values[i]);
    return text + (values.size() > most ? " …]" : "]");
}

} // namespace

std::string log_text(const std::vector<LogEntry>& log) {
    constexpr std::size_t most = 20;
    std::string text;
    for (std::size_t i = log.size() - std::min(log.size(), most); i < log.size(); ++i)
        text += "  t = " + number_text(log[i].time) + " s, " +
                escape::terminal(log[i].who + ": " + log[i].what) + "\n";
    return text;
}

const LogEntry* stop_in(const std::vector<LogEntry>& log) {
    for (const char* what : {emergency_entry, stop_service}) {
        const auto found =
            std::find_if(log.begin(), log.end(), [&](const auto& entry) { return entry.what == what; });
        if (found != log.end()) return &*found;
    }
    return nullptr;
}

std::string emergency_in(const std::vector<LogEntry>& log) {
    const LogEntry* const stop = stop_in(log);
    if (!stop || stop->what != emergency_entry) return "";
    return emergency_entry + (" by " + escape::terminal(stop->who));
}

const Log::Numbered& Log::add(double time, const std::string& who, const std::string& what) {
    if (entries_.size() == most_entries) entries_.pop_front();
    return entries_.emplace_back(Numbered{count_++, {clock_now(), time, who, what}});
}

const Log::Numbered& Log::add_change(double time, const std::string& who, const std::string& name,
                                     const std::vector<double>& was, const std::vector<double>& is) {
    const bool goes_on = !entries_.empty() && entries_.back().name == name &&
                         entries_.back().entry.who == who &&
                         clock_now() - entries_.back().entry.clock < joined_within;
    if (!goes_on) {
        add(time, who, "");
        entries_.back().name = name;
        entries_.back().was = was;
    }
    Numbered& last = entries_.back();
    last.entry.clock = clock_now();
    last.entry.time = time;
    last.entry.what = name + " = " + values_text(is) + ", was " + values_text(last.was);
    return last;
}

} // namespace bf::realtime

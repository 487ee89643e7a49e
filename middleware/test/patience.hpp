// What takes its time: a machine that is busy gets more of it before a test fails.
#pragma once

#include "bf/middleware/clock.hpp"
#include "running.hpp"

#include <functional>
#include <regex>
#include <string>
#include <unistd.h>

namespace bf::middleware::test {

/// Steps until it is so; false: it never was.
inline bool steps_until(toolbox::test::Running& run, const std::function<bool()>& is_so) {
    for (const double end = now() + 30; now() < end; usleep(1000)) {
        if (!run.step()) return false;
        if (is_so()) return true;
    }
    return false;
}

/// The model, whose start waits for so long.
inline std::string waiting(const std::string& model, const std::string& seconds) {
    return std::regex_replace(model, std::regex("start_timeout: [0-9.]+"), "start_timeout: " + seconds);
}
/// What the start of the model is refused for, where others have to be found first: a reason without `part`
/// counts only where a long time has not sufficed.
inline std::string refusal_with(const std::string& part, const std::string& model) {
    const std::string soon = toolbox::test::refusal(waiting(model, "3"));
    return soon.find(part) != std::string::npos ? soon : toolbox::test::refusal(waiting(model, "30"));
}
inline void expect_refusal_with(const std::string& part, const std::string& model) {
    toolbox::test::expect_contains(refusal_with(part, model), part);
}

} // namespace bf::middleware::test

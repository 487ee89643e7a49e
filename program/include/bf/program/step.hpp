// What a step needs while it runs, also in generated code.
#pragma once

#include <cstdint>

namespace bf::program {

enum class Edge { rising, falling, either, level };

/// Rising is from 0 or below to above 0. What was not looked at yet (NaN) has no edge; a level counts at
/// once.
constexpr bool is_edge(Edge edge, double before, double now) noexcept {
    const bool rises = before <= 0 && now > 0, falls = before > 0 && now <= 0;
    return edge == Edge::rising    ? rises
           : edge == Edge::falling ? falls
           : edge == Edge::either  ? rises || falls
                                   : now > 0;
}

/// How a guard crossed 0 between two values: +1 it rose, -1 it fell, 0 it did not. Leaving 0 is no crossing.
template <class T> constexpr int crossing(T before, T now) noexcept {
    return before < 0 && now >= 0 ? 1 : before > 0 && now <= 0 ? -1 : 0;
}

/// The time of a rate: of its last hit, and between two.
template <class Time> struct Clock {
    Time time = 0, period = 0, trigger = 0;
    std::int64_t step = -1; ///< hits before the last one
};

/// The clock's rate is hit.
template <class Clock, class Time> void hit(Clock& clock, Time time) noexcept {
    clock.time = time;
    ++clock.step;
}

/// The clock's rate is triggered: its period is the time since it ran before, 0 in the first run.
template <class Clock, class Time> void fire(Clock& clock, Time time) noexcept {
    clock.period = clock.step < 0 ? Time(0) : time - clock.time;
    clock.trigger = 1;
    hit(clock, time);
}

} // namespace bf::program

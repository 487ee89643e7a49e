#include "bf/fmi/clockwork.hpp"

#include <algorithm>
#include <cmath>

namespace bf::fmi {

namespace {
constexpr double slack = 1e-6; ///< of an interval, within which two times are one

/// Why the clock does not tick in steps that are known when the run begins; null: it does.
const char* why_not(const Ticks& ticks) {
    switch (ticks.kind) {
    case Ticks::Kind::constant:
    case Ticks::Kind::fixed: return nullptr;
    case Ticks::Kind::tunable:
        return ticks.interval ? nullptr : "has an interval that follows from parameters while it runs";
    case Ticks::Kind::triggered: return "is triggered by another FMU, which no signal of a diagram does";
    case Ticks::Kind::changing:
    case Ticks::Kind::countdown: break;
    }
    return "ticks at times that it finds while it runs, which need not be steps";
}
} // namespace

Clockwork::Clockwork(const Description& d, const std::string& fmu) {
    const std::string remedy = "; use an FMU whose clocks have intervals that stay (FMI 3.0, section 2.2.9)";
    for (int number = 0; number < static_cast<int>(d.variables.size()); ++number) {
        const Variable& v = d.variables[static_cast<std::size_t>(number)];
        if (v.ticks && v.causality == Causality::input) {
            if (const char* const why = why_not(*v.ticks))
                throw FmuError(fmu + ": its input clock '" + v.name + "' " + why + remedy);
            clocks_.push_back({number, v.reference, v.name, v.ticks->interval.value_or(0), v.ticks->shift,
                               v.ticks->interval.has_value()});
        }
        if (v.causality != Causality::input && v.causality != Causality::output) continue;
        for (const int clock : v.clocks) {
            const Variable& its = d.variables[static_cast<std::size_t>(clock)];
            if (its.causality != Causality::input)
                throw FmuError(fmu + ": '" + v.name + "' has a value only in the ticks of '" + its.name +
                               "', which the FMU triggers itself" + remedy);
        }
    }
    references_.reserve(clocks_.size());
    active_.reserve(clocks_.size());
}

bool Clockwork::begin(Instance& instance, double start) noexcept {
    start_ = start;
    active_.clear();
    for (auto& clock : clocks_) {
        if (clock.is_known) continue;
        if (!instance.get_interval(clock.reference, clock.interval, clock.shift)) return false;
        if (!(clock.interval > 0 && std::isfinite(clock.interval)) ||
            !(clock.shift >= 0 && std::isfinite(clock.shift)))
            return instance.fail("fmi3GetIntervalDecimal",
                                 " gave an interval that is not above 0, a shift below 0, or one of them is "
                                 "not finite (FMI 3.0, section 2.2.9)");
    }
    return true;
}

double Clockwork::next(const Clock& clock, double last) const noexcept {
    const double ticks = (last - start_ - clock.shift) / clock.interval;
    return start_ + clock.shift + (ticks < -slack ? 0 : std::floor(ticks + slack) + 1) * clock.interval;
}

double Clockwork::next(double last) const noexcept {
    double first = std::numeric_limits<double>::infinity();
    for (const auto& clock : clocks_) first = std::min(first, next(clock, last));
    return first;
}

bool Clockwork::is_due(double last, double time) const noexcept {
    return std::any_of(clocks_.begin(), clocks_.end(),
                       [&](const Clock& clock) { return is_due(clock, last, time); });
}

bool Clockwork::is_due(const Clock& clock, double last, double time) const noexcept {
    return next(clock, last) <= time + slack * clock.interval;
}

bool Clockwork::is_late(double last, double time) const noexcept {
    return std::any_of(clocks_.begin(), clocks_.end(),
                       [&](const Clock& clock) { return next(clock, last) < time - slack * clock.interval; });
}

bool Clockwork::tick(Instance& instance, double last, double time) noexcept {
    references_.clear();
    active_.clear();
    for (const auto& clock : clocks_)
        if (is_due(clock, last, time)) {
            references_.push_back(clock.reference);
            active_.push_back(clock.number);
        }
    return references_.empty() || instance.activate(references_);
}

bool Clockwork::is_active(const std::vector<int>& clocks) const noexcept {
    return std::any_of(clocks.begin(), clocks.end(), [&](int clock) {
        return std::find(active_.begin(), active_.end(), clock) != active_.end();
    });
}

const char* Clockwork::off_the_grid(double period) const noexcept {
    const auto is_multiple = [&](double time) {
        return std::abs(time / period - std::round(time / period)) <= slack * std::max(1.0, time / period);
    };
    for (const auto& clock : clocks_)
        if (!is_multiple(clock.interval) || !is_multiple(clock.shift)) return clock.name.c_str();
    return nullptr;
}

} // namespace bf::fmi

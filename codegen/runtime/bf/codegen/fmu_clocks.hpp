// Rates of a model as clocks of its FMU, which the importer ticks.
#pragma once

#include "bf/codegen/fmu_state.hpp"
#include "bf/codegen/fmu_variables.hpp"

#include <cmath>
#include <cstdint>
#include <cstdio>

namespace bf::generated {

/// Periodic clocks of constant interval: FMI 3.0, section 2.2.9. All that tick at one instant are one step of
/// the model, so that they must be active at once, in one event. What is refused has its reason in `problem`.
class FmuClocks {
  public:
    FmuClocks(const FmuTables& tables, FmuMoment& moment)
        : tables_(tables), period_(tables.library()->period), moment_(moment) {}

    bool have_some() const noexcept { return tables_.clock_count > 0; }
    /// The clock of a value reference, which follow those of variables; null for another one.
    const FmuClock* clock(std::uint32_t reference) const noexcept {
        const auto first = std::uint32_t(tables_.variable_count) + 1;
        return reference >= first && reference - first < std::uint32_t(tables_.clock_count)
                   ? tables_.clocks + (reference - first)
                   : nullptr;
    }
    double interval(const FmuClock& clock) const noexcept { return double(clock.ticks) * period_; }
    double shift(const FmuClock& clock) const noexcept { return double(clock.offset) * period_; }
    bool is_active(const FmuClock& clock) const noexcept { return (moment_.active & bit(clock)) != 0; }
    bool is_some_active() const noexcept { return moment_.active != 0; }
    /// Do some tick at that step of the model?
    bool is_due(std::int64_t step) const noexcept { return due(step) != 0; }

    /// Gives the step of the model that begins with it, and makes its time that of the instance; -1: the
    /// clock does not tick now.
    std::int64_t activate(const FmuClock& clock, Problem& problem) noexcept {
        const double steps = (moment_.time - moment_.start) / period_;
        const std::int64_t step = expected();
        if (!(std::abs(steps - double(step)) <= slack) || !(due(step) & bit(clock))) {
            std::snprintf(problem.text, sizeof problem.text,
                          "'%s' does not tick at %.17g s: the next to tick is '%s', at %.17g s", clock.name,
                          moment_.time, name(due(step)), time_of(step));
            return -1;
        }
        moment_.time = time_of(step); // what is computed again later is of the step's time, to the bit
        moment_.active |= bit(clock);
        return step;
    }
    /// Clocks of constant interval cannot be deactivated.
    bool deactivate(const FmuClock& clock, Problem& problem) const noexcept {
        std::snprintf(problem.text, sizeof problem.text,
                      "'%s' cannot be deactivated (FMI 3.0, section 2.3.5)", clock.name);
        return !is_active(clock);
    }
    /// The event of those that are active ends, and they with it.
    bool end_tick(Problem& problem) noexcept {
        if (const auto missing = due(expected()) & ~moment_.active) {
            std::snprintf(
                problem.text, sizeof problem.text,
                "clocks that tick at one instant are one step of the model: '%s' ticks at %.17g s, too, and "
                "must be active in the same event as '%s'",
                name(missing), moment_.time, name(moment_.active));
            return false;
        }
        moment_.ticked = expected();
        moment_.active = 0;
        return true;
    }
    /// Have those ticked that had to before that step, which begins at `time`?
    bool have_ticked(std::int64_t step, double time, Problem& problem) const noexcept {
        if (!have_some() || expected() >= step) return true;
        std::snprintf(
            problem.text, sizeof problem.text,
            "at %.17g s, before %.17g s, '%s' ticks: activate it there, in Event Mode (FMI 3.0, section "
            "2.2.9)",
            time_of(expected()), time, name(due(expected())));
        return false;
    }
    /// The first step at or after that time.
    std::int64_t step_after(double time) const noexcept {
        return std::int64_t(std::ceil((time - moment_.start) / period_ - slack));
    }
    /// Has the variable a value outside of the initialization?
    bool has_value(const FmuVariables::Variable& v, const char* function, Problem& problem) const noexcept {
        if (v.clocks == 0 || (v.clocks & moment_.active)) return true;
        std::snprintf(
            problem.text, sizeof problem.text,
            "%s: '%s' can be read and written while its clock '%s' is active (FMI 3.0, section 2.2.6.2)",
            function, v.name, name(v.clocks));
        return false;
    }

  private:
    static constexpr double slack = 1e-6; ///< steps

    /// Sets of clocks are bits.
    std::uint64_t bit(const FmuClock& clock) const noexcept {
        return std::uint64_t(1) << unsigned(&clock - tables_.clocks);
    }
    std::uint64_t due(std::int64_t step) const noexcept {
        std::uint64_t all = 0;
        for (int i = 0; i < tables_.clock_count; ++i) {
            const FmuClock& its = tables_.clocks[i];
            if (step >= its.offset && (step - its.offset) % its.ticks == 0) all |= bit(its);
        }
        return all;
    }
    /// The first step, behind the last one at which some ticked, at which some tick.
    std::int64_t expected() const noexcept {
        std::int64_t first = -1;
        for (int i = 0; i < tables_.clock_count; ++i) {
            const FmuClock& its = tables_.clocks[i];
            const std::int64_t behind = moment_.ticked - its.offset;
            const std::int64_t at = its.offset + (behind < 0 ? 0 : (behind / its.ticks + 1) * its.ticks);
            if (first < 0 || at < first) first = at;
        }
        return first;
    }
    double time_of(std::int64_t step) const noexcept { return moment_.start + double(step) * period_; }
    /// Of the first of a set.
    const char* name(std::uint64_t set) const noexcept {
        for (int i = 0; i < tables_.clock_count; ++i)
            if (set & bit(tables_.clocks[i])) return tables_.clocks[i].name;
        return "";
    }

    const FmuTables& tables_;
    double period_; ///< of the model [s]
    FmuMoment& moment_;
};

} // namespace bf::generated

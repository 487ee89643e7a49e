// What an importer knows of the clocks of an FMU, and ticks.
#pragma once

#include "bf/fmi/instance.hpp"

#include <limits>
#include <vector>

namespace bf::fmi {

/// The periodic clocks of an FMU: FMI 3.0, section 2.2.9. Those that tick at one instant are active in one
/// event.
class Clockwork {
  public:
    /// Throws FmuError, which begins with `fmu`, for input clocks that are not periodic, and for inputs and
    /// outputs with other clocks: who runs an FMU by steps does not know when these tick.
    Clockwork(const Description& d, const std::string& fmu);

    /// In Initialization Mode: asks for what the description does not say. False where the FMU fails.
    bool begin(Instance& instance, double start) noexcept;
    /// When the first tick after that time is; infinity for none.
    double next(double last) const noexcept;
    /// Does one tick at that time, after `last`?
    bool is_due(double last, double time) const noexcept;
    /// Should one have ticked before that time, after `last`?
    bool is_late(double last, double time) const noexcept;
    /// In Event Mode: activates the clocks that are due. False where the FMU fails.
    bool tick(Instance& instance, double last, double time) noexcept;
    /// Is one of these, by their numbers, active since tick()?
    bool is_active(const std::vector<int>& clocks) const noexcept;
    bool is_some_active() const noexcept { return !active_.empty(); }
    /// The event ended.
    void end() noexcept { active_.clear(); }
    /// The name of a clock with ticks that are no multiples of that period, after the start; null for none.
    const char* off_the_grid(double period) const noexcept;

  private:
    struct Clock {
        int number;
        std::uint32_t reference;
        std::string name;
        double interval, shift; ///< s
        bool is_known;          ///< from the description
    };
    double next(const Clock& clock, double last) const noexcept;
    bool is_due(const Clock& clock, double last, double time) const noexcept;

    std::vector<Clock> clocks_;
    double start_ = 0;
    std::vector<std::uint32_t> references_; ///< of those that tick() activates
    std::vector<int> active_;               ///< numbers
};

} // namespace bf::fmi

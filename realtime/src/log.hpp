// What viewers have done to a run.
#pragma once

#include "bf/realtime/server.hpp"

#include <deque>

namespace bf::realtime {

inline constexpr const char* emergency_entry = "emergency stop";

/// The last thousand entries; one thread uses it.
class Log {
  public:
    struct Numbered {
        std::int64_t number;
        LogEntry entry;
        std::string name = {};        ///< of the parameter that changed
        std::vector<double> was = {}; ///< its value before
    };

    const Numbered& add(double time, const std::string& who, const std::string& what);
    /// Joins with the last entry where the same one moves the same value on, as by a slider.
    const Numbered& add_change(double time, const std::string& who, const std::string& name,
                               const std::vector<double>& was, const std::vector<double>& is);
    const std::deque<Numbered>& entries() const { return entries_; }

  private:
    std::deque<Numbered> entries_;
    std::int64_t count_ = 0;
};

} // namespace bf::realtime

#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/recording/reader.hpp"
#include "bf/service/protocol.hpp"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace bf::service {

/// What was recorded of a model, in place of a run: any instant of it can be looked at, and nothing is
/// computed.
class RecordedRun {
  public:
    /// Throws std::runtime_error when the file is no recording.
    explicit RecordedRun(const std::filesystem::path& file);

    /// Signals are found by all names that the model has for them. Until then there is no run.
    void name_signals(const Diagram& diagram);

    const RunState& state() const { return state_; }
    const std::vector<SignalInfo>& signals() const { return signals_; }
    /// All samples of those signals, by index, as a binary frame.
    std::string samples(const std::set<int>& signals) const;
    void look_at(double time);

  private:
    const recording::Recording recording_;
    RunState state_;
    std::vector<SignalInfo> signals_; ///< indices are those of channels
};

} // namespace bf::service

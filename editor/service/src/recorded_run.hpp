#pragma once

#include "bf/elaborate/diagram.hpp"
#include "bf/recording/reader.hpp"
#include "bf/run/recorder.hpp"
#include "bf/service/protocol.hpp"
#include "bf/service/scenery.hpp"

#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace bf::service {

/// What was recorded of a model, in place of a run: any instant of it can be looked at, and nothing is
/// computed.
class RecordedRun {
  public:
    /// Throws std::runtime_error when the file is no recording. With `has_model` it is looked at with the
    /// model that it holds: throws RunError when it holds none.
    RecordedRun(const std::filesystem::path& file, bool has_model);

    /// The model that it holds, where it is looked at with that.
    const ModelSource& source() const { return source_; }

    /// Signals are found by all names that the model has for them. Until then there is no run.
    void name_signals(const Diagram& diagram);

    const RunState& state() const { return state_; }
    const std::vector<SignalInfo>& signals() const { return signals_; }
    /// All samples of those signals, by index, as a binary frame.
    std::string samples(const std::set<int>& signals) const;
    void look_at(double time);

    /// From now on `places` tells where things are in these; null: no longer. Gives why it cannot; empty: it
    /// does.
    std::string show(std::shared_ptr<Sceneries> sceneries);
    /// Where things are at the instant that is looked at, as a binary frame.
    std::string places();

  private:
    const recording::Recording recording_;
    ModelSource source_;
    std::shared_ptr<Sceneries> sceneries_;
    std::vector<std::vector<double>> held_; ///< by channel, what sceneries are bound to; empty: they are not
    std::vector<double> values_;
    RunState state_;
    std::vector<SignalInfo> signals_; ///< indices are those of channels
};

} // namespace bf::service

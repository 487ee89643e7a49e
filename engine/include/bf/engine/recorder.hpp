// Records chosen signals of a running simulation, and what running it again needs.
#pragma once

#include "bf/engine/simulation.hpp"
#include "bf/recording/writer.hpp"

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace bf {

/// The rate at which a signal is recorded: that of its block, or the constant rate.
int rate_of(const Diagram& diagram, const Node::End& end);

/// What a recording, or a live viewer, is told about a signal.
recording::ChannelInfo channel_info(const Diagram& diagram, const Node::End& end);

/// What a diagram was elaborated from.
struct ModelSource {
    std::filesystem::path file; ///< of the model, absolute
    std::map<std::filesystem::path, std::string>
        texts; ///< of it and of the files it refers to, by their path
    std::vector<std::pair<std::string, std::string>>
        overrides; ///< names and expressions, the last one counts
};

/// Writes signals to an MCAP file, each at its own rate, as the observers of a step see them. A signal with
/// several names, such as the output of a subsystem, is stored once. For a replay it adds the inputs of the
/// root and what comes from devices, and
///
///     attachment "model"               text of the model
///     attachment "model/PATH"          text of a file it refers to; PATH is relative to the model's folder
///     attachment "checkpoint/STEP"     snapshot before that step
///     metadata "run"                   file: of the model
///     metadata "overrides"             "000 NAME": expression
///     metadata "parameter change 0"    step: before which it acts;  name;  values: column by column
///     metadata "plots"                 the panels that the model asks for
class Recorder final : public Simulation::Observer {
  public:
    /// Opens the file for the signals; throws std::runtime_error when it cannot be created.
    Recorder(const Simulation& simulation, const std::vector<SignalName>& signals,
             const std::filesystem::path& file, const ModelSource& source = {},
             const recording::WriterOptions& options = {});

    void observe(const Simulation& simulation) noexcept override;

    /// Attaches a snapshot, between two steps. Throws RunError naming a block that refuses.
    void checkpoint(const Simulation& simulation);
    /// Notes a parameter that was set before a step. Any thread may, one at a time, while another one steps.
    void parameter_changed(std::int64_t step, const std::string& path, const std::vector<double>& values);

    /// Completes the file; throws std::runtime_error when something could not be written (disk full).
    void close() { writer_.close(); }
    bool failed() const noexcept { return writer_.failed(); }
    std::string status() const { return writer_.status(); }
    /// Samples lost because the disk was too slow, where the options allow it.
    std::uint64_t dropped() const noexcept { return writer_.dropped(); }

  private:
    recording::Writer writer_;
    std::map<int, std::vector<recording::Sample>> samples_; ///< by their rate
    std::atomic<bool> are_constants_due_ = true;
    int changes_ = 0;
};

} // namespace bf

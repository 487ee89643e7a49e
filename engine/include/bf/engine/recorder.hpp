// Records chosen signals of a running simulation.
#pragma once

#include "bf/engine/simulation.hpp"
#include "bf/recording/writer.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace bf {

/// The rate at which a signal is recorded: that of its block, or the constant rate.
int rate_of(const Diagram& diagram, const Node::End& end);

/// What a recording, or a live viewer, is told about a signal.
recording::ChannelInfo channel_info(const Diagram& diagram, const Node::End& end);

/// Writes signals to an MCAP file, each at its own rate, as the observers of a step see them. Attachment
/// "model" holds the model's text, metadata "plots" the panels that the model asks for.
class Recorder final : public Simulation::Observer {
  public:
    /// Opens the file for the signals; throws std::runtime_error when it cannot be created.
    Recorder(const Diagram& diagram, const std::vector<SignalName>& signals,
             const std::filesystem::path& file, const std::string& model_text,
             const recording::WriterOptions& options = {});

    void observe(const Simulation& simulation) noexcept override;
    /// Completes the file; throws std::runtime_error when something could not be written (disk full).
    void close() { writer_.close(); }
    bool failed() const noexcept { return writer_.failed(); }
    std::string status() const { return writer_.status(); }
    /// Samples lost because the disk was too slow, where the options allow it.
    std::uint64_t dropped() const noexcept { return writer_.dropped(); }

  private:
    struct Channel {
        recording::ChannelId id;
        Node::End end;
        int rate;
    };
    recording::Writer writer_;
    std::vector<Channel> channels_;
};

} // namespace bf

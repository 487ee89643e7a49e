// Records chosen signals of a run, and what running it again needs.
#pragma once

#include "bf/recording/writer.hpp"
#include "bf/run/run.hpp"

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace bf {

/// What a run was made from.
struct ModelSource {
    std::filesystem::path file; ///< of the model, absolute
    std::map<std::filesystem::path, std::string>
        texts; ///< of it and of the files it refers to, by their path
    std::vector<std::pair<std::string, std::string>>
        overrides; ///< names and expressions, the last one counts
};

/// What a recording of signals holds: each once, under the name that comes first and with its other ones, as
/// the output of a subsystem is the signal of a block inside; and what reaches the model from outside.
std::vector<Quantity> to_record(const Run& run, const std::vector<Quantity>& signals);

/// Writes signals to an MCAP file, each at its own rate, as the observers of a step see them. A signal with
/// several names, such as the output of a subsystem, is stored once. For a replay it adds the inputs of the
/// root and what comes from devices, and
///
///     attachment "model"               text of the model
///     attachment "model/PATH"          text of a file it refers to; PATH is relative to the model's folder
///     attachment "checkpoint/STEP"     snapshot before that step
///     metadata "run"                   file: of the model
///     metadata "overrides"             "000 NAME": expression
///     metadata "parameter change 0"    step: before which it acts, -1 before the start;  name;  values:
///     column
///                                      by column;  who: asked for it, where that is known
///     metadata "control 0"             time: of the model [s];  clock: s since 1970;  who;  what: "start",
///     ... metadata "plots"                 the panels that the model asks for
///     metadata "served"                to: whom the run let command its robots, which is not recorded
///     metadata "edit 0"                step: before which it acts;  who;  what
///     attachment "edit 0/model"        text of the edited model, whose other files are "edit 0/model/PATH"
class Recorder final : public Run::Observer {
  public:
    /// Opens the file for signals of the run, such as `run.recorded()`; throws std::runtime_error when it
    /// cannot be created.
    Recorder(const Run& run, const std::vector<Quantity>& signals, const std::filesystem::path& file,
             const ModelSource& source = {}, const recording::WriterOptions& options = {});

    void observe(const Run& run) noexcept override;

    /// Attaches a snapshot, between two steps. Throws RunError naming a block that refuses.
    void checkpoint(const Run& run);
    /// Notes a parameter that was set before a step. Any thread may, one at a time, while another one steps.
    void parameter_changed(std::int64_t step, const std::string& path, const std::vector<double>& values,
                           const std::string& who = "");
    /// Notes that other programs command the run's robots, which makes it one that cannot be done again.
    void served(const std::string& to) { writer_.add_metadata("served", {{"to", to}}); }
    /// Notes that somebody started or stopped the run, likewise.
    void controlled(double time, double clock, const std::string& who, const std::string& what);

    /// Sees the steps of a run that goes on in the place of the one before: channels of signals that it has,
    /// with the same type and size, go on. The recorder must live as long.
    std::unique_ptr<Run::Observer> continued(const Run& run);
    /// Notes that the model was edited before that step, likewise.
    void edited(std::int64_t step, const std::string& who, const std::string& what,
                const ModelSource& source);

    /// Completes the file; throws std::runtime_error when something could not be written (disk full).
    void close() { writer_.close(); }
    bool failed() const noexcept { return writer_.failed(); }
    std::string status() const { return writer_.status(); }
    /// Samples lost because the disk was too slow, where the options allow it.
    std::uint64_t dropped() const noexcept { return writer_.dropped(); }

  private:
    using Samples = std::map<int, std::vector<recording::Sample>>; ///< by their rate
    class Continued;
    struct Channel {
        std::string path;
        Type type;
        std::uint32_t rows, cols;
        recording::ChannelId id;
    };
    void append(const Run& run, const Samples& samples) noexcept;
    void attach(const std::string& prefix, const ModelSource& source);

    recording::Writer writer_;
    std::vector<Channel> channels_;
    Samples samples_;
    std::atomic<bool> are_constants_due_ = true;
    int changes_ = 0, controls_ = 0, edits_ = 0;
};

} // namespace bf

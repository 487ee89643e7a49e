#pragma once

#include "bf/recording/channel.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace bf::recording {

using Metadata = std::map<std::string, std::string>;

enum class ChannelId : std::uint16_t {};

struct WriterOptions {
    /// What `append` does when the disk is slower than the signals: wait (simulation), or drop the sample
    /// and count it (real time).
    bool drop_when_full = false;
    std::size_t chunk_bytes = std::size_t{1} << 20;  ///< a chunk goes to the file when it has this size,
    std::chrono::milliseconds flush_period{500};     ///< or this age, whichever comes first
    std::size_t buffer_bytes = std::size_t{8} << 20; ///< memory between `append` and the disk
};

/// The value of a channel.
struct Sample {
    ChannelId channel;
    const void* data;
};

/// Writes signals to an MCAP file (https://mcap.dev/spec): messages in CDR with ROS 2 schemas, chunks not
/// compressed, so that Foxglove and PlotJuggler open the file and doubles stay exact.
///
///     Writer writer("run.mcap", {{"model", "balancing"}});
///     const ChannelId tau = writer.add_channel("controller.tau", {.rows = 23, .unit = "N m"});
///     writer.add_attachment("model.yaml", "application/yaml", text);
///     writer.begin();
///     writer.append(tau, time_ns, data); // every step
///     writer.close();
///
/// A background thread writes the chunks; memory does not grow with time. A file that was cut (crash, kill)
/// stays readable up to its last chunk, that is up to `flush_period` before the end. All functions except
/// `append`, `status`, `failed` and `dropped` belong to set-up and closing; one thread appends.
class Writer {
  public:
    /// Creates the file, replacing an existing one. `metadata` (model name, tool version, ...) becomes the
    /// metadata record "recording". Throws std::runtime_error when the file cannot be created.
    explicit Writer(const std::filesystem::path& path, Metadata metadata = {},
                    const WriterOptions& options = {});
    ~Writer(); ///< closes the file if `close` was not called; its errors are lost then
    Writer(Writer&&) noexcept;
    Writer& operator=(Writer&&) noexcept;

    /// Adds a signal named by its dotted path; "controller.tau" becomes the topic "/controller/tau".
    /// Throws std::runtime_error for a repeated or empty name, no elements, or a call after `begin`.
    ChannelId add_channel(std::string_view name, const ChannelInfo& info);

    /// Adds a file to the recording, e.g. the text of the model. Any time before `close`.
    void add_attachment(std::string_view name, std::string_view media_type, std::span<const std::byte> bytes);
    void add_attachment(std::string_view name, std::string_view media_type, std::string_view text);

    /// Adds a named set of texts, e.g. the figures of a finished run. Any time before `close`.
    void add_metadata(std::string_view name, const Metadata& values);

    /// Ends the declaration of channels and starts the background thread.
    void begin();

    /// Records samples of one instant, each `info.bytes()` bytes at `data`, matrices column-major. Between
    /// `begin` and `close`. A negative `time_ns` is one that the clock does not hold, and fails. No heap, no
    /// lock; after a failure it does nothing.
    void append(std::span<const Sample> samples, std::int64_t time_ns) noexcept;
    void append(ChannelId channel, std::int64_t time_ns, const void* data) noexcept {
        const Sample sample{channel, data};
        append({&sample, 1}, time_ns);
    }

    /// True after a write error (disk full, device gone) or the clock's end: what was written before stays
    /// readable.
    bool failed() const noexcept;

    /// Empty while all is well, else the failure with the file's name and the reason.
    std::string status() const;

    /// Samples dropped so far because the disk was too slow (`drop_when_full`).
    std::uint64_t dropped() const noexcept;

    /// Writes what is left, the index and the footer, and closes the file. Throws std::runtime_error with
    /// the text of `status` when anything could not be written. A second call does nothing.
    void close();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace bf::recording

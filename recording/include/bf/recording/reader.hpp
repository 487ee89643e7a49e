#pragma once

#include "bf/recording/channel.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iosfwd>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace bf::recording {

/// One recorded signal: sample k was taken at `time_ns[k]`.
struct Channel {
    std::string name;  ///< dotted path, e.g. "controller.tau"
    std::string topic; ///< e.g. "/controller/tau"
    ChannelInfo info;
    std::vector<std::int64_t> time_ns;
    std::vector<std::byte> data; ///< the samples one after the other, each column-major

    std::size_t samples() const noexcept { return time_ns.size(); }

    /// Time of sample `k` in seconds.
    double time(std::size_t k) const noexcept { return static_cast<double>(time_ns[k]) / 1e9; }
    std::vector<double> times() const;
    /// The number of the last sample not after `time` (s), of the first where all are after it. There must be
    /// some.
    std::size_t sample_at(double time) const noexcept;

    /// Bytes of sample `k`.
    std::span<const std::byte> sample(std::size_t k) const noexcept;

    /// Element `element` (column-major, from 0) of sample `k`; exact for every element type.
    double value(std::size_t k, std::size_t element = 0) const noexcept;

    /// One element over all samples.
    std::vector<double> values(std::size_t element = 0) const;

    /// "tau" for a scalar, "tau[4]" or "tau[l_knee]" for a vector, "M[1][3]" for a matrix: these numbers
    /// count from 1.
    std::string element_name(std::size_t element) const;
};

struct Attachment {
    std::string name;
    std::string media_type;
    std::vector<std::byte> data;
    std::string text() const { return {reinterpret_cast<const char*>(data.data()), data.size()}; }
};

/// Everything a file holds.
struct Recording {
    /// In the order in which they were declared. One with several names stands under each.
    std::vector<Channel> channels;
    std::map<std::string, std::map<std::string, std::string>> metadata;
    std::vector<Attachment> attachments;
    bool complete = false;  ///< false when the file was cut or damaged: then the rest is what could be read
    std::string defect;     ///< what was found wrong, ten things at most; empty if complete
    bool unchecked = false; ///< a part of one of ours has no checksum, as our writer gives all: it was edited

    /// A signal by its path, or by that of its block or subsystem where this has no other in the recording.
    /// Throws std::runtime_error that names the recorded signals, or those of the block.
    const Channel& channel(std::string_view name) const;
    /// The same where one element may be named, by its name or by its number from 1: "robot.s[l_knee]".
    struct Found {
        const Channel& channel;
        std::optional<std::size_t> element; ///< column by column, from 0; nothing: all
    };
    Found find(std::string_view name) const;
};

struct LoadOptions {
    const std::atomic<bool>* given_up = nullptr; ///< looked at now and then: loading ends once it is true
    /// Of samples, where the file itself is not longer, and of what is unpacked.
    std::uint64_t most_bytes = std::uint64_t{4} << 30;
};

/// Reads a recording; of another program's each number in JSON or ROS 2's CDR is a channel, from t = 0 on.
/// What is cut off, fails its checksum, is not understood or is too much is left out, with `complete =
/// false`. Throws std::runtime_error when the file cannot be opened or is no recording at all, and when it is
/// given up.
Recording load(const std::filesystem::path& path, const LoadOptions& options = {});

/// The same from a stream that can seek; `name` stands for the path in errors.
Recording load(std::istream& stream, std::string_view name, const LoadOptions& options = {});

} // namespace bf::recording

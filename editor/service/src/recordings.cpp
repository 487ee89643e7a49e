#include "recordings.hpp"

#include "frame.hpp"

#include <algorithm>

namespace bf::service {

namespace {

constexpr std::size_t most_opened = 8;

} // namespace

SignalInfo described(int index, const std::string& path, const recording::ChannelInfo& info) {
    SignalInfo signal{index, path, static_cast<int>(info.elements()), info.element_names, info.unit};
    signal.rows = static_cast<int>(info.rows);
    for (const auto& [value, name] : info.names) signal.values.push_back({value, name});
    return signal;
}

void append_samples(std::string& frame, int index, const recording::Channel& channel) {
    const auto n = static_cast<std::uint32_t>(channel.info.elements());
    frame.reserve(frame.size() + channel.samples() * (20 + 8 * std::size_t{n}));
    for (std::size_t k = 0; k < channel.samples(); ++k) {
        append_piece(frame, static_cast<std::uint32_t>(index), 0, n, channel.time(k));
        for (std::size_t element = 0; element < n; ++element) append(frame, channel.value(k, element));
    }
}

Recorded Recordings::open(const std::filesystem::path& file, const std::string& name) {
    Opened opened{++number_, recording::load(file)};
    Recorded told{opened.number, name, {}, opened.recording.defect};
    int index = 0;
    for (const auto& channel : opened.recording.channels) {
        told.signals.push_back(described(index++, channel.name, channel.info));
        if (channel.samples() > 0) told.end = std::max(told.end, channel.time(channel.samples() - 1));
    }
    opened_.push_back(std::move(opened));
    if (opened_.size() > most_opened) opened_.erase(opened_.begin());
    return told;
}

std::optional<std::string> Recordings::samples(std::string_view what) const {
    for (const auto& [number, recording] : opened_) {
        const std::string prefix = std::to_string(number) + "/";
        if (!what.starts_with(prefix)) continue;
        for (std::size_t i = 0; i < recording.channels.size(); ++i) {
            if (what.substr(prefix.size()) != std::to_string(i)) continue;
            std::string bytes;
            append_samples(bytes, static_cast<int>(i), recording.channels[i]);
            return bytes;
        }
    }
    return {};
}

} // namespace bf::service

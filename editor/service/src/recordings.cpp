#include "recordings.hpp"

#include "frame.hpp"

#include <algorithm>

namespace bf::service {

namespace {

constexpr int most_opened = 8;

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

Recordings::Recordings(Post post, std::function<void(const Recorded&)> tell)
    : post_(std::move(post)), tell_(std::move(tell)) {}
Recordings::~Recordings() {
    for (const auto& opened : opened_) *opened.given_up = true;
}

int Recordings::read(int page, const std::filesystem::path& file, const std::string& name) {
    const auto given_up = std::make_shared<std::atomic<bool>>(false);
    opened_.push_back({++number_, page, given_up, {}});
    reader_.post([this, file, given_up, told = Recorded{number_, name}]() mutable {
        std::optional<recording::Recording> found;
        try {
            found = recording::load(file, {.given_up = given_up.get()});
        } catch (const std::exception& error) {
            told.failure = error.what();
        }
        if (*given_up) return;
        // A task is copied, and what a recording holds is long.
        auto kept = std::make_shared<std::optional<recording::Recording>>(std::move(found));
        post_([this, told = std::move(told), kept] { take(told, std::move(*kept)); });
    });
    return number_;
}

void Recordings::take(Recorded told, std::optional<recording::Recording> found) {
    const auto opened = std::ranges::find(opened_, told.number, &Opened::number);
    if (opened == opened_.end()) return; // it was closed
    if (found) {
        told.defect = found->defect;
        int index = 0;
        for (const auto& channel : found->channels) {
            told.signals.push_back(described(index++, channel.name, channel.info));
            if (channel.samples() > 0) told.end = std::max(told.end, channel.time(channel.samples() - 1));
        }
        opened->recording = std::move(found);
        const auto is_read = [](const Opened& one) { return one.recording.has_value(); };
        if (std::ranges::count_if(opened_, is_read) > most_opened)
            opened_.erase(std::ranges::find_if(opened_, is_read));
    } else {
        opened_.erase(opened);
    }
    tell_(told);
}

void Recordings::close(int number) {
    std::erase_if(opened_, [&](const Opened& one) {
        if (one.number != number) return false;
        *one.given_up = true;
        return true;
    });
}

void Recordings::leave(int page) {
    std::erase_if(opened_, [&](const Opened& one) {
        if (one.page != page || one.recording) return false;
        *one.given_up = true;
        return true;
    });
}

std::optional<std::string> Recordings::samples(std::string_view what) const {
    for (const auto& opened : opened_) {
        const std::string prefix = std::to_string(opened.number) + "/";
        if (!opened.recording || !what.starts_with(prefix)) continue;
        const auto& channels = opened.recording->channels;
        for (std::size_t i = 0; i < channels.size(); ++i) {
            if (what.substr(prefix.size()) != std::to_string(i)) continue;
            std::string bytes;
            append_samples(bytes, static_cast<int>(i), channels[i]);
            return bytes;
        }
    }
    return {};
}

} // namespace bf::service

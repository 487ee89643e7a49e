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
    for (auto& opened : opened_) opened.is_given_up = true;
}

int Recordings::read(int page, const std::filesystem::path& file, const std::string& name) {
    if (std::ranges::count_if(opened_, [](const Opened& one) { return !one.recording; }) >= most_opened)
        throw std::runtime_error(std::to_string(most_opened) +
                                 " recordings are being read; wait for one, or close one");
    Opened& opened = opened_.emplace_back(++number_, page);
    opened.reader->post([this, file, &opened, told = Recorded{number_, name}]() mutable {
        // A task is copied, and what a recording holds is long.
        const auto found = std::make_shared<std::optional<recording::Recording>>();
        try {
            *found = recording::load(file, {.given_up = &opened.is_given_up});
        } catch (const std::exception& error) {
            told.failure = error.what();
        }
        post_([this, told = std::move(told), found] { take(told, std::move(*found)); });
    });
    return number_;
}

void Recordings::take(Recorded told, std::optional<recording::Recording> found) {
    const auto opened = std::ranges::find(opened_, told.number, &Opened::number);
    if (opened->is_given_up || !found) {
        if (!opened->is_given_up) tell_(told);
        opened_.erase(opened);
        return;
    }
    told.defect = found->defect;
    int index = 0;
    for (const auto& channel : found->channels) {
        told.signals.push_back(described(index++, channel.name, channel.info));
        if (channel.samples() > 0) told.end = std::max(told.end, channel.time(channel.samples() - 1));
    }
    opened->recording = std::move(found);
    opened->reader.reset();
    const auto is_read = [](const Opened& one) { return one.recording.has_value(); };
    if (std::ranges::count_if(opened_, is_read) > most_opened)
        opened_.erase(std::ranges::find_if(opened_, is_read));
    tell_(told);
}

/// Those that are being read go when their readers have noticed.
template <class Which> void Recordings::give_up(const Which& which) {
    for (auto& opened : opened_)
        if (which(opened)) opened.is_given_up = true;
    opened_.remove_if([](const Opened& one) { return one.is_given_up && one.recording; });
}

void Recordings::close(int number) {
    give_up([&](const Opened& one) { return one.number == number; });
}

void Recordings::leave(int page) {
    give_up([&](const Opened& one) { return one.page == page && !one.recording; });
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

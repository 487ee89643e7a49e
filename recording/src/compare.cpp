#include "bf/recording/export.hpp"

#include "bf/base/numbers.hpp"

#include <algorithm>
#include <cstring>

namespace bf::recording {
namespace {

std::optional<Difference> compare(const Channel& a, const Channel& b) {
    if (a.info.type != b.info.type || a.info.rows != b.info.rows || a.info.cols != b.info.cols ||
        a.info.is_matrix != b.info.is_matrix)
        return Difference{a.name, 0, "the signal '" + a.name + "' has another type or shape"};
    const std::size_t common = std::min(a.samples(), b.samples());
    for (std::size_t k = 0; k < common; ++k) {
        const std::string at = "at " + number_text(a.time(k)) + " s the signal ";
        if (a.time_ns[k] != b.time_ns[k])
            return Difference{a.name, std::min(a.time(k), b.time(k)),
                              at + "'" + a.name + "' is sampled, in the other recording at " +
                                  number_text(b.time(k)) + " s"};
        if (std::memcmp(a.sample(k).data(), b.sample(k).data(), a.info.bytes()) == 0) continue;
        std::size_t i = 0;
        const std::size_t size = size_of(a.info.type);
        while (std::memcmp(&a.sample(k)[i * size], &b.sample(k)[i * size], size) == 0) ++i;
        return Difference{a.name, a.time(k),
                          at + "'" + a.element_name(i) + "' is " + number_text(a.value(k, i)) +
                              ", in the other recording " + number_text(b.value(k, i))};
    }
    if (a.samples() == b.samples()) return std::nullopt;
    const Channel& longer = a.samples() > b.samples() ? a : b;
    return Difference{a.name, longer.time(common),
                      "the signal '" + a.name + "' has " + std::to_string(a.samples()) +
                          " samples, in the other recording " + std::to_string(b.samples())};
}

const Channel* find(const Recording& recording, const std::string& name) {
    const auto found = std::find_if(recording.channels.begin(), recording.channels.end(),
                                    [&](const Channel& channel) { return channel.name == name; });
    return found == recording.channels.end() ? nullptr : &*found;
}

} // namespace

std::optional<Difference> first_difference(const Recording& a, const Recording& b) {
    std::optional<Difference> first;
    const auto keep_earlier = [&](std::optional<Difference> found) {
        if (found && (!first || found->time < first->time)) first = std::move(found);
    };
    for (const Channel& channel : a.channels) {
        const Channel* other = find(b, channel.name);
        keep_earlier(other ? compare(channel, *other)
                           : Difference{channel.name, 0,
                                        "the other recording lacks the signal '" + channel.name + "'"});
    }
    for (const Channel& channel : b.channels)
        if (!find(a, channel.name))
            keep_earlier(Difference{channel.name, 0,
                                    "only the other recording has the signal '" + channel.name + "'"});
    return first;
}

} // namespace bf::recording

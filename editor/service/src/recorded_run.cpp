#include "recorded_run.hpp"

#include "recordings.hpp"

#include <algorithm>
#include <map>

namespace bf::service {

RecordedRun::RecordedRun(const std::filesystem::path& file) : recording_(recording::load(file)) {
    for (const auto& channel : recording_.channels)
        if (channel.samples() > 0)
            state_.reached = std::max(state_.reached, channel.time(channel.samples() - 1));
    state_.time = state_.reached;
    state_.stop = state_.reached;
    state_.recorded = "blocks of plugins do not run in a browser; what was recorded can be looked at";
    if (const auto set = recording_.metadata.find("overrides"); set != recording_.metadata.end())
        for (const auto& [name, text] : set->second) // "000 Gain.Kp"
            state_.recorded += (name.starts_with("000 ") ? ", of a run with " : ", ") +
                               name.substr(name.find(' ') + 1) + " = " + text;
}

void RecordedRun::name_signals(const Diagram& diagram) {
    const SignalFinder finder(diagram);
    std::map<std::pair<int, int>, int> channels; // by node and slot
    signals_.clear();
    std::set<std::string> named;
    for (int i = 0; i < static_cast<int>(recording_.channels.size()); ++i) {
        const auto& [name, topic, info, times, data] = recording_.channels[static_cast<std::size_t>(i)];
        signals_.push_back(described(i, name, info));
        named.insert(name);
        if (const auto end = finder.find(name); end.node >= 0)
            channels.emplace(std::pair(end.node, end.slot), i);
    }
    for (const auto& signal : finder.all()) {
        const auto found = channels.find({signal.end.node, signal.end.slot});
        if (found == channels.end() || !named.insert(signal.path).second) continue;
        const auto& channel = recording_.channels[static_cast<std::size_t>(found->second)];
        signals_.push_back(described(found->second, signal.path, channel.info));
    }
    state_.state = Running::paused;
    state_.step = diagram.step;
}

std::string RecordedRun::samples(const std::set<int>& signals) const {
    std::string frame;
    for (const int index : signals)
        append_samples(frame, index, recording_.channels.at(static_cast<std::size_t>(index)));
    return frame;
}

void RecordedRun::look_at(double time) { state_.time = std::clamp(time, 0.0, state_.reached); }

} // namespace bf::service

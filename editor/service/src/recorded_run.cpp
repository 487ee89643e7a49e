#include "recorded_run.hpp"

#include "bf/run/replay.hpp"
#include "frame.hpp"
#include "recordings.hpp"

#include <algorithm>
#include <map>

namespace bf::service {

RecordedRun::RecordedRun(const std::filesystem::path& file, bool has_model)
    : recording_(recording::load(file)) {
    if (has_model) source_ = recorded_source(recording_);
    for (const auto& channel : recording_.channels)
        if (channel.samples() > 0)
            state_.reached = std::max(state_.reached, channel.time(channel.samples() - 1));
    state_.time = has_model ? 0 : state_.reached;
    state_.stop = state_.reached;
    state_.recorded = has_model
                          ? "this is a recording: it is looked at, and nothing is computed"
                          : "blocks of plugins do not run in a browser; what was recorded can be looked at";
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

std::string RecordedRun::show(std::shared_ptr<Sceneries> sceneries) {
    sceneries_ = nullptr;
    if (!sceneries) return {};
    held_.resize(recording_.channels.size());
    std::vector<Quantity> told;
    for (const auto& signal : signals_) {
        const auto index = static_cast<std::size_t>(signal.index);
        const auto& channel = recording_.channels[index];
        if (channel.info.type != recording::ElementType::Double || channel.samples() == 0) continue;
        held_[index].resize(channel.info.elements());
        told.push_back(
            {signal.path, Type::float64, channel.info, 0, reinterpret_cast<std::byte*>(held_[index].data())});
    }
    try {
        for (const auto& scenery : *sceneries) scenery->bind(told);
    } catch (const std::exception& error) {
        return "the recording does not tell where things are: " + std::string(error.what()) +
               "; record that signal";
    }
    sceneries_ = std::move(sceneries);
    return {};
}

std::string RecordedRun::places() {
    std::string frame;
    if (!sceneries_) return frame;
    for (std::size_t i = 0; i < held_.size(); ++i) {
        if (held_[i].empty()) continue;
        const auto& channel = recording_.channels[i];
        const std::size_t sample = channel.sample_at(state_.time);
        for (std::size_t k = 0; k < held_[i].size(); ++k) held_[i][k] = channel.value(sample, k);
    }
    for (std::size_t i = 0; i < sceneries_->size(); ++i) {
        values_.clear();
        (*sceneries_)[i]->look(values_);
        append_piece(frame, static_cast<std::uint32_t>(first_world + i), 0, values_.size(), state_.time);
        for (const double value : values_) append(frame, value);
    }
    return frame;
}

} // namespace bf::service

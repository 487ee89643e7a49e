#include "bf/engine/recorder.hpp"

#include "bf/base/numbers.hpp"
#include "bf/engine/snapshot.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace bf {

namespace {

recording::ElementType element_type(Type type) {
    using recording::ElementType;
    switch (type) {
    case Type::float64: return ElementType::Double;
    case Type::float32: return ElementType::Single;
    case Type::int8: return ElementType::Int8;
    case Type::uint8: return ElementType::Uint8;
    case Type::int16: return ElementType::Int16;
    case Type::uint16: return ElementType::Uint16;
    case Type::int32: return ElementType::Int32;
    case Type::uint32: return ElementType::Uint32;
    case Type::boolean: return ElementType::Boolean;
    }
    return ElementType::Double;
}

recording::Metadata panels(const Diagram& diagram) {
    recording::Metadata text;
    int number = 0;
    for (const auto& panel : diagram.plots) {
        std::string signals;
        for (const auto& signal : panel.signals) signals += (signals.empty() ? "" : "\n") + signal.path;
        text[std::to_string(100 + number++) + " " + panel.title] = signals; // a map sorts by key
    }
    return text;
}

/// What reaches the diagram from outside.
std::vector<SignalName> outside_signals(const Simulation& simulation) {
    const Diagram& diagram = simulation.diagram();
    std::vector<SignalName> signals = diagram.inputs;
    for (const int node : simulation.context().devices()) {
        const auto& slots = diagram.nodes[static_cast<std::size_t>(node)].block->declaration().slots;
        for (std::size_t i = 0; i < slots.size(); ++i)
            if (const Node::End end{node, static_cast<int>(i)}; slots[i].role == Role::output)
                signals.push_back({diagram.end_path(end), end});
    }
    return signals;
}

recording::Metadata numbered(const std::vector<std::pair<std::string, std::string>>& overrides) {
    recording::Metadata texts;
    for (std::size_t i = 0; i < overrides.size(); ++i) {
        std::string number = std::to_string(i);
        number.insert(0, number.size() < 3 ? 3 - number.size() : 0, '0');
        texts[number + " " + overrides[i].first] = overrides[i].second;
    }
    return texts;
}

} // namespace

int rate_of(const Diagram& diagram, const Node::End& end) {
    return std::max(diagram.nodes[static_cast<std::size_t>(end.node)].rate, constant_rate);
}

recording::ChannelInfo channel_info(const Diagram& diagram, const Node::End& end) {
    const Slot& slot = diagram.slot(end);
    recording::ChannelInfo info;
    info.type = element_type(slot.type);
    info.rows = static_cast<std::uint32_t>(slot.size.rows);
    info.cols = static_cast<std::uint32_t>(slot.size.cols);
    info.is_matrix = slot.size.is_matrix;
    if (slot.unit.kind == Unit::Kind::exact && slot.unit.text != "1") info.unit = slot.unit.text;
    info.doc = slot.doc;
    info.period = diagram.period(rate_of(diagram, end));
    for (const auto& named : diagram.enumerated)
        if (named.end.node == end.node && named.end.slot == end.slot) info.names = named.names;
    info.element_names = diagram.element_names(end);
    info.is_held = !diagram.rates[static_cast<std::size_t>(rate_of(diagram, end))].is_continuous;
    return info;
}

Recorder::Recorder(const Simulation& simulation, const std::vector<SignalName>& signals,
                   const std::filesystem::path& file, const ModelSource& source,
                   const recording::WriterOptions& options)
    : writer_(file, {{"model", simulation.diagram().name}, {"step", number_text(simulation.diagram().step)}},
              options) {
    const Diagram& diagram = simulation.diagram();
    // A subsystem's output is the signal of a block inside: recorded once, under the name that comes first.
    using Names = std::vector<std::string>;
    std::vector<std::pair<Node::End, Names>> named;
    std::map<std::pair<int, int>, std::size_t> position;
    const auto names_of = [&](const Node::End& end) -> Names& {
        const auto [found, is_new] = position.try_emplace({end.node, end.slot}, named.size());
        if (is_new) named.push_back({end, {}});
        return named[found->second].second;
    };
    for (const auto& signal : signals)
        if (Names& names = names_of(signal.end);
            std::find(names.begin(), names.end(), signal.path) == names.end())
            names.push_back(signal.path);
    for (const auto& signal : outside_signals(simulation))
        if (Names& names = names_of(signal.end); names.empty()) names.push_back(signal.path);

    for (const auto& [end, names] : named) {
        auto info = channel_info(diagram, end);
        info.other_names.assign(names.begin() + 1, names.end());
        samples_[rate_of(diagram, end)].push_back(
            {writer_.add_channel(names.front(), info), simulation.context().data(end.node, end.slot)});
    }
    writer_.add_metadata("plots", panels(diagram));
    if (!source.texts.empty()) {
        writer_.add_metadata("run", {{"file", source.file.string()}});
        writer_.add_metadata("overrides", numbered(source.overrides));
    }
    for (const auto& [path, text] : source.texts)
        writer_.add_attachment(path == source.file
                                   ? "model"
                                   : "model/" +
                                         path.lexically_relative(source.file.parent_path()).generic_string(),
                               "application/yaml", text);
    writer_.begin();
}

void Recorder::observe(const Simulation& simulation) noexcept {
    const auto time = static_cast<std::int64_t>(std::llround(simulation.time() * 1e9));
    const bool are_constants_due = are_constants_due_.exchange(false);
    for (const auto& [rate, samples] : samples_)
        if (rate == constant_rate ? are_constants_due : simulation.is_hit(rate))
            writer_.append(samples, time);
}

void Recorder::checkpoint(const Simulation& simulation) {
    writer_.add_attachment("checkpoint/" + std::to_string(simulation.steps()), "application/octet-stream",
                           make_snapshot(simulation));
}

void Recorder::parameter_changed(std::int64_t step, const std::string& path,
                                 const std::vector<double>& values) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : " ") + number_text(value);
    writer_.add_metadata("parameter change " + std::to_string(changes_++),
                         {{"step", std::to_string(step)}, {"name", path}, {"values", text}});
    are_constants_due_ = true;
}

} // namespace bf

#include "bf/engine/recorder.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <unordered_set>

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

/// The shortest text that reads back as the same number.
std::string digits(double number) {
    char text[32];
    return {text, std::to_chars(text, text + sizeof text, number).ptr};
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
    return info;
}

Recorder::Recorder(const Diagram& diagram, const std::vector<SignalName>& signals,
                   const std::filesystem::path& file, const std::string& model_text,
                   const recording::WriterOptions& options)
    : writer_(file, {{"model", diagram.name}, {"step", digits(diagram.step)}}, options) {
    std::unordered_set<std::string> seen;
    for (const auto& signal : signals) {
        if (!seen.insert(signal.path).second) continue;
        channels_.push_back({writer_.add_channel(signal.path, channel_info(diagram, signal.end)), signal.end,
                             rate_of(diagram, signal.end)});
    }
    writer_.add_metadata("plots", panels(diagram));
    if (!model_text.empty()) writer_.add_attachment("model", "application/yaml", model_text);
    writer_.begin();
}

void Recorder::observe(const Simulation& simulation) noexcept {
    const auto time = static_cast<std::int64_t>(std::llround(simulation.time() * 1e9));
    for (const auto& channel : channels_)
        if (channel.rate == constant_rate ? simulation.steps() == 0 : simulation.is_hit(channel.rate))
            writer_.append(channel.id, time, simulation.context().data(channel.end.node, channel.end.slot));
}

} // namespace bf

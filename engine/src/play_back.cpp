#include "bf/engine/play_back.hpp"

#include "bf/engine/simulation.hpp"

#include <algorithm>

namespace bf {

namespace {

/// A device in a replay: has ports and resources like the block itself, but does nothing.
class Silent final : public Block {
  public:
    explicit Silent(std::unique_ptr<Block> block) : block_(std::move(block)) {
        Declaration& d = detail::declared_by(*this);
        d = block_->declaration();
        d.output_rules.clear();
        d.update_rules.clear();
        d.derivative_rules.clear();
        resolution() = block_->resolution();
    }

  private:
    std::unique_ptr<Block> block_; // what the declaration's functions refer to
};

bool is_same(const Node::End& a, const Node::End& b) { return a.node == b.node && a.slot == b.slot; }

bool is_read(const Diagram& diagram, const Node::End& end) {
    return std::any_of(diagram.nodes.begin(), diagram.nodes.end(), [&](const DiagramNode& node) {
        return std::any_of(node.sources.begin(), node.sources.end(),
                           [&](const Node::End& source) { return is_same(source, end); });
    });
}

} // namespace

std::vector<int> play_back_devices(Diagram& diagram, const recording::Recording& recording) {
    const std::vector<int> devices = Simulation(diagram).context().devices();
    Plan& plan = diagram.plan;
    for (const int device : devices) {
        auto& node = diagram.nodes[static_cast<std::size_t>(device)];
        const auto& slots = node.block->resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            const Node::End end{device, static_cast<int>(i)};
            const bool is_recorded =
                std::any_of(recording.channels.begin(), recording.channels.end(), [&](const auto& channel) {
                    return is_same(diagram.find_signal(channel.name), end);
                });
            if (slots[i].role == Role::output && !is_recorded && is_read(diagram, end))
                throw RunError(
                    diagram.end_path(end) +
                    ": comes from a device, which a replay does not open, and is not in the recording");
        }
        node.block = std::make_unique<Silent>(std::move(node.block));
        node.methods = {};
        const auto silence = [&](std::vector<Segment>& segments) {
            for (auto& segment : segments)
                std::erase_if(segment.activities, [&](const Activity& a) { return a.node == device; });
        };
        for (auto* phase : {&plan.outputs, &plan.updates, &plan.derivatives, &plan.guards}) silence(*phase);
        for (auto& loop : plan.loops) {
            silence(loop.outputs);
            silence(loop.updates);
        }
    }
    return devices;
}

} // namespace bf

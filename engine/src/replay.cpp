#include "bf/engine/replay.hpp"

#include "bf/base/numbers.hpp"
#include "bf/engine/snapshot.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <tuple>

namespace bf {

namespace {

constexpr std::string_view checkpoint_prefix = "checkpoint/", file_prefix = "model/",
                           change_prefix = "parameter change ";

template <class T> T number(std::string_view text, const std::string& where) {
    const auto value = number_of<T>(text);
    if (!value)
        throw RunError("the recording is damaged: '" + std::string(text) + "' in " + where + " is no number");
    return *value;
}

std::string text_of(const std::map<std::string, std::string>& texts, const char* key) {
    const auto found = texts.find(key);
    return found == texts.end() ? std::string() : found->second;
}

/// A device in a replay: has ports and resources like the block itself, but does nothing.
class Silent final : public Block {
  public:
    explicit Silent(std::unique_ptr<Block> block) : block_(std::move(block)) {
        declaration() = block_->declaration();
        declaration().output_rules.clear();
        declaration().update_rules.clear();
        declaration().derivative_rules.clear();
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

ModelSource recorded_source(const recording::Recording& recording) {
    const auto run = recording.metadata.find("run");
    const std::string file = run == recording.metadata.end() ? "" : text_of(run->second, "file");
    ModelSource source{file, {}, {}};
    for (const auto& attachment : recording.attachments)
        if (attachment.name == "model")
            source.texts[source.file] = attachment.text();
        else if (attachment.name.starts_with(file_prefix))
            source.texts[(source.file.parent_path() / attachment.name.substr(file_prefix.size()))
                             .lexically_normal()] = attachment.text();
    if (file.empty() || !source.texts.contains(source.file))
        throw RunError("the recording does not hold its model, so it cannot be run again; bf run --record "
                       "makes recordings that do");
    if (const auto overrides = recording.metadata.find("overrides"); overrides != recording.metadata.end())
        for (const auto& [name, text] : overrides->second)
            source.overrides.emplace_back(name.substr(name.find(' ') + 1), text);
    return source;
}

std::vector<int> play_back_devices(Diagram& diagram, const recording::Recording& recording) {
    const std::vector<int> devices = Simulation(diagram).context().devices();
    Plan& plan = diagram.plan;
    for (const int device : devices) {
        auto& node = diagram.nodes[static_cast<std::size_t>(device)];
        const auto& slots = node.block->declaration().slots;
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

Replay::Replay(Simulation& simulation, const recording::Recording& recording, const std::vector<int>& devices)
    : simulation_(simulation), recording_(recording) {
    const Diagram& diagram = simulation.diagram();
    for (const auto& channel : recording.channels) {
        Node::End end = diagram.find_signal(channel.name);
        bool is_given = false;
        for (const auto& input : diagram.inputs) {
            if (input.path == channel.name) end = input.end;
            is_given = is_given || is_same(input.end, end);
        }
        if (end.node < 0)
            throw RunError("the model has no signal '" + channel.name + "', but the recording has");
        const Slot& slot = diagram.slot(end);
        if (channel.info.bytes() != static_cast<std::size_t>(slot.size.count() * bytes(slot.type)))
            throw RunError("the signal '" + channel.name + "' of the recording has another type or size");
        const Track track{&channel, end, diagram.nodes[static_cast<std::size_t>(end.node)].rate};
        is_given = is_given || std::find(devices.begin(), devices.end(), end.node) != devices.end();
        (is_given ? played_ : compared_).push_back(track);
        if (channel.samples() > 0) end_ns_ = std::max(end_ns_, channel.time_ns.back());
    }
    if (end_ns_ < 0) throw RunError("the recording holds no samples, so there is nothing to compare");
    check_times();
    read_changes();
    simulation.add_observer(*this);
}

/// A damaged time stamp would make a replay endless.
void Replay::check_times() const {
    const Diagram& diagram = simulation_.diagram();
    if (end() > diagram.stop + diagram.step)
        throw RunError("the recording is damaged: it has a sample at " + number_text(end()) +
                       " s, but the run ends at " + number_text(diagram.stop) + " s");
    if (std::isfinite(diagram.stop)) return;
    constexpr double longest_pause = 1e7; // steps without any sample
    std::vector<std::int64_t> times{0};
    for (const auto& channel : recording_.channels)
        times.insert(times.end(), channel.time_ns.begin(), channel.time_ns.end());
    std::sort(times.begin(), times.end());
    for (std::size_t i = 1; i < times.size(); ++i)
        if (static_cast<double>(times[i] - times[i - 1]) / 1e9 > longest_pause * diagram.step)
            throw RunError("the recording is damaged: it has no sample between " +
                           number_text(static_cast<double>(times[i - 1]) / 1e9) + " s and " +
                           number_text(static_cast<double>(times[i]) / 1e9) + " s");
}

double Replay::end() const { return static_cast<double>(end_ns_) / 1e9; }

std::int64_t Replay::time_ns() const {
    return static_cast<std::int64_t>(std::llround(simulation_.time() * 1e9));
}

void Replay::read_changes() {
    for (const auto& [name, change] : recording_.metadata) {
        if (!name.starts_with(change_prefix)) continue;
        Change read{number<std::int64_t>(text_of(change, "step"), name),
                    number<int>(std::string_view(name).substr(change_prefix.size()), name),
                    text_of(change, "name"),
                    {}};
        const std::string values = text_of(change, "values");
        for (std::size_t at = 0; at < values.size();) {
            const std::size_t blank = std::min(values.find(' ', at), values.size());
            read.values.push_back(number<double>(std::string_view(values).substr(at, blank - at), name));
            at = blank + 1;
        }
        changes_.push_back(std::move(read));
    }
    std::sort(changes_.begin(), changes_.end(), [](const Change& a, const Change& b) {
        return std::tie(a.step, a.number) < std::tie(b.step, b.number);
    });
}

void Replay::start(double from) {
    if (from > end())
        throw RunError("the recording ends at " + number_text(end()) + " s, before " + number_text(from) +
                       " s");
    std::int64_t begin_ns = end_ns_;
    for (const auto& channel : recording_.channels)
        if (channel.samples() > 0) begin_ns = std::min(begin_ns, channel.time_ns.front());
    const double step = simulation_.diagram().step;
    const double latest = std::max(from, static_cast<double>(begin_ns) / 1e9) + step / 2;
    const recording::Attachment* checkpoint = nullptr;
    std::int64_t its_step = -1;
    for (const auto& attachment : recording_.attachments) {
        if (!attachment.name.starts_with(checkpoint_prefix)) continue;
        const auto k = number<std::int64_t>(
            std::string_view(attachment.name).substr(checkpoint_prefix.size()), attachment.name);
        checkpoints_.insert(k);
        if (static_cast<double>(k) * step > latest || k <= its_step) continue;
        checkpoint = &attachment;
        its_step = k;
    }
    simulation_.start();
    if (checkpoint) restore_snapshot(simulation_, checkpoint->data, checkpoint->name);
    restored_ = its_step;
    const std::int64_t now = time_ns();
    for (auto* tracks : {&compared_, &played_})
        for (auto& track : *tracks) {
            const auto& times = track.channel->time_ns;
            track.next =
                static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), now) - times.begin());
            if (tracks == &played_ && track.next > 0) --track.next; // its value is held
        }
    while (next_change_ < changes_.size() && changes_[next_change_].step < simulation_.steps())
        ++next_change_;
}

bool Replay::step() {
    if (!difference_.empty() || time_ns() > end_ns_) return false;
    const std::int64_t now = time_ns();
    for (auto& track : played_)
        for (const auto& times = track.channel->time_ns;
             track.next < times.size() && times[track.next] <= now; ++track.next) {
            const auto sample = track.channel->sample(track.next);
            std::memcpy(simulation_.context().data(track.end.node, track.end.slot), sample.data(),
                        sample.size());
        }
    for (; next_change_ < changes_.size() && changes_[next_change_].step == simulation_.steps();
         ++next_change_) {
        const auto& change = changes_[next_change_];
        simulation_.set_parameter(change.name, change.values);
        if (recorder_) recorder_->parameter_changed(change.step, change.name, change.values);
    }
    // Some solvers begin anew where a snapshot is taken.
    if (checkpoints_.contains(simulation_.steps()) && simulation_.steps() != restored_) {
        static_cast<void>(simulation_.snapshot());
        if (recorder_) recorder_->checkpoint(simulation_);
    }
    if (!simulation_.step()) {
        const bool goes_on = std::any_of(compared_.begin(), compared_.end(), [&](const Track& track) {
            return track.next < track.channel->samples();
        });
        if (difference_.empty() && goes_on)
            difference_ = "at " + number_text(simulation_.time()) +
                          " s the replay fails, and the recording goes on: " + simulation_.failure();
        return false;
    }
    return difference_.empty();
}

void Replay::observe(const Simulation& simulation) noexcept {
    for (auto& track : compared_)
        if (difference_.empty()) compare(track, track.rate > constant_rate && simulation.is_hit(track.rate));
}

void Replay::compare(Track& track, bool is_hit) {
    const auto& channel = *track.channel;
    const std::int64_t now = time_ns();
    if (track.next == channel.samples() || channel.time_ns[track.next] > now) {
        missing_ += is_hit && track.next < channel.samples();
        return;
    }
    const auto at = [&] { return "at " + number_text(channel.time(track.next)) + " s '"; };
    const bool is_held = track.rate > constant_rate && !is_hit;
    if (is_held && simulation_.shows_event()) return; // its sample of this instant is still to come
    if (channel.time_ns[track.next] < now || is_held) {
        difference_ = at() + channel.name + "' has a sample in the recording, but none in the replay";
        return;
    }
    const auto sample = channel.sample(track.next);
    const auto* data =
        static_cast<const std::byte*>(simulation_.context().data(track.end.node, track.end.slot));
    if (std::memcmp(data, sample.data(), sample.size()) != 0) {
        std::size_t i = 0;
        const std::size_t size = recording::size_of(channel.info.type);
        while (std::memcmp(data + i * size, &sample[i * size], size) == 0) ++i;
        const Slot& slot = simulation_.diagram().slot(track.end);
        difference_ = at() + channel.element_name(i) + "' is " +
                      number_text(read_value(data, slot.type, static_cast<int>(i))) + ", in the recording " +
                      number_text(channel.value(track.next, i));
        return;
    }
    ++samples_;
    ++track.next;
}

} // namespace bf

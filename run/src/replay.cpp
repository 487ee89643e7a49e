#include "bf/run/replay.hpp"

#include "bf/base/numbers.hpp"
#include "bf/run/snapshot.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <tuple>

namespace bf {

namespace {

constexpr std::string_view checkpoint_prefix = "checkpoint/", file_prefix = "model/",
                           change_prefix = "parameter change ", edit_prefix = "edit ";

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
        throw RunError(
            recording.complete
                ? "the recording does not hold its model, so it cannot be run again; bf run --record makes "
                  "recordings that do"
                : "the recording was cut or damaged before its model, so it cannot be run again (" +
                      recording.defect + "); record it again");
    if (const auto overrides = recording.metadata.find("overrides"); overrides != recording.metadata.end())
        for (const auto& [name, text] : overrides->second)
            source.overrides.emplace_back(name.substr(name.find(' ') + 1), text);
    return source;
}

Replay::Replay(Run& run, const recording::Recording& recording) : run_(run), recording_(recording) {
    if (const auto served = recording.metadata.find("served"); served != recording.metadata.end())
        throw RunError(
            "the recording is of a robot that was served (" + text_of(served->second, "to") +
            "), and what its controllers commanded is not in it, so it cannot run again; replay the "
            "recording of a controller, which has what the robot measured");
    std::vector<Quantity> all = run.outside();
    std::set<const std::byte*> given;
    for (const auto& signal : all) given.insert(signal.data);
    for (auto& signal : run.signals()) all.push_back(std::move(signal));
    std::map<std::string_view, const Quantity*> by_path;
    for (const auto& signal : all) by_path.emplace(signal.path, &signal);
    const auto signal_of = [&](const std::string& path) -> const Quantity& {
        if (const auto found = by_path.find(path); found != by_path.end()) return *found->second;
        try {
            return find(all, path);
        } catch (const RunError&) {
            throw RunError("the model has no signal '" + path + "', but the recording has");
        }
    };
    for (const auto& channel : recording.channels) {
        const Quantity& signal = signal_of(channel.name);
        if (channel.info.bytes() != signal.info.bytes())
            throw RunError("the signal '" + channel.name + "' of the recording has another type or size");
        (given.contains(signal.data) ? played_ : compared_).push_back({&channel, signal});
        if (channel.samples() > 0) end_ns_ = std::max(end_ns_, channel.time_ns.back());
    }
    if (end_ns_ < 0) throw RunError("the recording holds no samples, so there is nothing to compare");
    check_times();
    read_changes();
    find_edit();
    run.add_observer(*this);
}

/// A damaged time stamp would make a replay endless.
void Replay::check_times() const {
    const double stop = run_.stop_time(), step = run_.period();
    if (end() > stop + step)
        throw RunError("the recording is damaged: it has a sample at " + number_text(end()) +
                       " s, but the run ends at " + number_text(stop) + " s");
    if (std::isfinite(stop)) return;
    constexpr double longest_pause = 1e7; // steps without any sample
    std::vector<std::int64_t> times{0};
    for (const auto& channel : recording_.channels)
        times.insert(times.end(), channel.time_ns.begin(), channel.time_ns.end());
    std::sort(times.begin(), times.end());
    for (std::size_t i = 1; i < times.size(); ++i)
        if (static_cast<double>(times[i] - times[i - 1]) / 1e9 > longest_pause * step)
            throw RunError("the recording is damaged: it has no sample between " +
                           number_text(static_cast<double>(times[i - 1]) / 1e9) + " s and " +
                           number_text(static_cast<double>(times[i]) / 1e9) + " s");
}

double Replay::end() const { return static_cast<double>(end_ns_) / 1e9; }

std::int64_t Replay::time_ns() const { return static_cast<std::int64_t>(std::llround(run_.time() * 1e9)); }

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

void Replay::find_edit() {
    for (const auto& [name, edit] : recording_.metadata) {
        if (!name.starts_with(edit_prefix)) continue;
        const double time =
            static_cast<double>(number<std::int64_t>(text_of(edit, "step"), name)) * run_.period();
        edited_ = std::min(edited_.value_or(time), time);
    }
    if (!edited_) return;
    const double last = std::round((*edited_ - run_.period()) * 1e9); // of the step before
    if (!(last >= 0))
        throw RunError("the model was edited before the first step, so nothing can be compared");
    if (last < static_cast<double>(end_ns_)) end_ns_ = static_cast<std::int64_t>(last);
}

void Replay::start(double from) {
    if (from > end())
        throw RunError("the recording ends at " + number_text(end()) + " s, before " + number_text(from) +
                       " s");
    std::int64_t begin_ns = end_ns_;
    for (const auto& channel : recording_.channels)
        if (channel.samples() > 0) begin_ns = std::min(begin_ns, channel.time_ns.front());
    const double step = run_.period();
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
    for (; next_change_ < changes_.size() && changes_[next_change_].step < 0; ++next_change_) make_change();
    run_.start();
    if (checkpoint) restore_snapshot(run_, checkpoint->data, checkpoint->name);
    restored_ = its_step;
    const std::int64_t now = time_ns();
    if (checkpoint) restored_ns_ = now;
    for (auto* tracks : {&compared_, &played_})
        for (auto& track : *tracks) {
            const auto& times = track.channel->time_ns;
            track.next =
                static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), now) - times.begin());
            if (tracks == &played_ && track.next > 0) --track.next; // its value is held
        }
    while (next_change_ < changes_.size() && changes_[next_change_].step < run_.steps()) ++next_change_;
}

void Replay::make_change() {
    const auto& change = changes_[next_change_];
    run_.set_parameter(change.name, change.values);
    if (recorder_) recorder_->parameter_changed(change.step, change.name, change.values);
}

bool Replay::step() {
    if (!difference_.empty() || time_ns() > end_ns_) return false;
    const std::int64_t now = time_ns();
    for (auto& track : played_)
        for (const auto& times = track.channel->time_ns;
             track.next < times.size() && times[track.next] <= now; ++track.next) {
            const auto sample = track.channel->sample(track.next);
            std::memcpy(track.signal.data, sample.data(), sample.size());
        }
    for (; next_change_ < changes_.size() && changes_[next_change_].step == run_.steps(); ++next_change_)
        make_change();
    // Some solvers begin anew where a snapshot is taken.
    if (checkpoints_.contains(run_.steps()) && run_.steps() != restored_) {
        static_cast<void>(run_.snapshot());
        if (recorder_) recorder_->checkpoint(run_);
    }
    if (!run_.step()) {
        const bool goes_on = std::any_of(compared_.begin(), compared_.end(), [&](const Track& track) {
            return track.next < track.channel->samples();
        });
        if (difference_.empty() && goes_on)
            difference_ = "at " + number_text(run_.time()) +
                          " s the replay fails, and the recording goes on: " + run_.failure();
        return false;
    }
    if (time_ns() > end_ns_ && !edited_) // what follows an edit is another model's
        for (const auto& track : compared_)
            if (difference_.empty() && track.next < track.channel->samples()) report_missing(track);
    return difference_.empty();
}

void Replay::observe(const Run& run) noexcept {
    for (auto& track : compared_)
        if (difference_.empty()) compare(track, track.signal.rate > 0 && run.is_hit(track.signal.rate));
    if (difference_.empty() || run.shows_event()) return;
    // A sample that has not come is nearer to the cause than values that differ.
    for (const auto& track : compared_)
        if (track.signal.rate > 0 && !run.is_hit(track.signal.rate) &&
            track.next < track.channel->samples() && track.channel->time_ns[track.next] == time_ns())
            return report_missing(track);
}

void Replay::report_missing(const Track& track) {
    difference_ = "at " + number_text(track.channel->time(track.next)) + " s '" + track.channel->name +
                  "' has a sample in the recording, but none in the replay";
}

/// Steps and events may share a nanosecond; their samples come in the order in which they were recorded.
void Replay::compare(Track& track, bool is_hit) {
    const auto& channel = *track.channel;
    const std::int64_t now = time_ns();
    const std::byte* data = track.signal.data;
    const bool is_held = track.signal.rate > 0 && !is_hit;
    const auto is_same = [&] {
        return std::memcmp(data, channel.sample(track.next).data(), channel.info.bytes()) == 0;
    };
    const auto is_in = [&](std::size_t k, std::int64_t instant) {
        return k < channel.samples() && channel.time_ns[k] == instant;
    };
    // An event in the nanosecond of the restored checkpoint may have been before it.
    while (is_in(track.next, restored_ns_) &&
           (now > restored_ns_ || (is_in(track.next + 1, restored_ns_) && !is_held && !is_same())))
        ++track.next;
    if (track.next == channel.samples() || channel.time_ns[track.next] > now) {
        missing_ += is_hit && track.next < channel.samples();
        return;
    }
    if (channel.time_ns[track.next] < now) return report_missing(track);
    if (is_held) return; // its sample of this nanosecond is still to come
    if (!is_same()) {
        const auto sample = channel.sample(track.next);
        std::size_t i = 0;
        const std::size_t size = recording::size_of(channel.info.type);
        while (std::memcmp(data + i * size, &sample[i * size], size) == 0) ++i;
        difference_ = "at " + number_text(channel.time(track.next)) + " s '" + channel.element_name(i) +
                      "' is " + number_text(track.signal[static_cast<int>(i)]) + ", in the recording " +
                      number_text(channel.value(track.next, i));
        return;
    }
    ++samples_;
    ++track.next;
}

} // namespace bf

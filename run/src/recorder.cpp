#include "bf/run/recorder.hpp"

#include "bf/base/numbers.hpp"
#include "bf/run/snapshot.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace bf {

namespace {

recording::Metadata panels(const Run& run) {
    recording::Metadata text;
    int number = 0;
    for (const auto& panel : run.plots()) {
        std::string signals;
        for (const auto& signal : panel.signals) signals += (signals.empty() ? "" : "\n") + signal;
        text[std::to_string(100 + number++) + " " + panel.title] = signals; // a map sorts by key
    }
    return text;
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

std::vector<Quantity> to_record(const Run& run, const std::vector<Quantity>& signals) {
    std::vector<Quantity> all;
    std::map<std::pair<const std::byte*, std::size_t>, std::size_t> position;
    const auto add = [&](const Quantity& signal, bool has_new_name) {
        if (signal.info.elements() == 0) return;
        const auto [found, is_new] = position.try_emplace({signal.data, signal.info.bytes()}, all.size());
        if (is_new) return static_cast<void>(all.emplace_back(signal));
        Quantity& known = all[found->second];
        auto& others = known.info.other_names;
        if (has_new_name && known.path != signal.path &&
            std::find(others.begin(), others.end(), signal.path) == others.end())
            others.push_back(signal.path);
    };
    for (const auto& signal : signals) add(signal, true);
    for (const auto& signal : run.outside()) add(signal, false);
    return all;
}

Recorder::Recorder(const Run& run, const std::vector<Quantity>& signals, const std::filesystem::path& file,
                   const ModelSource& source, const recording::WriterOptions& options)
    : writer_(file, {{"model", run.name()}, {"step", number_text(run.period())}}, options) {
    for (const auto& signal : to_record(run, signals)) {
        const auto id = writer_.add_channel(signal.path, signal.info);
        channels_.push_back({signal.path, signal.type, signal.info.rows, signal.info.cols, id});
        samples_[signal.rate].push_back({id, signal.data});
    }
    writer_.add_metadata("plots", panels(run));
    if (!source.texts.empty()) {
        writer_.add_metadata("run", {{"file", source.file.string()}});
        writer_.add_metadata("overrides", numbered(source.overrides));
    }
    attach("", source);
    writer_.begin();
}

void Recorder::attach(const std::string& prefix, const ModelSource& source) {
    for (const auto& [path, text] : source.texts)
        writer_.add_attachment(
            prefix + (path == source.file
                          ? "model"
                          : "model/" + path.lexically_relative(source.file.parent_path()).generic_string()),
            "application/yaml", text);
}

void Recorder::observe(const Run& run) noexcept { append(run, samples_); }

void Recorder::append(const Run& run, const Samples& all) noexcept {
    const double ns = run.time() * 1e9;
    const std::int64_t time = ns < 0x1p63 ? std::llround(ns) : -1; // which the writer refuses
    const bool are_constants_due = are_constants_due_.exchange(false);
    for (const auto& [rate, samples] : all)
        if (rate == 0 ? are_constants_due : run.is_hit(rate)) writer_.append(samples, time);
}

void Recorder::checkpoint(const Run& run) {
    writer_.add_attachment("checkpoint/" + std::to_string(run.steps()), "application/octet-stream",
                           make_snapshot(run));
}

void Recorder::parameter_changed(std::int64_t step, const std::string& path,
                                 const std::vector<double>& values, const std::string& who) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : " ") + number_text(value);
    recording::Metadata change{{"step", std::to_string(step)}, {"name", path}, {"values", text}};
    if (!who.empty()) change["who"] = who;
    writer_.add_metadata("parameter change " + std::to_string(changes_++), change);
    are_constants_due_ = true;
}

void Recorder::controlled(double time, double clock, const std::string& who, const std::string& what) {
    writer_.add_metadata(
        "control " + std::to_string(controls_++),
        {{"time", number_text(time)}, {"clock", number_text(clock)}, {"who", who}, {"what", what}});
}

class Recorder::Continued final : public Run::Observer {
  public:
    Continued(Recorder& recorder, Samples samples) : recorder_(recorder), samples_(std::move(samples)) {}
    void observe(const Run& run) noexcept override { recorder_.append(run, samples_); }

  private:
    Recorder& recorder_;
    const Samples samples_;
};

std::unique_ptr<Run::Observer> Recorder::continued(const Run& run) {
    std::map<std::string, Quantity> there;
    for (const auto& signals : {run.recorded(), run.signals(), run.outside()}) // the model's own names first
        for (const auto& signal : signals) there.emplace(signal.path, signal);
    Samples samples;
    for (const auto& channel : channels_)
        if (const auto found = there.find(channel.path);
            found != there.end() && found->second.type == channel.type &&
            found->second.info.rows == channel.rows && found->second.info.cols == channel.cols)
            samples[found->second.rate].push_back({channel.id, found->second.data});
    return std::make_unique<Continued>(*this, std::move(samples));
}

void Recorder::edited(std::int64_t step, const std::string& who, const std::string& what,
                      const ModelSource& source) {
    const std::string name = "edit " + std::to_string(edits_++);
    writer_.add_metadata(name, {{"step", std::to_string(step)}, {"who", who}, {"what", what}});
    attach(name + "/", source);
    are_constants_due_ = true;
}

} // namespace bf

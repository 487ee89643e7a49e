#include "live_model.hpp"

#include "bf/model/edit.hpp"

#include <algorithm>
#include <set>

namespace bf::service {

namespace {

/// The document as a program takes it, wherever both have their files.
realtime::Edit edit_of(const LiveModel::Newest& newest, std::int64_t before, bool accepts_loss) {
    const ModelSource& source = newest.model->source;
    realtime::Edit edit;
    edit.accepts_loss = accepts_loss;
    edit.is_by_hand = newest.moves.is_by_hand_since(before);
    for (const auto& [file, text] : source.texts)
        if (file == source.file)
            edit.text = text;
        else
            edit.files[file.lexically_relative(source.file.parent_path()).generic_string()] = text;
    std::set<std::string> paths;
    const auto add = [&](const std::string& path) { // and the subsystems around it
        for (auto end = path.size(); end != path.npos && end > 0; end = path.rfind('.', end - 1))
            if (!paths.insert(path.substr(0, end)).second) return;
    };
    for (const auto& node : newest.model->diagram.nodes) {
        add(node.path);
        for (const auto& slot : node.block->resolution().slots)
            for (const auto& name : slot.value_names) add(model::joined(node.path, name));
    }
    for (const auto& condition : newest.model->diagram.conditions) add(condition.path);
    for (const auto& path : paths)
        if (auto was = newest.moves.path_at(before, path); was != path) edit.origins[path] = std::move(was);
    return edit;
}

} // namespace

LiveModel::LiveModel(Live& live, std::int64_t revision, std::function<void(std::function<void()>)> post,
                     std::function<void()> tell)
    : live_(live), post_(std::move(post)), tell_(std::move(tell)), there_(revision) {}

void LiveModel::consider(Newest newest) {
    values_ = values_of_variables(Tuning(newest.model->diagram));
    values_.merge(values_of_parameters(newest.model->diagram));
    newest_ = std::move(newest);
    go_on();
}

void LiveModel::go_on() {
    if (newest_.model && newest_.revision != there_ && !on_the_way_) send(false);
}

void LiveModel::require_control() const {
    if (const std::string why = live_.state().live->refusal; !why.empty()) throw std::runtime_error(why);
}

void LiveModel::adopt(int page) {
    if (!waits_ || !waits_->refusal.empty() || on_the_way_)
        throw std::runtime_error("no edit waits to go on in the program");
    newest_.page = page;
    send(true);
}

void LiveModel::send(bool accepts_loss) {
    const LiveProgram program = live_.state().live.value_or(LiveProgram());
    if (!program.edit_refusal.empty()) {
        waits_ = RunEdit{program.edit_refusal};
        return tell_();
    }
    on_the_way_ = newest_.revision;
    live_.edit(edit_of(newest_, there_, accepts_loss), newest_.what, newest_.page,
               [this, post = post_, revision = newest_.revision](std::optional<RunEdit> waits) {
                   post([this, revision, waits = std::move(waits)] { hear(revision, waits); });
               });
}

void LiveModel::hear(std::int64_t revision, std::optional<RunEdit> waits) {
    on_the_way_.reset();
    if (!waits) there_ = revision;
    waits_ = std::move(waits);
    if (newest_.revision != revision) send(false); // there was another edit meanwhile
    tell_();
}

RunState LiveModel::seen(RunState state, std::int64_t revision) const {
    std::erase_if(state.tuned, [&](const Tune& tuned) {
        const auto known = values_.find(tuned.name);
        return known != values_.end() && known->second == tuned.values;
    });
    state.edit = waits_;
    state.is_current = revision == there_;
    return state;
}

} // namespace bf::service

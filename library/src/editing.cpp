#include "bf/library/editing.hpp"

#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"
#include "bf/engine/handover.hpp"
#include "bf/formats/yaml.hpp"
#include "bf/model/edit.hpp"

#include <algorithm>
#include <new>
#include <set>
#include <stdexcept>

namespace bf {

namespace {

using realtime::Edit;
using realtime::Edited;

std::set<std::string> plugins_of(const model::Model& model) {
    std::set<std::string> names;
    const auto add = [&](const model::Model& one) {
        for (const auto& plugin : one.plugins) names.insert(plugin.name);
    };
    add(model);
    model::walk(model, [&](const std::string&, const model::Block& block) {
        if (block.reference && block.reference->model) add(*block.reference->model);
    });
    return names;
}

/// Under the names of the program's files, wherever the viewer has them.
ModelSource source_of(const Edit& edit, const ModelSource& now) {
    ModelSource source{now.file, {{now.file, edit.text}}, now.overrides};
    for (const auto& [path, text] : edit.files)
        source.texts[(now.file.parent_path() / path).lexically_normal()] = text;
    return source;
}

Origin origin_of(const Edit& edit) {
    return [&edit](const std::string& path) -> std::optional<std::string> {
        const auto known = edit.origins.find(path);
        return known == edit.origins.end() ? path : known->second;
    };
}

/// What became of a path, of a block or of what is in one; none: it is gone, though another may have its
/// name.
std::optional<std::string> path_since(const Edit& edit, const std::string& path) {
    std::optional<std::string> found;
    std::size_t longest = 0;
    bool is_other = false; // has what bears the name another origin?
    for (const auto& [now, before] : edit.origins) {
        is_other = is_other || rest_under(path, now);
        if (!before || before->size() < longest) continue;
        const auto rest = rest_under(path, *before);
        if (!rest) continue;
        longest = before->size();
        found = now + *rest;
    }
    return found || is_other ? found : path;
}

std::string text_of(const std::vector<model::Diagnostic>& diagnostics) {
    std::string text;
    for (const auto& diagnostic : diagnostics) text += (text.empty() ? "" : "\n") + diagnostic.text();
    return text;
}

} // namespace

struct SimulationEditing::Next final : realtime::Successor {
    Next(std::shared_ptr<const LoadedModel> m, Simulation& before, const Origin& origin)
        : model(std::move(m)), simulation(model->diagram, before, origin) {}
    Run& run() override { return simulation; }
    void take_over() noexcept override { simulation.take_over(); }
    bool keeps_something() const {
        for (std::size_t n = 0; n < model->diagram.nodes.size(); ++n)
            if (simulation.keeps(static_cast<int>(n))) return true;
        return false;
    }

    std::vector<std::shared_ptr<const LoadedModel>> earlier; ///< whose blocks opened what goes on
    std::shared_ptr<const LoadedModel> model;
    Simulation simulation;
    std::unique_ptr<Run::Observer> observer;
};

SimulationEditing::SimulationEditing(const LoadedModel& model, Simulation& simulation, Observe observe)
    : observe_(std::move(observe)), model_(&model), simulation_(&simulation) {}
SimulationEditing::~SimulationEditing() = default;

Edited SimulationEditing::prepare(const Edit& edit, const std::vector<ParameterValue>& asked) {
    try {
        return compared(edit, asked);
    } catch (const std::exception& error) {
        next_.reset();
        const bool is_too_large = dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
        return {.refusal = is_too_large ? "there is no memory for the edited model beside the one that runs"
                                        : error.what()};
    }
}

Edited SimulationEditing::compared(const Edit& edit, const std::vector<ParameterValue>& asked) {
    ModelSource source = source_of(edit, model_->source);
    const model::Model model = formats::read_yaml_given(source.file, source.texts);
    const auto known = plugins_of(formats::read_yaml_given(model_->source.file, model_->source.texts));
    for (const auto& plugin : plugins_of(model))
        if (!known.contains(plugin))
            throw RunError("the program has not loaded the plugin '" + plugin +
                           "'; start it anew with the edited model");
    std::set<std::filesystem::path> files; // that the program uses
    for (const auto& node : model_->diagram.nodes) files.merge(named_files(node.arguments));
    const auto loaded = std::make_shared<const ExaminedModel>(examine(model, std::move(source), &files));
    if (!loaded->diagnostics.empty()) throw RunError(text_of(loaded->diagnostics));
    const Diagram &from = model_->diagram, &to = loaded->diagram;
    if (is_same_run(from, to)) return {};
    if (from.step != to.step)
        throw RunError("the edited model has a step of " + number_text(to.step) +
                       " s, and the program keeps its period of " + number_text(from.step) +
                       " s; start it anew");
    const Origin origin = origin_of(edit);
    next_ = std::make_unique<Next>(loaded, *simulation_, origin);
    Simulation& next = next_->simulation;
    if (const std::string reasons = next.not_for_real_time(); !reasons.empty()) throw RunError(reasons);
    Handover found = handover(*simulation_, next, origin);
    Edited edited{.lost = std::move(found.lost), .begun = std::move(found.begun)};
    if (edit.is_by_hand) edited.unclear = unclear(from, to);
    if (edit.is_late)
        edited.unclear.push_back("somebody else has edited the model of the program meanwhile, as its log "
                                 "says; this one takes its place");
    if (!edit.accepts_loss && !(edited.lost.empty() && edited.unclear.empty())) {
        next_.reset();
        return edited;
    }
    next.start();
    edited.asked = set_again(
        next, still_asked(from, to, asked, [&](const auto& path) { return path_since(edit, path); }));
    if (observe_) next_->observer = observe_(next);
    if (next_->observer) edited.observers.push_back(next_->observer.get());
    edited.successor = next_.get();
    return edited;
}

void SimulationEditing::finish(bool has_taken_over) {
    if (!has_taken_over) return next_.reset();
    simulation_->stop(); // but what goes on
    if (now_ && next_->keeps_something()) {
        next_->earlier = std::move(now_->earlier);
        next_->earlier.push_back(now_->model);
    }
    now_ = std::move(next_);
    model_ = now_->model.get();
    simulation_ = &now_->simulation;
}

const ModelSource& SimulationEditing::prepared() const { return next_->model->source; }

} // namespace bf

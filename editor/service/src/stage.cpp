#include "stage.hpp"

namespace bf::service {

void Stage::follow(const std::shared_ptr<const LoadedModel>& model, Playback* playback) {
    if (!pages_.empty() && model && model != model_) {
        failure_.clear();
        sceneries_ = std::make_shared<Sceneries>();
        try {
            if (make_) *sceneries_ = make_(model->diagram);
        } catch (const std::exception& error) {
            failure_ = error.what();
        }
        model_ = model;
        Json looks = Json::array({failure_});
        for (const auto& scenery : *sceneries_) looks.push_back(to_json(scenery->world()));
        if (number_ == 0 || looks != looks_) ++number_;
        looks_ = std::move(looks);
    }
    if (playback) playback->show(seen());
}

Scene Stage::look(int page, bool is_wanted, const std::shared_ptr<const LoadedModel>& model,
                  Playback* playback) {
    if (is_wanted)
        pages_.insert(page);
    else
        pages_.erase(page);
    follow(model, playback);
    Scene scene{.number = number_, .worlds = {}, .failure = failure_};
    if (is_wanted && sceneries_)
        for (const auto& scenery : *sceneries_) scene.worlds.push_back(scenery->world());
    return scene;
}

std::optional<std::string> Stage::meshes(std::string_view what) const {
    for (std::size_t i = 0; sceneries_ && i < sceneries_->size(); ++i)
        if (what == std::to_string(number_) + "/" + std::to_string(i)) return (*sceneries_)[i]->meshes();
    return {};
}

} // namespace bf::service

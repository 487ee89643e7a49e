#pragma once

#include "bf/library/load.hpp"
#include "bf/service/playback.hpp"
#include "bf/service/scenery.hpp"
#include "json.hpp"

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace bf::service {

/// What stands in space of the model that is looked at, and which pages look. It is made when the first page
/// does.
class Stage {
  public:
    explicit Stage(MakeSceneries make) : make_(std::move(make)) {}

    /// Of this model, which `playback` runs, where there is one.
    Scene look(int page, bool is_wanted, const std::shared_ptr<const LoadedModel>& model, Playback* playback);
    /// Another run began, or a page left. A scene that looks alike keeps its number.
    void follow(const std::shared_ptr<const LoadedModel>& model, Playback* playback);
    void leave(int page) { pages_.erase(page); }
    /// What pages look at; null: none looks.
    std::shared_ptr<Sceneries> seen() const { return pages_.empty() ? nullptr : sceneries_; }

    /// The meshes of "SCENE/WORLD", where that is what the pages were told.
    std::optional<std::string> meshes(std::string_view what) const;

  private:
    const MakeSceneries make_;
    std::set<int> pages_;
    std::shared_ptr<const LoadedModel> model_;
    std::shared_ptr<Sceneries> sceneries_;
    std::string failure_;
    Json looks_; ///< what pages were told of that number
    int number_ = 0;
};

} // namespace bf::service

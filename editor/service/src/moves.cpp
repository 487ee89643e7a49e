#include "bf/service/moves.hpp"

#include <algorithm>

namespace bf::service {

std::optional<std::string> Moves::path_at(std::int64_t before, std::string path) const {
    for (auto change = all_.rbegin(); change != all_.rend() && change->revision > before; ++change) {
        if (!change->moved) continue;
        std::optional<std::string> earlier = model::path_before(*change->moved, path);
        if (!earlier) return {};
        path = std::move(*earlier);
    }
    return path;
}

std::optional<std::string> Moves::path_since(std::int64_t before, std::string path) const {
    for (const Change& change : all_) {
        if (change.revision <= before || !change.moved) continue;
        std::optional<std::string> later = model::path_after(*change.moved, path);
        if (!later) return {};
        path = std::move(*later);
    }
    return path;
}

bool Moves::is_by_hand_since(std::int64_t before) const {
    return std::ranges::any_of(
        all_, [&](const Change& change) { return change.revision > before && !change.moved; });
}

} // namespace bf::service

#include "bf/model/suggest.hpp"

#include "bf/base/names.hpp"

#include <algorithm>

namespace bf::model {
std::string name_remedy(std::string_view word, const std::vector<std::string>& candidates) {
    if (const std::string meant = did_you_mean(word, candidates, ""); !meant.empty()) return meant;
    if (candidates.empty()) return {};
    const std::size_t most = 12;
    std::string text = "known are ";
    for (std::size_t i = 0; i < std::min(most, candidates.size()); ++i)
        text += (i ? ", '" : "'") + candidates[i] + "'";
    return candidates.size() > most ? text + ", ..." : text;
}

} // namespace bf::model

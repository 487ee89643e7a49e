#include "bf/model/suggest.hpp"

#include "bf/base/names.hpp"

#include <algorithm>

namespace bf::model {
std::string nearest(std::string_view word, const std::vector<std::string>& candidates) {
    const std::size_t longest_compared = 100;
    const std::string* best = nullptr;
    std::size_t fewest = std::max<std::size_t>(1, word.size() / 3) + 1;
    if (word.size() > longest_compared) return {};
    for (const std::string& candidate : candidates) {
        if (candidate.size() >= word.size() + fewest || word.size() >= candidate.size() + fewest) continue;
        const std::size_t edits = edit_distance(word, candidate);
        if (edits < fewest && edits < candidate.size()) best = &candidate, fewest = edits;
    }
    return best ? *best : std::string();
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
    if (const std::string best = nearest(word, candidates); !best.empty())
        return "did you mean '" + best + "'?";
    if (candidates.empty()) return {};
    const std::size_t most = 12;
    std::string text = "known are ";
    for (std::size_t i = 0; i < std::min(most, candidates.size()); ++i)
        text += (i ? ", '" : "'") + candidates[i] + "'";
    return candidates.size() > most ? text + ", ..." : text;
}

} // namespace bf::model

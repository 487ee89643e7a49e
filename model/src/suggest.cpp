#include "bf/model/suggest.hpp"

#include <algorithm>
#include <numeric>

namespace bf::model {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Edits (insert, delete, replace, swap of neighbours) that turn `a` into `b`, letter case apart.
std::size_t distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    std::iota(last.begin(), last.end(), 0);
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const bool same = lower(a[i - 1]) == lower(b[j - 1]);
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + !same});
            const bool swapped =
                i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]);
            if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
        }
        before.swap(last);
        last.swap(row);
    }
    return last[b.size()];
}

} // namespace

std::string nearest(std::string_view word, const std::vector<std::string>& candidates) {
    const std::size_t longest_compared = 100;
    const std::string* best = nullptr;
    std::size_t fewest = std::max<std::size_t>(1, word.size() / 3) + 1;
    if (word.size() > longest_compared) return {};
    for (const std::string& candidate : candidates) {
        if (candidate.size() >= word.size() + fewest || word.size() >= candidate.size() + fewest) continue;
        const std::size_t edits = distance(word, candidate);
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

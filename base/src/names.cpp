#include "bf/base/names.hpp"

#include <algorithm>
#include <numeric>

namespace bf {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

} // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    std::iota(last.begin(), last.end(), std::size_t{0});
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

std::vector<std::string> nearest_first(std::string_view name, std::vector<std::string> candidates,
                                       std::size_t most) {
    std::vector<std::pair<std::size_t, std::string>> ranked;
    for (auto& candidate : candidates)
        ranked.emplace_back(edit_distance(name, candidate), std::move(candidate));
    std::stable_sort(ranked.begin(), ranked.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<std::string> nearest;
    for (auto& [distance, candidate] : ranked)
        if (nearest.size() < most) nearest.push_back(std::move(candidate));
    return nearest;
}

std::vector<std::string> similar(std::string_view name, const std::vector<std::string>& candidates) {
    const std::size_t longest_compared = 100, most = std::max<std::size_t>(1, name.size() / 3);
    if (name.size() > longest_compared) return {};
    std::vector<std::string> near;
    for (const auto& candidate : candidates) {
        if (candidate.size() > name.size() + most || name.size() > candidate.size() + most) continue;
        if (edit_distance(name, candidate) <= most && std::ranges::find(near, candidate) == near.end())
            near.push_back(candidate);
    }
    return nearest_first(name, std::move(near));
}

std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates,
                         std::string_view before) {
    std::string text;
    for (const auto& near : similar(name, candidates))
        text += (text.empty() ? std::string(before) + "did you mean '" : " or '") + near + "'";
    return text.empty() ? text : text + "?";
}

std::optional<std::string> rest_under(std::string_view path, std::string_view prefix) {
    if (!path.starts_with(prefix)) return {};
    path.remove_prefix(prefix.size());
    if (!path.empty() && path[0] != '.') return {};
    return std::string(path);
}

} // namespace bf

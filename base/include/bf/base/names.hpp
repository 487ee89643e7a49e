// Names: how near two are, which was meant, lists of them in messages, and dotted paths of them.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace bf {

/// Edits that turn one name into the other: a letter inserted, left out or replaced, or two neighbours
/// swapped; upper and lower case are alike. (Optimal string alignment distance: L. Boytsov, "Indexing methods
/// for approximate dictionary searching", ACM J. Exp. Algorithmics 16, 2011.)
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The candidates in the order of their distance from `name`, those alike in the order given; at most `most`
/// of them.
std::vector<std::string> nearest_first(std::string_view name, std::vector<std::string> candidates,
                                       std::size_t most = 3);

/// The candidates that a person may have meant by `name`: as many edits away as a third of its letters, or
/// one. Nearest first, each once, at most three; none for what is longer than names are.
std::vector<std::string> similar(std::string_view name, const std::vector<std::string>& candidates);

/// `before` and "did you mean 'a' or 'b'?", or an empty text where none is similar.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates,
                         std::string_view before = "; ");

/// For which mistakes of a document names are suggested: the first ones. Each looks through all names, which
/// for each of many would take a time that grows with the square of the document.
class Suggestions {
  public:
    /// Whether one more is looked for.
    bool take() { return left_ > 0 && left_-- > 0; }

  private:
    int left_ = 20;
};

/// "a, b, c"; of many names the first ones, and how many more there are: each of many mistakes may list them.
template <class Items, class NameOf = std::identity>
std::string name_list(const Items& items, const NameOf& name_of = {}) {
    constexpr std::size_t most = 12;
    const std::size_t shown = items.size() <= most + 1 ? items.size() : most;
    std::string list;
    for (std::size_t i = 0; i < shown; ++i) list += (i > 0 ? ", " : "") + name_of(items[i]);
    return shown == items.size() ? list : list + " and " + std::to_string(items.size() - shown) + " more";
}

/// What follows `prefix` in the dotted path: "" or ".rest"; nothing if the path is not it nor under it.
std::optional<std::string> rest_under(std::string_view path, std::string_view prefix);

} // namespace bf

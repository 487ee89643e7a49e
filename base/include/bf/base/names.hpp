// How near two names are.
#pragma once

#include <cstddef>
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

} // namespace bf

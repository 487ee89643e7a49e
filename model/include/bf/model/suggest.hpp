#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace bf::model {

/// The candidate that a person most likely meant by `word` (fewest edits, letter case apart); empty if none
/// is near.
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// A remedy for an unknown word: "did you mean 'gain'?", else "known are 'gain', 'sum'" (at most twelve of
/// them).
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

} // namespace bf::model

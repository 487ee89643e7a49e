#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace bf::model {

/// A remedy for an unknown word: "did you mean 'gain'?", else "known are 'gain', 'sum'" (at most twelve of
/// them).
std::string name_remedy(std::string_view word, const std::vector<std::string>& candidates);

} // namespace bf::model

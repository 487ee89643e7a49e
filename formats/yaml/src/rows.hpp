#pragma once

#include "node.hpp"

#include <optional>

namespace bf::formats {

/// The text of a matrix or a list, of which some rows or items have become others: those that are the same,
/// by where they were read or else by what they say, keep their lines, comments and spelling, and of a row
/// that has as many entries as before only those change that are others. `value` stands in `text` between
/// `begin` (behind its key) and `end`, and is read as `before`; what is returned is read as `after`. Nothing
/// where no such text is found.
std::optional<std::string> edited_rows(std::string_view text, std::size_t begin, std::size_t end,
                                       const Node& value, const model::Expression& before,
                                       const model::Expression& after);

} // namespace bf::formats

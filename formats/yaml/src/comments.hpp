#pragma once

#include "node.hpp"

namespace bf::formats {

/// Lines [first, last] of a value that has no items of its own, such as a matrix over several lines.
struct LineRange {
    int first = 0;
    int last = 0;
};

/// Gives every comment and blank line of `source` to an item of `model`: a comment on an item's own line to
/// that item, any other to the item after it, those inside one of `values` to the item with the value, and
/// those after the last item to the end. `quoted` are the extents of quoted scalars.
void attach_comments(model::Model& model, const Source& source,
                     std::vector<std::pair<std::size_t, std::size_t>> quoted,
                     const std::vector<LineRange>& values);

} // namespace bf::formats

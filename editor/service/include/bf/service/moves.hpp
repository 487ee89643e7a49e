// Which path a block had at an earlier state of the document.
#pragma once

#include "bf/model/operation.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace bf::service {

/// What the changes of a document made of the paths of its blocks, by the revisions to which they led.
class Moves {
  public:
    /// `moved`: none where it is not known, since the model was written by hand. Revisions ascend; several
    /// changes may lead to one.
    void add(std::int64_t revision, std::optional<std::vector<model::Moved>> moved) {
        if (!moved || !moved->empty()) all_.push_back({revision, std::move(moved)});
    }

    /// The path at revision `before` of what has this path now; none: it was not there.
    std::optional<std::string> path_at(std::int64_t before, std::string path) const;
    /// The path now of what had this one at revision `before`; none: it is gone.
    std::optional<std::string> path_since(std::int64_t before, std::string path) const;
    /// Was the model written by hand after that revision?
    bool is_by_hand_since(std::int64_t before) const;

  private:
    struct Change {
        std::int64_t revision;
        std::optional<std::vector<model::Moved>> moved;
    };
    std::vector<Change> all_;
};

} // namespace bf::service

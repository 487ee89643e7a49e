#pragma once

#include "bf/model/model.hpp"
#include "bf/service/protocol.hpp"

namespace bf::service {

/// Where a text stands in the whole model, through the files it refers to: names first, then types, then
/// what is written.
Hits found_in(const model::Model& model, const std::string& text);

} // namespace bf::service

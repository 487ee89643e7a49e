#pragma once

#include "content.hpp"
#include "node.hpp"

/// Settings that are mappings, such as the chart of a state machine. The document keeps them as JSON, all
/// scalars being texts, on lines after `|`.
namespace bf::formats {

/// Of a mapping, sequence, scalar or nothing.
std::string json_of(const Node& node);

/// Whether an expression is such a mapping.
bool is_mapping(const model::Expression& value);

/// What is written of it.
Content mapping_content(const model::Expression& value);

} // namespace bf::formats

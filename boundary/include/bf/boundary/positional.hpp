// Values by position: how engines that give a block a row of parameters configure any class of blocks.
#pragma once

#include "BlockFactory/Core/Parameter.h"
#include "bf/core/registry.hpp"

#include <string>
#include <vector>

namespace bf::boundary {

/// One parameter of such an engine; the first two are class and library, so these begin at index 2.
struct PositionalValue {
    enum class Goal { argument, parameter, period } goal;
    const BlockClass* owner; ///< the class itself, or one that provides what it requires
    std::string name;        ///< of the argument or parameter
    std::string doc;
    Value initial;                    ///< the default
    std::vector<std::string> choices; ///< texts allowed; empty: any
    Limits limits;                    ///< of numbers
    /// Type, index, size and the engine's name: "Provider.name" for a name that is taken.
    blockfactory::core::ParameterMetadata metadata;
};

/// Of a native class: its arguments, its parameters (also those that only some arguments bring), the
/// arguments of its providers, and last the period `sample_time` [s]. Of a hosted one: what the old block
/// declares, in its order, fields of one struct with one index.
std::vector<PositionalValue> positional_values(const BlockClass& block_class,
                                               const std::vector<const BlockClass*>& providers = {});

/// The name of a hosted block's parameter here. Keys that a model file keeps for itself get an underscore:
/// `period` is the argument `period_`.
std::string argument_name(const std::string& legacy_name);

} // namespace bf::boundary

// What would mend a mistake, as operations on the document: found beside the check that reports it.
#pragma once

#include "bf/model/operation.hpp"

#include <string>
#include <vector>

namespace bf::elaboration {

model::Fix fix(std::string title, const model::Operation& operation);

/// A setting under the name that was meant, with the value it has.
model::Fix renamed_setting(const std::string& path, const model::Setting& setting, const std::string& name);

/// A wire of `system` between other ends.
model::Fix rewired(const std::string& system, const model::Endpoint& from, const model::Endpoint& to,
                   const std::string& new_from, const std::string& new_to);

/// The name of a signal of `system` for another source.
model::Fix named_anew(const std::string& system, const model::NamedSignal& signal,
                      const model::Endpoint& source);

/// A signal that is recorded or plotted, under the name that was meant.
model::Fix renamed_signal(const model::Model& model, const std::string& path, const std::string& name);

/// A block like this, each under a free name, in each wire into those inputs of the block at `path`; none
/// where the document has no such wire.
std::vector<model::Fix> inserted_before(const model::Model& model, const std::string& path,
                                        const std::vector<std::string>& inputs, std::string title,
                                        model::Block block);

} // namespace bf::elaboration

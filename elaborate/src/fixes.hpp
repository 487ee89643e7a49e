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

/// A RateTransition of that period in the wire into an input of the block at `path`; none where the document
/// has no such wire.
std::vector<model::Fix> inserted_transition(const model::Model& model, const std::string& path,
                                            const std::string& input, const std::string& period);

} // namespace bf::elaboration

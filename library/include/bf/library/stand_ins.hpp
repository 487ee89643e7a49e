// Blocks of plugins where the plugins are not, as in a browser: known by declarations that were written down
// where they are.
#pragma once

#include "bf/library/load.hpp"

#include <map>
#include <string>

namespace bf {

/// A file of this ending in the search path of plugins stands for the plugin that it is called after, where
/// that is not.
inline constexpr const char* declarations_ending = ".declarations.json";

/// By plugin, what its blocks in the diagram declare, with the sizes, types and names that the diagram has
/// decided, as texts for `stand_ins`.
std::map<std::string, std::string> declarations_of(const Diagram& diagram, Registry& registry);

/// The path of a block that is another one where such texts stand for the plugins, or whose wires or rate
/// are: elements of two blocks with the same arguments have other sizes, and no wire tells them. Empty: there
/// is none.
std::string block_that_differs(const LoadedModel& loaded,
                               const std::map<std::string, std::string>& declarations);

/// Blocks that declare what the text says and refuse to start: a model that it was written for can be
/// checked, drawn and edited with them. They are made with the arguments that the model gives, or with none.
/// Throws PluginError for a text that is no such thing.
Library stand_ins(const std::string& text);

} // namespace bf

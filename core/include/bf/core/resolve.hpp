// Finding the sizes and types of one block's quantities from what is wired to it.
#pragma once

#include "bf/core/block.hpp"

#include <stdexcept>

namespace bf {

/// A wiring or value that a block cannot accept; the text names the port, the value and the rule.
struct ResolutionError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// The quantity wired to, or given for, slot `index` has this size. Returns whether that was news.
/// Throws ResolutionError when it contradicts what is known.
bool offer(Declaration& declaration, int index, const Size& size);
bool offer(Declaration& declaration, int index, Type type);

/// The number, not empty, given for parameter `index`: its initial value, its type where that is open, and
/// its size, unless it is one element that stands for as many as an input has. Vectors are 1-D except where
/// the parameter is a matrix or keeps them as written. Throws ResolutionError.
void give(Declaration& declaration, int index, const Value& value);

/// What is wrong with the values of a parameter, by its limits and by its type as far as that is known:
/// "parameter 'T' must be greater than 0, but is -1". Empty: nothing is. No value is rounded to an integer,
/// and no parameter is NaN. `path` is how it is called, the slot's name if empty.
std::string outside_limits(const Slot& slot, const std::vector<double>& values, const std::string& path = {});
/// What to do about a value that the type of the block's signals does not hold; empty where a value alone
/// helps.
std::string outside_remedy(const Slot& slot);

/// Parameters that alone decide their size and were not given have the size of their default.
void give_defaults(Declaration& declaration);

/// Spreads what is known through the block's symbols and its `infer`, until nothing new is learned. Returns
/// whether any slot's size or type became known. Throws ResolutionError.
bool propagate(Block& block);

/// Why the block is not resolved yet: names of slots whose size or type is unknown; empty when resolved.
std::vector<int> unresolved(const Declaration& declaration);

} // namespace bf

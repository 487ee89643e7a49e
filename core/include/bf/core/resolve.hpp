// Finding the sizes and types of one block's quantities from what is wired to it.
#pragma once

#include "bf/core/block.hpp"

#include <stdexcept>

namespace bf {

/// A wiring or value that a block cannot accept; the text names the port, the value and the rule.
struct ResolutionError : std::runtime_error {
    using std::runtime_error::runtime_error;
};
/// Element types that do not fit, which a conversion before the block mends.
struct TypeError : ResolutionError {
    using ResolutionError::ResolutionError;
};

/// The quantity wired to, or given for, slot `index` has this size. Returns whether that was news.
/// Throws ResolutionError when it contradicts what is known.
bool offer(Resolution& resolution, int index, const Size& size);
bool offer(Resolution& resolution, int index, Type type);

/// The number, not empty, given for parameter `index`: its initial value, its type where that is open, and
/// its size, unless it is one element that stands for as many as an input has. Vectors are 1-D except where
/// the parameter is a matrix or keeps them as written. Throws ResolutionError.
void give(Resolution& resolution, int index, const Value& value);

/// What is wrong with the values of a parameter, by its limits and by its type as far as that is known:
/// "parameter 'T' must be greater than 0, but is -1". Empty: nothing is. No value is rounded to an integer,
/// and no parameter is NaN. `path` is how it is called, the slot's name if empty.
std::string outside_limits(const Slot& slot, const std::vector<double>& values, const std::string& path = {});
/// What is wrong with the size of a slot that is resolved: it has more elements than can be counted, or its
/// initial value, which an input has as long as it is not connected, has another number of them. Empty:
/// nothing is.
std::string wrong_size(const Slot& slot, bool is_connected);
/// Is an element of a parameter below the other parameter that it must be at least? Then writes what is
/// wrong. `value(slot, i)` is element i of a parameter of the block, `path` what the parameter is called.
/// Nothing allocates.
template <class F>
bool is_below_another(const Resolution& r, int parameter, F&& value, const char* path, char* text,
                      std::size_t size) noexcept {
    const Slot& slot = r.slots[static_cast<std::size_t>(parameter)];
    if (slot.at_least < 0) return false;
    const Slot& least = r.slots[static_cast<std::size_t>(slot.at_least)];
    return kernels::find_below(
        path, slot.size.count(), [&](int i) { return value(parameter, i); }, least.name.c_str(),
        least.size.count(), [&](int i) { return value(slot.at_least, i); }, text, size);
}
/// The same of the values that the block was given. Empty: nothing is wrong.
std::string below_another(const Resolution& r, int parameter);
/// What to do about a value that the type of the block's signals does not hold; empty where a value alone
/// helps.
std::string outside_remedy(const Slot& slot);

/// The size of a parameter, or of an input that may stay unconnected, where nothing else decides: as many
/// elements as its value.
Size size_of_value(const Slot& slot);
/// Parameters that alone decide their size and were not given have the size of their default.
void give_defaults(Resolution& resolution);

/// Spreads what is known through the block's symbols and its `infer`, until nothing new is learned. Returns
/// whether any slot's size or type became known. Throws ResolutionError.
bool propagate(Block& block);

/// The inputs without a size that take that of the initial value of `state`, where nothing else decides:
/// those of the state's shape, and all when the value is one number, as a state of another shape, such as the
/// past of a Delay, tells only that its input is a scalar.
std::vector<int> sized_by_initial(const Resolution& resolution, const Slot& state);
/// Decides what neither the block nor its wiring does. A parameter, and an input that may stay unconnected,
/// has as many elements as its value; inputs may have the size of a state's initial value; other ports are
/// scalars.
void settle_sizes(Block& block);
/// Numbers of which nothing says the type are double.
void settle_types(Block& block);

/// Slots whose size or type is unknown.
std::vector<int> unresolved(const Resolution& resolution);

/// Gives the block the resource that it requires there.
void require(Block& block, int requirement, std::shared_ptr<const void> resource);
/// Makes what the block provides, as far as that was not done. Throws what making it throws.
void provide(Block& block);

} // namespace bf

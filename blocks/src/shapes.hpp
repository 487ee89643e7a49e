// Sizes of results, and the short forms that the declarations of the standard blocks share.
#pragma once

#include "bf/core/block.hpp"

#include <limits>
#include <string>
#include <vector>

namespace bf::blocks {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// A quantity whose unit is that of whatever is wired.
inline About any(const char* doc = "") { return {.unit = any_unit, .doc = doc}; }
inline About any(const Shape& shape, const char* doc = "") {
    return {.shape = shape, .unit = any_unit, .doc = doc};
}
/// Of a state that begins as the parameter `initial` says.
template <class Key> About any(const Shape& shape, const char* doc, const Key& initial) {
    return {.shape = shape, .unit = any_unit, .doc = doc, .initial_from = initial.index()};
}
/// The shape of a scalar, for keys of any type.
inline constexpr Shape scalar{Extent(1)};

/// "input 'u1' of size [3]".
std::string label(const Resolution& resolution, int slot);

/// Slot indices of keys and lists of keys.
template <class... Keys> std::vector<int> slots(const Keys&... keys) {
    std::vector<int> all;
    const auto add = [&](const auto& key) {
        if constexpr (requires { key.begin(); }) {
            for (const auto& each : key) all.push_back(each.index());
        } else if (key.is_present()) {
            all.push_back(key.index());
        }
    };
    (add(keys), ...);
    return all;
}

inline constexpr int most_ports = 10'000;
inline constexpr int most_samples = 1'000'000; ///< of the past that a block keeps

/// Size of an element-by-element operation: equal sizes, scalars expand; a 1-D signal beside a row or column
/// matrix of as many elements takes its form. Told as soon as one operand is no scalar, so that loops
/// resolve.
void broadcast(const Block& block, Inference& inference, const std::vector<int>& operands, int result);

/// Size of a b; a 1-D operand counts as a column, a scalar scales the other operand.
void multiply(const Block& block, Inference& inference, int a, int b, int result);

/// Refuses unless the slot's size, once known, is a square matrix. Returns the size or null.
const Size* square(const Block& block, Inference& inference, int slot);

/// Refuses a feedthrough matrix given as argument unless it is 0 or has a row per output, a column per input.
void check_feedthrough(const Block& block, Inference& inference, const Matrix& D, int u, int y);

/// Tells the size of a signal from its initial value, and refuses one that is neither a scalar nor of that
/// size.
void check_initial(const Block& block, Inference& inference, int initial, int signal);

} // namespace bf::blocks

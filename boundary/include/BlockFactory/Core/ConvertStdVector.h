// Element-wise conversion of vectors by the rules of Parameters. Not installed.
#ifndef BLOCKFACTORY_CORE_CONVERTSTDVECTOR_H
#define BLOCKFACTORY_CORE_CONVERTSTDVECTOR_H

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace blockfactory {
namespace core {

/// Throws std::invalid_argument when the value has no counterpart in To. Of int, bool, double, std::string.
template <typename To, typename From> To convertValue(const From& value) {
    if constexpr (std::is_same_v<To, From>) {
        return value;
    } else if constexpr (std::is_same_v<From, std::string>) {
        std::size_t used = 0;
        double number = 0;
        try {
            number = std::stod(value, &used);
        } catch (const std::exception&) {
            used = 0;
        }
        if (used == 0) throw std::invalid_argument("the text '" + value + "' is no number");
        if (!std::is_same_v<To, double> && number != std::floor(number))
            throw std::invalid_argument("the text '" + value + "' is no whole number");
        return convertValue<To>(number);
    } else if constexpr (std::is_same_v<To, std::string>) {
        return std::to_string(value);
    } else if constexpr (std::is_same_v<To, bool>) {
        return value != 0;
    } else if constexpr (std::is_same_v<To, int> && std::is_same_v<From, double>) {
        if (!(std::abs(value) <= std::numeric_limits<int>::max()))
            throw std::invalid_argument("the number " + std::to_string(value) + " does not fit an int");
        return static_cast<int>(value);
    } else {
        return static_cast<To>(value);
    }
}

template <typename Tin, typename Tout>
void convertStdVector(const std::vector<Tin>& input, std::vector<Tout>& output) {
    std::vector<Tout> converted;
    converted.reserve(input.size());
    for (const auto& value : input) converted.push_back(convertValue<Tout, Tin>(value));
    output = std::move(converted);
}

} // namespace core
} // namespace blockfactory

#endif

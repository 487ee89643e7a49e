#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace bf::recording {

/// Type of each element of a recorded signal. A Boolean is one byte, 0 or 1.
enum class ElementType : std::uint8_t { Double, Single, Int8, Uint8, Int16, Uint16, Int32, Uint32, Boolean };

/// Bytes of one element.
std::size_t size_of(ElementType type) noexcept;

/// Element `i`, from 0, of elements that stand one after the other; exact for every type.
double element_at(ElementType type, const std::byte* elements, std::size_t i) noexcept;

/// "double", "single", "int8" ... "uint32", "boolean".
const char* name_of(ElementType type) noexcept;

/// What a recording keeps about one signal.
struct ChannelInfo {
    ElementType type = ElementType::Double;
    std::uint32_t rows = 1;
    std::uint32_t cols = 1;
    bool is_matrix = false; ///< false: scalar or 1-D signal of `rows` elements, with cols = 1
    std::string unit = {};  ///< e.g. "N m"; empty for none
    std::string doc = {};   ///< one sentence for people
    double period = 0;      ///< sample time in seconds; 0 when samples are not periodic
    bool is_held = false;   ///< keeps its value until the next sample: plots draw stairs
    std::vector<std::pair<double, std::string>> names = {}; ///< of values, for people; empty: they have none
    std::vector<std::string> other_names = {};              ///< of the same signal, which is stored once
    std::vector<std::string> element_names = {}; ///< of a vector, "" for one without; empty: they have none

    /// What stands behind the signal's name for element i (column by column, from 0): "" of a scalar, "[3]"
    /// or "[l_knee]" of a vector, "[1][3]" (row, column) of a matrix; these numbers count from 1.
    std::string element_text(std::size_t i) const;
    /// The element that such a text stands for, by its name or its number; nothing: there is none.
    std::optional<std::size_t> find_element(std::string_view text) const;
    std::size_t elements() const noexcept { return std::size_t{rows} * cols; }
    std::size_t bytes() const noexcept { return elements() * size_of(type); } ///< of one sample
    bool operator==(const ChannelInfo&) const = default;
};

} // namespace bf::recording

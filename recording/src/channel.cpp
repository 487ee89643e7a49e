#include "bf/recording/channel.hpp"

#include "bf/base/elements.hpp"

#include <cstring>
#include <iterator>

namespace bf::recording {
namespace {

struct TypeRow {
    const char* name;
    std::size_t size;
};
constexpr TypeRow types[] = {{"double", 8}, {"single", 4}, {"int8", 1},   {"uint8", 1},  {"int16", 2},
                             {"uint16", 2}, {"int32", 4},  {"uint32", 4}, {"boolean", 1}};
static_assert(std::size(types) == static_cast<std::size_t>(ElementType::Boolean) + 1);

template <class T> double read(const std::byte* elements, std::size_t i) noexcept {
    T value;
    std::memcpy(&value, elements + i * sizeof value, sizeof value);
    return static_cast<double>(value);
}

} // namespace

double element_at(ElementType type, const std::byte* elements, std::size_t i) noexcept {
    switch (type) {
    case ElementType::Double: return read<double>(elements, i);
    case ElementType::Single: return read<float>(elements, i);
    case ElementType::Int8: return read<std::int8_t>(elements, i);
    case ElementType::Uint8: return read<std::uint8_t>(elements, i);
    case ElementType::Int16: return read<std::int16_t>(elements, i);
    case ElementType::Uint16: return read<std::uint16_t>(elements, i);
    case ElementType::Int32: return read<std::int32_t>(elements, i);
    case ElementType::Uint32: return read<std::uint32_t>(elements, i);
    case ElementType::Boolean: return read<std::uint8_t>(elements, i);
    }
    return 0;
}

std::size_t size_of(ElementType type) noexcept { return types[static_cast<std::size_t>(type)].size; }
const char* name_of(ElementType type) noexcept { return types[static_cast<std::size_t>(type)].name; }

std::string ChannelInfo::element_text(std::size_t i) const {
    return bf::element_text(static_cast<int>(rows), static_cast<int>(cols), static_cast<int>(i),
                            element_names);
}

std::optional<std::size_t> ChannelInfo::find_element(std::string_view text) const {
    const int found = bf::find_element(text, static_cast<int>(rows), static_cast<int>(cols), element_names);
    return found < 0 ? std::nullopt : std::optional(static_cast<std::size_t>(found));
}

} // namespace bf::recording

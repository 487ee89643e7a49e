#include "bf/recording/channel.hpp"

#include "bf/base/elements.hpp"

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

} // namespace

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

#include "bf/recording/channel.hpp"

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

} // namespace bf::recording

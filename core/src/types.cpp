#include "bf/core/types.hpp"

#include <array>

namespace bf {

namespace {
constexpr std::array<const char*, type_count> names{"double", "single", "int8",   "uint8",  "int16",
                                                    "uint16", "int32",  "uint32", "boolean"};
}

const char* name(Type type) { return names[static_cast<std::size_t>(type)]; }

std::optional<Type> type_from_name(std::string_view text) {
    for (std::size_t i = 0; i < names.size(); ++i)
        if (text == names[i]) return static_cast<Type>(i);
    return std::nullopt;
}

int bytes(Type type) {
    return with_type(type, [](auto t) { return static_cast<int>(sizeof(typename decltype(t)::type)); });
}

std::string Size::text() const {
    if (is_scalar() && !is_matrix) return "scalar";
    if (!is_matrix) return "[" + std::to_string(rows) + "]";
    return std::to_string(rows) + "x" + std::to_string(cols);
}

} // namespace bf

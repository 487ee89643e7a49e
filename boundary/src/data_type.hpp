// Element types on both sides of the boundary: the enumerations have the same order.
#pragma once

#include "BlockFactory/Core/Port.h"
#include "bf/core/types.hpp"

namespace bf::boundary {

using DataType = blockfactory::core::Port::DataType;

inline Type native(DataType type) { return static_cast<Type>(type); }
inline DataType legacy(Type type) { return static_cast<DataType>(type); }
inline bool is_known(DataType type) {
    return static_cast<unsigned>(type) < static_cast<unsigned>(type_count);
}
inline std::size_t bytes(DataType type) { return static_cast<std::size_t>(bf::bytes(native(type))); }
inline const char* name(DataType type) { return bf::name(native(type)); }

} // namespace bf::boundary

// Lists by int.
#pragma once

#include <cstddef>

namespace bf::program {

template <class List> int count(const List& list) { return static_cast<int>(list.size()); }
template <class List> auto& at(List& list, int i) { return list[static_cast<std::size_t>(i)]; }

} // namespace bf::program

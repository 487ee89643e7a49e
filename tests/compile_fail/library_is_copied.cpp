// What is listed in a copy of the library is lost: nobody reads it.
#include "bf/core/registry.hpp"
#include "block.hpp"

void list(bf::Library& library) {
#ifdef BF_MUST_NOT_COMPILE
    auto group = library.group("test");
#else
    auto& group = library.group("test");
#endif
    group.add(bf::BlockClass{});
}

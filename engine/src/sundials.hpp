// Owners of the objects of SUNDIALS.
#pragma once

#include <memory>
#include <new>
#include <nvector/nvector_serial.h>
#include <type_traits>

namespace bf {

template <class T, auto free> struct Freed {
    void operator()(T* p) const { free(p); }
};
template <class Handle, auto free>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Freed<std::remove_pointer_t<Handle>, free>>;

inline void free_context(_SUNContext* context) { SUNContext_Free(&context); }

/// Throws std::bad_alloc.
inline Owned<SUNContext, free_context> make_context() {
    SUNContext context = nullptr;
    if (SUNContext_Create(nullptr, &context) != 0) throw std::bad_alloc();
    return Owned<SUNContext, free_context>(context);
}

} // namespace bf

#include "heap.hpp"

#include <cstddef>

namespace {
thread_local long calls = 0;
}

namespace bf::test {
long heap_calls() noexcept { return calls; }

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__GLIBC__)
bool heap_is_counted() noexcept { return false; }
} // namespace bf::test
#else
bool heap_is_counted() noexcept { return true; }
} // namespace bf::test

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
    ++calls;
    return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
    ++calls;
    return __libc_calloc(count, size);
}
void* realloc(void* pointer, std::size_t size) {
    ++calls;
    return __libc_realloc(pointer, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    ++calls;
    return __libc_memalign(alignment, size);
}
void free(void* pointer) {
    if (pointer) ++calls;
    __libc_free(pointer);
}
}
#endif

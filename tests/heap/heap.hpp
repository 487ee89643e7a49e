// Counting calls of the heap, in test programs that link bf_heap.
#pragma once

namespace bf::test {

/// Calls of malloc, calloc, realloc, aligned_alloc and free by this thread since the program began; 0 for
/// ever where counting is impossible (sanitizers).
long heap_calls() noexcept;
bool heap_is_counted() noexcept;

} // namespace bf::test

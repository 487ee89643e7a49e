// Counting calls of the heap; linked into the test program by heap.cpp.
#pragma once

namespace bf::conformance {

/// Calls of malloc, calloc, realloc and free by this thread since the program began; 0 for ever where
/// counting is impossible (sanitizers).
long heap_calls() noexcept;
bool heap_is_counted() noexcept;

} // namespace bf::conformance

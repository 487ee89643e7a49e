// What the C library of emscripten 3.1.6 lacks of what the core uses.
#include <cstddef> // which sys/random.h needs

#include <sys/random.h>
#include <unistd.h>

extern "C" ssize_t getrandom(void* bytes, size_t size, unsigned) {
    return ::getentropy(bytes, size) == 0 ? static_cast<ssize_t>(size) : -1;
}

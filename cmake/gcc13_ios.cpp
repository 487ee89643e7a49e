// Objects compiled by GCC 13 or later call this instead of constructing std::ios_base::Init themselves.
#include <ios>
namespace {
const std::ios_base::Init init;
}
extern "C" __attribute__((visibility("hidden"), used)) void _ZSt21ios_base_library_initv() {}

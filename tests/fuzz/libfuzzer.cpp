// Entry for clang's libFuzzer, whose input is the text of a model.
#include "cases.hpp"

#include <cstdio>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto outcome = bf::fuzz::try_model({reinterpret_cast<const char*>(data), size}, size);
    if (outcome.violation.empty()) return 0;
    std::fprintf(stderr, "%s\n", outcome.violation.c_str());
    std::abort();
}

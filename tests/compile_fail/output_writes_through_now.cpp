// What is read cannot be assigned.
#include "block.hpp"

struct Claim : Base {
    bf::Status output(bf::Now at, bf::Out) const noexcept override {
#ifdef BF_MUST_NOT_COMPILE
        at[u] = at[x];
#endif
        return bf::ok;
    }
};

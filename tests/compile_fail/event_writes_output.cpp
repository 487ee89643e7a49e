// An event cannot write an output.
#include "block.hpp"

struct Claim : Base {
    bf::Status event(bf::Now at, bf::After after) const noexcept override {
#ifdef BF_MUST_NOT_COMPILE
        after[y] = at[u];
#endif
        return bf::ok;
    }
};

// guards cannot write an output.
#include "block.hpp"

struct Claim : Base {
    bf::Status guards(bf::Now at, bf::Guards to) const noexcept override {
#ifdef BF_MUST_NOT_COMPILE
        to[y] = at[u];
#endif
        return bf::ok;
    }
};

// update cannot write an output.
#include "block.hpp"

struct Claim : Base {
    bf::Status update(bf::Now at, bf::Next next) const noexcept override {
#ifdef BF_MUST_NOT_COMPILE
        next[y] = at[u];
#endif
        return bf::ok;
    }
};

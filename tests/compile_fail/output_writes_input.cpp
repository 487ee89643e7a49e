// output cannot write an input.
#include "block.hpp"

struct Claim : Base {
    bf::Status output(bf::Now at, bf::Out out) const noexcept override {
#ifdef BF_MUST_NOT_COMPILE
        out[u] = at[u];
#endif
        return bf::ok;
    }
};

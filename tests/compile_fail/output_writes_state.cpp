// output cannot write a state.
#include "block.hpp"

struct Claim : Base {
    bf::Status output(bf::Now at, bf::Out out) const noexcept override {
#ifdef BF_MUST_NOT_COMPILE
        out[x] = at[u];
#endif
        return bf::ok;
    }
};

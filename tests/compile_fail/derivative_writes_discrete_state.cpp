// derivative cannot write a discrete state.
#include "block.hpp"

struct Claim : Base {
    bf::Status derivative(bf::Now at, bf::Rate rate) const noexcept override {
#ifdef BF_MUST_NOT_COMPILE
        rate[x] = at[u];
#endif
        return bf::ok;
    }
};

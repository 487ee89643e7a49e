// A method cannot read a quantity whose type the wiring decides.
#include "block.hpp"

struct Claim : Base {
    bf::Status output(bf::Now at, bf::Out) const noexcept override {
#ifdef BF_MUST_NOT_COMPILE
        (void)at[any];
#endif
        return bf::ok;
    }
};

// output cannot write a parameter.
#include "block.hpp"

struct Claim : Base {
    bf::Status output(bf::Now, bf::Out out) const noexcept override {
#ifdef BF_MUST_NOT_COMPILE
        out[k] = 1.0;
#endif
        return bf::ok;
    }
};

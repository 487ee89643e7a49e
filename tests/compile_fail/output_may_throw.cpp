// Methods of a step are noexcept.
#include "block.hpp"

struct Claim : Base {
#ifdef BF_MUST_NOT_COMPILE
    bf::Status output(bf::Now, bf::Out) const override { return bf::ok; }
#else
    bf::Status output(bf::Now, bf::Out) const noexcept override { return bf::ok; }
#endif
};

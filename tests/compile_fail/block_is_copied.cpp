// A block has an identity: keys point into it.
#include "block.hpp"

void use(const Base& block) {
    (void)block.declaration();
#ifdef BF_MUST_NOT_COMPILE
    Base copy = block;
#endif
}

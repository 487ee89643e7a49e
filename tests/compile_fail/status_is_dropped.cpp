// A status must not be overlooked (warnings are errors here).
#include "bf/core/status.hpp"

bf::Status step();
void run() {
    (void)step();
#ifdef BF_MUST_NOT_COMPILE
    step();
#endif
}

// A failure's text is a literal: building one would use the heap in a step.
#include "bf/core/status.hpp"

#include <string>

bf::Status step() {
#ifdef BF_MUST_NOT_COMPILE
    return bf::Status::failure(std::string("joint ") + "7");
#endif
    return bf::Status::failure("joint {} fails", 7);
}

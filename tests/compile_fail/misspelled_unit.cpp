// A unit that does not exist is found by the compiler.
#include "bf/core/units.hpp"

constexpr bf::Unit speed = bf::unit<"rad/s">;
static_assert(speed == bf::unit<"rad.Hz">);
#ifdef BF_MUST_NOT_COMPILE
constexpr bf::Unit wrong = bf::unit<"radd/s">;
#endif

// The floating-point environment, which code of an FMU may leave changed for all other blocks: libraries that
// were linked with -Ofast flush subnormal numbers to zero when they are opened, and others leave another
// rounding mode.
#pragma once

#include <cfenv>
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

namespace bf::fmi {

/// How numbers are rounded, which subnormal numbers are zero and which exceptions trap, without what the
/// exceptions so far have left; cheap enough for each call.
inline unsigned arithmetic_modes() noexcept {
#ifdef __SSE2__
    return _mm_getcsr() & ~_MM_EXCEPT_MASK;
#else
    return static_cast<unsigned>(std::fegetround());
#endif
}

/// Puts back modes that were read before.
inline void set_arithmetic_modes(unsigned modes) noexcept {
#ifdef __SSE2__
    std::fesetround(static_cast<int>((modes & _MM_ROUND_MASK) >> 3)); // of the x87 unit, too
    _mm_setcsr((_mm_getcsr() & _MM_EXCEPT_MASK) | modes);
#else
    std::fesetround(static_cast<int>(modes));
#endif
}

/// Keeps the whole environment around code that may change it.
class KeptArithmetic {
  public:
    KeptArithmetic() noexcept : modes_(arithmetic_modes()) { std::fegetenv(&environment_); }
    ~KeptArithmetic() { std::fesetenv(&environment_); }
    KeptArithmetic(const KeptArithmetic&) = delete;
    KeptArithmetic& operator=(const KeptArithmetic&) = delete;
    bool is_changed() const noexcept { return arithmetic_modes() != modes_; }

  private:
    std::fenv_t environment_;
    unsigned modes_;
};

} // namespace bf::fmi

// Numbers as text, whatever the locale.
#pragma once

#include <locale.h>

namespace bf::generated {

/// While one lives, its thread reads and writes numbers with a point, whatever locale the program has chosen.
class NumberLocale {
  public:
    NumberLocale() : own_(::newlocale(LC_ALL_MASK, "C", nullptr)), before_(::uselocale(own_)) {}
    ~NumberLocale() {
        ::uselocale(before_);
        ::freelocale(own_);
    }
    NumberLocale(const NumberLocale&) = delete;
    NumberLocale& operator=(const NumberLocale&) = delete;

  private:
    const locale_t own_, before_;
};

} // namespace bf::generated

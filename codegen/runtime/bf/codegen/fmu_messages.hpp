// What an instance of an FMU says, and in which order it is called.
#pragma once

#include "bf/codegen/quantity.hpp"
#include "bf/fmi/call_order.hpp"

#include <cstdarg>
#include <cstdio>
#include <string>

namespace bf::generated {

class FmuMessages {
  public:
    enum class Level { ok, warning, discard, error };
    /// Where messages go: `level` has the numbers of both standards.
    using Log = void (*)(const FmuMessages&, Level, const char* category, const char* message);

    FmuMessages(const char* name, fmi::CallOrder order_of_calls, Log log)
        : order(order_of_calls), name_(name ? name : ""), log_(log) {}

    const char* name() const noexcept { return name_.c_str(); }

    /// May this function be called now?
    bool may(fmi::Call call, const char* function) {
        Problem problem;
        return order.check(call, function, problem) || fail(problem.text);
    }

    [[gnu::format(printf, 4, 5)]] void message(Level level, const char* category, const char* format,
                                               ...) const noexcept {
        char text[600];
        va_list list;
        va_start(list, format);
        std::vsnprintf(text, sizeof text, format, list);
        va_end(list);
        if (log_) log_(*this, level, category, text);
    }
    bool fail(const char* text) const noexcept {
        message(Level::error, "logStatusError", "%s", text);
        return false;
    }

    fmi::CallOrder order;
    // Of the version's functions.
    void (*callback)(void) = nullptr; ///< that logs
    void* environment = nullptr;
    bool is_logging = false;

  private:
    std::string name_;
    Log log_;
};

} // namespace bf::generated

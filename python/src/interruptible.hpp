// What takes long and ends when Ctrl-C is pressed.
#pragma once

#include "native.hpp"

#include <chrono>
#include <exception>
#include <functional>
#include <optional>

namespace bf::python {

/// Asks Python about Ctrl-C twenty times a second; afterwards `raise` says what came.
class Interruption {
  public:
    Interruption() {
        const auto threading = nb::module_::import_("threading");
        is_main_ = threading.attr("current_thread")().is(threading.attr("main_thread")());
    }
    bool go_on() noexcept {
        using namespace std::chrono;
        const auto now = steady_clock::now();
        if (!is_main_ || now - last_ < 50ms) return !is_ending();
        last_ = now;
        const nb::gil_scoped_acquire gil;
        return PyErr_CheckSignals() == 0;
    }
    void raise() const {
        if (PyErr_Occurred()) throw nb::python_error();
    }

  private:
    bool is_main_; ///< the thread that sees signals
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// f(go_on) without the GIL, which ends early when Ctrl-C was pressed or `is_hindered` says so; then the
/// interpreter's own error is raised.
template <class F, class Is> auto interruptible(F&& f, Is&& is_hindered) {
    Interruption interruption;
    std::optional<decltype(f(std::function<bool()>()))> found;
    std::exception_ptr error;
    {
        const WithoutGil parallel;
        try {
            found.emplace(f([&] { return interruption.go_on() && !is_hindered(); }));
        } catch (...) {
            error = std::current_exception();
        }
    }
    interruption.raise();
    if (error && !is_hindered()) std::rethrow_exception(error);
    return found;
}

} // namespace bf::python

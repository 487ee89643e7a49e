// What blocks that wait look at, so that a run ends when it is asked to.
#pragma once

#include <csignal>
#include <string_view>

namespace bf {

/// Was the end of the run asked for, by Ctrl-C or a service manager? A block that waits for something
/// outside, or searches for long, looks at it a few times a second, and then fails with `interrupted`.
bool is_interrupted() noexcept;

/// Whoever catches the signals of the process says which flag they set; it lasts until another one is said.
/// Null: nobody catches them. Any thread may ask; the flag outlives the runs.
void look_for_interrupt(const volatile std::sig_atomic_t* flag) noexcept;

/// Asks for the end of the run as a signal does, such as where another program asks this one to end. False:
/// nobody catches the signals.
bool interrupt() noexcept;

/// Says what the start of a run waits for, such as a robot that is not there yet, to whoever listens.
void tell_wait(const char* what) noexcept;
/// Whoever starts runs says who listens, in any thread; null: nobody.
void listen_to_waits(void (*told)(const char* what)) noexcept;

/// The message of a step that ended early because of it, after the name of what it waited for. A program that
/// was asked to end does not call that a failure.
inline constexpr char interrupted[] = "the wait was interrupted";
inline bool is_interruption(std::string_view failure) noexcept {
    const std::string_view end(interrupted);
    return failure.size() >= end.size() && failure.substr(failure.size() - end.size()) == end;
}

} // namespace bf

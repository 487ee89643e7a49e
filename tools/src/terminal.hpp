// What a person sees while a verb works: a line on standard error, and Ctrl-C.
#pragma once

#include "bf/core/interrupt.hpp"
#include "bf/realtime/interrupt.hpp"
#include "bf/recording/reader.hpp"
#include "session.hpp"

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace bf::tools {

/// A line on standard error that is written over: on a terminal cut to its width, elsewhere (a log file) a
/// line every ten seconds.
class StatusLine {
  public:
    /// Shows the text, at most five times a second.
    void show(const std::string& text);
    /// Is there time for the next text?
    bool is_due() const;
    /// The last text, which stays.
    void finish(const std::string& text);

  private:
    double shown_ = -1e9; ///< s, of the steady clock
};

/// Says on standard error that something takes longer than a second, as long as the object lives.
class Waiting {
  public:
    explicit Waiting(std::string what);
    ~Waiting();

  private:
    void run(const std::string& what);
    std::mutex mutex_;
    std::condition_variable changed_;
    bool is_over_ = false;
    std::thread thread_;
};

/// Ends the command with exit code 1 after `output` was written from a recording that is not complete.
void refuse_incomplete(const recording::Recording& recording, const std::string& file,
                       const std::string& output);

/// Reads a recording; tells on standard error when it is not complete, or cannot be trusted to be.
recording::Recording load_recording(const std::string& file);

/// Tells on standard error what blocks of plugins warned of, each text once.
void show_warnings();

/// Ended by a signal; the command exits with 128 + its number, 130 for Ctrl-C.
struct Interrupted : CommandError {
    Interrupted(int number, const std::string& text) : CommandError(text), signal(number) {}
    int signal;
};

/// While one lives, blocks that wait end early at a signal, too, and standard error tells what a start waits
/// for.
struct InterruptGuard : realtime::InterruptGuard {
    InterruptGuard();
    ~InterruptGuard();
};

/// Why a run failed; nothing where it only ended a wait because of a signal.
std::string without_interruption(std::string failure);

} // namespace bf::tools

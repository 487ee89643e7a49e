// Calls of FMUs that end the process.
#pragma once

#include <atomic>
#include <string>

namespace bf::fmi {

/// The function of an FMU that is being called. An FMU that calls exit() would end a run as if it were
/// complete; where one is under way then, its name is said and the exit code is 1. Nobody can see _exit().
class UnderWay {
  public:
    /// `fmu`: for the message.
    explicit UnderWay(std::string fmu);
    ~UnderWay();
    UnderWay(const UnderWay&) = delete;
    UnderWay& operator=(const UnderWay&) = delete;
    /// nullptr: none.
    void set(const char* function) noexcept { function_.store(function, std::memory_order_relaxed); }

    /// In a process that another one watches, which says how it ended.
    static void leave_to_others() noexcept;

  private:
    static bool say_all() noexcept;

    std::string fmu_;
    std::atomic<const char*> function_ = nullptr;
    int process_;
};

} // namespace bf::fmi

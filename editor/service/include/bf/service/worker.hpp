// What is done beside the thread of the service.
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <memory>

namespace bf::service {

/// Does tasks in the order in which they come, in a thread of its own; where there are no threads, in turns
/// that whoever has the loop of events calls.
class Worker {
  public:
    using Task = std::function<void()>;
    using Time = std::chrono::steady_clock::time_point;
    static constexpr Time at_once = Time(), never = Time::max();

    /// What else there is to do: called after tasks and when its time has come, at first after the first
    /// task. Gives that time.
    using Turn = std::function<Time(bool was_asked)>; ///< are there tasks before it?

    explicit Worker(Turn turn = [](bool) { return never; });
    ~Worker(); ///< the task or turn that is under way is the last one
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    void post(Task task);
    void call(const Task& task); ///< waits until it is done, and throws what it throws

    /// Where there are no threads: does what is due of all workers, and gives the time of what comes next.
    static Time turn_all();

  private:
    struct State;
    const std::unique_ptr<State> state_;
};

} // namespace bf::service

// Workers where there are no threads, as in WebAssembly.
#include "bf/service/worker.hpp"

#include <algorithm>
#include <exception>
#include <set>
#include <utility>

namespace bf::service {

struct Worker::State {
    explicit State(Turn t) : turn(std::move(t)) { all().insert(this); }
    ~State() { all().erase(this); }

    static std::set<State*>& all() {
        static std::set<State*> states;
        return states;
    }

    void work() {
        std::deque<Task> now;
        now.swap(tasks);
        for (const auto& task : now) task();
        next = turn(!now.empty());
        if (!tasks.empty()) next = at_once; // which these posted
    }

    const Turn turn;
    std::deque<Task> tasks;
    Time next = never;
};

Worker::Worker(Turn turn) : state_(std::make_unique<State>(std::move(turn))) {}
Worker::~Worker() = default;

void Worker::post(Task task) {
    state_->tasks.push_back(std::move(task));
    state_->next = at_once;
}

void Worker::call(const Task& task) {
    std::exception_ptr failure;
    post([&] {
        try {
            task();
        } catch (...) {
            failure = std::current_exception();
        }
    });
    state_->work();
    if (failure) std::rethrow_exception(failure);
}

Worker::Time Worker::turn_all() {
    const std::set<State*> all = State::all(); // tasks make and end workers
    for (State* state : all)
        if (State::all().contains(state) && state->next <= std::chrono::steady_clock::now()) state->work();
    Time next = never;
    for (const State* state : State::all()) next = std::min(next, state->next);
    return next;
}

} // namespace bf::service

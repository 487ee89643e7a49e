#include "bf/service/worker.hpp"

#include <condition_variable>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

namespace bf::service {

struct Worker::State {
    explicit State(Turn t) : turn(std::move(t)), thread([this] { live(); }) {}
    ~State() {
        {
            const std::lock_guard lock(mutex);
            is_over = true;
        }
        wake.notify_one();
        thread.join();
    }

    void post(Task task) {
        {
            const std::lock_guard lock(mutex);
            tasks.push_back(std::move(task));
        }
        wake.notify_one();
    }

    void live() {
        for (Time next = never;;) {
            std::deque<Task> now;
            {
                std::unique_lock lock(mutex);
                const auto has_work = [&] { return is_over || !tasks.empty(); };
                if (next == never)
                    wake.wait(lock, has_work);
                else
                    wake.wait_until(lock, next, has_work);
                if (is_over) return;
                now.swap(tasks);
            }
            for (const auto& task : now) task();
            next = turn(!now.empty());
        }
    }

    const Turn turn;
    std::mutex mutex; ///< of these three
    std::condition_variable wake;
    std::deque<Task> tasks;
    bool is_over = false;
    std::thread thread; ///< last: it uses the others
};

Worker::Worker(Turn turn) : state_(std::make_unique<State>(std::move(turn))) {}
Worker::~Worker() = default;

void Worker::post(Task task) { state_->post(std::move(task)); }

void Worker::call(const Task& task) {
    std::promise<void> done;
    state_->post([&] {
        try {
            task();
            done.set_value();
        } catch (...) {
            done.set_exception(std::current_exception());
        }
    });
    done.get_future().get();
}

} // namespace bf::service

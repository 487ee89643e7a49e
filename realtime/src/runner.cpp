#include "bf/realtime/runner.hpp"

#include "bf/realtime/watchdog.hpp"

#include <cmath>
#include <csignal>
#include <deque>
#include <exception>

namespace bf::realtime {

bool ParameterMailbox::post(ParameterChange change) {
    if (state_.load(std::memory_order_acquire) != State::empty) return false;
    change_ = std::move(change);
    state_.store(State::posted, std::memory_order_release);
    return true;
}

std::optional<ParameterMailbox::Result> ParameterMailbox::take_result() {
    if (state_.load(std::memory_order_acquire) != State::applied) return {};
    Result result = result_;
    if (!result.status) result.refusal = change_.why_refused(result.status);
    state_.store(State::empty, std::memory_order_release);
    return result;
}

void ParameterMailbox::apply(Run& run, std::int64_t step) noexcept {
    if (state_.load(std::memory_order_acquire) != State::posted) return;
    result_ = {run.apply(change_), step, {}};
    state_.store(State::applied, std::memory_order_release);
}

/// Notes which task is at work, for the watchdog, while it lives.
class Runner::Running {
  public:
    explicit Running(Run& stepped) : run_(stepped) {
        run_.visit_tasks([&](Task& task, Phase, const std::string& block, int) {
            entries_.push_back({this, task, block});
            task = {run, &entries_.back(), 0};
        });
    }
    ~Running() {
        run_.visit_tasks([&](Task& task, Phase, const std::string&, int) {
            if (task.run == run) task = static_cast<const Entry*>(task.data)->task;
        });
    }
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;

    /// The block whose task was begun last. Any thread may ask.
    std::string block() const {
        const Entry* entry = at_work_.load(std::memory_order_relaxed);
        return entry ? entry->block : "";
    }

  private:
    struct Entry {
        Running* running;
        Task task;
        std::string block;
    };
    static Status run(const void* p, int) {
        const auto& entry = *static_cast<const Entry*>(p);
        entry.running->at_work_.store(&entry, std::memory_order_relaxed);
        return entry.task();
    }
    Run& run_;
    std::deque<Entry> entries_;
    std::atomic<const Entry*> at_work_{nullptr};
};

/// Lets observers see a step, unless it is degraded.
class Runner::Gate final : public Run::Observer {
  public:
    void observe(const Run& run) noexcept override {
        if (!is_open) return;
        for (Observer* observer : observers) observer->observe(run);
    }
    bool is_open = true;
    std::vector<Observer*> observers;
};

Runner::Runner(Run& run, RunnerOptions options)
    : run_(run), options_(std::move(options)),
      pacer_(std::max<Nanoseconds>(nanoseconds(run.period() / options_.factor), 1), options_.overrun),
      control_(options_.waits), gate_(std::make_unique<Gate>()) {
    run_.add_observer(*gate_);
}

Runner::~Runner() = default;

void Runner::add_observer(Run::Observer& observer) { gate_->observers.push_back(&observer); }

void Runner::run(double stop, const std::function<bool(const Progress&)>& monitor) {
    const std::int64_t steps = run_.steps_before(stop);
    if (const std::string reasons = run_.not_for_real_time(); !reasons.empty()) throw RunError(reasons);
    std::exception_ptr error;
    // Signals are for the thread that watches.
    sigset_t all, before;
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before);
    std::thread thread([&] {
        try {
            loop(steps);
        } catch (...) {
            error = std::current_exception();
        }
        is_over_.store(true);
    });
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
    try {
        for (bool is_over = false; !is_over; sleep_until(now() + (is_over ? 0 : 20'000'000))) {
            is_over = is_over_.load();
            const std::int64_t done = steps_.load(std::memory_order_acquire);
            if (!monitor({done, missed_.load(std::memory_order_relaxed)})) control_.stop();
        }
    } catch (...) {
        control_.stop();
        thread.join();
        throw;
    }
    thread.join();
    if (error) std::rethrow_exception(error);
}

void Runner::loop(std::int64_t steps) {
    std::optional<Running> running;
    std::optional<Watchdog> watchdog;
    if (options_.on_stall || ServiceManager().is_there()) {
        const int priority = options_.thread.priority > 0 ? std::min(options_.thread.priority + 1, 99) : 0;
        watchdog.emplace(options_.watchdog, emergency_limit(pacer_.statistics().period), priority, control_,
                         [&] {
                             if (options_.on_stall)
                                 options_.on_stall(steps_.load(), running ? running->block() : "");
                         });
    }
    while (control_.state() == Control::State::waiting) {
        parameters_.apply(run_, -1);
        if (watchdog) watchdog->kick();
        sleep_until(now() + 20'000'000);
    }
    if (!control_.goes_on()) return;
    if (watchdog) watchdog->rest();
    run_.start(); // before the preparation: threads that devices start are ordinary ones
    struct AtEnd {
        Run& run;
        std::optional<Watchdog>& watchdog;
        ~AtEnd() {
            if (watchdog) watchdog->end();
            run.stop();
            ::munlockall();
        }
    } const at_end{run_, watchdog};
    if (options_.watchdog > 0) running.emplace(run_);
    refused_ = prepare_thread(options_.thread);
    if (options_.is_strict && !refused_.empty()) {
        std::string text = "this machine refuses real time";
        for (const auto& refusal : refused_) text += "\n  " + refusal;
        throw RunError(text);
    }
    pacer_.start();
    if (watchdog) watchdog->kick();
    const Nanoseconds begin = pacer_.release();
    const double last = static_cast<double>(begin) + options_.duration * 1e9; // may be infinite
    const auto is_due = [&] { // a loop that is behind looks at the clock, not at its releases
        return static_cast<double>(std::max(pacer_.release(), pacer_.end())) < last;
    };
    while (run_.steps() < steps && is_due() && control_.goes_on() && pacer_.wait() && control_.goes_on()) {
        parameters_.apply(run_, run_.steps());
        if (options_.before_step) options_.before_step();
        gate_->is_open = !pacer_.is_degraded();
        const Status status = run_.step();
        pacer_.end_step();
        if (watchdog) watchdog->kick();
        missed_.store(pacer_.statistics().missed(), std::memory_order_relaxed);
        steps_.store(run_.steps(), std::memory_order_release);
        if (!status) break;
    }
    if (pacer_.statistics().steps > 0) wall_ = static_cast<double>(pacer_.end() - begin) / 1e9;
}

std::string Runner::failure() const {
    if (auto failure = run_.failure(); !failure.empty()) return failure;
    return options_.overrun == Overrun::stop ? missed_deadline(pacer_.statistics()) : "";
}

} // namespace bf::realtime

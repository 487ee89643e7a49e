#include "bf/realtime/runner.hpp"

#include "bf/realtime/watchdog.hpp"

#include <cmath>
#include <csignal>
#include <deque>
#include <exception>
#include <mutex>

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
    struct Entry {
        Running* running;
        Task task;
        std::string block;
    };
    using AtWork = std::atomic<const Entry*>;

    Running(Run& stepped, AtWork& at_work) : run_(stepped), at_work_(at_work) {
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

  private:
    static Status run(const void* p, int) {
        const auto& entry = *static_cast<const Entry*>(p);
        entry.running->at_work_.store(&entry, std::memory_order_relaxed);
        return entry.task();
    }
    Run& run_;
    AtWork& at_work_;
    std::deque<Entry> entries_;
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

/// A run with what belongs to it alone.
struct Runner::Stepped {
    explicit Stepped(Run& r) : run(r) { run.add_observer(gate); }
    Stepped(const Stepped&) = delete;
    Stepped& operator=(const Stepped&) = delete;

    Run& run;
    Gate gate;
    std::optional<Running> running; ///< where a watchdog looks
};

/// The run that is stepped, and the one that comes or came before.
class Runner::Relay final : public Succession {
  public:
    Relay(Run& run, const RunnerOptions& options)
        : is_watched_(options.watchdog > 0), locks_memory_(options.thread.locks_memory),
          now_(std::make_unique<Stepped>(run)) {}

    Stepped& now() { return *now_; }
    void watch(Stepped& stepped) {
        if (is_watched_) stepped.running.emplace(stepped.run, at_work_);
    }

    void post(Successor& successor, const std::vector<Run::Observer*>& observers) override {
        other_ = std::make_unique<Stepped>(successor.run());
        other_->gate.observers = observers;
        watch(*other_);
        successor_ = &successor;
        if (locks_memory_) // what was allocated since the loop began, too; a refusal is known from there
            static_cast<void>(prepare_thread({.locks_memory = true, .stack = 0}));
        state_.store(State::posted, std::memory_order_release);
    }
    std::optional<std::int64_t> taken() override {
        if (state_.load(std::memory_order_acquire) != State::taken) return {};
        const std::lock_guard lock(reading_);
        other_.reset();
        state_.store(State::empty, std::memory_order_release);
        return step_;
    }
    void withdraw() override {
        if (state_.exchange(State::empty) == State::posted) other_.reset();
    }
    /// The loop, before a step.
    void exchange() noexcept {
        if (state_.load(std::memory_order_acquire) != State::posted) return;
        step_ = now_->run.steps();
        successor_->take_over();
        at_work_.store(nullptr, std::memory_order_relaxed);
        now_.swap(other_);
        state_.store(State::taken, std::memory_order_release);
    }

    /// The block whose task was begun last. Any thread may ask.
    std::string block() {
        const std::lock_guard lock(reading_);
        const auto* entry = at_work_.load(std::memory_order_relaxed);
        return entry ? entry->block : "";
    }

  private:
    enum class State { empty, posted, taken };
    const bool is_watched_, locks_memory_;
    Running::AtWork at_work_{nullptr};
    std::mutex reading_; ///< of what `at_work_` points to; the loop never takes it
    std::unique_ptr<Stepped> now_, other_;
    Successor* successor_ = nullptr;
    std::int64_t step_ = 0;
    std::atomic<State> state_{State::empty};
};

Runner::Runner(Run& run, RunnerOptions options)
    : options_(std::move(options)),
      pacer_(std::max<Nanoseconds>(nanoseconds(run.period() / options_.factor), 1), options_.overrun),
      control_(options_.waits), relay_(std::make_unique<Relay>(run, options_)) {}

Runner::~Runner() = default;

void Runner::add_observer(Run::Observer& observer) { relay_->now().gate.observers.push_back(&observer); }
LoopAccess Runner::access() { return {parameters_, control_, pacer_.statistics(), relay_.get()}; }
Run& Runner::stepped() { return relay_->now().run; }

void Runner::run(double stop, const std::function<bool(const Progress&)>& monitor) {
    const std::int64_t steps = stepped().steps_before(stop);
    if (const std::string reasons = stepped().not_for_real_time(); !reasons.empty()) throw RunError(reasons);
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
    std::optional<Watchdog> watchdog;
    if (options_.on_stall || ServiceManager().is_there()) {
        const int priority = options_.thread.priority > 0 ? std::min(options_.thread.priority + 1, 99) : 0;
        watchdog.emplace(options_.watchdog, emergency_limit(pacer_.statistics().period), priority, control_,
                         [&] {
                             if (options_.on_stall) options_.on_stall(steps_.load(), relay_->block());
                         });
    }
    while (control_.state() == Control::State::waiting) {
        parameters_.apply(stepped(), -1);
        if (watchdog) watchdog->kick();
        sleep_until(now() + 20'000'000);
    }
    if (!control_.goes_on()) return;
    if (watchdog) watchdog->rest();
    stepped().start(); // before the preparation: threads that devices start are ordinary ones
    struct AtEnd {
        Runner& runner;
        std::optional<Watchdog>& watchdog;
        ~AtEnd() {
            if (watchdog) watchdog->end();
            runner.relay_->now().running.reset();
            runner.stepped().stop();
            ::munlockall();
        }
    } const at_end{*this, watchdog};
    relay_->watch(relay_->now());
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
    while (stepped().steps() < steps && is_due() && control_.goes_on() && pacer_.wait() &&
           control_.goes_on()) {
        relay_->exchange();
        auto& [run, gate, running] = relay_->now();
        parameters_.apply(run, run.steps());
        if (options_.before_step) options_.before_step();
        gate.is_open = !pacer_.is_degraded();
        const Status status = run.step();
        pacer_.end_step();
        if (watchdog) watchdog->kick();
        missed_.store(pacer_.statistics().missed(), std::memory_order_relaxed);
        steps_.store(run.steps(), std::memory_order_release);
        if (!status) break;
    }
    if (pacer_.statistics().steps > 0) wall_ = static_cast<double>(pacer_.end() - begin) / 1e9;
}

std::string Runner::failure() const {
    if (auto failure = relay_->now().run.failure(); !failure.empty()) return failure;
    return options_.overrun == Overrun::stop ? missed_deadline(pacer_.statistics()) : "";
}

} // namespace bf::realtime

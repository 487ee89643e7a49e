#include "bf/realtime/runner.hpp"

#include <cmath>
#include <csignal>
#include <exception>

namespace bf::realtime {

bool ParameterMailbox::post(ParameterChange change) {
    if (state_.load(std::memory_order_acquire) != State::empty) return false;
    change_ = std::move(change);
    state_.store(State::posted, std::memory_order_release);
    return true;
}

std::optional<Status> ParameterMailbox::take_result() {
    if (state_.load(std::memory_order_acquire) != State::applied) return {};
    const Status status = status_;
    state_.store(State::empty, std::memory_order_release);
    return status;
}

void ParameterMailbox::apply(Simulation& simulation) noexcept {
    if (state_.load(std::memory_order_acquire) != State::posted) return;
    status_ = simulation.apply(change_);
    state_.store(State::applied, std::memory_order_release);
}

/// Lets observers see a step, unless it is degraded.
class Runner::Gate final : public Simulation::Observer {
  public:
    void observe(const Simulation& simulation) noexcept override {
        if (!is_open) return;
        for (Observer* observer : observers) observer->observe(simulation);
    }
    bool is_open = true;
    std::vector<Observer*> observers;
};

Runner::Runner(Simulation& simulation, RunnerOptions options)
    : simulation_(simulation), options_(std::move(options)),
      pacer_(std::max<Nanoseconds>(std::llround(simulation.diagram().step / options_.factor * 1e9), 1),
             options_.overrun),
      gate_(std::make_unique<Gate>()) {
    simulation_.add_observer(*gate_);
}

Runner::~Runner() = default;

void Runner::add_observer(Simulation::Observer& observer) { gate_->observers.push_back(&observer); }

void Runner::run(double stop, const std::function<bool(const Progress&)>& monitor) {
    const double count = std::round(stop / simulation_.diagram().step);
    const auto steps = count < 9e18 ? static_cast<std::int64_t>(count) : INT64_MAX;
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
            if (!monitor({done, missed_.load(std::memory_order_relaxed)})) ends_.store(true);
        }
    } catch (...) {
        ends_.store(true);
        thread.join();
        throw;
    }
    thread.join();
    if (error) std::rethrow_exception(error);
}

void Runner::loop(std::int64_t steps) {
    simulation_.start(); // before the preparation: threads that devices start are ordinary ones
    struct AtEnd {
        Simulation& simulation;
        ~AtEnd() {
            simulation.stop();
            ::munlockall();
        }
    } const at_end{simulation_};
    std::optional<Watchdog> watchdog;
    const int priority = options_.thread.priority > 0 ? std::min(options_.thread.priority + 1, 99) : 0;
    if (options_.watchdog > 0)
        watchdog.emplace(static_cast<Nanoseconds>(options_.watchdog * 1e9), priority, [this] {
            if (options_.on_stall) options_.on_stall(steps_.load());
        });
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
    while (simulation_.steps() < steps && is_due() && !ends_.load(std::memory_order_relaxed) &&
           pacer_.wait()) {
        parameters_.apply(simulation_);
        gate_->is_open = !pacer_.is_degraded();
        const Status status = simulation_.step();
        pacer_.end_step();
        if (watchdog) watchdog->kick();
        missed_.store(pacer_.statistics().missed(), std::memory_order_relaxed);
        steps_.store(simulation_.steps(), std::memory_order_release);
        if (!status) break;
    }
    if (pacer_.statistics().steps > 0) wall_ = static_cast<double>(pacer_.end() - begin) / 1e9;
}

std::string Runner::failure() const {
    if (auto failure = simulation_.failure(); !failure.empty()) return failure;
    const Statistics& s = pacer_.statistics();
    if (options_.overrun != Overrun::stop || s.missed() == 0) return {};
    const auto& miss = s.first_misses.front();
    return "step " + std::to_string(miss.step) + " missed its deadline by " +
           std::to_string(miss.late / 1000) + " us: " + text(miss.cause) +
           "; choose another --overrun than stop, or give the step more time";
}

} // namespace bf::realtime

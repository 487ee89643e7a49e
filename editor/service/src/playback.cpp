#include "bf/service/playback.hpp"

#include "bf/engine/simulation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <future>
#include <limits>
#include <mutex>
#include <thread>

namespace bf::service {

namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr auto slice = std::chrono::milliseconds(15);      ///< between two looks at commands
constexpr std::size_t most_samples = 60;                   ///< of a signal in a slice
constexpr std::size_t most_bytes = std::size_t{256} << 20; ///< of checkpoints
constexpr std::size_t first_world = std::size_t{1} << 31;  ///< index in frames
constexpr double infinity = std::numeric_limits<double>::infinity();

template <class T> void append(std::string& frame, const T& value) {
    frame.append(reinterpret_cast<const char*>(&value), sizeof value);
}

} // namespace

class Playback::Loop final : public Run::Observer {
  public:
    Loop(std::shared_ptr<const LoadedModel> model, Listener listener)
        : model_(std::move(model)), listener_(std::move(listener)), run_(model_->diagram),
          quantities_(run_.signals()) {
        for (std::size_t i = 0; i < quantities_.size(); ++i) {
            const Quantity& quantity = quantities_[i];
            infos_.push_back({static_cast<int>(i), quantity.path, static_cast<int>(quantity.info.elements()),
                              quantity.info.element_names, quantity.info.unit});
        }
        run_.add_observer(*this);
        run_.start();
        state_.state = Running::paused;
        if (std::isfinite(run_.stop_time())) state_.stop = run_.stop_time();
        checkpoint();
        thread_ = std::thread([this] { live(); });
    }
    ~Loop() override {
        {
            const std::lock_guard lock(mutex_);
            is_over_ = true;
        }
        wake_.notify_one();
        thread_.join();
        run_.stop();
    }
    Loop(const Loop&) = delete;
    Loop& operator=(const Loop&) = delete;

    void command(const RunCommand& command) {
        post([this, command] { obey(command); });
    }
    /// Waits for the run to take it, which is a matter of one slice.
    void tune(const Tune& tune) {
        std::promise<void> done;
        post([&] {
            try {
                change({{tune.name, tune.values}});
                done.set_value();
            } catch (...) {
                done.set_exception(std::current_exception());
            }
        });
        done.get_future().get();
    }
    void watch(std::vector<int> signals) {
        post([this, signals = std::move(signals)] {
            watched_.clear();
            for (const int signal : signals) watched_.push_back({signal, 1, 0});
            is_seen_wanted_ = true;
        });
    }
    void show(std::shared_ptr<Sceneries> sceneries) {
        post([this, sceneries = std::move(sceneries)] {
            if (sceneries && sceneries != sceneries_)
                for (const auto& scenery : *sceneries) scenery->bind(quantities_);
            sceneries_ = sceneries;
            is_seen_wanted_ = true;
        });
    }
    RunState state() const {
        const std::lock_guard lock(mutex_);
        return state_;
    }
    const std::vector<SignalInfo>& signals() const { return infos_; }

    void observe(const Run& run) noexcept override {
        seen_time_ = run.time();
        for (auto& watched : watched_) {
            const Quantity& quantity = quantities_[static_cast<std::size_t>(watched.signal)];
            const bool is_constant = quantity.rate == constant_rate;
            if (!is_constant && !run.is_hit(quantity.rate)) continue;
            if (is_constant ? watched.seen > 0 : watched.seen++ % watched.stride != 0) continue;
            watched.seen = std::max<std::size_t>(watched.seen, 1);
            write(watched, run.time());
        }
    }

  private:
    struct Watched {
        int signal;
        std::size_t stride, seen; ///< every which sample is sent; how many there were in this slice
    };
    struct Checkpoint {
        double time, seen_time;
        std::vector<std::byte> data;
    };

    void post(std::function<void()> task) {
        {
            const std::lock_guard lock(mutex_);
            tasks_.push_back(std::move(task));
        }
        wake_.notify_one();
    }

    void write(const Watched& watched, double time) {
        const Quantity& quantity = quantities_[static_cast<std::size_t>(watched.signal)];
        const int n = infos_[static_cast<std::size_t>(watched.signal)].elements;
        append(frame_, static_cast<std::uint32_t>(watched.signal));
        append(frame_, static_cast<std::uint32_t>(n));
        append(frame_, time);
        for (int i = 0; i < n; ++i) append(frame_, quantity[i]);
    }

    void write_places() {
        for (std::size_t i = 0; sceneries_ && i < sceneries_->size(); ++i) {
            places_.clear();
            (*sceneries_)[i]->look(places_);
            append(frame_, static_cast<std::uint32_t>(first_world + i));
            append(frame_, static_cast<std::uint32_t>(places_.size()));
            append(frame_, seen_time_);
            for (const double value : places_) append(frame_, value);
        }
        shown_time_ = seen_time_;
    }

    // ---- the thread of the run ----

    void live() {
        for (;;) {
            std::deque<std::function<void()>> tasks;
            {
                std::unique_lock lock(mutex_);
                const auto has_work = [&] { return is_over_ || !tasks_.empty(); };
                if (state_.state == Running::running)
                    wake_.wait_until(lock, next_, has_work);
                else
                    wake_.wait(lock, has_work);
                if (is_over_) return;
                tasks.swap(tasks_);
            }
            for (const auto& task : tasks) task();
            if (current() == Running::running) play();
            deliver(!tasks.empty());
        }
    }

    Running current() const {
        const std::lock_guard lock(mutex_);
        return state_.state;
    }
    void enter(Running running, std::string message = {}) {
        const std::lock_guard lock(mutex_);
        state_.state = running;
        state_.message = std::move(message);
    }

    /// Steps for a slice of time, not beyond what the pace allows.
    void play() {
        const auto begin = Clock::now();
        next_ = begin + slice;
        const auto factor = state().factor;
        double until = target_;
        if (factor)
            until = std::min(until, paced_from_ + Seconds(begin + slice - paced_at_).count() * *factor);
        else
            next_ = begin; // at once
        while (run_.time() + run_.period() / 2 < until && Clock::now() - begin < slice)
            if (!advance()) return;
        if (run_.time() + run_.period() / 2 >= target_) {
            const bool is_end = target_ >= run_.stop_time();
            target_ = run_.stop_time();
            enter(is_end ? Running::ended : Running::paused);
        } else if (factor && run_.time() + run_.period() / 2 < until) {
            pace(); // it cannot keep up: no debt is made good for later
        }
    }

    bool advance() {
        if (!run_.step()) {
            enter(Running::failed, run_.failure());
            return false;
        }
        if (run_.time() >= checkpoints_.back().time + interval_ && run_.time() > state().reached)
            checkpoint();
        const std::lock_guard lock(mutex_);
        state_.time = run_.time();
        state_.reached = std::max(state_.reached, state_.time);
        return true;
    }

    void pace() {
        paced_at_ = Clock::now();
        paced_from_ = run_.time();
    }

    void obey(const RunCommand& command) {
        switch (command.action) {
        case Action::start: {
            const Running running = current();
            if (running == Running::failed) return;
            if (running == Running::ended) go_back(0);
            target_ = run_.stop_time();
            set_factor(command.factor);
            next_ = Clock::now();
            enter(Running::running);
            break;
        }
        case Action::pace: set_factor(command.factor); break;
        case Action::pause:
            if (current() == Running::running) enter(Running::paused);
            break;
        case Action::step:
            if (current() == Running::failed || current() == Running::ended) return;
            enter(Running::paused);
            advance();
            break;
        case Action::to: go_to(command.time.value_or(0)); break;
        case Action::stop: go_back(0); break;
        }
    }

    void set_factor(const std::optional<double>& factor) {
        {
            const std::lock_guard lock(mutex_);
            state_.factor = factor;
        }
        pace();
    }

    /// Back to the last checkpoint before that time; the run pauses there.
    void go_back(double time) {
        auto last = std::upper_bound(checkpoints_.begin(), checkpoints_.end(), time + run_.period() / 2,
                                     [](double t, const Checkpoint& c) { return t < c.time; });
        run_.restore(std::prev(last)->data);
        seen_time_ = std::prev(last)->seen_time;
        enter(Running::paused);
        const std::lock_guard lock(mutex_);
        state_.time = run_.time();
    }

    void go_to(double time) {
        time = std::clamp(time, 0.0, run_.stop_time());
        target_ = time;
        if (time < run_.time() || current() == Running::failed || current() == Running::ended) go_back(time);
        // What was simulated before is a matter of milliseconds; what is new is played, to be stopped or
        // watched.
        while (run_.time() + run_.period() / 2 < std::min(time, state().reached))
            if (!advance()) return;
        is_seen_wanted_ = true;
        if (run_.time() + run_.period() / 2 < time) {
            set_factor({});
            enter(Running::running);
        } else {
            target_ = run_.stop_time();
            enter(Running::paused);
        }
    }

    /// From here on it is another run.
    void change(const std::vector<ParameterValue>& asked) {
        ParameterChange change = run_.prepare(run_.follow(asked));
        if (!run_.apply(change)) throw RunError(run_.failure());
        run_.accept(asked);
        is_seen_wanted_ = true; // constants may follow from it
        std::erase_if(checkpoints_, [&](const Checkpoint& c) { return c.time > run_.time(); });
        checkpoint();
        const std::lock_guard lock(mutex_);
        state_.reached = run_.time();
    }

    void checkpoint() {
        if (!checkpoints_.empty() && checkpoints_.back().time >= run_.time()) checkpoints_.pop_back();
        checkpoints_.push_back({run_.time(), seen_time_, run_.snapshot()});
        if (checkpoints_.size() * checkpoints_.back().data.size() < most_bytes) return;
        // Half of them, twice as far apart; the first one is that of the beginning.
        std::vector<Checkpoint> kept;
        for (std::size_t i = 0; i < checkpoints_.size(); i += 2) kept.push_back(std::move(checkpoints_[i]));
        checkpoints_ = std::move(kept);
        interval_ *= 2;
    }

    void deliver(bool was_asked) {
        if (is_seen_wanted_ && seen_time_ >= 0) // what signals were last, whatever their rate
            for (const auto& watched : watched_) write(watched, seen_time_);
        if (seen_time_ >= 0 && (is_seen_wanted_ || shown_time_ != seen_time_)) write_places();
        is_seen_wanted_ = false;
        for (auto& watched : watched_) {
            if (quantities_[static_cast<std::size_t>(watched.signal)].rate == constant_rate) continue;
            watched.stride = std::max<std::size_t>(1, watched.seen / most_samples);
            watched.seen = 0;
        }
        if (!frame_.empty()) listener_.samples(std::exchange(frame_, {}));
        const bool is_quiet = current() != Running::running;
        if (!was_asked && !is_quiet && Clock::now() - told_ < std::chrono::milliseconds(50)) return;
        told_ = Clock::now();
        listener_.state(state());
    }

    const std::shared_ptr<const LoadedModel> model_;
    const Listener listener_;
    Simulation run_;
    const std::vector<Quantity> quantities_;
    std::vector<SignalInfo> infos_;

    mutable std::mutex mutex_; ///< of these four
    std::condition_variable wake_;
    std::deque<std::function<void()>> tasks_;
    bool is_over_ = false;
    RunState state_;

    std::vector<Watched> watched_;
    std::shared_ptr<Sceneries> sceneries_;
    std::vector<double> places_;
    double shown_time_ = -1;              ///< of the places that were told last [s]
    std::vector<Checkpoint> checkpoints_; ///< in the order of time; the first is the beginning
    double interval_ = 0.05;              ///< between two of them [s]
    double target_ = infinity;            ///< time to play to [s]
    Clock::time_point next_{}, told_{}, paced_at_{};
    double paced_from_ = 0;
    double seen_time_ = -1; ///< of the outputs that are there; below 0: none were computed yet [s]
    bool is_seen_wanted_ = false;
    std::string frame_;
    std::thread thread_;
};

Playback::Playback(std::shared_ptr<const LoadedModel> model, Listener listener)
    : loop_(std::make_unique<Loop>(std::move(model), std::move(listener))) {}
Playback::~Playback() = default;

void Playback::command(const RunCommand& command) { loop_->command(command); }
void Playback::tune(const Tune& tune) { loop_->tune(tune); }
void Playback::show(std::shared_ptr<Sceneries> sceneries) { loop_->show(std::move(sceneries)); }
void Playback::watch(std::vector<int> signals) { loop_->watch(std::move(signals)); }
RunState Playback::state() const { return loop_->state(); }
const std::vector<SignalInfo>& Playback::signals() const { return loop_->signals(); }

} // namespace bf::service

#include "bf/service/playback.hpp"

#include "bf/run/comparison.hpp"
#include "bf/run/profile.hpp"
#include "bf/service/worker.hpp"
#include "frame.hpp"
#include "recordings.hpp"
#include "thinning.hpp"
#include "timeline.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

namespace bf::service {

namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr auto slice = std::chrono::milliseconds(15);     ///< between two looks at commands
constexpr auto fill_slice = std::chrono::milliseconds(5); ///< for what is computed again, beside the run
constexpr std::size_t most_samples = 240;                 ///< of a signal in a slice
constexpr std::size_t most_filled = 4000;                 ///< of a signal on a branch that is computed again
constexpr std::size_t most_fillings = 32;                 ///< that wait
constexpr std::size_t most_branches = 16;
constexpr std::size_t most_checkpoint_bytes = std::size_t{256} << 20;
constexpr double infinity = std::numeric_limits<double>::infinity();

} // namespace

class Playback::Loop final : public Run::Observer {
  public:
    Loop(std::shared_ptr<const LoadedModel> model, std::int64_t revision, Listener listener)
        : listener_(std::move(listener)),
          timeline_([this](Played& played) { prepare(played); }, most_checkpoint_bytes, most_branches),
          newest_{model, revision} {
        timeline_.begin(std::move(model), revision);
        state_.state = Running::paused;
        note();
    }
    Loop(const Loop&) = delete;
    Loop& operator=(const Loop&) = delete;

    /// What may be refused waits for the run to take it, which is a matter of one slice.
    void command(const RunCommand& command) {
        const bool may_be_refused = command.action == Action::until || command.action == Action::branch;
        const auto task = [this, command] { obey(command); };
        may_be_refused ? worker_.call(task) : worker_.post(task);
    }
    void tune(const Tune& tune) {
        worker_.call([&] {
            timeline_.change({{tune.name, tune.values}});
            tunings_ = {};
            note();
        });
    }
    void edit(Edited edited) {
        worker_.post([this, edited = std::move(edited)]() mutable {
            newest_ = std::move(edited);
            consider(true);
        });
    }
    void watch(std::vector<int> signals, std::vector<int> branches, std::set<int> again) {
        worker_.post(
            [this, signals = std::move(signals), branches = std::move(branches), again = std::move(again)] {
                std::vector<Watched> wanted;
                for (const int signal : signals) {
                    const auto known = std::ranges::find(watched_, signal, &Watched::signal);
                    wanted.push_back(known == watched_.end() ? Watched{signal} : *known);
                }
                watched_ = std::move(wanted);
                compared_ = branches;
                std::erase_if(filled_, [&](const auto& filled) {
                    return again.contains(filled.second) ||
                           std::ranges::find(watched_, filled.second, &Watched::signal) == watched_.end();
                });
            });
    }
    void refine(double from, double to) {
        worker_.post([this, from, to] {
            for (const int index : shown_branches()) {
                const Timeline::Branch& branch = *timeline_.branch(index);
                const double period = branch.played->run.period();
                const auto floor = [&](double time) { return std::floor(time / period + 1e-6) * period; };
                const double first =
                    std::max(branch.info.from, std::min(floor(from), branch.info.reached - period));
                fill_in(branch, watched_, first, std::min(floor(to) + period, branch.info.reached));
            }
        });
    }
    void show(std::shared_ptr<Sceneries> sceneries) {
        worker_.post([this, sceneries = std::move(sceneries)] {
            sceneries_ = sceneries;
            bound_ = nullptr;
        });
    }
    Times times(bool is_wanted) {
        Times told;
        worker_.call([&] {
            const auto& played = timeline_.current().played;
            if (!is_wanted || timed_ != played) profiler_.reset();
            timed_ = is_wanted ? played : nullptr;
            if (is_wanted && !profiler_) profiler_.emplace(played->run);
            if (profiler_)
                for (const auto& row : profiler_->blocks())
                    told.blocks.push_back({row.name, row.seconds, row.calls});
        });
        return told;
    }
    std::shared_ptr<const LoadedModel> model() const {
        const std::lock_guard lock(mutex_);
        return model_;
    }
    RunState state() const {
        const std::lock_guard lock(mutex_);
        return state_;
    }
    std::int64_t revision() const {
        const std::lock_guard lock(mutex_);
        return revision_;
    }
    std::vector<SignalInfo> signals() const {
        const std::lock_guard lock(mutex_);
        return infos_;
    }

    void observe(const Run& run) noexcept override {
        switch (sees_) {
        case Sees::nothing: break;
        case Sees::instant: // of which events come later
            for (const auto& watched : watched_) write(watched.signal, timeline_.at(), run.time());
            write_places(run.time());
            sees_ = Sees::nothing;
            break;
        case Sees::past: {
            Filling& filling = fillings_.back();
            const Timeline::Branch& branch = *timeline_.branch(filling.cursor.branch);
            if (run.time() + run.period() / 2 < filling.from) break;
            // What a signal was when this begins, it became before.
            if (std::exchange(filling.is_new, false) && filling.from > branch.info.from)
                for (const auto& watched : filling.signals) write(watched.signal, branch, run.time());
            for (auto& watched : filling.signals) sample(run, watched, branch);
            break;
        }
        case Sees::run:
            seen_time_ = run.time();
            for (auto& watched : watched_) sample(run, watched, timeline_.at());
            if (event_ && &run == event_->run) look_for_event(run);
            break;
        }
    }

  private:
    struct Watched {
        int signal;
        Thinning thinning = {};
        std::size_t seen = 0; ///< samples in this slice
        int branch = -1;      ///< of the group that is being thinned, or on which it was sent as a constant
    };
    enum class Sees { run, instant, past, nothing };
    /// Samples that were missed when the run was there.
    struct Filling {
        Timeline::Cursor cursor;
        std::vector<Watched> signals;
        double from, until; ///< s
        bool is_new = true;
    };
    struct Event {
        std::string text;
        const Run* run = nullptr;
        std::optional<Comparison> holds = {}; ///< none: `signal` changes
        Quantity signal = {};
        std::vector<double> before = {}; ///< empty: not looked at yet
        std::optional<double> time = {}; ///< of the step in which it happened [s]
        bool is_inside = false;          ///< the step
    };

    /// What the values of the run depend on, besides what was set last.
    struct Tunings {
        int branch = -1;
        std::size_t changes = 0;
        std::shared_ptr<const LoadedModel> newest = {};
        bool operator==(const Tunings&) const = default;
    };

    /// Pages know signals of all branches by one number, if they have the same path and size.
    void prepare(Played& played) {
        played.run.add_observer(*this);
        const std::lock_guard lock(mutex_);
        std::map<std::pair<std::string, int>, int> known;
        for (const auto& info : infos_) known.emplace(std::pair(info.path, info.elements), info.index);
        for (std::size_t i = 0; i < played.signals.size(); ++i) {
            const Quantity& quantity = played.signals[i];
            const int elements = static_cast<int>(quantity.info.elements());
            const auto [at, is_new] =
                known.emplace(std::pair(quantity.path, elements), static_cast<int>(infos_.size()));
            if (is_new) {
                infos_.push_back(described(at->second, quantity.path, quantity.info));
                infos_.back().is_continuous =
                    played.model->diagram.rates[static_cast<std::size_t>(quantity.rate)].is_continuous;
            }
            const auto index = static_cast<std::size_t>(at->second);
            if (played.places.size() <= index) played.places.resize(index + 1, -1);
            played.places[index] = static_cast<int>(i);
        }
    }

    static const Quantity* quantity_of(const Played& played, int signal) {
        const auto index = static_cast<std::size_t>(signal);
        const int place = index < played.places.size() ? played.places[index] : -1;
        return place < 0 ? nullptr : &played.signals[static_cast<std::size_t>(place)];
    }

    auto writer(const Watched& watched) {
        return [this, &watched](double time, const std::vector<double>& values) {
            append_piece(frame_, static_cast<std::uint32_t>(watched.signal), watched.branch, values.size(),
                         time);
            for (const double value : values) append(frame_, value);
        };
    }
    void sample(const Run& run, Watched& watched, const Timeline::Branch& branch) {
        const Quantity* const quantity = quantity_of(*branch.played, watched.signal);
        if (!quantity) return;
        if (watched.branch != branch.info.index) finish(watched);
        const bool is_first = std::exchange(watched.branch, branch.info.index) != branch.info.index;
        if (quantity->rate == constant_rate) {
            if (is_first) write(watched.signal, branch, run.time());
        } else if (run.is_hit(quantity->rate)) {
            ++watched.seen;
            watched.thinning.take(run.time(), *quantity, writer(watched));
        }
    }
    /// What it thinned so far is sent.
    void finish(Watched& watched) { watched.thinning.finish(writer(watched)); }

    void write(int signal, const Timeline::Branch& branch, double time) {
        const Quantity* const quantity = quantity_of(*branch.played, signal);
        if (!quantity) return;
        const auto n = quantity->info.elements();
        append_piece(frame_, static_cast<std::uint32_t>(signal), branch.info.index, n, time);
        for (std::size_t i = 0; i < n; ++i) append(frame_, (*quantity)[static_cast<int>(i)]);
    }

    void write_places(double time) {
        const auto& played = timeline_.at().played;
        if (sceneries_ && bound_ != played) {
            try {
                for (const auto& scenery : *sceneries_) scenery->bind(played->signals);
                bound_ = played;
            } catch (const std::exception&) { // they are of another model
            }
        }
        if (!sceneries_ || bound_ != played) return;
        for (std::size_t i = 0; i < sceneries_->size(); ++i) {
            places_.clear();
            (*sceneries_)[i]->look(places_);
            append_piece(frame_, static_cast<std::uint32_t>(first_world + i), timeline_.at().info.index,
                         places_.size(), time);
            for (const double value : places_) append(frame_, value);
        }
        shown_time_ = time;
    }

    // ---- the thread of the run ----

    Worker::Time turn(bool was_asked) {
        if (current() == Running::running) play();
        if (fillings_.empty()) find_filling();
        if (!fillings_.empty()) fill();
        if (fillings_.empty()) find_filling();
        const bool rests = current() != Running::running;
        const bool has_news = was_asked || (rests && was_running_);
        if (rests && has_news) look();
        deliver(has_news);
        was_running_ = !rests;
        return was_running_ ? next_ : !fillings_.empty() ? Worker::at_once : Worker::never;
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

    /// Of where the run is.
    void note() {
        const Timeline::Branch& shown = timeline_.current();
        const Tunings now{timeline_.at().info.index, timeline_.changes_so_far().size(), newest_.model};
        const bool is_other = std::exchange(tunings_, now) != now;
        const auto unlike =
            is_other ? timeline_.unlike(newest_.model->diagram) : std::vector<ParameterValue>();
        const std::lock_guard lock(mutex_);
        if (is_other) {
            state_.tuned.clear();
            for (const auto& [name, values] : unlike) state_.tuned.push_back({name, values});
        }
        state_.time = state_.state == Running::running ? std::max(seen_time_, 0.0) : timeline_.time();
        state_.step = 2 * half_step();
        state_.reached = timeline_.reached();
        state_.branch = shown.info.index;
        state_.branches.clear();
        for (const auto& branch : timeline_.branches()) state_.branches.push_back(branch->info);
        state_.stop.reset();
        if (std::isfinite(stop_time())) state_.stop = stop_time();
        revision_ = shown.played->revision;
        model_ = shown.played->model;
    }

    double stop_time() const { return timeline_.current().played->run.stop_time(); }
    double half_step() const { return timeline_.current().played->run.period() / 2; }
    bool is_before(double time) const { return timeline_.time() + half_step() < time; }

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
        while (is_before(until) && Clock::now() - begin < slice)
            if (!advance()) return;
        if (!is_before(target_)) {
            const bool is_end = target_ >= stop_time();
            target_ = stop_time();
            rest(is_end ? Running::ended : Running::paused);
        } else if (factor && is_before(until)) {
            pace(); // it cannot keep up: no debt is made good for later
        }
    }

    /// False where the run does not go on.
    bool advance() {
        const double before = timeline_.time();
        if (event_ && event_->run != &timeline_.run()) bind_event();
        if (!timeline_.advance()) {
            rest(Running::failed, timeline_.run().failure());
            return false;
        }
        if (!event_ || !event_->time) return true;
        const bool is_inside = event_->is_inside;
        rest(Running::paused);
        if (!is_inside) timeline_.go_to(before); // where the outputs are those of the event
        return false;
    }

    void rest(Running running, std::string message = {}) {
        event_.reset();
        enter(running, std::move(message));
    }

    void pace() {
        paced_at_ = Clock::now();
        paced_from_ = timeline_.time();
    }

    void obey(const RunCommand& command) {
        const Running running = current();
        const bool is_over = running == Running::failed || running == Running::ended;
        switch (command.action) {
        case Action::start:
        case Action::until:
            if ((is_over || timeline_.time() == 0) && went_through_other())
                begin();
            else if (running == Running::failed)
                return;
            else if (running == Running::ended)
                go_back(0);
            if (current() == Running::failed) return;
            event_.reset();
            if (command.action == Action::until) {
                event_ = Event{command.event};
                try {
                    bind_event();
                } catch (const RunError&) {
                    event_.reset();
                    throw;
                }
            }
            target_ = stop_time();
            set_factor(command.factor);
            next_ = Clock::now();
            enter(Running::running);
            break;
        case Action::pace: set_factor(command.factor); break;
        case Action::emergency_stop: break; // of runs of other programs alone
        case Action::pause:
            if (running == Running::running) rest(Running::paused);
            break;
        case Action::step:
            if (is_over) return;
            rest(Running::paused);
            advance();
            break;
        case Action::to: go_to(command.time.value_or(0)); break;
        case Action::stop: go_back(0); break;
        case Action::branch:
            timeline_.choose(command.branch.value_or(-1));
            target_ = stop_time();
            rest(Running::paused);
            consider(false);
            break;
        case Action::adopt: adopt(); break;
        }
    }

    void set_factor(const std::optional<double>& factor) {
        {
            const std::lock_guard lock(mutex_);
            state_.factor = factor;
        }
        pace();
    }

    /// The run pauses there.
    void go_back(double time) {
        rest(Running::paused);
        timeline_.go_to(time, true);
    }

    void go_to(double time) {
        time = std::clamp(time, 0.0, stop_time());
        const Running running = current();
        const bool is_over = running == Running::failed || running == Running::ended;
        rest(Running::paused);
        target_ = time;
        // What was simulated before is a matter of milliseconds; what is new is played, to be stopped or
        // watched.
        if (!timeline_.go_to(std::min(time, timeline_.reached()), is_over))
            return rest(Running::failed, timeline_.run().failure());
        if (is_before(time)) {
            set_factor({});
            enter(Running::running);
        } else {
            target_ = stop_time();
        }
        if (is_over) consider(false);
    }

    // ---- edits ----

    bool is_other(const Timeline::Branch& branch) const {
        return !is_same_run(newest_.model->diagram, branch.played->model->diagram);
    }
    /// Did the run, on the way to where it ends, go through a model that is not the newest one?
    bool went_through_other() const {
        for (const auto* on = &timeline_.current(); on; on = timeline_.branch(on->info.parent))
            if (is_other(*on)) return true;
        return false;
    }

    void begin() {
        try {
            timeline_.begin(newest_.model, newest_.revision);
            waits({});
            rest(Running::paused);
        } catch (const std::exception& error) {
            rest(Running::failed, error.what());
        }
    }

    void waits(std::optional<RunEdit> edit) {
        const std::lock_guard lock(mutex_);
        state_.edit = std::move(edit);
    }

    /// What becomes of the newest model.
    void consider(bool may_adopt) {
        const Timeline::Branch& shown = timeline_.current();
        if (!is_other(shown)) {
            shown.played->revision = newest_.revision;
            return waits({});
        }
        if (shown.info.reached == 0 && shown.info.parent < 0) return begin();
        const Running now = current();
        if (now == Running::ended || now == Running::failed) return waits({}); // the next run is one of it
        RunEdit edit = timeline_.compare(newest_);
        const bool is_lossless = edit.refusal.empty() && edit.lost.empty() && edit.unclear.empty();
        waits(std::move(edit));
        if (may_adopt && is_lossless) adopt();
    }

    void adopt() {
        if (!is_other(timeline_.current())) return;
        try {
            timeline_.edit(newest_);
            waits({});
            target_ = stop_time();
            if (const Running now = current(); now != Running::running) rest(Running::paused);
            if (!is_before(target_)) rest(Running::ended);
        } catch (const std::exception& error) {
            waits(RunEdit{error.what()});
        }
    }

    // ---- what pages see ----

    void bind_event() {
        const Run& run = timeline_.run();
        event_->run = &run;
        event_->before.clear();
        if (event_->text.find_first_of("<>=") == std::string::npos)
            event_->signal = find_signal(run, event_->text);
        else
            event_->holds.emplace(run, event_->text);
    }

    void look_for_event(const Run& run) noexcept {
        std::vector<double> now;
        if (event_->holds)
            now.push_back((*event_->holds)() ? 1 : 0);
        else
            now = event_->signal.values();
        const bool happens = event_->holds ? !event_->before.empty() && event_->before[0] == 0 && now[0] == 1
                                           : !event_->before.empty() && event_->before != now;
        if (happens && !event_->time) {
            event_->time = run.time();
            event_->is_inside = run.shows_event();
        }
        event_->before = std::move(now);
    }

    /// What a recording has of the instant at which the run rests. At the end it has nothing, and what was
    /// seen last stays.
    void look() {
        if ((watched_.empty() && !sceneries_) || current() == Running::failed || !is_before(stop_time()))
            return;
        sees_ = Sees::instant;
        timeline_.peek();
        sees_ = Sees::run;
    }

    /// Branches of which all samples are wanted.
    std::set<int> shown_branches() const {
        std::set<int> all;
        std::vector<int> wanted = compared_;
        wanted.push_back(timeline_.current().info.index);
        for (const int index : wanted)
            for (const auto* on = timeline_.branch(index); on; on = timeline_.branch(on->info.parent))
                all.insert(on->info.index);
        return all;
    }

    void find_filling() {
        for (const int index : shown_branches()) {
            const Timeline::Branch& branch = *timeline_.branch(index);
            std::vector<Watched> missing;
            for (const auto& watched : watched_)
                if (filled_.emplace(index, watched.signal).second) missing.push_back({watched.signal});
            if (fill_in(branch, missing, branch.info.from, branch.info.reached)) return;
        }
    }

    /// Computes samples from one time to another again, before all else that is to be computed again.
    bool fill_in(const Timeline::Branch& branch, const std::vector<Watched>& signals, double from,
                 double until) {
        const Played& played = *branch.played;
        std::vector<Watched> wanted;
        for (const auto& watched : signals) {
            const Quantity* const quantity = quantity_of(played, watched.signal);
            if (!quantity) continue;
            wanted.push_back({watched.signal});
            if (quantity->rate == constant_rate) continue;
            const auto ticks = played.model->diagram.rates[static_cast<std::size_t>(quantity->rate)].ticks;
            const double samples = (until - from) / played.run.period() / static_cast<double>(ticks);
            wanted.back().thinning.stride =
                stride(*quantity, static_cast<std::size_t>(std::max(samples, 0.0)), most_filled);
        }
        if (wanted.empty() || until <= from) return false;
        if (fillings_.size() >= most_fillings) fillings_.erase(fillings_.begin());
        fillings_.push_back({timeline_.before(branch.info.index, from), std::move(wanted), from, until});
        return true;
    }
    /// Which leaves at most so many samples.
    static std::size_t stride(const Quantity& quantity, std::size_t samples, std::size_t most) {
        const std::size_t left = Thinning::most_left(static_cast<int>(quantity.info.elements()));
        return samples <= most ? 1 : samples * left / most + 1;
    }

    void fill() {
        Filling& filling = fillings_.back();
        const Timeline::Branch* const branch = timeline_.branch(filling.cursor.branch);
        if (!branch) return fillings_.pop_back(); // it was forgotten
        const Timeline::Cursor here = timeline_.leave();
        timeline_.enter(filling.cursor);
        sees_ = Sees::past;
        const Simulation& run = branch->played->run;
        bool goes_on = true;
        for (const auto end = Clock::now() + fill_slice; goes_on && Clock::now() < end;)
            goes_on = run.time() + run.period() / 2 < filling.until && timeline_.step(filling.cursor);
        sees_ = Sees::run;
        filling.cursor.data = run.snapshot();
        timeline_.enter(here);
        if (goes_on) return;
        for (auto& watched : filling.signals) finish(watched);
        fillings_.pop_back();
    }

    void deliver(bool was_asked) {
        note();
        for (auto& watched : watched_) {
            finish(watched);
            const auto* const branch = timeline_.branch(watched.branch);
            const Quantity* const quantity = branch ? quantity_of(*branch->played, watched.signal) : nullptr;
            if (quantity) watched.thinning.stride = stride(*quantity, watched.seen, most_samples);
            watched.seen = 0;
        }
        if (seen_time_ != shown_time_ && current() != Running::paused && seen_time_ >= 0)
            write_places(seen_time_);
        if (!frame_.empty()) listener_.samples(std::exchange(frame_, {}));
        if (!was_asked &&
            (current() != Running::running || Clock::now() - told_ < std::chrono::milliseconds(50)))
            return;
        told_ = Clock::now();
        listener_.state(state(), revision());
    }

    const Listener listener_;

    mutable std::mutex mutex_; ///< of these four
    RunState state_;
    std::int64_t revision_ = 0;
    std::shared_ptr<const LoadedModel> model_;
    std::vector<SignalInfo> infos_;

    Timeline timeline_;
    Edited newest_; ///< of the document
    Tunings tunings_;
    std::vector<Watched> watched_;
    std::vector<int> compared_;            ///< branches
    std::set<std::pair<int, int>> filled_; ///< branches and signals of which all is known, or comes
    std::vector<Filling> fillings_;        ///< the last one is under way
    std::shared_ptr<Sceneries> sceneries_;
    std::shared_ptr<const Played> bound_; ///< whose signals tell where things are
    std::vector<double> places_;
    std::shared_ptr<Played> timed_;
    std::optional<Profiler> profiler_; ///< of its run
    double shown_time_ = -1;           ///< of the places that were told last [s]
    std::optional<Event> event_;
    Sees sees_ = Sees::run;
    double target_ = infinity; ///< time to play to [s]
    Clock::time_point next_{}, told_{}, paced_at_{};
    double paced_from_ = 0;
    double seen_time_ = -1; ///< of the outputs that are there; below 0: none were computed yet [s]
    std::string frame_;
    bool was_running_ = false;                                          ///< after the last turn
    Worker worker_{[this](bool was_asked) { return turn(was_asked); }}; ///< last: its thread ends first
};

Playback::Playback(std::shared_ptr<const LoadedModel> model, std::int64_t revision, Listener listener)
    : loop_(std::make_unique<Loop>(std::move(model), revision, std::move(listener))) {}
Playback::~Playback() = default;

void Playback::command(const RunCommand& command) { loop_->command(command); }
void Playback::tune(const Tune& tune) { loop_->tune(tune); }
void Playback::edit(std::shared_ptr<const LoadedModel> model, std::int64_t revision, std::string cause,
                    Moves moves) {
    loop_->edit({std::move(model), revision, std::move(cause), std::move(moves)});
}
void Playback::watch(std::vector<int> signals, std::vector<int> branches, std::set<int> again) {
    loop_->watch(std::move(signals), std::move(branches), std::move(again));
}
void Playback::refine(double from, double to) { loop_->refine(from, to); }
Times Playback::times(bool is_wanted) { return loop_->times(is_wanted); }
void Playback::show(std::shared_ptr<Sceneries> sceneries) { loop_->show(std::move(sceneries)); }
std::shared_ptr<const LoadedModel> Playback::model() const { return loop_->model(); }
RunState Playback::state() const { return loop_->state(); }
std::int64_t Playback::revision() const { return loop_->revision(); }
std::vector<SignalInfo> Playback::signals() const { return loop_->signals(); }

} // namespace bf::service

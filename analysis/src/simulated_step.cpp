#include "bf/analysis/tune_loop.hpp"
#include "injection.hpp"
#include "loop_by_gains.hpp"
#include "named.hpp"

#include <cmath>
#include <memory>

namespace bf::analysis {

namespace {

/// Elements of signals that are held where they are.
class Held {
  public:
    Held(Simulation& run, const std::vector<std::string>& signals) {
        const Diagram& d = run.diagram();
        const SignalFinder finder(d);
        for (const auto& signal : signals) {
            const auto its = named(signal, [&](const std::string& path) { return finder.find(path); });
            const auto numbers = its.end.node < 0 ? std::vector<int>() : elements(d, its);
            if (numbers.size() <= 1) find_element(d, signal); // which says what is wrong with it
            for (const int i : numbers) {
                auto& held = all_.emplace_back(std::make_unique<One>());
                held->injection = std::make_unique<Injection>(
                    run, Element{its.end, i, signal, ""},
                    [one = held.get()](double) { return one->value - one->injection->own(); });
                held->value = held->injection->own();
            }
        }
    }
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    ~Held() {
        while (!all_.empty()) all_.pop_back(); // the last one lies around those before
    }

  private:
    struct One {
        double value = 0;
        std::unique_ptr<Injection> injection;
    };
    std::vector<std::unique_ptr<One>> all_;
};

} // namespace

SimulatedStep simulated_step(Simulation& run, const std::string& loop, double duration, double height,
                             const std::vector<std::string>& open, const std::function<bool()>& go_on) {
    if (!(duration > 0) || !std::isfinite(duration))
        throw RunError("a step is simulated for longer than 0 s, not for " + short_text(duration) + " s");
    if (!std::isfinite(height)) throw RunError("the height of a step is a number, not " + short_text(height));
    constexpr double most_steps = 1e8; // of which each takes four numbers
    if (duration / run.period() > most_steps)
        throw RunError("a step of " + short_text(duration) + " s has " + short_text(duration / run.period()) +
                       " samples, of which " + short_text(most_steps) +
                       " can be kept; simulate it for a shorter time");
    const Element at = find_element(run.diagram(), loop);
    const auto start = run.snapshot();
    const double value =
        read_value(run.context().data(at.end.node, at.end.slot), run.diagram().slot(at.end).type, at.number);
    SimulatedStep found{
        .time = {}, .value = {}, .height = height != 0 ? height : 0.01 * std::max(1.0, std::abs(value))};
    /// What the loop's block computes, after each step's outputs.
    struct Watch final : Run::Observer {
        Injection* injection = nullptr;
        std::vector<double> values;
        void observe(const Run& of) noexcept override {
            if (!of.shows_event() && values.size() < values.capacity()) values.push_back(injection->own());
        }
    };
    const auto steps = static_cast<std::size_t>(run.steps_before(duration));
    const auto back = [&](double added) {
        run.restore(start);
        const Held held(run, open);
        Injection injection(run, at, [added](double) { return added; });
        Watch watch;
        watch.injection = &injection;
        watch.values.reserve(steps);
        run.add_observer(watch);
        const std::shared_ptr<void> end(nullptr, [&](void*) { run.remove_observer(watch); });
        for (std::size_t k = 0; k < steps; ++k) {
            if (go_on && k % 1000 == 0 && !go_on()) throw Interrupted("the simulated step was interrupted");
            if (!run.step())
                throw RunError("the simulated step " +
                               (added == 0 ? "ends at " : "of " + short_text(added) + " ends at ") +
                               short_text(run.time()) + " s: " + run.failure());
        }
        return watch.values;
    };
    std::vector<double> still, stepped;
    try {
        still = back(0);
        stepped = back(found.height);
    } catch (...) {
        run.restore(start);
        throw;
    }
    run.restore(start);
    for (std::size_t k = 0; k < steps; ++k) {
        found.time.push_back(static_cast<double>(k) * run.period());
        found.value.push_back(-(stepped[k] - still[k]) / found.height);
    }
    return found;
}

} // namespace bf::analysis

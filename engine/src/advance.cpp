#include "bf/engine/simulation.hpp"

#include <cmath>

namespace bf {

namespace {

class EventWatch final : public Simulation::Observer {
  public:
    explicit EventWatch(const std::function<bool(const Simulation&)>& event) : event_(event) {}
    void observe(const Simulation& simulation) noexcept override { happened = event_(simulation); }
    bool happened = false;

  private:
    const std::function<bool(const Simulation&)>& event_;
};

/// The first step that does not stand before that time.
double step_at(double time, double period) { return std::round(time / period); }

} // namespace

bool Simulation::run_until(const std::function<bool(const Simulation&)>& event, double limit) {
    EventWatch watch(event);
    observers_.push_back(&watch);
    const double last = step_at(limit, diagram_.step);
    while (!watch.happened && static_cast<double>(steps_) < last && step()) {
    }
    std::erase(observers_, &watch);
    return watch.happened && status_;
}

bool Simulation::run_until(double time) {
    const double last = step_at(time, diagram_.step);
    while (static_cast<double>(steps_) < last)
        if (!step()) return false;
    return true;
}

void Simulation::visit_tasks(const TaskVisitor& visit) {
    const auto all = [&](std::vector<BoundSegment>& segments, Phase phase) {
        for (auto& segment : segments)
            for (std::size_t i = 0; i < segment.tasks.size(); ++i)
                visit(segment.tasks[i], phase, segment.nodes[i], segment.rate);
    };
    all(outputs_, Phase::output);
    all(minor_outputs_, Phase::output);
    all(updates_, Phase::update);
    all(derivatives_, Phase::derivative);
    all(guards_, Phase::guards);
}

} // namespace bf

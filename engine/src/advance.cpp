#include "machine.hpp"

#include "bf/kernels/steps.hpp"

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

} // namespace

std::int64_t Simulation::steps_before(double time) const {
    return kernels::steps_before(time, diagram_.step);
}

bool Simulation::run_until(const std::function<bool(const Simulation&)>& event, double limit) {
    EventWatch watch(event);
    observers_.push_back(&watch);
    const std::int64_t last = steps_before(limit);
    while (!watch.happened && steps_ < last && step()) {
    }
    std::erase(observers_, &watch);
    return watch.happened && status_;
}

bool Simulation::run_until(double time) {
    const std::int64_t last = steps_before(time);
    while (steps_ < last)
        if (!step()) return false;
    return true;
}

void Simulation::visit_tasks(const TaskVisitor& visit) { machine_->visit_tasks(visit); }

} // namespace bf

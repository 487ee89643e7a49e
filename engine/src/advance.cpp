#include "machine.hpp"

namespace bf {

namespace {

class EventWatch final : public Simulation::Observer {
  public:
    EventWatch(const std::function<bool(const Simulation&)>& event, const Simulation& simulation)
        : event_(event), simulation_(simulation) {}
    void observe(const Run&) noexcept override { happened = event_(simulation_); }
    bool happened = false;

  private:
    const std::function<bool(const Simulation&)>& event_;
    const Simulation& simulation_;
};

} // namespace

bool Simulation::run_until(const std::function<bool(const Simulation&)>& event, double limit) {
    EventWatch watch(event, *this);
    add_observer(watch);
    const std::int64_t last = steps_before(limit);
    while (!watch.happened && steps_ < last && step()) {
    }
    remove_observer(watch);
    return watch.happened && status_;
}

void Simulation::visit_tasks(const TaskVisitor& visit) { machine_->visit_tasks(visit); }

} // namespace bf

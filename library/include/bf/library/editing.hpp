// The model of a run against the clock is edited while it runs.
#pragma once

#include "bf/engine/simulation.hpp"
#include "bf/library/load.hpp"
#include "bf/realtime/server.hpp"

#include <functional>
#include <memory>

namespace bf {

/// Makes simulations of the models that viewers send, each of which goes on where the one before is (see
/// Simulation::take_over). An edited model keeps the step of the run, and has no other plugins than the one
/// that the program began with; changes by name that the program was started with hold for it, too.
class SimulationEditing final : public realtime::Editing {
  public:
    /// Makes what sees the steps of a simulation, besides the server; may give nothing.
    using Observe = std::function<std::unique_ptr<Run::Observer>(Run& run)>;

    /// Both outlive it; so does what `observe` gives, for as long as its run is stepped.
    SimulationEditing(const LoadedModel& model, Simulation& simulation, Observe observe = {});
    ~SimulationEditing() override;

    realtime::Edited prepare(const realtime::Edit& edit, const std::vector<ParameterValue>& asked) override;
    void finish(bool has_taken_over) override;

    /// Of the edit that was prepared last, before it is finished.
    const ModelSource& prepared() const;

  private:
    struct Next;
    realtime::Edited compared(const realtime::Edit& edit, const std::vector<ParameterValue>& asked);

    const Observe observe_;
    const LoadedModel* model_;
    Simulation* simulation_;
    std::unique_ptr<Next> now_, next_; ///< none at first
};

} // namespace bf

// What is added to a signal of a run while it steps.
#pragma once

#include "bf/engine/simulation.hpp"
#include "element.hpp"

#include <functional>
#include <memory>
#include <vector>

namespace bf::analysis {

/// As long as one lives, all that read the element over a wire, and observers, see it with `added(t)` [s] on
/// top, also inside of a solver's steps; the block that computes it goes on from its own value. Of a sampled
/// signal it is added at its hits.
class Injection {
  public:
    /// The run is between two steps, and outlives the injection. Throws RunError: nobody reads it in a step.
    Injection(Simulation& run, const Element& at, std::function<double(double)> added);
    ~Injection();
    Injection(const Injection&) = delete;
    Injection& operator=(const Injection&) = delete;

    /// To be said after the run was restored: the element then is what its block computed.
    void begin() { own_ = get(); }
    double own() const { return own_; } ///< as its block computed it last

  private:
    /// A task of the block that computes it, or of one that reads it.
    struct Wrapped {
        Injection* injection;
        Task task;
        const Clock* clock;
        Phase phase;
    };
    static Status run_computing(const void* wrapped, int) noexcept;
    static Status run_reading(const void* wrapped, int) noexcept;
    double get() const;
    void put(double value);

    Simulation& run_;
    std::function<double(double)> added_;
    void* data_; ///< of the element
    bool is_double_;
    double own_ = 0, now_ = 0; ///< of what is added now
    std::vector<std::unique_ptr<Wrapped>> wrapped_;
};

} // namespace bf::analysis

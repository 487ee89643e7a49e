// A run in Python, with all that lives as long as it.
#pragma once

#include "bf/analysis/linearize.hpp"
#include "native.hpp"

#include <optional>
#include <unordered_map>

namespace bf::python {

/// The first exception of Python in a step, which its caller gets when the step is done.
class Pending {
  public:
    bool is_there() const noexcept { return is_there_; }
    /// The GIL is held, as in the next ones.
    void keep(nb::python_error& error, bool is_of_block = false) noexcept;
    nb::object take() noexcept;
    void raise(); ///< throws it, if it is there
    /// The same after an analysis that went well: where a block raises beside the operating point, its slope
    /// is that of the other side.
    void raise_unless_of_block();

  private:
    nb::object error_;
    bool is_of_block_ = false;
    std::atomic<bool> is_there_ = false;
};

/// Of the run that this thread steps, the exception that a block raised.
void keep_cause(nb::python_error& error) noexcept;

struct PythonRun {
    explicit PythonRun(std::shared_ptr<PythonModel> of);
    ~PythonRun();

    std::shared_ptr<PythonModel> model;
    Simulation run;
    std::optional<analysis::Linearizer> linearizer; ///< the last one, for the next point
    std::vector<Quantity> signals, inputs, parameters;
    std::unordered_map<std::string, std::size_t> signal_numbers;
    std::vector<std::unique_ptr<Run::Observer>> observers;
    std::vector<std::shared_ptr<Recorder>> recorders;
    Pending pending;
    std::atomic<bool> is_in_use = false;
    bool is_started = false;

    void require_started() const;
};

/// One thread at a time steps, restores, records or changes a run. Throws RunError in another one, and in its
/// observers.
class InUse {
  public:
    explicit InUse(PythonRun& run);
    ~InUse();
    InUse(const InUse&) = delete;
    InUse& operator=(const InUse&) = delete;

  private:
    PythonRun& run_;
    Pending* around_;
};

} // namespace bf::python

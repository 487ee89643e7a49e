// Generated code in a shared library as a run.
#pragma once

#include "bf/run/run.hpp"
#include "bf/run/run_c.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace bf {

/// A model of a shared library that exports bf_run_v1 (see run_c.h), as projects of `bf generate` do. Its
/// signals are those that the model records; inputs of the root are all that comes from outside.
class LoadedRun final : public Run {
  public:
    /// Opens the library for as long as the run lives. Throws RunError when it cannot or exports no run.
    explicit LoadedRun(const std::filesystem::path& library);
    /// A model that another loop makes, initialises and steps, and that outlives this: whatever looks at a
    /// run or changes its parameters may do so then. That loop calls observers, and `show_event` at an event.
    LoadedRun(const bf_run_library& library, bf_run_model& model);
    ~LoadedRun() override;

    std::string name() const override { return library_->name; }
    double period() const override { return library_->period; }
    double stop_time() const override { return library_->stop_time; }
    std::vector<RunRate> rates() const override;
    std::vector<RunPanel> plots() const override;

    std::vector<Quantity> signals() const override { return table(bf_run_signals); }
    std::vector<Quantity> recorded() const override { return signals(); }
    std::vector<Quantity> inputs() const override { return table(bf_run_inputs); }
    std::vector<Quantity> outside() const override { return inputs(); }
    std::vector<Quantity> parameters() const override;

    void start() override;
    Status step() noexcept override;
    void stop() noexcept override;

    double time() const override { return static_cast<double>(steps()) * period(); }
    std::int64_t steps() const override { return library_->steps(model_); }
    std::string failure() const override;
    std::vector<CheckResult> checks() const override;
    bool is_hit(int rate) const override;
    bool shows_event() const override { return shows_event_; }
    std::string not_for_real_time() const override { return {}; } // generated code has none of that

    ParameterChange prepare(const std::vector<ParameterValue>& values) override;
    Status apply(ParameterChange& change) noexcept override;
    std::vector<ParameterValue> variables() const override;
    /// The model itself follows its variables.
    std::vector<ParameterValue> follow(const std::vector<ParameterValue>& asked) const override;
    void show_event(Observer& observer) noexcept;
    void accept(const std::vector<ParameterValue>&) override {}

    std::vector<std::byte> snapshot() const override;
    void restore(const std::vector<std::byte>& snapshot) override;
    std::uint64_t fingerprint() const override { return library_->fingerprint; }
    void visit_tasks(const TaskVisitor&) override {}

  private:
    std::vector<Quantity> table(bf_run_table table) const;
    void read_given();

    std::shared_ptr<void> handle_; ///< null: the model is another's
    const bf_run_library* library_ = nullptr;
    bf_run_model* model_ = nullptr;
    std::vector<std::vector<std::byte>> given_; ///< to parameters by the model
    bool is_started_ = false, shows_event_ = false;
};

} // namespace bf

// The model of an instance of an FMU.
#pragma once

#include "bf/codegen/fmu_memory.hpp"
#include "bf/codegen/fmu_messages.hpp"
#include "bf/codegen/fmu_state.hpp"
#include "bf/codegen/fmu_structure.hpp"

#include <string>
#include <utility>

namespace bf::generated {

/// Which model of the FMU it is, its memory, and how far it has come.
class FmuModel : public FmuMessages {
  public:
    /// `resources`: the folder of the FMU's files, which a model of rules alone does without.
    FmuModel(const FmuModels& models, const char* name, fmi::CallOrder order_of_calls, Log log_message,
             std::string resources)
        : FmuMessages(name, order_of_calls, log_message), structure(models), tables_(models.first),
          resources_(std::move(resources)) {}
    FmuModel(const FmuModel&) = delete;
    FmuModel& operator=(const FmuModel&) = delete;
    ~FmuModel() { close(); }

    const FmuTables& tables() const noexcept { return *tables_; }
    const Exchange& exchange() const noexcept { return *exchange_; }
    bf_run_model* model() noexcept { return model_; }
    double time() const noexcept { return moment_.time; }
    bool has_state() const noexcept { return memory_.size() > 0; }
    std::size_t model_size() const noexcept { return memory_.size(); } ///< bytes of a saved model

    FmuVariables variables;
    FmuStructure structure;

  protected:
    /// False, with a message, where it cannot be made.
    bool open() {
        exchange_ = tables_->exchange;
        library_ = tables_->library();
        host_ = tables_->host;
        model_ = library_->create();
        if (!model_) return fail("there is no memory for the model");
        moment_ = {};
        folder_ = resources_;
        if (host_ && !host_->make(model_, folder_)) return fail_of_model();
        if (!variables.bind(*tables_, model_, &moment_.time)) return fail("its tables do not fit its code");
        memory_.bind(*tables_, model_);
        return true;
    }
    void close() noexcept {
        if (moment_.is_initialized) library_->terminate(model_);
        if (model_) library_->destroy(model_);
        model_ = nullptr;
        moment_.is_initialized = false;
    }
    /// The next to open.
    void choose(const FmuTables& tables) {
        close();
        tables_ = &tables;
        structure.set(tables);
    }

    /// When the next step of the model is, in its time.
    double due() const noexcept { return double(library_->steps(model_)) * library_->period; }
    bool fail_of_model() {
        const char *const block = library_->failed_block(model_), *const why = library_->failure(model_);
        message(Level::error, "logStatusError", "at %g s: %s%s%s", moment_.time, block ? block : "",
                block && *block ? ": " : "", why ? why : "the model failed");
        return false;
    }

    const FmuTables* tables_; ///< of the present model, as all that follows
    const Exchange* exchange_ = nullptr;
    const bf_run_library* library_ = nullptr;
    const FmuHost* host_ = nullptr;
    bf_run_model* model_ = nullptr;
    FmuMemory memory_; ///< kept while the signals of a step are computed
    FmuMoment moment_;

  private:
    std::string resources_, folder_; ///< the last one of the model's files
};

} // namespace bf::generated

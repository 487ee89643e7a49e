#pragma once

#include "bf/library/load.hpp"
#include "bf/service/worker.hpp"

#include <functional>
#include <memory>
#include <mutex>
#include <optional>

namespace bf::service {

/// Checks models beside the thread of the service, the newest alone.
class Checker {
  public:
    using Done = std::function<void(std::shared_ptr<const ExaminedModel>)>; ///< called there

    /// `source` has the texts that the model was read from: mistakes stand at their lines.
    void check(std::shared_ptr<const model::Model> model, ModelSource source, Done done);

  private:
    struct Job {
        std::shared_ptr<const model::Model> model;
        ModelSource source;
        Done done;
    };
    static ExaminedModel examined(Job& job);
    void check_newest();

    std::mutex mutex_; ///< of the job
    std::optional<Job> job_;
    Worker worker_; ///< last: its thread ends first
};

} // namespace bf::service

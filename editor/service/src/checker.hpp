#pragma once

#include "bf/library/load.hpp"
#include "bf/service/worker.hpp"

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

namespace bf::service {

/// Checks models beside the thread of the service, the newest alone.
class Checker {
  public:
    using Done = std::function<void(std::shared_ptr<const ExaminedModel>)>; ///< called there

    void check(model::Model model, std::filesystem::path file, Done done);

  private:
    struct Job {
        model::Model model;
        std::filesystem::path file;
        Done done;
    };
    static ExaminedModel examined(const Job& job);
    void check_newest();

    std::mutex mutex_; ///< of the job
    std::optional<Job> job_;
    Worker worker_; ///< last: its thread ends first
};

} // namespace bf::service

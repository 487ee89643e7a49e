#pragma once

#include "bf/formats/yaml.hpp"
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

    /// `texts` are those of the model's files: mistakes stand at their lines.
    void check(formats::Files texts, std::filesystem::path file, Done done);

  private:
    struct Job {
        formats::Files texts;
        std::filesystem::path file;
        Done done;
    };
    static ExaminedModel examined(Job& job);
    void check_newest();

    std::mutex mutex_; ///< of the job
    std::optional<Job> job_;
    Worker worker_; ///< last: its thread ends first
};

} // namespace bf::service

#pragma once

#include "bf/library/load.hpp"

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

namespace bf::service {

/// Checks models in a thread of its own, the newest alone.
class Checker {
  public:
    using Done = std::function<void(std::shared_ptr<const ExaminedModel>)>; ///< called in that thread

    Checker() : thread_([this] { live(); }) {}
    ~Checker();
    Checker(const Checker&) = delete;
    Checker& operator=(const Checker&) = delete;

    void check(model::Model model, std::filesystem::path file, Done done);

  private:
    struct Job {
        model::Model model;
        std::filesystem::path file;
        Done done;
    };
    static ExaminedModel examined(const Job& job);
    void live();

    std::mutex mutex_;
    std::condition_variable wake_;
    bool is_over_ = false;
    std::optional<Job> job_;
    std::thread thread_;
};

} // namespace bf::service

#pragma once

#include "bf/library/load.hpp"

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace bf::service {

/// Checks models in a thread of its own, the newest alone.
class Checker {
  public:
    using Done = std::function<void(std::shared_ptr<const ExaminedModel>)>;

    Checker() : thread_([this] { live(); }) {}
    ~Checker() {
        {
            const std::lock_guard lock(mutex_);
            is_over_ = true;
        }
        wake_.notify_one();
        thread_.join();
    }
    Checker(const Checker&) = delete;
    Checker& operator=(const Checker&) = delete;

    void check(model::Model model, std::filesystem::path file, Done done) {
        {
            const std::lock_guard lock(mutex_);
            job_ = Job{std::move(model), std::move(file), std::move(done)};
        }
        wake_.notify_one();
    }

  private:
    struct Job {
        model::Model model;
        std::filesystem::path file;
        Done done;
    };

    static ExaminedModel examined(const Job& job) {
        try {
            return examine(job.model, job.file);
        } catch (const model::Errors& errors) {
            return {{make_registry(), {job.file, {}, {}}, {}}, errors.diagnostics()};
        } catch (const std::exception& error) {
            return {{make_registry(), {job.file, {}, {}}, {}}, {{{}, "", error.what(), ""}}};
        }
    }

    void live() {
        for (;;) {
            std::unique_lock lock(mutex_);
            wake_.wait(lock, [&] { return is_over_ || job_; });
            if (is_over_) return;
            const Job job = *std::exchange(job_, {});
            lock.unlock();
            job.done(std::make_shared<const ExaminedModel>(examined(job)));
        }
    }

    std::mutex mutex_;
    std::condition_variable wake_;
    bool is_over_ = false;
    std::optional<Job> job_;
    std::thread thread_;
};

} // namespace bf::service

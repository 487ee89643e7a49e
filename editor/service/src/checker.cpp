#include "checker.hpp"

#include <utility>

namespace bf::service {

Checker::~Checker() {
    {
        const std::lock_guard lock(mutex_);
        is_over_ = true;
    }
    wake_.notify_one();
    thread_.join();
}

void Checker::check(model::Model model, std::filesystem::path file, Done done) {
    {
        const std::lock_guard lock(mutex_);
        job_ = Job{std::move(model), std::move(file), std::move(done)};
    }
    wake_.notify_one();
}

ExaminedModel Checker::examined(const Job& job) {
    try {
        return examine(job.model, job.file);
    } catch (const model::Errors& errors) {
        return {{make_registry(), {job.file, {}, {}}, {}}, errors.diagnostics()};
    } catch (const std::exception& error) {
        return {{make_registry(), {job.file, {}, {}}, {}}, {{{}, "", error.what(), ""}}};
    }
}

void Checker::live() {
    for (;;) {
        std::unique_lock lock(mutex_);
        wake_.wait(lock, [&] { return is_over_ || job_; });
        if (is_over_) return;
        const Job job = *std::exchange(job_, {});
        lock.unlock();
        job.done(std::make_shared<const ExaminedModel>(examined(job)));
    }
}

} // namespace bf::service

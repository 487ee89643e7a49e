#include "checker.hpp"

#include <utility>

namespace bf::service {

void Checker::check(formats::Files texts, std::filesystem::path file, Done done) {
    {
        const std::lock_guard lock(mutex_);
        job_ = Job{std::move(texts), std::move(file), std::move(done)};
    }
    worker_.post([this] { check_newest(); });
}

ExaminedModel Checker::examined(Job& job) {
    try {
        return examine(formats::read_yaml(job.file, job.texts), job.file);
    } catch (const model::Errors& errors) {
        return {{make_registry(), {job.file, {}, {}}, {}}, errors.diagnostics()};
    } catch (const std::exception& error) {
        return {{make_registry(), {job.file, {}, {}}, {}}, {{{}, "", error.what(), ""}}};
    }
}

void Checker::check_newest() {
    std::unique_lock lock(mutex_);
    if (!job_) return;
    Job job = *std::exchange(job_, {});
    lock.unlock();
    job.done(std::make_shared<const ExaminedModel>(examined(job)));
}

} // namespace bf::service

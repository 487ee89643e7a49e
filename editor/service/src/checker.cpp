#include "checker.hpp"

#include "bf/model/check.hpp"
#include "bf/model/edit.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

namespace bf::service {

namespace {

/// What is wrong with the structure of the model and of all that it refers to.
std::vector<model::Diagnostic> mistakes_in(const model::Model& model) {
    std::vector<model::Diagnostic> all;
    std::set<const model::Model*> known;
    const auto add = [&](const model::Model& one) {
        if (!known.insert(&one).second) return;
        std::vector<model::Diagnostic> own = model::check(one);
        std::ranges::stable_sort(own, {},
                                 [](const auto& d) { return std::pair(d.where.line, d.where.column); });
        std::ranges::move(own, std::back_inserter(all));
    };
    add(model);
    model::walk(model, [&](const std::string&, const model::Block& block) {
        if (block.reference && block.reference->model) add(*block.reference->model);
    });
    return all;
}

} // namespace

void Checker::check(std::shared_ptr<const model::Model> model, ModelSource source, Done done) {
    {
        const std::lock_guard lock(mutex_);
        job_ = Job{std::move(model), std::move(source), std::move(done)};
    }
    worker_.post([this] { check_newest(); });
}

ExaminedModel Checker::examined(Job& job) {
    std::vector<model::Diagnostic> wrong;
    try {
        wrong = mistakes_in(*job.model);
        if (wrong.empty()) return examine(*job.model, job.source);
    } catch (const model::Errors& errors) {
        wrong = errors.diagnostics();
    } catch (const std::exception& error) {
        wrong = {{{}, "", error.what(), ""}};
    }
    return {{make_registry(), std::move(job.source), {}}, std::move(wrong)};
}

void Checker::check_newest() {
    std::unique_lock lock(mutex_);
    if (!job_) return;
    Job job = *std::exchange(job_, {});
    lock.unlock();
    job.done(std::make_shared<const ExaminedModel>(examined(job)));
}

} // namespace bf::service

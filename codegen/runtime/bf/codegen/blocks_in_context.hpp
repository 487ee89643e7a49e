// Blocks whose memory a context holds, as the class of the model calls them.
#pragma once

#include "bf/codegen/hosted.hpp"

#include "bf/core/context.hpp"
#include "bf/program/step.hpp"

#include <exception>
#include <string>
#include <utility>
#include <vector>

namespace bf::generated {

/// Who derives owns the context besides the blocks, and stops them before they go.
class BlocksInContext : public Hosted {
  public:
    void prepare() noexcept override {
        stop();
        for (std::size_t r = 0; r < periods_.size(); ++r)
            context_->clock(static_cast<int>(r)) = {0, periods_[r], -1};
    }
    bool start() noexcept override {
        for (; started_ < count(); ++started_) try {
                context_->start(started_);
            } catch (const std::exception& error) {
                const int failed = started_;
                stop();
                return fail(failed, error.what());
            }
        return true;
    }
    void stop() noexcept override {
        for (; started_ > 0; --started_) context_->stop(started_ - 1);
    }
    bool run(int task) noexcept override {
        const TaskOf& of = tasks_[static_cast<std::size_t>(task)];
        return good(of.task(), of.block);
    }
    void set_states(int block) noexcept override { context_->set_states(block); }
    bool reset(int block) noexcept override { return good(context_->reset(block), block); }
    bool event(int block) noexcept override {
        return good(context_->event(block, events_[static_cast<std::size_t>(block)]), block);
    }
    void hit(int rate, double time) noexcept override { program::hit(context_->clock(rate), time); }
    void go_to(int rate, double time) noexcept override { context_->clock(rate).time = time; }
    void fire(int rate, double time) noexcept override { program::fire(context_->clock(rate), time); }
    std::ptrdiff_t snapshot_size() const noexcept override {
        return context_->refuses_snapshot() >= 0 ? -1
                                                 : static_cast<std::ptrdiff_t>(context_->snapshot_size());
    }
    void save(unsigned char* to) const noexcept override { context_->save(reinterpret_cast<std::byte*>(to)); }
    void restore(const unsigned char* from) noexcept override {
        context_->restore(reinterpret_cast<const std::byte*>(from));
    }
    const char* failure() const noexcept override { return failure_.c_str(); }
    const char* failed_block() const noexcept override { return failed_block_.c_str(); }

  protected:
    virtual int count() const = 0;
    virtual const std::string& path(int block) const = 0;
    virtual const Block& block(int block) const = 0;
    /// run() knows tasks by their place in the order of these calls.
    void add_task(int block, Phase phase, int index) {
        tasks_.push_back({context_->task(block, phase, index), block});
    }

    /// After the last block: what they do in events.
    void add_events() {
        for (int block = 0; block < count(); ++block) {
            events_.emplace_back();
            for (int i = 0; i < context_->activities(block, Phase::event); ++i)
                events_.back().push_back(context_->task(block, Phase::event, i));
        }
    }

    Context* context_ = nullptr;
    std::vector<double> periods_; ///< by rate; 0: continuous

  private:
    struct TaskOf {
        Task task;
        int block;
    };
    bool good(Status status, int block) noexcept {
        if (status) return true;
        failure_ = status.text(&this->block(block).resolution());
        return false;
    }
    bool fail(int block, std::string text) noexcept {
        failed_block_ = path(block);
        failure_ = std::move(text);
        return false;
    }

    std::vector<TaskOf> tasks_;
    std::vector<std::vector<Task>> events_; ///< by block
    int started_ = 0;
    std::string failure_, failed_block_;
};

} // namespace bf::generated

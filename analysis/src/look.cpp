#include "look.hpp"

#include <exception>

namespace bf::analysis {

namespace {

class Look final : public Run::Observer {
  public:
    explicit Look(const std::function<void()>& look) : look_(look) {}
    void observe(const Run& run) noexcept override {
        if (is_done_ || run.shows_event()) return;
        is_done_ = true;
        try {
            look_();
        } catch (...) {
            error_ = std::current_exception();
        }
    }
    void rethrow() const {
        if (error_) std::rethrow_exception(error_);
    }

  private:
    const std::function<void()>& look_;
    bool is_done_ = false;
    std::exception_ptr error_;
};

} // namespace

Status step_with(Simulation& run, const std::function<void()>& look) {
    Look seen(look);
    run.add_observer(seen);
    const Status status = run.step();
    run.remove_observer(seen);
    seen.rethrow();
    return status;
}

} // namespace bf::analysis

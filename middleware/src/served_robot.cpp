#include "bf/middleware/served_robot.hpp"

#include "bf/core/value.hpp"

#include <utility>

namespace bf::middleware {

namespace {

class Hosted final : public ServedRobot {
  public:
    Hosted(std::string name, const ServeRequest& request, std::unique_ptr<RobotEnd> end)
        : options_(request.host), end_(std::move(end)),
          host_(std::move(name), request.device, request.robot, *end_, request.host) {}

    void start(double period) override { host_.start(period); }
    void show(double time) noexcept override { host_.show(time); }
    void step(double) noexcept override { host_.step(); }
    void heed() noexcept override { host_.heed(); }
    void allow_reset() noexcept override { end_->allow_reset(); }
    bool wants_reset() const noexcept override { return end_->wants_reset(); }
    void reset() noexcept override { host_.reset(); }
    const std::string& name() const noexcept override { return end_->name(); }
    std::string take_news() override {
        if (RobotHost::Event event; host_.take_event(event)) return text_of(event);
        if (end_->has_double() && !std::exchange(is_doubled_, true))
            return "another program shows a robot of the same name, and controllers see both by turns; end "
                   "it, or give one of them another name";
        return end_->take_news();
    }
    int gone() const noexcept override { return host_.gone(); }

  private:
    std::string text_of(RobotHost::Event event) const {
        const std::string then =
            options_.on_loss == OnLoss::limp ? "; its joints are limp" : "; its joints hold";
        switch (event) {
        case RobotHost::Event::came: return "a controller has come";
        case RobotHost::Event::left: return "the controller has left" + then;
        case RobotHost::Event::died: return "the controller has died" + then;
        case RobotHost::Event::silent:
            return "no command for " + Value(options_.watchdog).describe() + " s" + then;
        case RobotHost::Event::idle:
            return "no references for " + Value(options_.idle_after).describe() + " s" + then +
                   " until some come";
        case RobotHost::Event::refused: return "a command was refused";
        }
        return "";
    }

    const HostOptions options_;
    const std::unique_ptr<RobotEnd> end_;
    RobotHost host_;
    bool is_doubled_ = false; ///< which was told
};

} // namespace

std::unique_ptr<ServedRobot> make_served_robot(std::string name, const ServeRequest& request,
                                               std::unique_ptr<RobotEnd> end) {
    return std::make_unique<Hosted>(std::move(name), request, std::move(end));
}

} // namespace bf::middleware
